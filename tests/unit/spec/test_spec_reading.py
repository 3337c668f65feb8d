import math

import numpy as np
import pytest
import shapely

from layoutopt.errors import InvalidInput
from layoutopt.layout import ReaderProfile
from layoutopt.problem import Limit
from layoutopt.readers.profiles import COMMERCIAL, MI2016
from layoutopt.robot import Drive, Gyro, Odometry
from layoutopt.scenario import Faults, Role
from layoutopt.spec.building import DEFAULT_ESTIMATORS
from layoutopt.spec.reading import read_spec

HALL = "[site]\nfloor = [[0, 0], [8, 0], [8, 5], [0, 5]]\n"
ZONES = (
    '[[site.zone]]\nname = "dock"\nregion = [[0, 0], [2, 0], [2, 2]]\ntarget_error = "5 mm"\n'
    '[[site.zone]]\nname = "plain"\nregion = [[4, 0], [6, 0], [6, 2]]\n'
)
FULL = """
schema = 1
seed = 11
[site]
name = "hall"
floor = [["0 m", 0], ["800 cm", 0], [8, 5], [0, 5]]
obstacles = [[[3, 2], [3.2, 2], [3.2, 2.2], [3, 2.2]]]
tiling = { size = "0.5 m", origin = [0.1, 0], angle = "30 deg" }
[[site.zone]]
name = "dock"
region = [[0, 0], [2, 0], [2, 2], [0, 2]]
target_error = "10 mm"
[[site.zone]]
name = "plate"
region = [[5, 0], [6, 0], [6, 1], [5, 1]]
metal = true
[robots]
count = 4
drive = "omnidirectional"
outline = [["-0.3 m", "-0.3 m"], ["0.3 m", "-0.3 m"], ["0.3 m", "0.3 m"], ["-0.3 m", "0.3 m"]]
speed = "0.5 m/s"
gyro = { random_walk_after_1s = "0.02 deg", bias = "0.001 rad/s", fitted = true }
pause = "20 s"
heading = "90 deg"
routes = [[1, 1], [4, 4]]
[robots.odometry]
translation = "3 %"
rotation = "2 deg/m"
lateral = "1 %"
half_track = "150 mm"
translation_after_1s = "7 mm"
rotation_after_1s = "0.05 rad"
[parts]
prices = "default-2026"
tag = "disc"
reader = "industrial_reader"
reader_profile = { name = "cheap", scan_period = "40 ms", tags_per_scan = "one", spacing_sides = 1.2 }
[space]
antenna = { model = "sphere" }
antenna_side = ["30 mm", "60 mm"]
antenna_height = ["15 mm", "20 mm"]
antennas_per_module = [1, 2, 8]
origin = [0.05, 0]
placement_sigma = "2 mm"
readers = [{ family = "cross", count = [4, 8], spacing = "50 mm" }, { family = "mi2016_8" }]
patterns = [
    { family = "square", pitch = { from = "60 mm", to = "300 mm", steps = 9 } },
    { family = "triangular", pitch = 0.1, row_gap = ["80 mm", "100 mm"] },
    { family = "square", pitch = "50 mm", zone = "dock" },
]
[goal]
minimise = ["cost", "position_error_p95"]
limits = ["heading_error_p95 <= 5 deg", "dock.position_error_max <= 30 mm", "lost_share <= 2 %", "nees <= 2.5"]
target_error = "15 mm"
budget = "5000 EUR"
[study]
search_trials = 100
validate_with = ["mcl", "odometry", "midrange"]
validation_trials = 20
step = "25 ms"
duration = "30 s"
start_uncertainty = { position = "20 mm", heading = "2 deg" }
particles = 64
held_out_faults = { tag_offset = ["5 mm", 0], slips_per_m = 0.5, slip_sigma = "10 mm", asynchronous = true }
[study.design_faults]
dead_tag_share = "5 %"
kidnapped_at = "12 s"
start_offset = { x = "165 mm", heading = "1.5 rad" }
"""


@pytest.fixture
def read(tmp_path):
    """Return a reader of spec texts."""

    def of(text):
        path = tmp_path / "spec.toml"
        path.write_text(text, encoding="utf-8")
        return read_spec(path)

    return of


def faults_of(read, text):
    with pytest.raises(InvalidInput) as caught:
        read(text)
    return [str(fault) for fault in caught.value.faults]


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


RANGES = """
[space]
antenna_side = ["40 mm", "60 mm"]
antenna_height = { from = "5 mm", to = "40 mm" }
antennas_per_module = [1, 4]
readers = [
    { family = "ring", count = { from = 3, to = 6 }, radius = { from = "80 mm", to = "120 mm" } },
    { family = "listed", points = [[0.1, { from = -0.1, to = "50 mm" }], [-0.1, 0]] },
]
patterns = [{ family = "square", pitch = { from = "100 mm", to = "300 mm" } }]
"""


