"""Specs read: site, robots, goals, scenarios, parts and plans are what the file says."""

import math

import numpy as np
import pytest
import shapely
from shapely.geometry import box
from spec_texts import FULL, HALL

from layoutopt.errors import InvalidInput
from layoutopt.layout import ReaderProfile
from layoutopt.problem import Limit
from layoutopt.readers.profiles import COMMERCIAL, MI2016
from layoutopt.robot import Drive, Gyro, Odometry
from layoutopt.scenario import Faults, Role
from layoutopt.spec.building import DEFAULT_ESTIMATORS


def test_site_is_what_the_spec_says(read):
    """Floor, obstacles, tiles and zones arrive in metres with their rules."""
    site = read(FULL).site
    assert site.name == "hall"
    assert shapely.equals(site.floor, shapely.box(0, 0, 8, 5))
    assert site.obstacles[0].area == pytest.approx(0.04)
    assert site.tiling.size_m == 0.5
    assert site.tiling.origin_m == (0.1, 0.0)
    assert site.tiling.angle_rad == pytest.approx(math.pi / 6)
    assert site.zone_names == ("dock", "plate")
    assert site.zone("dock").target_error_m == 0.01
    assert not site.zone("plate").taggable


def test_robots_are_what_the_spec_says(read):
    """Drive, speed, odometry, outline and way points arrive in SI."""
    spec = read(FULL)
    assert spec.robot_count == 4
    assert spec.robot.drive is Drive.OMNIDIRECTIONAL
    assert spec.robot.speed_m_s == 0.5
    assert spec.robot.odometry == Odometry(
        translation_share=0.03,
        rotation_rad_per_m=math.radians(2),
        lateral_share=0.01,
        half_track_m=0.15,
        translation_m_per_sqrt_s=0.007,
        rotation_rad_per_sqrt_s=0.05,
    )
    assert spec.robot.gyro == Gyro(random_walk_rad_per_sqrt_s=math.radians(0.02), bias_sigma_rad_s=0.001)
    assert spec.robot.gyro_fitted
    assert spec.robot.radius_m == pytest.approx(0.3 * math.sqrt(2))
    assert spec.design.routes.kind == "way_points"
    np.testing.assert_array_equal(spec.design.routes.way_points_m, [[1, 1], [4, 4]])
    assert spec.design.routes.pause_s == 20.0
    assert {item.routes.heading_rad for item in (spec.design, *spec.held_out)} == {math.pi / 2}
    assert {item.routes.pause_s for item in spec.held_out} == {0.0}


def test_goals_become_limits_in_order(read):
    """The target is the first limit, then each zone's own, the budget, and what is listed."""
    spec = read(FULL)
    assert spec.goals == ("cost", "position_error_p95")
    assert spec.problem().limits == (
        Limit(score="position_error_mean", upper=0.015),
        Limit(score="dock.position_error_mean", upper=0.01),
        Limit(score="cost", upper=5000.0),
        Limit(score="heading_error_p95", upper=math.radians(5)),
        Limit(score="dock.position_error_max", upper=0.03),
        Limit(score="lost_share", upper=0.02),
        Limit(score="nees", upper=2.5),
    )


def test_scenarios_keep_search_and_validation_apart(read):
    """The search has its own routes; both held-out scenarios have others, the second more faults."""
    problem = read(FULL).problem()
    assert (problem.design.name, problem.design.role) == ("design/way_points", Role.DESIGN)
    assert [(item.name, item.role) for item in problem.held_out] == [
        ("held-out/point_to_point", Role.HELD_OUT),
        ("held-out/faults", Role.HELD_OUT),
    ]
    assert problem.design.faults == Faults(
        dead_tag_share=0.05, missed_read_share=0.02, kidnapped_at_s=12.0, start_offset=(0.165, 0.0, 1.5)
    )
    assert problem.held_out[0].faults == problem.design.faults
    assert problem.held_out[1].faults == Faults(
        tag_placement_sigma_m=0.003,
        tag_offset_m=(0.005, 0.0),
        dead_tag_share=0.01,
        missed_read_share=0.02,
        read_edge_m=0.002,
        slips_per_m=0.5,
        slip_sigma_m=0.01,
        asynchronous=True,
    )
    assert (problem.design.step_s, problem.design.step_count) == (0.025, 1200)
    assert problem.design.start_sigma_m == 0.02
    assert problem.design.start_sigma_rad == pytest.approx(math.radians(2))


