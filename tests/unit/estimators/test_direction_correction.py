"""The published correction against its equations one by one, and the bearing filter against known answers."""

import math

import numpy as np
import pytest

from layoutopt.estimators.bearing_filter import BearingBelief, BearingFilter, expected_bearing
from layoutopt.estimators.direction_of_arrival import TRIALS_RAD, correct_direction

DRAWS = np.random.Generator(np.random.Philox(1219))


def triples(count):
    """Noise-free drives of three positions: directions, ranges, moves, turns and the true error of the last.

    The true error is one of the trial values; the driven headings are off by up to 40 degrees.
    """
    rows = []
    for _ in range(count):
        places, heading = [np.zeros(2)], 0.0
        transponder = DRAWS.uniform(2.0, 4.0) * np.array([1.0, DRAWS.uniform(-0.5, 0.5)])
        moves, turns, ranges, directions = DRAWS.uniform(0.3, 0.6, 2), [], [], []
        error = DRAWS.choice(TRIALS_RAD)
        for position in range(3):
            away = transponder - places[-1]
            true_rad = math.atan2(away[1], away[0])
            ranges.append(math.hypot(*away))
            off = error if position == 2 else DRAWS.uniform(-0.7, 0.7)
            directions.append(true_rad - off - heading)
            if position < 2:
                turns.append(directions[-1])
                heading += directions[-1]
                places.append(places[-1] + moves[position] * np.array([math.cos(heading), math.sin(heading)]))
        rows.append((directions, ranges, moves, turns, error))
    return [np.array(column) for column in zip(*rows, strict=True)]


def sizes_m(direction, ranges, moves, turn):
    """|x| for every trial value by Eq. 13-17 as printed (with the two index repairs); infinite where undefined."""
    latest, middle, oldest = ranges[2], ranges[1], ranges[0]
    if middle - latest > moves[1]:
        middle = latest + moves[1] / 2
    if oldest - middle > moves[0]:
        oldest = middle + moves[0] / 2
    sizes = []
    for trial in TRIALS_RAD:
        sine = latest / middle * math.sin(direction + trial)
        if abs(sine) > 1.0:
            sizes.append(math.inf)
            continue
        middle_error = math.asin(sine)
        sine = middle / oldest * math.sin(turn + middle_error)
        if abs(sine) > 1.0:
            sizes.append(math.inf)
            continue
        oldest_error = math.asin(sine)
        angle = trial + direction
        x1, y1 = -moves[1] * math.sin(angle), -moves[1] * math.cos(angle)
        x2, y2 = x1 - moves[0] * math.sin(angle + turn), y1 - moves[0] * math.cos(angle + turn)
        slope1, slope2 = 1 / math.tan(angle - middle_error), 1 / math.tan(angle + turn - oldest_error)
        sizes.append(abs((slope1 * x1 - slope2 * x2 - y1 + y2) / (slope1 - slope2)))
    return np.array(sizes)


def test_the_correction_is_the_smallest_size_of_the_printed_equations():
    """Vectorised crossing of lines and cotangents of Eq. 15-17 give the same sizes and one best trial."""
    directions, ranges, moves, turns, _ = triples(300)
    ranges = ranges * DRAWS.uniform(0.8, 1.2, ranges.shape)
    found = correct_direction(directions, ranges, moves, turns)
    for row in range(300):
        sizes = sizes_m(directions[row, 2], ranges[row], moves[row], turns[row, 1])
        assert found.found[row] == np.isfinite(sizes).any()
        if found.found[row]:
            assert found.size_m[row] == pytest.approx(sizes.min(), rel=1e-6, abs=1e-9)
            chosen = np.argmin(np.abs(TRIALS_RAD - found.error_rad[row]))
            assert sizes[chosen] == pytest.approx(sizes.min(), rel=1e-6, abs=1e-9)


def test_true_ranges_make_the_triangle_of_the_true_error_vanish():
    """Without noise all three lines meet in the transponder; the size found is never larger than rounding."""
    directions, ranges, moves, turns, error = triples(300)
    found = correct_direction(directions, ranges, moves, turns)
    true_m = np.array(
        [
            sizes_m(directions[row, 2], ranges[row], moves[row], turns[row, 1])[
                np.argmin(np.abs(TRIALS_RAD - error[row]))
            ]
            for row in range(300)
        ]
    )
    assert np.median(true_m) < 1e-12
    assert (true_m < 1e-6).all()
    assert (found.size_m < 1e-6).all()


def test_the_correction_is_ill_conditioned():
    """Even without noise several trial values make a triangle below a centimetre: the reason for the filter."""
    directions, ranges, moves, turns, _ = triples(200)
    flat = [
        (sizes_m(directions[row, 2], ranges[row], moves[row], turns[row, 1]) < 0.01).sum() for row in range(200)
    ]
    assert np.mean(flat) > 2.0


def test_a_range_that_breaks_the_bound_is_replaced():
    """r(i-1) - r(i) beyond the move counts as r(i) plus half the move (Algorithm 1)."""
    directions, moves, turns = [0.0, 0.3, 0.2], [0.5, 0.5], [0.0, 0.3]
    broken = correct_direction(directions, [3.9, 3.6, 3.0], moves, turns)
    replaced = correct_direction(directions, [3.25 + 0.25, 3.25, 3.0], moves, turns)
    assert broken == replaced


def test_a_straight_drive_at_the_transponder_is_left_alone():
    """All three lines are one, which no trial value can better."""
    found = correct_direction([0.0, 0.0, 0.0], [4.0, 3.5, 3.0], [0.5, 0.5], [0.0, 0.0])
    assert found.found
    assert float(found.error_rad) == 0.0
    assert float(found.size_m) == 0.0