def test_a_range_without_steps_is_continuous(read):
    """Lengths become intervals, whole numbers all in between; a point's range is a coordinate of its own."""
    space = read(HALL + RANGES).space
    assert [(axis.name, axis.continuous) for axis in space.axes] == [
        ("family", False),
        ("radius_m", True),
        ("mount.side_m", False),
        ("mount.height_m", True),
        ("count", False),
        ("mount.antennas_per_module", False),
        ("points_m.at_0_1", True),
        ("pitch_m", True),
    ]
    # Three antennas take no multiplexer of four, so theirs is a family without that choice.
    assert [dict(family.values)["count"] for family in space.readers[:2]] == [(3,), (4, 5, 6)]
    group = space.decode((0.9, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.25)).readers[0]
    np.testing.assert_allclose(group.poses[:, :3], [[0.1, 0.05, 0.04], [-0.1, 0.0, 0.04]], atol=1e-12)


def test_enumeration_of_a_range_without_steps_takes_five_levels(read):
    """Five pitches and heights, five radii; a free point stands in the middle of its range."""
    space = read(HALL + RANGES).space
    # Rings of 3 have one kind of module, of 4 to 6 two; times 5 radii, 2 sides, 5 heights. Two antennas have one.
    assert space.axis_sizes == ((1 + 3 * 2) * 5 * 10 + 10, 5)
    assert space.size == len({layout.key for layout in space.layouts()})
    assert space.readers[-1].option(0).poses[0, 1] == -0.025


def test_space_is_the_product_of_what_is_listed(read):
    """Values, lists and ranges with both ends are axes; a pattern of a zone is an axis of its own."""
    space = read(FULL).space
    assert list(space.patterns) == ["", "dock"]
    square, triangular = space.patterns[""]
    np.testing.assert_allclose(square.values["pitch_m"], np.linspace(0.06, 0.3, 9), rtol=0, atol=1e-12)
    assert triangular.values == {"pitch_m": (0.1,), "row_gap_m": (0.08, 0.1)}
    # Cross 4 takes two of the three multiplexers, cross 8 and mi2016_8 all: (2 + 3 + 3) by 2 sides by 2 heights.
    assert space.axis_sizes == (32, 11, 1)
    assert space.size == len({layout.key for layout in space.layouts()}) == 352
    assert space.tag_part == "disc"
    assert space.tag_size_m == (0.025, 0.025)
    assert space.origin_m == (0.05, 0.0)
    assert space.placement_sigma_m == 0.002


def test_no_module_has_more_ports_than_antennas(read):
    """Options with idle multiplexer ports are left out, the rest is complete, and a note counts both."""
    spec = read(FULL)
    groups = [group for family in spec.space.readers for group in family.options()]
    assert all(group.antennas_per_module <= group.count for group in groups)
    assert {(group.count, group.antennas_per_module) for group in groups if group.name == "cross"} == {
        (4, 1), (4, 2), (8, 1), (8, 2), (8, 8),
    }  # fmt: skip
    assert spec.notes == ("left out 4 of 36 reader options that have more antennas a module than antennas",)


def test_combinations_that_are_no_product_survive_the_ports_rule(read):
    """A grid of 2 by 2 and one of 3 by 1 lose different multiplexers; no other combination is lost or added."""
    spec = read(
        HALL + '[space]\nantennas_per_module = [1, 4, 6]\nantenna_side = "40 mm"\n'
        'readers = [{ family = "grid", rows = [1, 2], columns = [2, 3, 4], spacing = "100 mm" }]'
    )
    built = [
        (group.parameters["rows"], group.parameters["columns"], group.antennas_per_module)
        for family in spec.space.readers
        for group in family.options()
    ]
    wanted = {
        (rows, columns, m) for rows in (1, 2) for columns in (2, 3, 4) for m in (1, 4, 6) if m <= rows * columns
    }
    assert len(built) == len(wanted)
    assert set(built) == wanted


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


def test_recovery_can_be_demanded_where_robots_are_kidnapped(read):
    """A limit on the recovery time stands with a kidnapping in the search, and is refused without one."""
    limit = '[goal]\nlimits = ["recovery_time <= 5 s"]\n'
    spec = read(HALL + limit + '[study.design_faults]\nkidnapped_at = "30 s"')
    assert spec.limits == (Limit(score="recovery_time", upper=5.0),)
    for study in ("", '[study.held_out_faults]\nkidnapped_at = "30 s"'):
        (fault,) = faults_of(read, HALL + limit + study)
        assert "goal.limits[0]" in fault
        assert "no robot of the search is kidnapped" in fault


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