def test_errands_in_the_search_are_validated_on_patrols(read):
    """Where the search drives errands, the held-out routes are patrols, so that they are others."""
    problem = read(HALL + '[robots]\nroutes = "point_to_point"').problem()
    assert [scenario.name for scenario in problem.held_out] == ["held-out/patrol", "held-out/faults"]
    assert {scenario.routes.kind for scenario in problem.held_out} == {"patrol"}


def test_problem_holds_objectives_and_estimators(read):
    """Cost comes first and knows prices, fleet and reader; estimators keep the order of the spec."""
    spec = read(FULL)
    problem = spec.problem()
    cost = problem.objectives[0]
    assert (cost.prices.key, cost.robot_count, cost.reader_part) == (spec.prices.key, 4, "industrial_reader")
    fidelities = [objective.card.fidelity for objective in problem.objectives]
    assert fidelities == sorted(fidelities, key=["exact", "published", "sampled", "simulated"].index)
    assert [estimator.name for estimator in problem.estimators] == ["mcl", "odometry", "midrange"]
    assert problem.estimators[0].particles == 64


def test_an_unknown_start_is_unknown_in_every_scenario(read):
    """start_known = false holds in the search and in validation, and leaves the stated deviations alone."""
    problem = read(HALL + "[study]\nstart_known = false").problem()
    assert {item.start_known for item in (problem.design, *problem.held_out)} == {False}


def test_profiles_by_name_and_by_table(read):
    """The named profiles are those of the reader package; a table makes one of its own, one tag a scan too."""
    assert read(HALL).reader_profile == COMMERCIAL
    assert read(HALL + '[parts]\nreader_profile = "mi2016"').reader_profile == MI2016
    assert read(FULL).reader_profile == ReaderProfile(
        name="cheap",
        scan_period_s=0.04,
        tags_per_scan="one",
        spacing_sides=1.2,
        simultaneous_spacing_sides=4.0,
    )


def test_a_floor_is_enough(read):
    """Everything but the floor has a default, and the defaults make a problem with layouts."""
    spec = read(HALL)
    problem = spec.problem()
    assert spec.seed == 0
    assert spec.robot_count == 1
    assert problem.goals == ("cost", "position_error_mean")
    assert problem.limits == ()
    assert problem.design.name == "design/patrol"
    assert problem.design.faults == Faults(missed_read_share=0.02)
    assert problem.design.duration_s == pytest.approx(60.0)
    assert tuple(estimator.name for estimator in problem.estimators) == DEFAULT_ESTIMATORS
    assert DEFAULT_ESTIMATORS[-2:] == ("odometry", "odometry_gyro")
    assert problem.design.start_known
    assert spec.robot.gyro == Gyro()
    assert not spec.robot.gyro_fitted
    assert problem.space.size > 50


def test_floor_with_holes_and_in_parts(read):
    """Lists of rings are a floor with holes, lists of these a floor in parts."""
    outer, hole = "[[0, 0], [8, 0], [8, 5], [0, 5]]", "[[1, 1], [2, 1], [2, 2], [1, 2]]"
    part = "[[9, 0], [12, 0], [12, 3], [9, 3]]"
    assert read(f"[site]\nfloor = [{outer}, {hole}]").site.floor.area == 39.0
    assert read(f"[site]\nfloor = [[{outer}, {hole}], [{part}]]").site.floor.area == 48.0


def test_a_zone_may_lie_over_a_hole_in_the_floor(read):
    """A pillar of a map is a hole; no tag can lie in it, whatever zone is there."""
    floor = "[[[0, 0], [8, 0], [8, 5], [0, 5]], [[1, 1], [2, 1], [2, 2], [1, 2]]]"
    zone = "[[site.zone]]\nname = 'around'\nregion = [[0, 0], [3, 0], [3, 3], [0, 3]]\ntags = false"
    site = read(f"[site]\nfloor = {floor}\n{zone}").site
    assert site.zone("around").region.area == 9.0
    assert site.taggable_region().area == pytest.approx(40.0 - 9.0)


def zone_text(west_m, east_m=1.0):
    """Return a zone from y = 1 to 2 m."""
    corners = f"[[{west_m}, 1], [{east_m}, 1], [{east_m}, 2], [{west_m}, 2]]"
    return f"[[site.zone]]\nname = 'dock'\nregion = {corners}\n"


