"""The study of reader groups: what is compared, verdicts in both directions, and the page."""

import csv
import math
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from layoutopt import feasibility
from layoutopt.errors import InvalidInput
from layoutopt.layout import TagPattern
from layoutopt.protocols import Evaluation
from layoutopt.readers.listed import listed
from layoutopt.scores import OUTCOME_COLUMNS, TrialOutcomes
from layoutopt.space import DesignSpace, Family
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from solvers.information import CRITERIA
from studies.reader_group_setting import comparison_of, label_of, middle_floor, spread, way_between_looks_m
from studies.reader_group_verdicts import agreement, verdicts
from studies.reader_groups import ReaderGroups

SPEC = """
schema = 1
seed = 3
[site]
floor = [[0,0],[4,0],[4,3],[0,3]]
[robots]
outline = [["-0.2 m","-0.2 m"],["0.2 m","-0.2 m"],["0.2 m","0.2 m"],["-0.2 m","0.2 m"]]
[space]
antenna_side = ["40 mm", "60 mm"]
antenna_height = "20 mm"
antennas_per_module = [1, 4]
readers = [
  { family = "ring", count = [4, 9], radius = ["0.09 m", "0.12 m", "0.15 m"] },
  { family = "cross", count = 4, spacing = "0.16 m" },
]
patterns = [{ family = "square", pitch = ["100 mm", "200 mm", "300 mm"] }]
[study]
duration = "15 s"
particles = 200
"""


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    path = tmp_path_factory.mktemp("spec") / "groups.toml"
    path.write_text(SPEC, encoding="utf-8")
    return read_spec(path)


@pytest.fixture(scope="module")
def study(spec):
    return replace(ReaderGroups.for_spec(spec, quick=False), trials=20)


def made_up(study, errors_m):
    """Outcomes in which groups have mean errors ``errors_m(number, contender)``; most of the noise is shared."""
    drive = 1.0 + 0.05 * np.random.default_rng(1).standard_normal(20)
    found = {}
    for number, setting in enumerate(study.comparison.settings):
        for contender in setting.contenders:
            draws = np.random.default_rng(int(contender.layout.key[:8], 16))
            values = np.full((20, len(OUTCOME_COLUMNS)), 0.5)
            for column in ("position_error_mean", "heading_error_mean"):
                own = 1.0 + 0.002 * draws.standard_normal(20)
                values[:, OUTCOME_COLUMNS.index(column)] = errors_m(number, contender) * drive * own
            found[number, contender.label] = TrialOutcomes(
                replications=np.arange(20), columns=OUTCOME_COLUMNS, values=values
            )
    return found


def evaluations(study, found):
    """The same as the study's own evaluations, each group once."""
    return [
        Evaluation(group=group, first=0, outcomes=outcomes, seconds=0.0)
        for group, outcomes in {cell.group: found[place] for place, cell in study.cells()}.items()
    ]


def test_every_group_that_is_driven_can_be_built_and_every_other_has_a_reason(study):
    """All mounts and numbers of the spec are there; nine antennas at four sides do not fit, and it is said."""
    settings = study.comparison.settings
    assert len(settings) == 8
    assert study.comparison.left_out == ()
    for setting in settings:
        for contender in setting.contenders:
            assert not feasibility.check(contender.layout, study.comparison.scenario)
            assert contender.group.count == setting.count
        listed_groups = 4 if setting.count == 4 else 3
        driven = [item for item in setting.contenders if not item.chosen]
        refused = [reason for label, reason in setting.refused if not label.endswith("optimal")]
        assert len(driven) + len(refused) == listed_groups
        assert all(setting.refused[number][1] for number in range(len(setting.refused)))
    told = [choice.message for setting in settings for choice in setting.choices.values() if not choice.chosen]
    assert any("at most" in message for message in told)


def test_the_chosen_group_tells_more_than_those_of_the_spec(study):
    """Each criterion's group has the greatest merit of its setting, and no merit passes the bound."""
    for setting in study.comparison.settings:
        for criterion in CRITERIA:
            choice = setting.choices[criterion]
            if not choice.chosen:
                continue
            merits = {item.label: item.merits[criterion] for item in setting.contenders}
            assert max(merits, key=merits.get) in {f"{name}-optimal" for name in CRITERIA}
            assert merits[f"{criterion}-optimal"] == pytest.approx(choice.value)
            assert max(merits.values()) <= choice.bound + 1e-12