def test_all_faults_come_at_once_with_line_key_value_and_repair(read):
    """One error lists every fault of all tables, in the form in which people can find and mend them."""
    text = (
        "shema = 1\n[site]\nfloor = [[0, 0], [8, 0], [8, 5], [0, 5]]\n"
        '[robots]\nspeed = "fast"\n[space]\nantenna_side = ["30 mm", "6 cm2"]\n'
        '[goal]\nlimits = ["heading_eror_p95 <= 5 deg"]\n[study]\nparticles = 0\n'
    )
    faults = faults_of(read, text)
    for line, key, value, repair in [
        (1, "shema", "1", "Did you mean 'schema'?"),
        (5, "robots.speed", '"fast"', "0.3 m/s"),
        (7, "space.antenna_side[1]", '"6 cm2"', 'Did you mean "6 cm"?'),
        (9, "goal.limits[0]", '"heading_eror_p95 <= 5 deg"', "Did you mean 'heading_error_p95'?"),
        (11, "study.particles", "0", "greater than or equal to 1"),
    ]:
        assert [text for text in faults if f"spec.toml:{line} {key} = {value}: " in text and repair in text]
    assert len(faults) == 5


@pytest.mark.parametrize(
    ("text", "key", "said"),
    [
        ('readers = [{ family = "sudoku", count = 4 }]', "space.readers[0].family", "no readers named"),
        (
            'patterns = [{ family = "hexagonal", pitch = 0.1 }]',
            "space.patterns[0].family",
            "Known: equilateral, line, listed, parallelogram, random, square, sudoku, tilted, triang",
        ),
        ('antenna = "biot_savart"', "space.antenna", "Known: disc, sphere"),
        ('readers = [{ family = "cross", cout = 4 }]', "space.readers[0].cout", "Did you mean 'count'?"),
        ('readers = [{ family = "cross" }]', "space.readers[0]", "needs the parameter 'count'"),
        ('readers = [{ family = "cross", count = 6 }]', "space.readers[0]", "multiple of four"),
        (
            'readers = [{ family = "ring", count = 3, radius = "0.5 m" }]',
            "space.readers[0]",
            "fits under the robot",
        ),
        (
            'patterns = [{ family = "square", pitch = ["100 mm", "15 mm"] }]',
            "space.patterns[0].pitch",
            "20 mm long",
        ),
        ('patterns = [{ family = "square", pitch = 0.1, zone = "x" }]', "space.patterns[0].zone", "no such zone"),
        ('antenna_height = "90 mm"', "space.antenna_height", "reads the floor"),
        ("antennas_per_module = 16", "space.antennas_per_module", "1 to 8"),
        ("antennas_per_module = 8\nreaders = [{ family = 'cross', count = 4 }]", "space.readers[0]", "smaller"),
        ('antenna_side = ["40 mm", "4 cm"]', "space.antenna_side[1]", "stands twice"),
        ('antenna_side = { from = "40 mm", to = "30 mm", steps = 3 }', "space.antenna_side", "must rise"),
        ('antenna_side = { from = "40 mm", to = "30 mm" }', "space.antenna_side", "must rise"),
        ('antenna_height = { from = "80 mm", to = "90 mm" }', "space.antenna_height", "reads the floor"),
        (
            'readers = [{ family = "ring", count = { from = 3, to = 4.5 }, radius = 0.1 }]',
            "space.readers[0].count",
            "whole number",
        ),
        (
            'readers = [{ family = "listed", points = [[{ from = 0, to = 0.1, steps = 3 }, 0]] }]',
            "space.readers[0].points[0][0]",
            "takes no steps",
        ),
        (
            'readers = [{ family = "mirrored", points = [[0.1, 0]], symmetry = { from = 1, to = 2 } }]',
            "space.readers[0].symmetry",
            "a range is",
        ),
    ],
)
def test_faults_of_the_space_name_the_entry(read, text, key, said):
    """What a family, its parameters or the antennas cannot be is said at the key, with what is known."""
    faults = faults_of(read, f"{HALL}[space]\n{text}")
    assert any(key in fault and said in fault for fault in faults)


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ("coverage <= 3", "no score named"),
        ("heading_error_p95 <= 5 mm", "none of angle"),
        ("heading_error_p95 <= 5", "no unit"),
        ("heading_error_p95 >= 5 deg", 'less is better. Write "heading_error_p95 <= 5 deg"'),
        ("pose_coverage <= 99 %", 'more is better. Write "pose_coverage >= 99 %"'),
        ("heading_error_p95 == 5 deg", "says <= or >="),
        ("heading_error_p95", "no limit"),
        ("nowhere.position_error_mean <= 5 mm", "no zone"),
        ("lost_share <= 0", "positive"),
        ("dock.lost_share <= 0.1", "not known for a zone"),
        ("plain.position_error_mean <= 5 mm", "has no target_error"),
    ],
)
def test_faults_of_limits(read, limits, said):
    """A limit on an unknown score or zone, with a wrong unit or sign, is refused."""
    faults = faults_of(read, f'{HALL}{ZONES}[goal]\nlimits = ["{limits}"]')
    assert len(faults) == 1
    assert said in faults[0]


