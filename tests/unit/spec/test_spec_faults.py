"""Faulty specs: every fault is told with line, key, value and what would be right."""

import pytest
from spec_texts import HALL, ZONES

from layoutopt.errors import InvalidInput
from layoutopt.problem import Limit


def faults_of(read, text):
    with pytest.raises(InvalidInput) as caught:
        read(text)
    return [str(fault) for fault in caught.value.faults]


def test_recovery_can_be_demanded_where_robots_are_kidnapped(read):
    """A limit on the recovery time stands with a kidnapping in the search, and is refused without one."""
    limit = '[goal]\nlimits = ["recovery_time <= 5 s"]\n'
    spec = read(HALL + limit + '[study.design_faults]\nkidnapped_at = "30 s"')
    assert spec.limits == (Limit(score="recovery_time", upper=5.0),)
    for study in ("", '[study.held_out_faults]\nkidnapped_at = "30 s"'):
        (fault,) = faults_of(read, HALL + limit + study)
        assert "goal.limits[0]" in fault
        assert "no robot of the search is kidnapped" in fault


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
        ('readers = [{ family = "sudoku", count = 4 }]', "space.readers[0].family", "no reader family named"),
        (
            'patterns = [{ family = "hexagonal", pitch = 0.1 }]',
            "space.patterns[0].family",
            "Known: equilateral, line, listed, parallelogram, random, square, sudoku, tilted, triang",
        ),
        ('antenna = "hertz"', "space.antenna", "Known: biot_savart, disc, measured, sphere"),
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
