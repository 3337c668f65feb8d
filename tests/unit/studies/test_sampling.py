"""The study of sampling intervals: what is compared, hard limits, and which interval costs no accuracy."""

import csv
import math
from dataclasses import replace

import numpy as np
import pytest
from tracking_specs import spec_of

from layoutopt.problem import Limit
from layoutopt.protocols import Evaluation
from layoutopt.scores import TRACKING_UNITS, TrialOutcomes
from layoutopt.streams import Streams
from studies.finder_scores import laser_lines
from studies.page_frame import closing_lines
from studies.sampling import Sampling
from studies.sampling_setting import INTERVALS_S, READINGS, SPEEDS_M_S
from studies.sampling_words import ALLOWANCE, longest_without_loss


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    return spec_of(tmp_path_factory.mktemp("spec"))


@pytest.fixture(scope="module")
def study(spec):
    return Sampling.for_spec(spec, quick=False)


def made_up(study, error_m, sigma_m=0.01):
    """Return outcomes of every cell; errors are those of its place with noise of its own."""
    found = []
    for number, (place, cell) in enumerate(study.cells()):
        noise = np.random.Generator(np.random.Philox(number)).standard_normal(cell.trials)
        values = np.zeros((cell.trials, len(TRACKING_UNITS)))
        values[:, :3] = (error_m(place) + sigma_m * noise)[:, None]
        outcomes = TrialOutcomes(replications=np.arange(cell.trials), columns=tuple(TRACKING_UNITS), values=values)
        found.append(Evaluation(group=cell.group, first=0, outcomes=outcomes, seconds=0.0))
    return found


def by_limit(place, slope=0.5):
    """Return errors that grow once the interval is beyond what two hypotheses can tell."""
    beyond = max(0.0, place.interval_s * place.speed_m_s / 0.163 - 1.0)
    return 0.2 + slope * beyond - 0.03 * place.offset_db * (place.offset_db < 0.0)


def test_hard_limits_are_those_of_the_wavelength(study):
    """At 920 MHz and 0.4 m/s: 0.2037 s signed, 0.4073 s with two hypotheses, half as much more with three."""
    limits_s = [study.setting.longest_s(reading, 0.4) for reading in READINGS]
    assert limits_s == pytest.approx([0.20366, 0.40733, 0.61099], abs=1e-5)
    assert study.setting.longest_s("signed", 0.8) == pytest.approx(limits_s[0] / 2.0)


def test_every_interval_is_driven_at_every_speed_with_every_reading(study):
    places = [place for place, _ in study.cells()]
    assert len(places) == len(set(places))
    own = study.setting.own
    assert (own.speed_m_s, own.interval_s, own.reading, own.offset_db) == (0.4, 0.4, "two hypotheses", 0.0)
    compared = {place[:3] for place in places if place.mode == own.mode and place.offset_db == 0.0}
    assert compared == {
        (speed, interval, reading) for speed in SPEEDS_M_S for interval in INTERVALS_S for reading in READINGS
    }


def test_cells_are_what_their_places_say(study):
    """Speed and tag are in the world, the interval in the readers, the reading of phases in the tracker."""
    for place, cell in study.cells():
        world = cell.scenario.tracking
        assert world.walking_speed_m_s == place.speed_m_s
        assert world.signal.tag_offset_db == place.offset_db
        assert cell.layout.readers[0].cycle_s == pytest.approx(place.interval_s)
        assert cell.estimator.aliases == place.reading
        assert cell.estimator.mode == ("strength" if place.mode == "strength alone" else "fused")
        assert cell.scenario.name == study.setting.scenario.name


def test_lists_of_the_spec_take_the_place_of_the_usual_values(tmp_path):
    listed = Sampling.for_spec(
        spec_of(tmp_path, 'interval = ["0.5 s", "0.25 s"]\nwalking_speed = "0.3 m/s"\n'), quick=False
    )
    assert listed.setting.intervals_s == (0.25, 0.5)
    assert listed.setting.own.interval_s == 0.5
    assert 0.3 in listed.setting.speeds_m_s


def test_the_longest_interval_within_the_allowance_is_taken(study):
    """Two hypotheses hold to 0.407 s at 0.4 m/s, to 0.814 s at 0.2 m/s and to 0.136 s at 1.2 m/s."""
    found = study.finished(made_up(study, by_limit))
    longest = {speed: longest_without_loss(study.setting, found, speed, "two hypotheses") for speed in SPEEDS_M_S}
    assert longest == {0.2: 0.8, 0.4: 0.4, 1.2: 0.1}