@pytest.mark.parametrize(
    ("goals", "place", "said"),
    [
        (
            '"cost", "position_error_mean", "heading_error_mean"',
            "goal.minimise = ",
            "no search minimises 3 goals yet",
        ),
        ('"cost", "derived_half_gap"', "goal.minimise[1]", "no search minimises 'derived_half_gap' yet"),
        ('"cost", "dock.published_half_gap"', "goal.minimise[1]", "no search minimises 'dock.published_half_gap'"),
        ('"cost", "plain.heading_error_p95"', "goal.minimise[1]", "has no target_error"),
        ('"position_error_mean", "cost"', "goal.minimise = ", "cost and one other score, in this order"),
        ('"cost"', "goal.minimise = ", "cost and one other score, in this order"),
        ('"cost", "cost"', "goal.minimise[1]", "stands twice"),
    ],
)
def test_goals_that_no_search_minimises_are_refused(read, goals, place, said):
    """A search weighs cost against one simulated score; anything else is one fault with its repair."""
    faults = faults_of(read, f"{HALL}{ZONES}[goal]\nminimise = [{goals}]")
    assert len(faults) == 1
    assert place in faults[0]
    assert said in faults[0]


@pytest.mark.parametrize("goal", ["position_error_p95", "lost_share", "nees", "dock.heading_error_mean"])
def test_simulated_scores_are_goals(read, goal):
    """Every score of a drive, and of a zone with a target, can be weighed against cost."""
    assert read(f'{HALL}{ZONES}[goal]\nminimise = ["cost", "{goal}"]').goals == ("cost", goal)


@pytest.mark.parametrize("wish", ['limits = ["nees <= 2.5"]', 'minimise = ["cost", "nees"]'])
def test_nees_needs_an_estimator_with_a_covariance(read, wish):
    """The search's estimator, the first of the list, must state a covariance where the NEES is asked for."""
    faults = faults_of(read, f'{HALL}[goal]\n{wish}\n[study]\nvalidate_with = ["midrange", "mcl"]')
    assert len(faults) == 1
    assert "'midrange', the estimator of the search, states no covariance" in faults[0]
    assert "study.validate_with: mcl" in faults[0]
    assert read(f'{HALL}[goal]\n{wish}\n[study]\nvalidate_with = ["mcl", "midrange"]').study is not None


def test_an_unknown_estimator_is_one_fault(read):
    """A table with a fault of its own holds up only the check that needs it."""
    faults = faults_of(read, HALL + '[goal]\nlimits = ["nees <= 2"]\n[study]\nvalidate_with = ["mcll"]')
    assert len(faults) == 1
    assert "no such estimator" in faults[0]


def test_way_points_out_of_reach_are_named(read):
    """A way point that the robot cannot reach is named with its number and the nearest place that works."""
    faults = faults_of(read, HALL + "[robots]\nroutes = [[1, 1], [4, 4.9]]")
    assert len(faults) == 1
    assert "robots.routes[1]" in faults[0]
    assert "nearest place" in faults[0]


def test_messages_of_other_files_keep_their_own_line(read, tmp_path):
    """A fault within the price file is reported with that file's line, behind the key that named it."""
    (tmp_path / "mine.toml").write_text('schema = 1\nname = "m"\ndate = "2026"\nbase = "default-2026"\nbad = 1\n')
    faults = faults_of(read, HALL + '[parts]\nprices = "mine.toml"')
    assert 'spec.toml:4 parts.prices = "mine.toml" -> ' in faults[0]
    assert "mine.toml:5 bad" in faults[0]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('placement = ["5 mm", "0 mm"]', ("study.tolerance.placement", "from low to high")),
        ('dead_tags = ["0 %", "120 %"]', ("study.tolerance.dead_tags[1]",)),
        ('missed_reads = ["2 %"]', ("study.tolerance.missed_reads",)),
        ('combine = "best"', ("study.tolerance.combine", "worst")),
        ("quantile = 1.0", ("study.tolerance.quantile",)),
        ('placment = ["0 mm", "1 mm"]', ("placment", "placement")),
    ],
)
def test_a_faulty_tolerance_is_named(read, line, words):
    """Each value that is none is told with its key and what would be right."""
    faults = faults_of(read, HALL + "[study.tolerance]\n" + line)
    assert len(faults) == 1
    assert all(word in faults[0] for word in words)
