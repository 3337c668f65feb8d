"""The compiled likelihoods are the plain ones, for every particle, to what single precision leaves."""

import math

import numpy as np
import pytest
from filter_worlds import CROSS_M, antennas, knowledge, lattice_m, observations

from layoutopt.estimators import likelihood_kernels
from layoutopt.estimators.evidence import edge_width_m, floor_of, origin_of
from layoutopt.estimators.likelihood import log_likelihood, ring_log_likelihood
from layoutopt.estimators.mcl_negative_information import NegativeInformation
from layoutopt.estimators.particles import antenna_places
from layoutopt.readings import Prior

COUNTS = (1, 7, 500)
SPREADS_M = {"point": 0.0, "tight": 0.003, "wide": 0.05, "everywhere": 0.6}


def cloud_at_random(draws, count, spread_m, middle_m=(0.1, -0.2)):
    angle_rad = draws.normal(0.4, spread_m / 0.2, count)
    return np.stack([*(draws.normal(0.0, spread_m, (2, count)) + np.array(middle_m)[:, None]), angle_rad])


def compiled_cloud(cloud, room=2):
    """Return a plain cloud as the kernels hold it, with places left over that must not be looked at."""
    found = np.full((4, cloud.shape[1] + room), np.nan, np.float32)
    found[:, : cloud.shape[1]] = cloud[0], cloud[1], np.cos(cloud[2]), np.sin(cloud[2])
    return found


def rows_at_random(draws, count):
    """Antennas and tags near each other for a robot near the middle, shape (count, 4)."""
    return np.column_stack([draws.uniform(-0.2, 0.2, (count, 2)), draws.uniform(-0.4, 0.4, (count, 2))])


def distances_m(cloud, row):
    away_m = antenna_places(cloud, row[:2]) - row[2:, None]
    return np.hypot(away_m[0], away_m[1])


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("spread", SPREADS_M)
@pytest.mark.parametrize(("likelihood", "beta"), [("gaussian", 1.0), ("combination", 1.0), ("combination", 0.3)])
def test_weigh_by_distance(count, spread, likelihood, beta):
    """Eq. 6 of mi2016 in both forms, added to what the weights were."""
    draws = np.random.default_rng(count)
    cloud = cloud_at_random(draws, count, SPREADS_M[spread])
    rows, sigma_m = rows_at_random(draws, 6), draws.uniform(0.02, 0.3, 6)
    expected = np.full(count, 0.25)
    for row, one in zip(rows, sigma_m, strict=True):
        expected += log_likelihood(distances_m(cloud, row) ** 2, float(one), likelihood, math.log(beta))
    shape = np.zeros((6, 4), np.float32)
    shape[:, 0] = 1.0 / (2.0 * sigma_m**2)
    found = np.full(count, 0.25, np.float32)
    flat = likelihood == "combination"
    likelihood_kernels.weigh_by_distance(
        compiled_cloud(cloud), rows.astype(np.float32), shape, flat, math.log(beta), found
    )
    # Over the edge of the flat top a weight jumps by half a unit and log beta.
    near = np.isclose(found, expected, rtol=1e-5, atol=1e-4)
    assert (~near).sum() <= (1 if flat and count > 7 else 0)


def test_the_flat_top_is_open():
    """A tag as far as sigma lies beyond the flat top, as in the plain form."""
    row, cloud = np.array([[0.0, 0.0, 0.5, 0.0]]), np.zeros((3, 1))
    for sigma_m in (0.5, np.nextafter(np.float32(0.5), np.float32(1.0))):
        shape = np.array([[1.0 / (2.0 * float(sigma_m) ** 2), 0.0, 0.0, 0.0]], np.float32)
        found = np.zeros(1, np.float32)
        likelihood_kernels.weigh_by_distance(
            compiled_cloud(cloud), row.astype(np.float32), shape, True, 0.0, found
        )
        plain = log_likelihood(np.array([0.25]), float(sigma_m), "combination", 0.0)
        assert found[0] == pytest.approx(plain[0], abs=1e-6)


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("spread", SPREADS_M)
def test_weigh_by_rings(count, spread):
    """Reads (no inner radius), crossings inwards and outwards, and rings without width, with their floors."""
    draws = np.random.default_rng(count)
    cloud = cloud_at_random(draws, count, SPREADS_M[spread])
    rows = rows_at_random(draws, 6)
    rings = np.array(
        [(0.0, 0.03), (0.02, 0.03), (0.03, 0.04), (0.1, 0.1), (0.0, 0.3), (0.0, 0.0)], dtype=np.float64
    )
    width_m, least = np.array([0.0045, 0.0005, 0.01, 0.02, 0.045, 0.0005]), math.log(0.001)
    expected = np.full(count, -0.5)
    for row, (inner_m, outer_m), one in zip(rows, rings, width_m, strict=True):
        expected += ring_log_likelihood(
            distances_m(cloud, row), inner_m=inner_m, outer_m=outer_m, width_m=float(one), log_floor=least
        )
    shape = np.column_stack([rings, 1.0 / width_m, np.full(6, least)]).astype(np.float32)
    found = np.full(count, -0.5, np.float32)
    likelihood_kernels.weigh_by_rings(compiled_cloud(cloud), rows.astype(np.float32), shape, found)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=3e-3)
    assert (found >= -0.5 + 6 * least - 1e-3).all()