def test_an_interval_counts_only_if_its_bound_is_within_the_allowance(study):
    """A mean within the allowance is not enough where trials scatter."""
    just = 0.9 * ALLOWANCE * 0.2

    def step(place):
        return 0.2 + (just if place.interval_s == 0.8 else 0.0) + (1.0 if place.interval_s in (0.4, 0.6) else 0.0)

    sure, unsure = (study.finished(made_up(study, step, sigma_m)) for sigma_m in (1e-4, 0.02))
    assert longest_without_loss(study.setting, sure, 0.2, "three aliases") == 0.8
    assert longest_without_loss(study.setting, unsure, 0.2, "three aliases") <= 0.3


def test_an_interval_beyond_what_phases_tell_is_not_taken_for_a_lucky_walk(study):
    """Equal errors everywhere: the limit decides, and where no interval is below it there is none."""
    found = study.finished(made_up(study, lambda place: 0.2, 1e-4))
    longest = [longest_without_loss(study.setting, found, speed, "signed") for speed in SPEEDS_M_S]
    assert longest == [0.4, 0.2, None]


def test_a_walk_too_fast_for_every_interval_is_told_the_limit(tmp_path):
    """At 5 m/s two hypotheses need samples every 33 ms."""
    fast = spec_of(tmp_path, 'walking_speed = "5 m/s"\n')
    study = Sampling.for_spec(fast, quick=False)
    line, *_, after = study.answer(made_up(study, by_limit), fast).lines(None)
    assert line.startswith("No interval that was tried is short enough")
    assert "33 ms" in line
    assert after == closing_lines("sampling", found=False)[-1]


@pytest.mark.parametrize(
    ("share", "told"), [(0.0, "Only at 0 % of the instants"), (0.49, "Only at 49 %"), (0.5, "")]
)
def test_a_laser_that_sees_no_cluster_is_told(share, told):
    """Then the fused estimate is the one by strength, and its error does not show it."""
    values = np.full((2, 1), share)
    found = laser_lines(TrialOutcomes(replications=np.arange(2), columns=("laser_match_share",), values=values))
    assert [line[: len(told)] for line in found] == ([told] if told else [])


def test_an_answer_without_all_cells_recommends_nothing(study, spec):
    answer = study.answer(made_up(study, by_limit)[:3], spec)
    told = [
        "Not every cell is finished, so no interval can be recommended.",
        *closing_lines("sampling", found=False),
    ]
    assert answer.lines(None) == told
    assert answer.exit_code == 0


def test_the_answer_tells_interval_limits_turns_and_the_worst_tag(study, spec, tmp_path):
    answer = study.answer(made_up(study, by_limit), spec)
    told = answer.lines(None)
    assert told[0].startswith("Take 400 ms: the longest interval at which a person who walks at 0.4 m/s")
    assert "204 ms with signed, 407 ms with two hypotheses, 611 ms with three aliases" in told[1]
    assert told[2].startswith("At 0.4 m/s with signed: 200 ms, mean error")
    assert told[5].startswith("At 1.2 m/s with two hypotheses: 100 ms, mean error")
    assert "each has 200 ms of the interval" in told[6]
    assert "-6 dB against the calibrated type is the worst" in told[7]
    answer.write(tmp_path, streams=Streams(seed=3), quick=False)
    with (tmp_path / "tables" / "sampling.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(1 for _ in study.cells())
    aliases = {
        float(row["interval_s"]): float(row["expected_alias_share"])
        for row in rows
        if row["walking_speed_m_s"] == "0.4" and row["phases_read"] == "signed"
    }
    assert aliases[0.2] == 0.0 < aliases[0.3] < aliases[0.8]


def test_a_tracker_without_these_settings_is_compared_as_it_is(spec, study):
    """Then there is one way to read phases, and no limit of it is known."""
    setting = replace(study.setting, readings=("as the tracker has it",))
    assert math.isnan(setting.longest_s("as the tracker has it", 0.4))


def test_limits_are_left_to_other_studies_and_told(study, spec):
    """Nothing is judged here; the demand is not lost."""
    limited = replace(spec, own_limits=(Limit(score="tracking_error_mean", upper=0.3),))
    told = "Other studies look at these limits: mean tracking error at most 300 mm."
    found = made_up(study, by_limit)
    answer = Sampling.for_spec(limited, quick=False).answer(found, limited)
    assert told in answer.lines(None)
    assert told in answer.page(Streams(seed=3)).summary
    assert not any("Other studies" in line for line in study.answer(found, spec).lines(None))
