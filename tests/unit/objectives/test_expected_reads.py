"""Expected reads and new tags: closed forms against counting on random runs over true lattices."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.detection import antennas_of
from layoutopt.layout import EditKind, FloorTags, Layout, ReaderGroup, TagEdit, TagPattern, ZonePattern
from layoutopt.patterns.listed import listed
from layoutopt.patterns.square import square
from layoutopt.patterns.triangular import triangular
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.site import Site, Zone
from objectives.expected_reads import CARD, ExpectedReads, swept_area_m2

RADIUS_M = SphereAntenna(side_m=0.06).read_radius_m(0.02)
DISC_M2 = math.pi * RADIUS_M**2
SITE = Site(
    name="room",
    floor=box(0, 0, 4, 3),
    obstacles=(box(2, 2, 3, 3),),
    zones=(Zone(name="dock", region=box(0, 0, 1, 1)),),
)
PATTERNS = {
    "square": square(pitch_m=0.1),
    "triangular": triangular(pitch_m=0.12, row_gap_m=0.07),
    "sheared": TagPattern(name="sheared", points_m=[(0, 0), (0.03, 0.01)], cell_m=[(0.15, 0.02), (-0.04, 0.11)]),
}


def group(poses, module=1, side_m=0.06, kind="tag_read"):
    return ReaderGroup(
        name="some",
        poses=[(x, y, 0.02, 0.0) for x, y in poses],
        antenna=SphereAntenna(side_m=side_m),
        profile=COMMERCIAL,
        slots=tuple(number % module for number in range(len(poses))),
        antennas_per_module=module,
        kind=kind,
    )


def layout(*zones, readers=None, edits=()):
    """Return a layout of (zone name, pattern) pairs under one antenna, or under the readers given."""
    floor_tags = FloorTags(zones=tuple(ZonePattern(zone=name, pattern=one) for name, one in zones), edits=edits)
    return Layout(floor_tags=floor_tags, readers=readers or (group([(0.0, 0.0)]),))


def world(speed_m_s=0.3, step_s=0.05, site=SITE):
    robot = Robot(outline_m=[(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)], speed_m_s=speed_m_s)
    return Scenario(name="design", role=Role.DESIGN, site=site, robot=robot, step_s=step_s)


def scores(candidate, scenario=None):
    found = ExpectedReads()(candidate, scenario or world(), None)
    return {name: score.value for name, score in found.items()}


def counted_run(candidate, pattern, scenario, steps, draws):
    """Return reads per step and new tags per metre of one straight run from a random pose, counted tag by tag."""
    antennas = antennas_of(candidate, scenario.step_s)
    way_m = scenario.robot.speed_m_s * scenario.step_s
    angle = draws.uniform(0, 2 * math.pi)
    ahead, left = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    start_m = draws.uniform(-5.0, 5.0, 2)
    reach_m = steps * way_m + 1.0
    tags_m = pattern.points_in((*(start_m - reach_m), *(start_m + reach_m)))
    reads = news = 0
    for place, radius_m, period, phase in zip(
        antennas.xy_m, antennas.radius_m, antennas.period_steps, antennas.phase_steps, strict=True
    ):
        before = None
        for step in range(-int(period), steps):
            if step % period != phase:
                continue
            centre_m = start_m + (step * way_m + place[0]) * ahead + place[1] * left
            seen = set(np.flatnonzero(((tags_m - centre_m) ** 2).sum(axis=1) < radius_m**2).tolist())
            if step >= 0:
                reads += len(seen)
                news += len(seen - before)
            before = seen
    return reads / steps, news / (steps * way_m)


@pytest.mark.parametrize("name", PATTERNS)
@pytest.mark.parametrize(("module", "speed_m_s"), [(1, 0.3), (4, 0.1), (4, 0.6)], ids=["fast", "slow", "gaps"])
def test_closed_forms_agree_with_counting(name, module, speed_m_s):
    """Mean reads and new tags of 300 random straight runs lie within 4.5 standard errors of the closed forms.

    18 comparisons, each two-sided at 1e-5: with Student's tails a right formula fails once in about 5000 runs.
    "gaps" moves 120 mm between two scans of an antenna that sees 59 mm.
    """
    draws = np.random.Generator(np.random.Philox(17))
    pattern, scenario = PATTERNS[name], world(speed_m_s=speed_m_s)
    readers = (
        group([(0.1, 0.0), (-0.1, 0.05), (0.0, 0.2), (0.05, -0.2)], module),
        group([(0.2, 0.2)], side_m=0.04),
    )
    candidate = layout(("", pattern), readers=readers)
    runs = np.array([counted_run(candidate, pattern, scenario, 8, draws) for _ in range(300)])
    found = scores(candidate, scenario)
    error = runs.std(axis=0, ddof=1) / math.sqrt(len(runs))
    assert found["expected_reads_per_step"] == pytest.approx(runs[:, 0].mean(), abs=4.5 * error[0])
    assert found["expected_new_tags_per_m"] == pytest.approx(runs[:, 1].mean(), abs=4.5 * error[1])
    assert (error / runs.mean(axis=0) < 0.1).all()


def test_one_antenna_on_a_square_lattice():
    """100 tags per square metre under one disc: area times density, and a strip as wide as the disc."""
    found = scores(layout(("", square(pitch_m=0.1))), world(speed_m_s=1e-5))
    assert found["expected_reads_per_step"] == pytest.approx(100.0 * DISC_M2)
    assert found["expected_new_tags_per_m"] == pytest.approx(100.0 * 2.0 * RADIUS_M)


def test_reads_per_metre_fall_with_speed_and_rise_with_the_scan_rate():
    """Twice the speed halves the reads per metre; a module of four reads each antenna a fourth as often."""
    slow, fast = (scores(layout(("", square(pitch_m=0.1))), world(speed_m_s=v)) for v in (0.15, 0.3))
    assert slow["expected_reads_per_m"] == pytest.approx(2.0 * fast["expected_reads_per_m"])
    assert slow["expected_reads_per_step"] == fast["expected_reads_per_step"]
    places = [(0.1 * number, 0.0) for number in range(4)]
    alone, shared = (scores(layout(("", square(pitch_m=0.1)), readers=(group(places, m),))) for m in (1, 4))
    assert alone["expected_reads_per_m"] == pytest.approx(4.0 * shared["expected_reads_per_m"])
    assert alone["expected_new_tags_per_m"] > shared["expected_new_tags_per_m"]


def test_a_scan_longer_than_a_step_takes_whole_steps():
    """50 ms scans in steps of 20 ms take three steps, as in the simulation."""
    found = scores(layout(("", square(pitch_m=0.1))), world(step_s=0.02))
    assert found["expected_reads_per_step"] == pytest.approx(100.0 * DISC_M2 / 3.0)


@given(st.floats(1e-3, 1.0), st.floats(1e-6, 5.0))
def test_swept_area_lies_between_nothing_and_strip_and_disc(radius_m, way_m):
    """New floor is less than the strip and no more than the disc, and a longer way sweeps no less of it."""
    area, farther = swept_area_m2(np.array([radius_m] * 2), np.array([way_m, 1.5 * way_m]))
    assert 0.0 < area <= min(2.0 * radius_m * way_m, math.pi * radius_m**2) * (1.0 + 1e-12)
    assert farther >= area * (1.0 - 1e-12)
    assert swept_area_m2(np.array([radius_m]), np.array([2.0 * radius_m])) == pytest.approx(math.pi * radius_m**2)


def test_swept_area_of_a_known_lens():
    """Unit discs one radius apart share 2 pi / 3 - sqrt(3) / 2."""
    shared = 2.0 * math.pi / 3.0 - math.sqrt(3.0) / 2.0
    assert swept_area_m2(np.array([1.0]), np.array([1.0]))[0] == pytest.approx(math.pi - shared)


def test_an_antenna_out_of_reach_of_the_floor_reads_nothing():
    """A read radius of zero gives zeros, and a layout without HF antennas no scores."""
    assert set(scores(layout(("", square(pitch_m=0.1)), readers=(group([(0, 0)], side_m=0.015),))).values()) == {
        0.0
    }
    assert scores(layout(("", square(pitch_m=0.1)), readers=(group([(0, 0)], kind="bearing"),))) == {}


def test_zones_with_their_own_pattern_are_scored_apart():
    """Four times as many tags a square metre in the dock give four times the reads and new tags there."""
    found = scores(layout(("", square(pitch_m=0.1)), ("dock", square(pitch_m=0.05))))
    assert set(found) == {prefix + name for name in CARD.scores for prefix in ("", "dock.")}
    for name in CARD.scores:
        assert found[f"dock.{name}"] == pytest.approx(4.0 * found[name])
    only = scores(layout(("dock", square(pitch_m=0.05))))
    assert only["expected_reads_per_m"] == only["dock.expected_reads_per_m"] == found["dock.expected_reads_per_m"]


def test_a_pattern_that_is_laid_once_counts_by_its_tags_on_the_floor():
    """Five tags on 11 square metres: one in the dock, one that is dropped; a sixth would lie below an obstacle."""
    places = [(0.5, 0.5), (1.5, 0.5), (1.5, 1.5), (3.5, 0.5), (3.5, 2.5), (2.5, 2.5)]
    everywhere = scores(layout(("", listed(points_m=places))))
    assert everywhere["expected_reads_per_step"] == pytest.approx(5 / 11 * DISC_M2)
    dropped = TagEdit(kind=EditKind.DROPPED, from_m=(3.5, 0.5))
    fewer = scores(layout(("", listed(points_m=places)), edits=(dropped,)))
    assert fewer["expected_reads_per_step"] == pytest.approx(4 / 11 * DISC_M2)
    beside = scores(layout(("", listed(points_m=places)), ("dock", listed(points_m=places[:2]))))
    assert beside["expected_reads_per_step"] == pytest.approx(4 / 10 * DISC_M2)
    assert beside["dock.expected_reads_per_step"] == pytest.approx(1 / 1 * DISC_M2)


def test_a_listed_lattice_is_as_dense_as_the_lattice():
    """A square lattice laid out tag by tag over its own floor has the density of its cell."""
    centres = (np.arange(20) + 0.5) * 0.1
    places = [(x, y) for x in centres for y in centres]
    floor = Site(name="hall", floor=box(0, 0, 2, 2))
    once, forever = (
        scores(layout(("", pattern)), world(site=floor))
        for pattern in (listed(points_m=places), square(pitch_m=0.1))
    )
    assert once == pytest.approx(forever)


def test_a_zone_that_another_pattern_takes_over_has_no_floor_left():
    """Where a later zone rules everything, an earlier pattern laid once has no tags and scores zero."""
    site = Site(
        name="room",
        floor=box(0, 0, 2, 2),
        zones=(Zone(name="low", region=box(0, 0, 1, 1)), Zone(name="high", region=box(0, 0, 1.5, 1.5))),
    )
    pattern = listed(points_m=[(0.5, 0.5)])
    found = scores(layout(("low", pattern), ("high", pattern)), world(site=site))
    assert found["low.expected_reads_per_m"] == 0.0
    assert found["high.expected_reads_per_step"] == pytest.approx(1 / 2.25 * DISC_M2)
