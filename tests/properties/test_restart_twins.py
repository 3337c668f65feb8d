"""Where the compiled filter puts particles, at the start and when they start anew, the plain one puts them too.

Both draw their own numbers, so places are compared as samples: by Kolmogorov and Smirnov's test of two samples,
with a false-alarm rate of 1e-6 for each coordinate.
"""

import math

import numpy as np
import pytest
from filter_worlds import CROSS_M, antennas, knowledge, lattice_m
from scipy import stats

from layoutopt.estimators import mcl_kernels
from layoutopt.estimators.disc_filter import REMEMBERED, DiscFilter
from layoutopt.estimators.evidence import Constraints
from layoutopt.estimators.mcl_adaptive import AdaptiveParticles
from layoutopt.estimators.mcl_negative_information import NegativeInformation
from layoutopt.estimators.particles import antenna_places, cloud_at_start, start_bounds_m
from layoutopt.readings import Prior

COUNT = 4000
KEY = (12, 34)
KNOWN = knowledge(lattice_m(0.1), antennas(radius_m=np.linspace(0.02, 0.05, 8)))
SOMEWHERE = Prior(pose=(0.3, -0.2, 2.0), sigma_m=0.1, sigma_rad=0.2)


def assert_alike(compiled, plain, rows=(0, 1, 2, 3)):
    """Compare clouds, shape (4, n) of the kernel and (3, n): x, y, cosine, sine, and products of two."""
    plain = np.stack([plain[0], plain[1], np.cos(plain[2]), np.sin(plain[2])])
    for first in rows:
        for second in [None, *(row for row in rows if row < first)]:
            pair = [cloud[first] * (1.0 if second is None else cloud[second]) for cloud in (compiled, plain)]
            assert stats.ks_2samp(*pair, method="asymp").pvalue > 1e-6


@pytest.mark.parametrize("sigma_m", [0.0, 0.1, math.inf])
@pytest.mark.parametrize("sigma_rad", [0.0, 0.2, math.inf])
@pytest.mark.parametrize("floor", ["lattice", "empty"])
def test_the_cloud_at_the_start(sigma_m, sigma_rad, floor):
    """About a known pose, over the whole floor, in every direction, or both; without tags over a metre."""
    known = KNOWN if floor == "lattice" else knowledge(np.empty((0, 2)))
    prior = Prior(pose=SOMEWHERE.pose, sigma_m=sigma_m, sigma_rad=sigma_rad)
    draws = np.random.default_rng(1)
    noise = draws.standard_normal((3, COUNT))
    plain = cloud_at_start(prior, known, noise, draws.random((3, COUNT)))
    cloud = np.empty((4, COUNT), np.float32)
    origin_m = np.array([0.05, 0.02])
    told = np.array([*prior.pose, sigma_m, sigma_rad])
    low, high = start_bounds_m(prior, known)
    normals = noise.astype(np.float32).ravel()
    mcl_kernels._start(KEY, told, np.array([low, high]), origin_m, COUNT, normals, cloud)
    cloud[:2] += origin_m[:, None]
    # What is known is the same to the bit that is left; what is not has numbers of its own.
    if math.isinf(sigma_m):
        assert (cloud[:2].min(axis=1) >= low - 1e-6).all()
        assert (cloud[:2].max(axis=1) <= high + 1e-6).all()
    else:
        np.testing.assert_allclose(cloud[:2], plain[:2], atol=1e-6)
    if not math.isinf(sigma_rad):
        np.testing.assert_allclose(cloud[2:], [np.cos(plain[2]), np.sin(plain[2])], atol=1e-6)
    assert_alike(cloud, plain, [*(0, 1)[: 2 * math.isinf(sigma_m)], *(2, 3)[: 2 * math.isinf(sigma_rad)]])


def plain_filter(estimator=None):
    settings = estimator or AdaptiveParticles(particles=COUNT)
    return DiscFilter(settings, SOMEWHERE, KNOWN, np.random.default_rng(2))


def columns(reads):
    """Return the constraints of one step that read what is given."""
    antenna, tag = np.array(reads).T
    radius_m = KNOWN.antennas.radius_m[antenna]
    shape = np.column_stack([0.0 * radius_m, radius_m, 1.0 + 0.0 * radius_m, 0.0 * radius_m])
    return Constraints(
        start=np.array([0, len(reads)]),
        read_end=np.array([len(reads)]),
        place=np.column_stack([KNOWN.antennas.xy_m[antenna], KNOWN.tags.xy_m[tag]]).astype(np.float32),
        shape=shape.astype(np.float32),
        antenna=antenna,
        tag=tag,
    )


def memory_of(running):
    """Return what a plain filter remembers as the kernel holds it."""
    rows = np.zeros((REMEMBERED, 5))
    for row, (antenna_m, tag_m, radius_m) in enumerate(running._remembered):
        rows[row] = *antenna_m, *tag_m, radius_m
    return rows, len(running._remembered)