def test_a_zone_outside_the_floor_is_told_by_how_much_and_where(read):
    """Area, depth and a place; over the wall between two rooms the depth is half the wall, not nothing."""
    with pytest.raises(
        InvalidInput, match=r"0\.012 m² of zone 'dock' lie outside the floor, up to 12 mm, near "
    ) as no:
        read(HALL + zone_text(-0.012))
    assert "near (-0.01, 1.00) m" in str(no.value)
    rooms = "[site]\nfloor = [[[[0, 0], [4, 0], [4, 5], [0, 5]]], [[[4.2, 0], [8, 0], [8, 5], [4.2, 5]]]]\n"
    with pytest.raises(InvalidInput, match=r"0\.2 m² of .* up to 100 mm, near \(4\.10, [12]\.00\) m"):
        read(rooms + zone_text(3, 5))
    with pytest.raises(InvalidInput, match=r"zone 'dock' lies outside the floor\. Draw it on the floor"):
        read(HALL + zone_text(-2, -1))


def test_a_zone_that_hardly_sticks_out_is_cut_back_with_a_note(read):
    """A millimetre of any floor; what is left ends at the floor and is read again as it is."""
    spec = read(HALL + zone_text(-0.0009))
    assert spec.site.zone("dock").region.equals(box(0, 1, 1, 2))
    assert spec.notes[0] == (
        "zone 'dock' stuck out of the floor by up to 0.9 mm, near (0.00, 1.00) m: 0.000899 m² were cut off"
    )
    with pytest.raises(InvalidInput, match=r"up to 1\.1 mm"):
        read(HALL + zone_text(-0.0011))
    with pytest.raises(InvalidInput, match="obstacles cover the whole of zone 'dock'"):
        read(HALL + "obstacles = [[[0, 0], [2, 0], [2, 3], [0, 3]]]\n" + zone_text(-0.0009))


@pytest.mark.parametrize(("depth_m", "cut"), [(0.024, True), (0.026, False)])
def test_half_a_pixel_of_a_map_is_cut_off(read, tmp_path, depth_m, cut):
    """Pixels of 50 mm: a zone may stick out by 25 mm, in the wall or beyond."""
    rows = [[0] * 60, *[[0, *[254] * 58, 0]] * 58, [0] * 60]
    (tmp_path / "map.pgm").write_bytes(b"P5\n60 60\n255\n" + bytes(cell for row in rows for cell in row))
    (tmp_path / "map.yaml").write_text(
        "image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    text = '[site]\nplan = "map.yaml"\n' + zone_text(0.05 - depth_m)
    if cut:
        spec = read(text)
        assert spec.site.zone("dock").region.equals(box(0.05, 1, 1, 2))
        assert any("stuck out of the floor by up to 24 mm" in note for note in spec.notes)
    else:
        with pytest.raises(InvalidInput, match="up to 26 mm, near "):
            read(text)


def test_a_floor_that_is_cut_off_is_told(read):
    """A part of the floor that the robot cannot reach is no fault but a note with its area."""
    spec = read(HALL + "obstacles = [[[5, 0], [5.1, 0], [5.1, 5], [5, 5]]]")
    assert any("no way leads there" in note for note in spec.notes)


def test_plan_and_prices_come_from_files_beside_the_spec(read, tmp_path):
    """Names of files count from the folder of the spec; notes and source of the plan are kept."""
    rows = ["P2", "40 20", "255", *(["254 " * 40] * 20)]
    (tmp_path / "hall.pgm").write_text("\n".join(rows))
    (tmp_path / "hall.yaml").write_text(
        "image: hall.pgm\nresolution: 0.1\norigin: [1.0, 2.0, 0.0]\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    (tmp_path / "mine.toml").write_text(
        'schema = 1\nname = "mine"\ndate = "2026"\nbase = "default-2026"\n'
        '[items.label]\nprice = "0.10 EUR"\nsource = "quote"\n'
    )
    spec = read('[site]\nplan = "hall.yaml"\n[parts]\nprices = "mine.toml"')
    assert spec.site.bounds_m == pytest.approx((1.0, 2.0, 5.0, 4.0))
    assert spec.site.source == "hall.yaml"
    assert any("hall.pgm" in note for note in spec.notes)
    assert (spec.prices.name, spec.prices.items["label"].price_eur) == ("mine", 0.1)
