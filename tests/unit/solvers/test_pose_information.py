"""Information of reads about a pose: against tags drawn at random, a plain Kalman filter, and differences."""

import math

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from layoutopt.geometry import turned
from layoutopt.robot import Odometry
from solvers.information import (
    CRITERIA,
    LEAST_DRIFT,
    Merit,
    PoseDrift,
    drift_of,
    kept_information,
    place_information,
    pose_information,
)

XY_M = np.array([(0.2, 0.1), (0.2, 0.13), (-0.15, -0.1)])
"""Two antennas whose discs of 30 mm overlap, and one apart."""
RADIUS_M = 0.03
DENSITY = 150.0
DRIFT = drift_of(Odometry(), 0.06, 0.3)


def merits():
    return [Merit(criterion=criterion, drift=DRIFT, lever_m=0.3) for criterion in CRITERIA]


def looks(draws, count):
    """Information of looks of random groups of two to five antennas."""
    found = [
        pose_information(draws.uniform(-0.3, 0.3, (draws.integers(2, 6), 2)), RADIUS_M, DENSITY).sum(axis=0)
        for _ in range(count)
    ]
    return np.array(found)


def test_a_read_leaves_a_quarter_of_the_radius_squared_for_each_axis():
    """Places of an antenna that reads a tag, drawn over the floor: five standard errors, p below 1e-6 an axis."""
    draws = np.random.Generator(np.random.Philox(1))
    place_m = draws.uniform(-RADIUS_M, RADIUS_M, (200_000, 2))
    squared = place_m[np.linalg.norm(place_m, axis=1) < RADIUS_M] ** 2
    error = squared.std(axis=0) / math.sqrt(len(squared))
    assert (np.abs(squared.mean(axis=0) - RADIUS_M**2 / 4.0) < 5.0 * error).all()
    reads = DENSITY * math.pi * RADIUS_M**2
    assert place_information(RADIUS_M, DENSITY) == pytest.approx(reads / (RADIUS_M**2 / 4.0))


@pytest.mark.parametrize("heading_rad", [0.0, 2.0])
def test_a_soft_edge_has_the_fisher_information_of_reads_and_silences(heading_rad):
    """The covariance of the score, by differences of the likelihood, over 4000 floors of tags at random places.

    The score is taken along (forward, left, turn), with turns in units of 0.2 m. Each of the six sums is asked to
    lie within 5.5 standard errors: a false alarm in 4e-6 of seeds, for both headings. Two discs share tags.
    """
    draws = np.random.Generator(np.random.Philox(2))
    edge_m, half_m, step = 0.004, 0.35, 1e-5
    unit = np.array([1.0, 1.0, 1.0 / 0.2])

    def chances(pose, tags_m):
        centre_m = turned(XY_M, pose[2]) + pose[:2]
        distance_m = np.linalg.norm(centre_m[:, None, :] - tags_m[None, :, :], axis=2)
        return 1.0 / (1.0 + np.exp(np.minimum((distance_m - RADIUS_M) / edge_m, 500.0)))

    scores = []
    for _ in range(4000):
        tags_m = draws.uniform(-half_m, half_m, (draws.poisson(DENSITY * 4.0 * half_m**2), 2))
        pose = np.array([0.0, 0.0, heading_rad])
        read = draws.random((len(XY_M), len(tags_m))) < chances(pose, tags_m)
        score = []
        for axis in np.eye(3) * unit:
            moved = np.array([*turned(axis[:2], heading_rad), axis[2]]) * step
            ahead, behind = (
                np.log(np.where(read, p, 1.0 - p)).sum()
                for p in (chances(pose + moved, tags_m), chances(pose - moved, tags_m))
            )
            score.append((ahead - behind) / (2.0 * step))
        scores.append(score)
    products = np.einsum("ki,kj->kij", scores, scores)
    error = products.std(axis=0) / math.sqrt(len(products))
    expected = pose_information(XY_M, RADIUS_M, DENSITY, edge_m=edge_m).sum(axis=0) * np.outer(unit, unit)
    assert (np.abs(products.mean(axis=0) - expected) < 5.5 * error).all()


def test_reads_are_worth_an_edge_of_a_quarter_of_the_radius():
    """Both closed forms agree there to half a per cent, whatever the radius; a sharper edge tells more."""
    for radius_m in (0.01, 0.1):
        soft = place_information(radius_m, DENSITY, radius_m / 4.0)
        assert soft == pytest.approx(place_information(radius_m, DENSITY), rel=0.005)
        assert place_information(radius_m, DENSITY, radius_m / 20.0) > 4.9 * soft


def test_an_antenna_tells_the_pose_as_far_as_its_lever_arm_carries():
    """By hand: at (0, 0.1) a turn moves the antenna backwards; two opposite ones tell places and turn apart."""
    one = pose_information(np.array([(0.0, 0.1)]), RADIUS_M, DENSITY)[0] / place_information(RADIUS_M, DENSITY)
    assert one == pytest.approx(np.array([(1.0, 0.0, -0.1), (0.0, 1.0, 0.0), (-0.1, 0.0, 0.01)]))
    two = pose_information(np.array([(0.0, 0.1), (0.0, -0.1)]), RADIUS_M, DENSITY).sum(axis=0)
    assert two == pytest.approx(np.diag([2.0, 2.0, 0.02]) * place_information(RADIUS_M, DENSITY))