def test_a_quick_look_takes_few_settings_with_something_to_compare(spec):
    """Each of its settings has a group of the spec, and it says how many settings it leaves out."""
    quick = ReaderGroups.for_spec(spec, quick=True)
    assert len(quick.comparison.settings) <= 5
    for setting in quick.comparison.settings:
        assert [item for item in setting.contenders if not item.chosen]
    assert re.match(r"\d of 8 mounts", quick.comparison.left_out[0])
    assert quick.trials < 10
    assert quick.key != ReaderGroups.for_spec(spec, quick=False).key


def test_the_floor_is_that_of_middle_density(spec):
    """Of three pitches the second; of two the wider."""
    assert middle_floor(spec.space).base.pattern.density_per_m2 == pytest.approx(25.0)
    family = spec.space.patterns[""][0]
    two = Family(name=family.name, build=family.build, values={"pitch_m": (0.1, 0.3)})
    space = DesignSpace(readers=spec.space.readers, patterns={"": (two,)})
    assert middle_floor(space).base.pattern.density_per_m2 == pytest.approx(1.0 / 0.09)


def test_a_floor_without_tags_is_refused(spec):
    """A pattern that is laid once beside the floor."""
    away = Family(name="away", build=lambda: TagPattern(name="away", points_m=np.array([(90.0, 90.0)])), values={})
    space = DesignSpace(readers=spec.space.readers, patterns={"": (away,)})
    problem = spec.problem()
    with pytest.raises(InvalidInput, match="lays no tag"):
        comparison_of(space, problem.design, problem.estimators[0], seed=1)


def test_looks_are_a_mean_chord_apart_or_a_turn():
    """An antenna that listens all the time, and one that comes to its turn too late to see a tag twice."""
    assert way_between_looks_m(0.03, 1e-6) == pytest.approx(math.pi * 0.03 / 2.0, rel=1e-3)
    assert way_between_looks_m(0.03, 0.2) == pytest.approx(0.2)


@pytest.mark.parametrize(("factor", "better", "worse"), [(0.8, 3, 0), (1.3, 0, 3), (1.0, 0, 0)])
def test_the_verdict_follows_the_drives_and_not_the_model(study, spec, factor, better, worse):
    """Outcomes made up so that chosen groups err 0.8, 1.3 or exactly 1 times as much as the best of the spec."""
    rivals = {number: best for number, best in enumerate(rival_errors(study)) if best}
    found = made_up(study, lambda number, item: factor * rivals.get(number, 0.01) if item.chosen else error(item))
    made = [item for item in verdicts(study.comparison, found, "position_error_mean") if item.criterion == "D"]
    assert len(made) == len(rivals) >= 3
    if factor != 1.0:
        assert sum(item.better for item in made) == (len(made) if better else 0)
        assert sum(item.worse for item in made) == (len(made) if worse else 0)
        for item in made:
            assert item.ratio.value == pytest.approx(factor, rel=0.01)
    lines = study.answer(evaluations(study, found), spec).lines(None)
    told = next(line for line in lines if line.startswith("D-optimal groups: mean position error"))
    lower, higher = sum(item.better for item in made), sum(item.worse for item in made)
    assert f"lower in {lower} of {len(made)} settings, higher in {higher}," in told
    value, low, high = (
        float(text) for text in re.search(r"error ([\d.]+) \(([\d.]+) to ([\d.]+)\)", told).groups()
    )
    assert value == pytest.approx(factor, abs=0.006)
    assert low <= value <= high
    assert high - low < 0.05


def error(item):
    """An error that tells groups of the spec apart and is not the model's."""
    return 0.01 + 0.001 * len(item.label)