def test_three_readings_at_one_place_make_no_triangle():
    """Any error would fit them, so none is told; after one move there is something to go by."""
    stood = correct_direction([0.1, 0.2, 0.3], [3.0, 3.0, 3.0], [0.0, 0.0], [0.0, 0.2])
    assert not stood.found
    assert float(stood.error_rad) == 0.0
    assert correct_direction([0.1, 0.2, 0.3], [3.4, 3.0, 3.0], [0.5, 0.0], [0.0, 0.2]).found


def test_no_arc_sine_at_any_trial_value_means_no_correction():
    """A range that grew three hundredfold fits only directions next to straight ahead; no trial value is."""
    found = correct_direction([0.0, 0.0, math.radians(92.5)], [1.0, 1.0, 300.0], [0.5, 0.5], [0.0, 0.0])
    assert not found.found
    assert float(found.error_rad) == 0.0


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"directions_rad": [0.0, 0.0]}, "3 numbers"),
        ({"directions_rad": [0.0, 0.0, math.nan]}, "not finite"),
        ({"ranges_m": [1.0, 0.0, 1.0]}, "not positive"),
        ({"moves_m": [0.5, -0.5]}, "negative way"),
        ({"turns_rad": [[0.0, 0.0]]}, "same number of rows"),
    ],
)
def test_a_triple_that_does_not_fit_is_refused(change, sentence):
    """Every number must be one, ranges positive, moves not negative."""
    right = {
        "directions_rad": [0.0, 0.1, 0.2],
        "ranges_m": [4.0, 3.6, 3.2],
        "moves_m": [0.5, 0.5],
        "turns_rad": [0.0, 0.1],
    }
    correct_direction(**right)
    with pytest.raises(ValueError, match=sentence):
        correct_direction(**{**right, **change})


GRID_M = np.stack(np.meshgrid(np.arange(-1.0, 5.01, 0.1), np.arange(-3.0, 3.01, 0.1)), axis=-1).reshape(-1, 2)
TRANSPONDER_M = np.array([3.03, 1.04])


def true_rad(place_m):
    return math.atan2(*(TRANSPONDER_M - place_m)[::-1])


def drive(bearings_off_rad, places_m, belief=None):
    found = BearingFilter(GRID_M, 1, belief)
    for place_m, off_rad in zip(places_m, bearings_off_rad, strict=True):
        answer = found.step(np.array([0]), [place_m], [true_rad(place_m) + off_rad])
    return float(answer[0]), found


def test_true_bearings_leave_the_transponder():
    """Bearings from two sides without error put the most likely candidate within a cell of the transponder."""
    places = [np.array([0.0, 0.0]), np.array([0.4, -0.8]), np.array([1.0, -2.0]), np.array([2.5, -2.0])]
    bearing_rad, found = drive([0.0] * 4, places)
    assert np.abs(GRID_M[found.log_weights[0].argmax()] - TRANSPONDER_M).max() < 0.11
    assert bearing_rad == pytest.approx(true_rad(places[-1]), abs=math.radians(5.0))


def test_one_wrong_bearing_hardly_matters():
    """A bearing that is 80 degrees off turns the answer by a few degrees, where a mean would turn by ten."""
    places = [np.array([0.25 * step, 0.1 * step]) for step in range(8)]
    right, wrong = (drive([0.0] * 7 + [off_rad], places)[0] for off_rad in (0.0, math.radians(80.0)))
    assert abs(right - true_rad(places[-1])) < math.radians(4.0)
    assert abs(wrong - right) < math.radians(5.0)


def test_readings_at_one_place_count_once():
    """A robot that is stopped hears the same scattered waves again; they are no new evidence."""
    places = [np.array([0.0, 0.0])] + [np.array([0.0, 0.1])] * 20
    _, often = drive([0.0] + [0.5] * 20, places)
    _, once = drive([0.0], places[:1])
    assert np.array_equal(often.log_weights, once.log_weights)


def test_evidence_is_a_density_over_bearings():
    """Its mean over the circle is that of a uniform density, whatever spread and share."""
    bearings = np.linspace(-math.pi, math.pi, 4000, endpoint=False)
    for spread_rad in (0.01, 0.4, 2.0):
        belief = BearingBelief(spread_rad=spread_rad, wrong_share=0.3)
        evidence = belief.log_evidence(np.array([[1.0, 2.0]]), np.zeros((4000, 2)), bearings)
        assert np.exp(evidence).mean() == pytest.approx(1.0, abs=1e-9)
        assert bearings[evidence[:, 0].argmax()] == pytest.approx(math.atan2(2.0, 1.0), abs=0.002)


def test_the_expected_bearing_is_the_mean_of_directions():
    """Two places of one weight give the middle of their directions, across the seam of the circle too."""
    found = expected_bearing(np.array([[-2.0, 0.2], [-1.0, -0.1]]), np.zeros((1, 2)), np.zeros((1, 2)))
    assert math.cos(float(found[0]) - math.pi) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    "settings",
    [
        {"spread_rad": 0.0},
        {"spread_rad": math.nan},
        {"wrong_share": 0.0},
        {"wrong_share": 1.0},
        {"apart_m": -1.0},
        {"apart_m": math.inf},
    ],
)
def test_a_belief_outside_its_range_is_refused(settings):
    """A setting that would make the filter blind or sure of everything."""
    with pytest.raises(ValueError, match=next(iter(settings))):
        BearingBelief(**settings)


def test_candidates_and_bearings_must_be_numbers():
    """No candidate, or a bearing that is NaN."""
    with pytest.raises(ValueError, match="rows of x and y"):
        BearingFilter(np.zeros((0, 2)), 1)
    with pytest.raises(ValueError, match="not finite"):
        BearingFilter(GRID_M, 1).step(np.array([0]), [[0.0, 0.0]], [math.nan])
