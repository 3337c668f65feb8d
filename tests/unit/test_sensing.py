"""What the readers see, against answers worked out by hand."""

import numpy as np
import pytest
from scipy.stats import kstest
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import FloorTags, Layout, ReaderProfile, ZonePattern
from layoutopt.patterns.listed import listed
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.listed import listed as listed_readers
from layoutopt.readings import UNKNOWN_TAG
from layoutopt.robot import Robot
from layoutopt.scenario import Faults, Role, Scenario
from layoutopt.simulation.motion import Drive
from layoutopt.simulation.sensing import observe, true_tags
from layoutopt.site import Site
from layoutopt.streams import Streams

RADIUS_M = 0.03  # of a 60 mm antenna 24 mm above the floor


def readers(xy_m, *, tags_per_scan="several", antennas_per_module=1):
    profile = ReaderProfile(name="test", scan_period_s=0.05, tags_per_scan=tags_per_scan)
    mount = Mount(
        antenna=SphereAntenna(side_m=0.06),
        height_m=0.024,
        profile=profile,
        antennas_per_module=antennas_per_module,
    )
    return listed_readers(points_m=xy_m, mount=mount)


def reads_of(pattern, group, poses, faults=None, seed=1):
    """Return (step, antenna, tag) of all reads of a robot that stands at each pose after one step."""
    robot = Robot(outline_m=np.array([(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)]))
    scenario = Scenario(
        name="test",
        role=Role.DESIGN,
        site=Site(name="room", floor=box(-2.0, -2.0, 2.0, 2.0)),
        robot=robot,
        faults=faults or Faults(),
        step_count=len(poses),
    )
    layout = Layout(floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=pattern),)), readers=(group,))
    tags = layout.floor_tags.lay_on(scenario.site)
    poses = np.array([poses[0], *poses], dtype=float)
    still = np.zeros((len(poses) - 1, 3))
    driven = Drive(
        poses=poses, increments=still, sigma=still, gyro_turn_rad=still[:, 2], gyro_sigma_rad=still[:, 2]
    )
    seen = observe(driven, layout, scenario, tags, Streams(seed=seed), 0)
    step = np.repeat(np.arange(len(seen)), np.diff(seen.read_start))
    return list(zip(step.tolist(), seen.read_antenna.tolist(), seen.read_tag.tolist(), strict=True)), seen


def one_tag():
    return listed(points_m=[(0.5, 0.25)])


def test_an_antenna_over_the_only_tag_reads_it():
    """Turned by 90 degrees, an antenna 0.2 m ahead lies 0.2 m to the left on the floor."""
    reads, _ = reads_of(one_tag(), readers([(0.2, 0.0)]), [(0.5, 0.05, np.pi / 2), (0.5, 0.05, 0.0)])
    assert reads == [(0, 0, 0)]


@pytest.mark.parametrize(("beyond_m", "count"), [(-1e-9, 1), (1e-9, 0)])
def test_a_tag_is_read_within_the_disc_only(beyond_m, count):
    """The disc of Eq. 5 ends at 30 mm."""
    reads, _ = reads_of(one_tag(), readers([(0.0, 0.0)]), [(0.5 + RADIUS_M + beyond_m, 0.25, 0.0)])
    assert len(reads) == count


def test_multiplexed_antennas_take_turns():
    """Two antennas at one module scan in every second step each, and say when they did."""
    group = readers([(0.0, 0.0), (0.001, 0.0)], antennas_per_module=2)
    reads, seen = reads_of(one_tag(), group, [(0.5, 0.25, 0.0)] * 4)
    assert reads == [(step, group.slots.index(step % 2), 0) for step in range(4)]
    assert seen.active.sum(axis=1).tolist() == [1, 1, 1, 1]
    assert all(seen.active[step, antenna] for step, antenna, _ in reads)


def test_two_tags_in_the_field_collide():
    """A reader that takes one tag a scan reads nothing over two tags, and one that takes several reads both."""
    pair = listed(points_m=[(0.5, 0.25), (0.52, 0.25)])
    poses = [(0.51, 0.25, 0.0), (0.475, 0.25, 0.0)]
    several, _ = reads_of(pair, readers([(0.0, 0.0)]), poses)
    one, _ = reads_of(pair, readers([(0.0, 0.0)], tags_per_scan="one"), poses)
    assert several == [(0, 0, 0), (0, 0, 1), (1, 0, 0)]
    assert one == [(1, 0, 0)]


def test_without_faults_nothing_is_drawn(monkeypatch):
    """A drive without faults asks for no random stream."""
    monkeypatch.setattr(Streams, "generator", lambda *_: pytest.fail("a stream was asked for"))
    reads, _ = reads_of(square(pitch_m=0.1), readers([(0.0, 0.0)]), [(0.1, 0.1, 0.0)])
    assert len(reads) == 1