class Silence:
    """One scan of all antennas: the plain filter's log weights, and the kernel's."""

    def __init__(self, tags_m, carried, *, miss_share=0.1, tag_sigma_m=0.0, active=None):
        self.known = knowledge(tags_m, carried, tag_sigma_m)
        self.estimator = NegativeInformation(particles=1, miss_share=miss_share)
        scanning = np.ones(len(carried), dtype=bool) if active is None else np.asarray(active)
        self.scanning = np.flatnonzero(scanning)
        told = observations(np.zeros((1, 3)), np.zeros((1, 3)), scanning[None, :], [])
        self.origin_m = origin_of(self.known, (0.0, 0.0))
        self.floor = floor_of(
            told, self.known, self.origin_m, edge_share=self.estimator.edge_share, miss_share=miss_share
        )

    def plain(self, cloud, reads=()):
        running = self.estimator.start(
            Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.0, sigma_rad=0.0), self.known, np.random.default_rng(0)
        )
        running._cloud = cloud
        return running._of_silence(self.scanning, list(reads))

    def compiled(self, cloud, reads=()):
        count = cloud.shape[1]
        shifted = cloud - np.array([*self.origin_m, 0.0])[:, None]
        antenna, tag = np.array(list(reads), dtype=np.int64).reshape(-1, 2).T
        found = np.zeros(count, np.float32)
        scratch = np.full((2, count + 3), np.nan, np.float32)
        likelihood_kernels.weigh_by_silence(
            compiled_cloud(shifted), self.floor, 0, antenna.copy(), tag.copy(), found, scratch[0], scratch[1]
        )
        return found

    def assert_alike(self, cloud, reads=(), jumps=0):
        """Check the twins; where two tags silence each other, a particle on the very edge may jump."""
        expected, found = self.plain(cloud, reads), self.compiled(cloud, reads)
        near = np.isclose(found, expected, rtol=1e-5, atol=1e-3)
        assert (~near).sum() <= jumps, np.abs(found - expected).max()
        return expected


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("spread", SPREADS_M)
@pytest.mark.parametrize("one_tag", [False, True])
@pytest.mark.parametrize("pitch_m", [0.03, 0.1, 0.4])
def test_weigh_by_silence(count, spread, one_tag, pitch_m):
    """Tight and wide clouds over dense and sparse tags, for readers with and without collisions."""
    draws = np.random.default_rng(count)
    silence = Silence(lattice_m(pitch_m), antennas(radius_m=0.04, one_tag=one_tag))
    cloud = cloud_at_random(draws, count, SPREADS_M[spread])
    expected = silence.assert_alike(cloud, jumps=2 if one_tag and count > 7 else 0)
    assert (expected <= 0.0).all()
    if count == 500 and spread == "everywhere":
        assert (expected < 0.0).any()


@pytest.mark.parametrize("one_tag", [False, True])
@pytest.mark.parametrize("spread", SPREADS_M)
def test_tags_that_were_read_do_not_count(one_tag, spread):
    """Not for the antenna that read them, but for the others; a reader that read one had no collision."""
    draws = np.random.default_rng(4)
    tags_m = lattice_m(0.05)
    silence = Silence(tags_m, antennas(radius_m=0.06, one_tag=one_tag))
    cloud = cloud_at_random(draws, 300, SPREADS_M[spread])
    centre_m = antenna_places(cloud, CROSS_M[0]).mean(axis=1)
    near = np.argsort(np.hypot(*(tags_m - centre_m).T))[:4].tolist()
    for reads in ([(0, near[0])], [(0, tag) for tag in near], [(0, near[0]), (3, near[1]), (3, near[2])]):
        silence.assert_alike(cloud, reads, jumps=1 if one_tag else 0)
    unread, read = silence.plain(cloud), silence.plain(cloud, [(0, near[0])])
    assert (unread != read).any()


def test_both_ways_of_looking_up_tags_agree():
    """A particle weighs the same among its like and with one far away, which makes each look up its own tags."""
    draws = np.random.default_rng(5)
    tags_m = lattice_m(0.03, half_m=3.0)
    for one_tag in (False, True):
        silence = Silence(tags_m, antennas(radius_m=0.05, one_tag=one_tag))
        cloud = cloud_at_random(draws, 200, 0.004)
        wide = np.concatenate([cloud, [[2.5], [2.5], [-2.0]]], axis=1)
        for reads in ((), [(2, 7)], [(0, int(np.argmin(np.hypot(*(tags_m - cloud[:2, 0]).T))))]):
            together, apart = silence.compiled(cloud, reads), silence.compiled(wide, reads)[:-1]
            differs = ~np.isclose(together, apart, rtol=1e-5, atol=1e-3)
            assert differs.sum() <= (1 if one_tag else 0)
            assert (together < 0.0).any() or one_tag