def test_what_is_kept_is_what_a_kalman_filter_keeps():
    """The fixed point is that of a thousand plain steps of a filter, and that of scipy's Riccati solver."""
    forwards = np.linalg.inv(DRIFT.backwards)
    for look in looks(np.random.Generator(np.random.Philox(3)), 5):
        covariance = np.eye(3)
        for _ in range(1000):
            predicted = forwards @ covariance @ forwards.T + DRIFT.covariance
            covariance = np.linalg.inv(np.linalg.inv(predicted) + look)
        kept = kept_information(look, DRIFT)
        assert kept == pytest.approx(np.linalg.inv(covariance), rel=1e-6)
        values, vectors = np.linalg.eigh(look)
        rows = (vectors * np.sqrt(np.maximum(values, 0.0))).T
        riccati = solve_discrete_are(forwards.T, rows.T, DRIFT.covariance, np.eye(3))
        assert kept == pytest.approx(np.linalg.inv(riccati) + look, rel=1e-6)


def test_an_error_of_heading_becomes_one_to_the_side_to_which_it_points():
    """A robot and where it takes itself to be both drive straight on: the error before follows from that after."""
    drift = PoseDrift(way_m=0.06, covariance=np.eye(3))
    ahead_m, left_m, turn_rad = 0.002, -0.001, 1e-4
    after = (
        ahead_m + drift.way_m * (math.cos(turn_rad) - 1.0),
        left_m + drift.way_m * math.sin(turn_rad),
        turn_rad,
    )
    assert drift.backwards @ after == pytest.approx((ahead_m, left_m, turn_rad), abs=1e-9)


def test_one_antenna_at_the_centre_still_tells_the_heading_of_a_robot_that_moves():
    """An error of heading becomes one to the side; of a robot that hardly moves less is known of it."""
    look = pose_information(np.zeros((1, 2)), RADIUS_M, DENSITY)[0]
    for merit in merits():
        still = Merit(
            criterion=merit.criterion,
            drift=PoseDrift(way_m=1e-4, covariance=DRIFT.covariance),
            lever_m=merit.lever_m,
        )
        assert math.isfinite(float(still(look)))
        assert float(still(look)) < float(merit(look)) - 1.0


@pytest.mark.parametrize("merit", merits(), ids=CRITERIA)
def test_the_slope_is_that_of_differences(merit):
    """Along random directions, central differences agree to a millionth."""
    draws = np.random.Generator(np.random.Philox(4))
    for look, other in zip(looks(draws, 10), looks(draws, 10), strict=True):
        step = 1e-4
        change = (float(merit(look + step * other)) - float(merit(look - step * other))) / (2.0 * step)
        assert float((merit.slope(look) * other).sum()) == pytest.approx(change, rel=1e-6)


@pytest.mark.parametrize("merit", merits(), ids=CRITERIA)
def test_the_merit_is_concave_and_never_falls_with_more_information(merit):
    """It lies above its chords and below its tangents on 200 random segments; singular ends count too."""
    draws = np.random.Generator(np.random.Philox(5))
    first, second = looks(draws, 200), looks(draws, 200)
    second[::4] = pose_information(draws.uniform(-0.3, 0.3, (50, 2)), RADIUS_M, DENSITY)
    share = draws.random(200)
    between = merit(first * share[:, None, None] + second * (1.0 - share)[:, None, None])
    assert (between >= share * merit(first) + (1.0 - share) * merit(second) - 1e-10).all()
    slopes = np.array([merit.slope(look) for look in first])
    tangent = merit(first) + (slopes * (second - first)).sum(axis=(1, 2))
    assert (merit(second) <= tangent + 1e-10).all()
    assert (merit(first + second) >= merit(first) - 1e-12).all()


def test_the_mean_square_error_is_that_of_a_point_of_the_robot():
    """The A merit against errors drawn from the covariance: a point 0.3 m off, in a random direction."""
    draws = np.random.Generator(np.random.Philox(6))
    look = looks(draws, 1)[0]
    merit = Merit(criterion="A", drift=DRIFT, lever_m=0.3)
    errors = draws.multivariate_normal(np.zeros(3), np.linalg.inv(kept_information(look, DRIFT)), 100_000)
    angle = draws.uniform(0.0, 2.0 * np.pi, len(errors))
    moved = errors[:, :2] + 0.3 * errors[:, 2:] * np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    squared = (moved**2).sum(axis=1)
    assert abs(squared.mean() - math.exp(-float(merit(look)))) < 5.0 * squared.std() / math.sqrt(len(squared))


def test_a_perfect_odometry_keeps_the_least_drift():
    """Where a spec states no error, the drift is positive all the same."""
    perfect = Odometry(translation_share=0.0, rotation_rad_per_m=0.0, lateral_share=0.0)
    assert np.diag(drift_of(perfect, 0.05, 0.3).covariance) == pytest.approx(LEAST_DRIFT**2)
    assert math.isfinite(
        float(
            Merit(criterion="D", drift=drift_of(perfect, 0.05, 0.3), lever_m=0.3)(
                looks(np.random.default_rng(1), 1)[0]
            )
        )
    )


def test_numbers_out_of_reason_are_refused():
    """Radius, density, way, covariance, criterion and lever."""
    with pytest.raises(ValueError, match="must be positive"):
        place_information(0.0, DENSITY)
    with pytest.raises(ValueError, match="must be positive"):
        pose_information(XY_M, RADIUS_M, DENSITY, edge_m=-1.0)
    with pytest.raises(ValueError, match="way between looks must be positive"):
        PoseDrift(way_m=0.0, covariance=np.eye(3))
    with pytest.raises(ValueError, match="positive definite"):
        PoseDrift(way_m=0.1, covariance=np.zeros((3, 3)))
    with pytest.raises(ValueError, match="one of D, A"):
        Merit(criterion="E", drift=DRIFT, lever_m=0.3)
    with pytest.raises(ValueError, match="lever"):
        Merit(criterion="D", drift=DRIFT, lever_m=0.0)