def test_a_missed_scan_loses_all_its_reads():
    """With every second scan missed the two tags below an antenna are seen together or not at all."""
    pair = listed(points_m=[(0.5, 0.25), (0.52, 0.25)])
    reads, seen = reads_of(pair, readers([(0.0, 0.0)]), [(0.51, 0.25, 0.0)] * 2000, Faults(missed_read_share=0.5))
    counts = np.diff(seen.read_start)
    assert set(counts.tolist()) == {0, 2}
    # Five standard deviations of a share over 2,000 scans: false alarm below one in a million.
    assert abs((counts == 2).mean() - 0.5) < 5 * np.sqrt(0.25 / 2000)
    assert len(reads) == counts.sum()


def test_a_wrong_identity_is_another_tag_of_the_map():
    """Misread tags never keep their name, all others occur, and the only tag of a map becomes unknown."""
    three = listed(points_m=[(0.5, 0.25), (0.9, 0.25), (1.3, 0.25)])
    reads, _ = reads_of(three, readers([(0.0, 0.0)]), [(0.5, 0.25, 0.0)] * 200, Faults(wrong_identity_share=1.0))
    assert {tag for _, _, tag in reads} == {1, 2}
    reads, _ = reads_of(one_tag(), readers([(0.0, 0.0)]), [(0.5, 0.25, 0.0)], Faults(wrong_identity_share=1.0))
    assert reads == [(0, 0, UNKNOWN_TAG)]


def test_a_common_offset_shifts_what_is_read():
    """Tags laid 40 mm off are read 40 mm off, under their planned index."""
    faults = Faults(tag_offset_m=(0.04, 0.0))
    reads, _ = reads_of(one_tag(), readers([(0.0, 0.0)]), [(0.5, 0.25, 0.0), (0.54, 0.25, 0.0)], faults)
    assert reads == [(1, 0, 0)]


def test_dead_tags_keep_the_indices_of_the_others():
    """With half the tags dead every read names the tag that truly lies below."""
    site = Site(name="room", floor=box(-2.0, -2.0, 2.0, 2.0))
    tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.1)),)).lay_on(site)
    truth = true_tags(tags, Faults(dead_tag_share=0.5), np.random.default_rng(1))
    np.testing.assert_array_equal(truth.xy_m, tags.xy_m[truth.tag])
    assert 0.4 * len(tags) < len(truth.tag) < 0.6 * len(tags)
    poses = [(0.1 * step - 1.0, 0.0, 0.0) for step in range(21)]
    reads, _ = reads_of(square(pitch_m=0.1), readers([(0.0, 0.0)]), poses, Faults(dead_tag_share=0.5))
    assert 0 < len(reads) < 21
    for step, _, tag in reads:
        np.testing.assert_allclose(tags.xy_m[tag], poses[step][:2], atol=1e-9)


def test_a_height_error_changes_the_true_disc():
    """At 24 + 18 mm the sphere of 30 mm cuts a disc of 24 mm; beyond 54 mm it does not reach the floor."""
    edge = [(0.5 + 0.0239, 0.25, 0.0), (0.5 + 0.0241, 0.25, 0.0)]
    reads, _ = reads_of(one_tag(), readers([(0.0, 0.0)]), edge, Faults(antenna_height_error_m=0.018))
    assert [step for step, _, _ in reads] == [0]
    out_of_reach = Faults(antenna_height_error_m=0.031, read_edge_m=0.01)
    assert reads_of(one_tag(), readers([(0.0, 0.0)]), [(0.5, 0.25, 0.0)] * 50, out_of_reach)[0] == []


def test_a_soft_edge_is_a_logistic_curve():
    """Half of the scans see a tag at the nominal radius, and 1/(1 + e) of them one edge width beyond."""
    faults = Faults(read_edge_m=0.002)
    for beyond_m, share in ((0.0, 0.5), (0.002, 1.0 / (1.0 + np.e))):
        poses = [(0.5 + RADIUS_M + beyond_m, 0.25, 0.0)] * 4000
        reads, _ = reads_of(one_tag(), readers([(0.0, 0.0)]), poses, faults)
        # Five standard deviations: false alarm below one in a million.
        assert abs(len(reads) / 4000 - share) < 5 * np.sqrt(share * (1 - share) / 4000)


def test_a_clock_error_delays_reads():
    """A read stamped two steps late shows the tag that lay below two steps before."""
    poses = [(0.5 + 0.1 * step, 0.25, 0.0) for step in range(5)]
    late, _ = reads_of(one_tag(), readers([(-0.1, 0.0)]), poses, Faults(clock_error_s=0.1))
    prompt, _ = reads_of(one_tag(), readers([(-0.1, 0.0)]), poses)
    assert prompt == [(1, 0, 0)]
    assert late == [(3, 0, 0)]


