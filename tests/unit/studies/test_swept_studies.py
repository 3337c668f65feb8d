"""Studies that vary one quantity: which values are told to keep the error, and what each of them varies."""

from dataclasses import replace

import numpy as np
import pytest

from layoutopt.errors import InvalidInput
from layoutopt.protocols import Evaluation
from layoutopt.scenario import Faults, TruePlaces
from layoutopt.scores import OUTCOME_COLUMNS, TrialOutcomes
from layoutopt.spec.reading import read_spec
from objectives.speed_limit import SpeedLimit
from studies.antenna_sizing import AntennaSizing
from studies.dead_tags import PATCH, STREWN, DeadTags, with_patch
from studies.page import Table
from studies.page_frame import closing_lines
from studies.placement_tolerance import PlacementTolerance
from studies.reader_count import ReaderCount, spread_m
from studies.speed import MULTIPLES, Speed
from studies.swept import GOAL, cheapest_meeting, first_layout, largest_meeting, largest_within
from studies.swept_page import ends_shown, page_of


@pytest.fixture(scope="module")
def spec(tmp_path_factory, tiny_text):
    path = tmp_path_factory.mktemp("spec") / "tiny.toml"
    path.write_text(tiny_text, encoding="utf-8")
    return read_spec(path)


def made_up(study, error_m, sigma_m=0.0001):
    """Return outcomes of every cell by its place, all columns as large as the error told by the place."""
    found = {}
    for number, (place, cell) in enumerate(study.cells()):
        noise = sigma_m * np.random.Generator(np.random.Philox(number)).standard_normal(cell.trials)
        values = np.full((cell.trials, len(OUTCOME_COLUMNS)), error_m(place)) + noise[:, None]
        found[place] = TrialOutcomes(
            replications=np.arange(cell.trials), columns=OUTCOME_COLUMNS, values=np.abs(values)
        )
    return found


def test_the_largest_value_told_is_the_last_before_the_first_that_errs_a_tenth_more(spec):
    """The error grows by 20 % at twice the speed and falls again beyond: what lies beyond is not told."""
    study = Speed.for_spec(spec, quick=False)
    (series,), own = study.sweep.series, spec.robot.speed_m_s
    found = made_up(study, lambda place: 0.012 if place.value == 2.0 * own else 0.010)
    assert largest_within(study.sweep, found, series) == pytest.approx(1.5 * own)
    found = made_up(study, lambda place: 0.010)
    assert largest_within(study.sweep, found, series) == pytest.approx(MULTIPLES[-1] * own)
    found = made_up(study, lambda place: 0.010 if place.value <= own else 0.02)
    assert largest_within(study.sweep, found, series) is None


def test_a_demand_is_met_up_to_the_first_value_whose_bound_is_beyond_it(spec):
    study = Speed.for_spec(spec, quick=False)
    (series,), own = study.sweep.series, spec.robot.speed_m_s
    found = made_up(study, lambda place: 0.031 if place.value == 3.0 * own else 0.01)
    assert study.sweep.target_m == 0.03
    assert largest_meeting(study.sweep, found, series) == pytest.approx(2.0 * own)


def test_the_layout_varied_is_the_first_that_can_be_built(spec):
    """With a radius at which antennas of 40 mm overlap first, the next one is taken; with that alone, refused."""
    assert first_layout(spec).key == next(iter(spec.space.layouts())).key
    family = spec.space.readers[0]
    tight = replace(family, values={**family.values, "radius_m": (0.02, 0.15)})
    both = replace(spec, space=replace(spec.space, readers=(tight,)))
    assert first_layout(both).floor_readers[0].parameters["radius_m"] == 0.15
    alone = replace(family, values={**family.values, "radius_m": (0.02,)})
    with pytest.raises(InvalidInput, match=r"no layout can be built and judged; the first, ring 4 × 40 mm"):
        first_layout(replace(spec, space=replace(spec.space, readers=(alone,))))


def test_speeds_change_the_robot_alone_and_crossings_are_exact(spec):
    study = Speed.for_spec(spec, quick=False)
    layout = first_layout(spec)
    for point in study.sweep.points:
        assert point.cell.layout == layout
        scenario = point.cell.scenario
        assert scenario.robot.speed_m_s == point.place.value
        assert replace(scenario, robot=spec.robot) == spec.design
        exact = SpeedLimit()(layout, scenario, None)["missed_crossing_share"].value
        assert point.exact["missed_crossing_share"] == exact


def test_a_patch_is_the_share_of_the_tags_nearest_to_its_middle(spec):
    """What was silent before stays silent, and tags that were moved stay moved."""
    tags = first_layout(spec).floor_tags.lay_on(spec.site)
    middle_m = np.array([2.0, 1.5])
    faults = with_patch(Faults(), tags, 0.1, middle_m)
    silent = np.isin(tags.ids, faults.true_places.silent)
    assert silent.sum() == round(0.1 * len(tags))
    distance_m = np.linalg.norm(tags.xy_m - middle_m, axis=1)
    assert distance_m[silent].max() <= distance_m[~silent].min() + 1e-9
    known = TruePlaces(tag_id=tags.ids[:1], xy_m=tags.xy_m[:1] + 0.01, silent=tags.ids[-1:])
    both = with_patch(Faults(true_places=known), tags, 0.1, middle_m).true_places
    assert set(both.silent) == set(faults.true_places.silent) | {tags.ids[-1]}
    assert (both.tag_id == known.tag_id).all()
    assert with_patch(Faults(), tags, 0.0, middle_m) == Faults()


