"""Speed limits of readers against crossings that are driven, integrals and what is known of two antennas."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import FloorTags, Layout, ReaderProfile, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.ring import ring
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.site import Site
from objectives.speed_limit import SpeedLimit, mean_chord_m, missed_share


def group(side_m, *, ports=1, height_m=0.02, scan_s=0.05, count=4):
    """Return a ring of antennas."""
    profile = ReaderProfile(name="test", scan_period_s=scan_s, tags_per_scan="several")
    antenna = SphereAntenna(side_m=side_m)
    mount = Mount(antenna=antenna, height_m=height_m, profile=profile, antennas_per_module=ports)
    return ring(count=count, radius_m=0.2, mount=mount)


def scores(*groups, speed_m_s=0.3):
    """Return the scores of a layout with these groups, by name."""
    tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.1)),))
    outline_m = [(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)]
    scenario = Scenario(
        name="room",
        role=Role.DESIGN,
        site=Site(name="room", floor=box(0, 0, 4, 4)),
        robot=Robot(outline_m=outline_m, speed_m_s=speed_m_s),
    )
    found = SpeedLimit()(Layout(floor_tags=tags, readers=groups), scenario, None)
    return {name: score.value for name, score in found.items()}


def driven_missed(radius_m, way_m, count, seed):
    """Return which of so many crossings no scan meets: any chord, any moment of the first scan."""
    draws = np.random.Generator(np.random.Philox(seed))
    half_m = np.sqrt(radius_m**2 - (radius_m * draws.uniform(-1.0, 1.0, count)) ** 2)
    first_m = -radius_m + way_m * (draws.random(count) - 1.0)
    scans_m = first_m[:, None] + way_m * np.arange(int(2.0 * radius_m / way_m) + 3)
    return ~(np.abs(scans_m) < half_m[:, None]).any(axis=1)


@pytest.mark.parametrize(
    ("side_m", "chord_mm", "limit_m_s"), [(0.030, 14.1, 0.28), (0.060, 46.7, 0.93)], ids=["30 mm", "60 mm"]
)
def test_two_antennas_at_20_mm(side_m, chord_mm, limit_m_s):
    """Discs of 9.0 and 29.7 mm: mean chords of 14 and 47 mm, 0.28 and 0.93 m/s at a scan every 50 ms."""
    antenna = SphereAntenna(side_m=side_m)
    assert 1e3 * float(mean_chord_m(antenna.read_radius_m(0.02))) == pytest.approx(chord_mm, abs=0.05)
    assert scores(group(side_m))["speed_limit"] == pytest.approx(limit_m_s, abs=0.005)


def test_the_mean_chord_is_the_mean_of_chords():
    """Over offsets that are all alike."""
    mean_m = quad(lambda offset_m: 2.0 * math.sqrt(0.03**2 - offset_m**2), -0.03, 0.03)[0] / 0.06
    assert float(mean_chord_m(0.03)) == pytest.approx(mean_m)


@pytest.mark.parametrize("sides", [0.2, 0.9, 1.6, 2.0, 2.5, 7.0])
def test_missed_crossings_are_those_that_are_driven(sides):
    """200 000 crossings with any chord and any phase of the scans; a false alarm comes once in a million."""
    missed = driven_missed(0.009, sides * 0.009, 200_000, seed=17)
    expected = float(missed_share(0.009, sides * 0.009))
    assert abs(missed.mean() - expected) < 4.9 * math.sqrt(expected * (1.0 - expected) / len(missed)) + 1e-12


@given(st.floats(0.001, 0.2), st.floats(0.01, 30.0))
def test_missed_crossings_are_the_integral_over_chords(radius_m, sides):
    """One less the mean of the chance min(1, chord / way); a share, and more of it the faster one drives."""
    way_m = sides * radius_m
    kink = math.sqrt(max(0.0, 1.0 - (sides / 2.0) ** 2))
    read = quad(lambda off: min(1.0, 2.0 * math.sqrt(1.0 - off**2) / sides), 0.0, 1.0, points=[kink])[0]
    found = float(missed_share(radius_m, way_m))
    assert found == pytest.approx(1.0 - read, abs=2e-7)
    assert 0.0 <= found <= float(missed_share(radius_m, 1.1 * way_m)) <= 1.0


def test_at_the_limit_a_ninth_of_the_crossings_is_missed():
    """11.5 % at the speed of the mean crossing, and 21.5 % (1 - pi/4) at that of the middle."""
    found = scores(group(0.06))
    for name, share in (("speed_limit", 0.115), ("speed_limit_centre", 1.0 - math.pi / 4.0)):
        at_it = scores(group(0.06), speed_m_s=found[name])
        assert at_it["missed_crossing_share"] == pytest.approx(share, abs=0.0005)


def test_under_the_middle_nothing_is_missed_up_to_its_limit():
    """A tag on the axis meets a scan just below the limit whatever the phase, and may miss it above."""
    limit_m_s = scores(group(0.06))["speed_limit_centre"]
    diameter_m = 2.0 * SphereAntenna(side_m=0.06).read_radius_m(0.02)
    for factor, always in ((0.999, True), (1.001, False)):
        way_m = factor * limit_m_s * 0.05
        first_m = np.linspace(0.0, way_m, 20_001)
        assert bool((first_m < diameter_m).all()) is always


def test_a_module_that_takes_turns_is_slower_by_its_antennas():
    """Four antennas a module listen in turn, and a longer scan counts alike."""
    alone, shared = scores(group(0.06)), scores(group(0.06, ports=4))
    assert shared["speed_limit"] == pytest.approx(alone["speed_limit"] / 4.0)
    assert shared["speed_limit_centre"] == pytest.approx(alone["speed_limit_centre"] / 4.0)
    assert shared["missed_crossing_share"] > alone["missed_crossing_share"]
    assert scores(group(0.06, scan_s=0.2)) == pytest.approx(shared)


def test_the_slowest_antenna_limits_and_crossings_are_weighed_by_width():
    """Of two groups the smaller discs set the limit; missed crossings count as often as they happen."""
    wide, small = scores(group(0.06)), scores(group(0.03))
    both = scores(group(0.06), group(0.03))
    assert both["speed_limit"] == small["speed_limit"] < wide["speed_limit"]
    radius_m = [SphereAntenna(side_m=side_m).read_radius_m(0.02) for side_m in (0.06, 0.03)]
    shares = [found["missed_crossing_share"] for found in (wide, small)]
    assert both["missed_crossing_share"] == pytest.approx(np.average(shares, weights=radius_m))


def test_antennas_out_of_reach_read_nothing_at_any_speed():
    """30 mm antennas 30 mm high: no speed is slow enough and every tag is missed."""
    found = scores(group(0.03, height_m=0.03))
    assert found == {"speed_limit": 0.0, "speed_limit_centre": 0.0, "missed_crossing_share": 1.0}