def lags_m(faults, seed, antennas=4):
    """Return how far behind the step's end each scan took place, shape (steps, antennas), read off to 1 mm.

    The robot goes 0.1 m east in every step, over a line of tags 1 mm apart.
    """
    tags = listed(points_m=[(0.001 * number, 0.25) for number in range(-300, 1300)])
    ends_m = 0.3 + 0.1 * np.arange(1, 6)
    poses = [(0.3, 0.25, 0.0), *((end_m, 0.25, 0.0) for end_m in ends_m)]
    reads, seen = reads_of(tags, readers([(0.0, 0.0)] * antennas), poses, faults, seed)
    assert seen.active.all()
    middle_m = np.full((6, antennas), np.nan)
    for step in range(6):
        for antenna in range(antennas):
            read = [tag for at, of, tag in reads if (at, of) == (step, antenna)]
            middle_m[step, antenna] = 0.001 * (min(read) + max(read)) / 2.0 - 0.3
    return ends_m[1:, None] - middle_m[2:]


def test_every_asynchronous_antenna_scans_at_a_moment_of_its_own():
    """An antenna's lag is the same in all steps, below one step, and not that of the others."""
    for seed in range(5):
        lag_m = lags_m(Faults(asynchronous=True), seed)
        assert np.ptp(lag_m, axis=0).max() < 0.0011
        assert lag_m.min() > -0.001
        assert lag_m.max() < 0.101
        assert np.ptp(lag_m[0]) > 0.003
    assert np.abs(lags_m(Faults(), 0)).max() < 0.001


def test_a_clock_error_adds_to_asynchrony():
    """Half a step late, every antenna lags 50 mm more; and a longer array starts with the same delays."""
    own = lags_m(Faults(asynchronous=True), 3)
    late = lags_m(Faults(asynchronous=True, clock_error_s=0.025), 3)
    np.testing.assert_allclose(late - own, 0.05, atol=0.0011)
    np.testing.assert_allclose(lags_m(Faults(asynchronous=True), 3, antennas=6)[:, :4], own, atol=1e-9)


def test_delays_of_asynchronous_antennas_are_uniform_within_the_step():
    """400 lags over 50 trials are uniform over a step (Kolmogorov-Smirnov), with a false alarm rate of 1e-6."""
    lag_m = np.concatenate([lags_m(Faults(asynchronous=True), seed, antennas=8)[0] for seed in range(50)])
    # Lags are read off in whole tags; a draw within a millimetre makes them continuous again.
    lag_m = lag_m + np.random.default_rng(1).uniform(-0.0005, 0.0005, lag_m.shape)
    assert kstest(lag_m, "uniform", args=(0.0, 0.1)).pvalue > 1e-6


@pytest.mark.parametrize("faults", [{"asynchronous": True}, {"clock_error_s": 0.02}, {"clock_error_s": 0.07}])
def test_a_lifted_robot_reads_nothing_on_its_way(faults):
    """Between the place where it was lifted and that where it is put down lie tags that no late scan may see."""
    tags = listed(points_m=[(0.0, 0.0), *((0.01 * number, 0.0) for number in range(10, 90)), (1.0, 0.0)])
    poses = [(0.0, 0.0, 0.0)] * 3 + [(1.0, 0.0, 0.0)] * 3
    for seed in range(10):
        reads, _ = reads_of(tags, readers([(0.0, 0.0)] * 4), poses, Faults(kidnapped_at_s=0.15, **faults), seed)
        assert {tag for _, _, tag in reads} == {0, 81}


def test_reads_are_sorted_even_when_spoiled():
    """Reads come by step, antenna and tag, whatever the faults did to them."""
    faults = Faults(
        tag_placement_sigma_m=0.01,
        dead_tag_share=0.1,
        missed_read_share=0.1,
        wrong_identity_share=0.3,
        read_edge_m=0.003,
    )
    draws = np.random.default_rng(3)
    poses = np.column_stack([draws.uniform(-2, 2, (300, 2)), draws.uniform(-9, 9, 300)])
    reads, _ = reads_of(square(pitch_m=0.03), readers([(0.1, 0.0), (-0.1, 0.05)]), list(poses), faults)
    assert len(reads) > 300
    assert reads == sorted(reads)


def test_a_floor_without_tags_is_silent():
    """No tags, no reads, with and without faults."""
    nothing = listed(points_m=[(5.0, 5.0)])
    for faults in (Faults(), Faults(dead_tag_share=0.5, wrong_identity_share=0.5, tag_placement_sigma_m=0.01)):
        assert reads_of(nothing, readers([(0.0, 0.0)]), [(0.5, 0.25, 0.0)], faults)[0] == []


def test_same_seed_same_reads():
    """Spoiled reads depend on the seed and on nothing else."""
    faults = Faults(missed_read_share=0.3, tag_placement_sigma_m=0.01)
    poses = [(0.01 * step, 0.0, 0.0) for step in range(100)]
    runs = [reads_of(square(pitch_m=0.1), readers([(0.0, 0.0)]), poses, faults, seed)[0] for seed in (1, 1, 2)]
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]