def test_dead_tags_are_strewn_by_their_share_or_lie_in_the_patch(spec):
    study = DeadTags.for_spec(spec, quick=False)
    for place, cell in study.cells():
        faults = cell.scenario.faults
        if place.series == STREWN:
            assert faults.dead_tag_share == place.value
            assert faults.true_places is None
        elif place.series == PATCH:
            assert faults.dead_tag_share == 0.0
            assert (faults.true_places is None) == (place.value == 0.0)


def test_estimators_that_read_no_tags_are_left_out_of_the_placement_with_the_reason(spec):
    sweep = PlacementTolerance.for_spec(spec, quick=True).sweep
    assert {name for name, _ in sweep.refused} == {"odometry", "odometry_gyro"}
    assert {point.cell.scenario.faults.tag_placement_sigma_m for point in sweep.points} == {0.0, 0.005, 0.02}


def test_antennas_are_counted_and_their_spread_is_that_of_the_series(spec):
    """Of four antennas the cross is the ring, so crosses begin with eight."""
    sweep = ReaderCount.for_spec(spec, quick=False).sweep
    for point in sweep.points:
        (group,) = point.cell.layout.floor_readers
        assert group.count == point.place.value
        told_mm = float(point.place.series.split()[2])
        assert spread_m(group) == pytest.approx(told_mm / 1000.0, abs=1e-9)
        assert group.antennas_per_module <= group.count
    assert {p.place.value for p in sweep.points if p.place.series.startswith("cross")} <= {8.0, 12.0}


def test_sides_and_heights_are_those_told_and_what_reads_nothing_is_left_out(spec):
    sweep = AntennaSizing.for_spec(spec, quick=False).sweep
    for point in sweep.points:
        (group,) = point.cell.layout.floor_readers
        assert point.place.series == f"antennas of {1000.0 * group.antenna.side_m:g} mm"
        assert set(group.poses[:, 2]) == {point.place.value}
        assert point.exact["read_radius_m"] == group.antenna.read_radius_m(point.place.value) > 0.0
    assert any("reads no tag" in reason for _, reason in sweep.refused)


def test_the_figure_points_out_the_largest_value_that_is_shown_to_do(spec):
    """A ring at the last speed before the demand of 30 mm is missed; without a demand, where the error grows."""
    study = Speed.for_spec(spec, quick=False)
    own = spec.robot.speed_m_s
    found = made_up(study, lambda place: 0.01 * max(1.0, place.value / own))
    (curve,) = study.panels(found)[0].curves
    ((number, words),) = curve.pointed_out
    assert curve.x[number] == pytest.approx(2.0 * own)
    assert words == f"meets the demand up to {2.0 * own:g} m/s"
    free = Speed.for_spec(replace(spec, target_error_m=None), quick=False)
    assert list(ends_shown(free.sweep, found).values()) == []
    alike = made_up(study, lambda place: 0.01)
    assert list(ends_shown(free.sweep, alike).values()) == [f"within 10 % up to {MULTIPLES[-1] * own:g} m/s"]


def test_a_quick_look_shows_nothing_and_says_so(spec):
    """Two drives: what they say is seen and not shown, and no point is pointed out."""
    study = Speed.for_spec(spec, quick=True)
    found = made_up(study, lambda place: 0.01)
    told = " ".join(study.summary(found))
    assert told.count("seen on 2 drives, too few to decide,") == 2
    assert "shown" not in told.replace("no difference shown", "")
    assert not any(curve.pointed_out for panel in study.panels(found) for curve in panel.curves)


def test_the_cheapest_number_of_antennas_and_the_best_antenna_are_pointed_out(spec):
    count = ReaderCount.for_spec(spec, quick=False)
    found = made_up(count, lambda place: 0.02 if place.value > 1 else 0.04)
    cheapest = cheapest_meeting(count.sweep, found)
    assert cheapest.place.value == 2
    assert [curve.name for curve in count.panels(found)[0].curves if curve.pointed_out] == [cheapest.place.series]
    sizing = AntennaSizing.for_spec(spec, quick=False)
    least = sizing.sweep.points[3].place
    found = made_up(sizing, lambda place: 0.01 if place == least else 0.02)
    assert sizing.best(found).place == least
    (curve,) = [curve for curve in sizing.panels(found)[0].curves if curve.pointed_out]
    assert curve.name == least.series


@pytest.mark.parametrize("kind", [Speed, DeadTags, PlacementTolerance, ReaderCount, AntennaSizing])
def test_a_study_without_any_outcome_says_so(kind, spec):
    study = kind.for_spec(spec, quick=True)
    assert study.summary({}) == ["No cell is finished."]
    tables = [part for part in page_of(study, {}, failed=0).sections[0].parts if isinstance(part, Table)]
    assert tables[0].rows
    assert all("–" in row for row in tables[0].rows)


def test_the_summary_tells_a_difference_only_where_its_interval_leaves_out_zero(spec):
    study = Speed.for_spec(spec, quick=False)
    own = spec.robot.speed_m_s
    alike = made_up(study, lambda place: 0.010, sigma_m=0.002)
    worse = made_up(study, lambda place: 0.010 * max(1.0, place.value / own), sigma_m=0.002)
    assert any("no difference shown" in line for line in study.summary(alike))
    assert not any("no difference shown" in line for line in study.summary(worse))
    answer = study.answer(
        [Evaluation(group=cell.group, first=0, outcomes=worse[p], seconds=0.0) for p, cell in study.cells()], spec
    )
    assert answer.lines(None) == [*study.summary(worse), *closing_lines("speed")]
    assert worse[study.sweep.points[-1].place].score(GOAL).value > 0.09