def test_more_tags_in_one_field_than_there_is_room_for():
    """Hundreds of tags within one disc: the list of each particle grows, and nothing is left out."""
    draws = np.random.default_rng(6)
    tags_m = draws.uniform(-0.5, 0.5, (3000, 2))
    silence = Silence(tags_m, antennas(CROSS_M[:2], radius_m=0.3))
    cloud = cloud_at_random(draws, 20, 0.01)
    expected = silence.plain(cloud)
    np.testing.assert_allclose(silence.compiled(cloud), expected, rtol=1e-4)
    assert expected.max() < -200.0


def test_antennas_that_cannot_tell():
    """Out of reach of the floor or not scanning, an antenna says nothing; the others do."""
    draws = np.random.default_rng(7)
    cloud = cloud_at_random(draws, 100, 0.05)
    tags_m = lattice_m(0.05)
    radius_m = np.where(np.arange(8) < 4, 0.0, 0.05)
    some = Silence(tags_m, antennas(radius_m=radius_m)).assert_alike(cloud)
    half = Silence(tags_m, antennas(radius_m=0.05), active=np.arange(8) >= 4).assert_alike(cloud)
    np.testing.assert_allclose(some, half)
    none = Silence(tags_m, antennas(radius_m=0.0))
    idle = Silence(tags_m, antennas(radius_m=0.05), active=np.zeros(8, dtype=bool))
    for silence in (none, idle):
        np.testing.assert_array_equal(silence.compiled(cloud), 0.0)
        np.testing.assert_array_equal(silence.plain(cloud), 0.0)


@pytest.mark.parametrize("place_m", [0.0, 5.0, 1e6, 1e30])
def test_an_empty_floor_says_nothing(place_m):
    """No tag at all, or a cloud off the floor, however far."""
    draws = np.random.default_rng(8)
    cloud = cloud_at_random(draws, 50, 0.01, (place_m, -place_m))
    empty = Silence(np.empty((0, 2)), antennas())
    np.testing.assert_array_equal(empty.compiled(cloud), 0.0)
    if place_m:
        away = Silence(lattice_m(0.03), antennas())
        np.testing.assert_array_equal(away.compiled(cloud), 0.0)
        np.testing.assert_array_equal(away.plain(cloud), 0.0)


def test_one_tag_on_the_floor():
    """A grid of one cell is a grid too."""
    draws = np.random.default_rng(9)
    silence = Silence(np.array([[0.2, -0.2]]), antennas(radius_m=0.05))
    expected = silence.assert_alike(cloud_at_random(draws, 500, 0.03))
    assert (expected < 0.0).any()


def test_tolerances_of_tags_widen_the_edge():
    """A tag laid inexactly speaks less against a place near the edge of the disc, in both forms."""
    draws = np.random.default_rng(10)
    cloud = cloud_at_random(draws, 200, 0.02)
    tags_m = lattice_m(0.1)
    exact = Silence(tags_m, antennas(radius_m=0.05)).assert_alike(cloud)
    sigma_m = draws.uniform(0.0, 0.03, len(tags_m))
    inexact = Silence(tags_m, antennas(radius_m=0.05), tag_sigma_m=sigma_m).assert_alike(cloud)
    assert (inexact >= exact - 1e-12).all()
    assert (inexact > exact + 0.1).any()


def test_the_plain_silence_is_what_it_says():
    """Over a lone tag silence is as unlikely as a missed scan; on the edge of the disc it says nothing."""
    silence = Silence(np.array([[0.0, 0.0]]), antennas(np.zeros((1, 2)), radius_m=0.05), miss_share=0.2)
    width_m = edge_width_m(0.15, silence.known, np.array([0]), np.array([0]))[0]
    cloud = np.zeros((3, 4))
    cloud[0] = 0.0, 0.05 - width_m, 0.05, 0.2
    expected = [math.log(0.2), -0.5, 0.0, 0.0]
    np.testing.assert_allclose(silence.plain(cloud), expected, atol=1e-9)
    np.testing.assert_allclose(silence.compiled(cloud), expected, atol=1e-5)


def test_two_tags_in_one_field_silence_each_other():
    """A reader that takes one tag at a time is silent over none and over two, but not over one."""
    tags_m = np.array([[0.0, 0.0], [0.06, 0.0]])
    silence = Silence(tags_m, antennas(np.zeros((1, 2)), radius_m=0.05, one_tag=True))
    cloud = np.zeros((3, 3))
    cloud[0] = -0.02, 0.03, 0.5
    for found in (silence.plain(cloud), silence.compiled(cloud)):
        np.testing.assert_allclose(found, [math.log(0.1), 0.0, 0.0], atol=1e-6)
    reads = [(0, 0)]
    for found in (silence.plain(cloud, reads), silence.compiled(cloud, reads)):
        assert found[1] < -1.0