def test_what_is_remembered():
    """The eight newest reads, carried along with the robot, are the same in both forms, step after step."""
    draws = np.random.default_rng(3)
    running = plain_filter()
    remembered, kept = np.zeros((REMEMBERED, 5)), 0
    for _ in range(60):
        increment = draws.normal(0.0, [0.1, 0.1, 0.5])
        reads = [
            (int(draws.integers(8)), int(draws.integers(len(KNOWN.tags)))) for _ in range(draws.integers(0, 4))
        ]
        running._carry(increment)
        mcl_kernels._carry(remembered, kept, increment)
        running._remember(reads)
        if reads:
            kept = mcl_kernels._remember(remembered, kept, columns(reads), 0, len(reads))
        expected, count = memory_of(running)
        assert kept == count
        np.testing.assert_allclose(remembered[:kept], expected[:kept], atol=1e-6)
    assert kept == REMEMBERED


def test_a_read_that_is_carried_stays_where_it_was():
    """Seen from the floor the antenna of a read before does not move while the robot does."""
    draws = np.random.default_rng(4)
    running = plain_filter()
    running._remember([(5, 0)])
    cloud = np.array([[0.3], [-0.2], [1.0]])
    before_m = antenna_places(cloud, CROSS_M[5])
    for _ in range(20):
        forward_m, left_m, turn_rad = increment = draws.normal(0.0, [0.1, 0.1, 0.5])
        cos, sin = np.cos(cloud[2]), np.sin(cloud[2])
        cloud += np.stack([cos * forward_m - sin * left_m, sin * forward_m + cos * left_m, [turn_rad]])
        running._carry(increment)
        np.testing.assert_allclose(antenna_places(cloud, running._remembered[0][0]), before_m, atol=1e-12)


@pytest.mark.parametrize("paired", [False, True])
@pytest.mark.parametrize("present", [[(1, 200)], [(1, 200), (4, 230), (4, 231)]])
def test_particles_that_start_anew(paired, present):
    """From one read or several, with headings at random or from a read before."""
    estimator = (AdaptiveParticles if paired else NegativeInformation)(particles=COUNT)
    running = plain_filter(estimator)
    # Antenna 5 lies 0.2 m to the left, and its tag of then 0.4 m from that of now; antenna 1 of now is too near.
    for increment, reads in (((0.1, 0.0, 0.2), [(5, 120)]), ((0.05, 0.02, 0.1), [(3, 190)])):
        running._carry(np.array(increment))
        running._remember(reads)
    remembered, kept = memory_of(running)
    running._start_anew(present)
    cloud = np.empty((4, COUNT), np.float32)
    mcl_kernels._start_anew(KEY, 7, columns(present), 0, len(present), remembered, kept, paired, cloud)
    assert_alike(cloud, running._cloud)
    np.testing.assert_allclose(np.hypot(cloud[2], cloud[3]), 1.0, atol=1e-6)
    places = np.array([cloud[0], cloud[1], np.arctan2(cloud[3], cloud[2])])
    off_m = np.array(
        [
            np.hypot(*(antenna_places(places, CROSS_M[antenna]) - KNOWN.tags.xy_m[tag][:, None]))
            / KNOWN.antennas.radius_m[antenna]
            for antenna, tag in present
        ]
    )
    # Each lies in the disc of one read, evenly: the squared distance in radii is uniform.
    nearest = off_m.min(axis=0)
    assert nearest.max() <= 1.0 + 1e-4
    if len(present) == 1:
        assert stats.kstest(nearest**2, "uniform").pvalue > 1e-6
        heading_rad = places[2] / (2.0 * math.pi) + 0.5
        assert (stats.kstest(heading_rad, "uniform").pvalue < 1e-6) == paired


def test_headings_from_two_reads():
    """Half of the particles look so that the antenna of the read before lies in the direction of its tag."""
    running = plain_filter()
    tags_m = KNOWN.tags.xy_m
    middle = int(np.argmin(np.hypot(*tags_m.T)))
    away = int(np.argmin(np.hypot(*(tags_m - tags_m[middle] - [0.3, 0.0]).T)))
    running._remember([(5, away)])
    remembered, kept = memory_of(running)
    for form in ("plain", "compiled"):
        cloud = np.empty((4, COUNT), np.float32)
        if form == "plain":
            running._start_anew([(7, middle)])
            cloud[:] = *running._cloud[:2], np.cos(running._cloud[2]), np.sin(running._cloud[2])
        else:
            mcl_kernels._start_anew(KEY, 8, columns([(7, middle)]), 0, 1, remembered, kept, True, cloud)
        poses = np.array([cloud[0], cloud[1], np.arctan2(cloud[3], cloud[2])])
        across_m = antenna_places(poses, CROSS_M[5]) - antenna_places(poses, CROSS_M[7])
        off_rad = np.arctan2(across_m[1], across_m[0]) - np.arctan2(*(tags_m[away] - tags_m[middle])[::-1])
        off_rad = np.abs(np.angle(np.exp(1j * off_rad)))
        most_rad = math.asin((KNOWN.antennas.radius_m[5] + KNOWN.antennas.radius_m[7]) / 0.3)
        assert off_rad[::2].max() <= most_rad + 1e-4
        assert off_rad[1::2].max() > 3.0