def rival_errors(study):
    return [
        min((error(item) for item in setting.contenders if not item.chosen), default=0.0)
        for setting in study.comparison.settings
    ]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_agreement_is_that_of_the_ranks(study, sign):
    """Errors that follow the prediction, or its inverse, agree fully or not at all, at equal antennas too."""
    exact = made_up(study, lambda number, item: item.sigma_m**sign)
    found = {
        place: replace(table, values=np.repeat(table.values.mean(axis=0)[None], 20, axis=0))
        for place, table in exact.items()
    }
    ranks = agreement(study.comparison, found, "position_error_mean")
    assert sign * ranks.overall.value > 0.95
    assert sign * ranks.equal.value > 0.9
    assert sign * ranks.own.value > 0.9
    none = agreement(study.comparison, {}, "position_error_mean")
    assert math.isnan(none.overall.value)
    assert math.isnan(none.own.value)


def test_better_chosen_groups_do_not_hide_that_the_model_ranks_the_others_wrongly(study, spec):
    """Chosen groups err half as much and the spec's own in reverse order of the prediction: both are told."""
    found = made_up(study, lambda number, item: (0.5 if item.chosen else 1.0) * 1e-4 / item.sigma_m)
    ranks = agreement(study.comparison, found, "position_error_mean")
    assert ranks.equal.value > 0.3
    assert ranks.own.value < -0.7
    lines = study.answer(evaluations(study, found), spec).lines(None)
    told = next(line for line in lines if "Rank correlation of predicted and simulated position" in line)
    assert f"{ranks.own.value:.2f} (" in told.partition("among the spec's own groups")[0]


def test_the_page_says_what_the_drives_gave(study, spec, tmp_path):
    """Numbers of the tables are those of the outcomes; the readers can be built from the listing."""
    found = made_up(study, lambda number, item: error(item))
    answer = study.answer(evaluations(study, found), spec)
    answer.write(tmp_path, streams=Streams(seed=3), quick=False)
    with (tmp_path / "tables" / "groups.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    known = study.finished(evaluations(study, found))
    assert len(rows) == len(known)
    for row in rows:
        score = known[int(row["setting"]), row["group"]].score("position_error_mean")
        assert float(row["position_error_mean_m"]) == pytest.approx(score.value, rel=1e-8)
        assert float(row["position_error_mean_se_m"]) == pytest.approx(score.standard_error, rel=1e-8)
        if row["group"].startswith("D"):
            assert float(row["D_merit"]) <= float(row["D_bound"]) + 1e-9
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "at most" in page
    groups = {
        item.group.poses.tobytes(): (setting, item)
        for setting in study.comparison.settings
        for item in setting.contenders
        if item.chosen
    }
    lines = re.findall(r"\{ family = .*? \}", page.replace("&#34;", '"'))
    assert len(lines) >= len(groups)
    for line in lines:
        points_m = tomllib.loads(f"reader = {line}")["reader"]["points"]
        near = [
            (setting, item)
            for setting, item in groups.values()
            if item.group.poses[:, :2].shape == np.shape(points_m)
            and np.abs(item.group.poses[:, :2] - points_m).max() < 1e-9
        ]
        for setting, item in near:
            again = listed(points_m=points_m, mount=setting.mount)
            assert again.slots == item.group.slots
            layout = item.layout.replace(readers=(again,))
            assert not feasibility.check(layout, study.comparison.scenario)
        assert near


def test_without_any_outcome_the_answer_says_that_nothing_is_known(study, spec, tmp_path):
    """No ratio, no correlation, and a page all the same."""
    answer = study.answer((), spec)
    lines = answer.lines(None)
    assert lines[0] == "No chosen group was driven beside one of the spec."
    assert "not known among the spec's own groups" in lines[1]
    answer.write(tmp_path, streams=Streams(seed=3), quick=False)
    assert not re.search(r"[> ](nan|inf)[< ,]", (tmp_path / "report.html").read_text(encoding="utf-8"))


def test_labels_name_family_and_sizes(study):
    """A ring by its radius; counts are those of the setting."""
    labels = {label_of(item.group) for setting in study.comparison.settings for item in setting.contenders}
    assert {"ring 150 mm", "cross 160 mm", "listed"} <= labels
    assert spread(range(10), 4) == [0, 3, 6, 9]
