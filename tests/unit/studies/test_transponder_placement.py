"""The study of a transponder's place: the race on made-up drives, the answer on real ones."""

import csv
import itertools
from dataclasses import replace

import numpy as np
import pytest

from layoutopt.errors import FailureKind, InvalidInput
from layoutopt.progress import Silent
from layoutopt.protocols import Evaluation, Failure
from layoutopt.result import Status
from layoutopt.scores import DOCKING_UNITS, TrialOutcomes, wilson
from layoutopt.spec.layout_file import read_layout
from layoutopt.spec.quantities import in_si
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from objectives.direction_quality import DirectionMap
from studies.runner import run_rounds
from studies.transponder_placement import TransponderPlacement
from studies.transponder_placement_race import chance_better, hits_of
from studies.transponder_placement_setting import (
    GUIDES,
    MOST_PLACES,
    OUT_OF_REACH,
    TOO_NEAR,
    asked_of,
    lattice_m,
    places_of,
)

DOCKING = 'fitted = false\ncandidate_pitch = "250 mm"\ntrials = 100\n'


@pytest.fixture
def spec_with(tmp_path, tiny_text):
    """Return a reader of the tiny spec with a table of docking, and limits among its goal."""

    def made(table=DOCKING, limits=""):
        text = tiny_text.replace("[goal]\n", f"[goal]\n{limits}\n") + "[docking]\n" + table
        path = tmp_path / "own.toml"
        path.write_text(text, encoding="utf-8")
        return read_spec(path)

    return made


@pytest.fixture(scope="module")
def plain(tmp_path_factory, tiny_text):
    """Return the spec with the usual table of docking, and its study, whose places are scored once."""
    path = tmp_path_factory.mktemp("plain") / "plain.toml"
    path.write_text(tiny_text + "[docking]\n" + DOCKING, encoding="utf-8")
    spec = read_spec(path)
    return spec, TransponderPlacement.for_spec(spec, quick=False)


class MadeUp:
    """Drives that dock with a chance that the place decides, the same luck for all places."""

    def __init__(self, chance, seed=1):
        self.chance = chance
        self.luck = np.random.Generator(np.random.Philox(seed)).random((2, 1000))
        self.drives = {}

    def evaluation(self, task):
        place_m = task.layout.transponders[0].position_m[:2]
        numbers = np.arange(task.first, task.first + task.count)
        docked = self.luck[int(task.scenario.name.endswith("/fresh"))][numbers] < self.chance(place_m)
        self.drives[task.group] = max(self.drives.get(task.group, 0), task.first + task.count)
        values = np.column_stack([docked, np.full(len(numbers), 7.0), np.full(len(numbers), 0.1)])
        outcomes = TrialOutcomes(replications=numbers, columns=tuple(DOCKING_UNITS), values=values)
        return Evaluation(group=task.group, first=task.first, outcomes=outcomes, seconds=0.0)

    def run(self, study, failing=()):
        """Return all evaluations of the study; tasks of ``failing`` places fail."""
        found = []
        while tasks := study.next_batch(found).tasks:
            for task in tasks:
                if task.layout.transponders[0].position_m[:2] in failing:
                    found.append(
                        Failure(group=task.group, first=task.first, message="no way", kind=FailureKind.RAISED)
                    )
                else:
                    found.append(self.evaluation(task))
        return found


def falling(place_m):
    """A chance that is best, 0.98, at (2, 1) m and falls by 0.3 a metre."""
    return 0.98 - 0.3 * float(np.hypot(place_m[0] - 2.0, place_m[1] - 1.0))


def test_the_race_finds_the_best_of_many_places_on_a_part_of_the_drives(plain):
    """Four seeds: the best by construction wins each, for less than 40 % of all drives to all places."""
    _, study = plain
    running = [place for place in study.places if not place.refusal]
    assert len(running) > 40
    for seed in range(4):
        drives = MadeUp(falling, seed)
        results = study.results(drives.run(study))
        assert results.best.xy_m == pytest.approx((2.0, 1.0))
        raced = [count for group, count in drives.drives.items() if not group.scenario.endswith("/fresh")]
        assert len(raced) == len(running)
        assert sum(raced) < 0.4 * len(running) * 100


def test_what_the_race_drops_never_comes_back_and_fresh_drives_are_others(plain):
    """Each round asks for a part of the places of the round before; the fresh drives have a name of their own."""
    study, drives = plain[1], MadeUp(falling)
    found, rounds = [], []
    while tasks := study.next_batch(found).tasks:
        rounds.append(({task.layout.key for task in tasks}, {task.scenario.name for task in tasks}))
        found += [drives.evaluation(task) for task in tasks]
    *race, (last, names) = rounds
    for (before, _), (after, _) in itertools.pairwise(race):
        assert after < before
        assert len(after) <= max(6, -(-len(before) // 3))
    assert all(names == {"docking"} for _, names in race)
    assert names == {"docking/fresh"}
    assert last < race[-1][0]
    assert len(last) == 6


def test_a_certain_place_ends_the_race_for_those_that_their_interval_tells_apart(plain):
    """One place always docks and all others never: two go on, so that the best has a rival."""
    _, study = plain
    drives = MadeUp(lambda place_m: 1.0 if np.allclose(place_m, (2.0, 1.0)) else 0.0)
    results = study.results(drives.run(study))
    assert wilson(0, 24)[1] < wilson(24, 24)[0]
    assert len(results.race.ranked) == 2
    assert results.correct > 0.999
    assert [item.as_good for item in results.finalists] == [True, False]
    assert results.finalists[1].lead.value == 1.0
    assert "probability of at least 100 %" in " ".join(study.answer(drives.run(study), plain[0]).lines(None))


def test_equal_places_are_called_as_good(plain):
    """Where chance is the same everywhere, so are the drives, and nobody is told to be best."""
    spec, study = plain
    results = study.results(MadeUp(lambda place_m: 0.8).run(study))
    assert all(item.as_good for item in results.finalists)
    assert [item.better for item in results.finalists[1:]] == pytest.approx([0.5] * 5)
    assert results.correct == 0.0
    lines = study.answer(MadeUp(lambda place_m: 0.8).run(study), spec).lines(None)
    assert any("these drives do not tell" in line for line in lines)


def test_a_place_whose_drives_fail_is_left_out_and_told(plain):
    """The second best wins, the failure is among the lines, and the exit code is one."""
    spec, study = plain
    answer = study.answer(MadeUp(falling).run(study, failing=[(2.0, 1.0)]), spec)
    assert answer.exit_code == 1
    assert any("no way" in line for line in answer.lines(None))
    assert answer.layouts[0].transponders[0].position_m[:2] != (2.0, 1.0)


@pytest.mark.parametrize(
    ("wanted", "status", "code"), [("80 %", Status.TARGET_MET, 0), ("99 %", Status.TARGET_NOT_MET, 1)]
)
def test_a_limit_on_docking_is_met_at_its_confidence_or_missed_with_the_shortfall(spec_with, wanted, status, code):
    """The bound of the best place on fresh drives decides."""
    spec = spec_with(limits=f'limits = ["docking_success >= {wanted}"]')
    study = TransponderPlacement.for_spec(spec, quick=False)
    answer = study.answer(MadeUp(falling).run(study), spec)
    assert (answer.status, answer.exit_code) == (status, code)
    assert any(line.startswith("Not shown") and "short" in line for line in answer.lines(None)) is (code == 1)


def test_limits_that_the_study_does_not_look_at_are_told(spec_with):
    """One on cost; that on docking is its own."""
    spec = spec_with(limits='limits = ["docking_success >= 80 %", "cost <= 2000 EUR"]')
    study = TransponderPlacement.for_spec(spec, quick=False)
    answer = study.answer(MadeUp(falling).run(study), spec)
    told = [line for line in answer.lines(None) if "Other studies" in line]
    assert len(told) == 1
    assert told[0] in answer.page.page(Streams(seed=spec.seed)).summary
    assert "cost at most" in told[0]
    assert "drives that dock" not in told[0]


def test_a_place_without_a_score_keeps_no_limit_on_it(spec_with):
    """Where nothing is heard there is no error of the direction, and none is not a small one."""
    spec = spec_with(limits='limits = ["direction_error_mean <= 60 deg"]')
    asked = asked_of(spec, quick=False)
    small = DirectionMap(cells_m=np.zeros((0, 2)), error_rad=np.zeros(0), in_view=0.0)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("studies.transponder_placement_setting.direction_map", lambda *_: small)
        silent = places_of(asked)
    reasons = {place.refusal for place in silent if place.clearance_m >= asked.least_clearance_m}
    assert reasons == {"limit on the mean error of the direction"}
    assert any(not place.refusal for place in places_of(asked))


def test_a_given_place_is_judged_beside_the_best_even_if_it_would_be_refused(spec_with):
    """Too near the wall it takes no part in the race, but meets the fresh drives, and the words say so."""
    spec = spec_with(DOCKING + "transponder = [0.3, 1.0]\n")
    study = TransponderPlacement.for_spec(spec, quick=False)
    evaluations = MadeUp(falling).run(study)
    results = study.results(evaluations)
    given = results.finalists[-1]
    assert (given.place.given, given.place.refusal) == (True, TOO_NEAR)
    assert given.place not in results.race.ranked
    assert len(given.drives) == 100
    assert any("would have been refused" in line for line in study.answer(evaluations, spec).lines(None))


def test_where_no_place_keeps_the_clearance_the_answer_says_so_and_no_drive_is_asked_for(spec_with):
    """More than half the width of the floor is demanded; the widest clearance there is told."""
    spec = spec_with(limits='limits = ["scatterer_clearance >= 2 m"]')
    study = TransponderPlacement.for_spec(spec, quick=False)
    assert not study.next_batch(()).tasks
    answer = study.answer((), spec)
    assert (answer.status, answer.exit_code, answer.layouts) == (Status.INFEASIBLE, 1, ())
    assert any("1.5 m" in line and "2 m" in line for line in answer.lines(None))


def test_exact_scores_rank_places_as_the_drives_do_where_these_follow_them(spec_with):
    """Drives whose chance falls with the rank of the exact mean error give a rank correlation near -1."""
    spec = spec_with(DOCKING + "scatterers = [[1.0, 1.6], [2.9, 0.7], [2.4, 2.3]]\n")
    study = TransponderPlacement.for_spec(spec, quick=False)
    error = {place.xy_m: place.scores["direction_error_mean"].value for place in study.places if place.scores}
    ranked = sorted(error, key=error.__getitem__)
    drives = MadeUp(lambda place_m: 1.0 - ranked.index(tuple(place_m)) / len(ranked))
    found, count = study.results(drives.run(study)).correlation("direction_error_mean")
    assert count == sum(not place.refusal for place in study.places)
    assert -1.0 <= found.low <= found.value <= found.high < -0.7


def test_places_lie_on_the_open_floor_and_along_what_stands_on_it(tmp_path, tiny_text):
    """A lattice from the datum; about a box of 4 m round 16 places or more, just off its border."""
    tiling = 'tiling = { size = "0.5 m" }'
    text = tiny_text.replace(tiling, f"{tiling}\nobstacles = [[[1.6,1.6],[2.6,1.6],[2.6,2.6],[1.6,2.6]]]")
    path = tmp_path / "box.toml"
    path.write_text(text + "[docking]\n" + DOCKING, encoding="utf-8")
    asked = asked_of(read_spec(path), quick=False)
    places_m = lattice_m(asked)
    border = np.abs(places_m - 2.1).max(axis=1) < 0.5 + 1e-5
    assert border.sum() >= 16
    assert (np.abs(places_m[border] - 2.1).max(axis=1) > 0.5).all()
    assert np.allclose(places_m[~border] / 0.25, np.round(places_m[~border] / 0.25))
    assert len(np.unique(np.round(places_m, 4), axis=0)) == len(places_m)


def test_questions_that_cannot_be_asked_are_refused_with_what_would_do(spec_with):
    """Too many places name a pitch that works."""
    spec = spec_with()

    def asked(**changes):
        return asked_of(replace(spec, docking=replace(spec.docking, **changes)), quick=False)

    with pytest.raises(InvalidInput, match=r"docking\.candidate_pitch") as caught:
        asked(candidate_pitch_m=0.02)
    pitch = caught.value.faults[0].repair.removeprefix("Write ").removesuffix(".")
    assert len(lattice_m(asked(candidate_pitch_m=in_si(pitch, "length")))) <= MOST_PLACES
    with pytest.raises(InvalidInput, match="guides no docking robot"):
        asked(estimator="midrange")
    with pytest.raises(InvalidInput, match="says nothing of docking"):
        asked_of(replace(spec, docking=None), quick=False)


def test_places_that_no_robot_reaches_are_refused(spec_with):
    """A stop of 10 mm is nearer than a robot's middle gets to the walls."""
    spec = spec_with(DOCKING + 'stop = "10 mm"\n', limits='limits = ["scatterer_clearance >= 0.1 m"]')
    places = TransponderPlacement.for_spec(spec, quick=False).places
    reasons = {place.xy_m: place.refusal for place in places}
    assert reasons[(0.25, 1.0)] == OUT_OF_REACH
    assert reasons[(2.0, 1.0)] == ""


@pytest.mark.parametrize(("ahead", "behind"), [(0, 0), (3, 0), (0, 3), (7, 4), (60, 40)])
def test_the_chance_to_be_better_is_the_posterior_of_a_share(ahead, behind):
    """By summing Jeffreys' posterior over a fine grid; pairs that agree tell nothing."""
    first = np.concatenate([np.ones(ahead), np.zeros(behind), np.ones(5)])
    second = np.concatenate([np.zeros(ahead), np.ones(behind), np.ones(5)])
    tables = [
        TrialOutcomes(replications=np.arange(len(values)), columns=("docking_success",), values=values[:, None])
        for values in (first, second)
    ]
    # p = sin², so that the prior is even in the angle and the grid needs no care at its ends.
    angle = (np.arange(200_000) + 0.5) / 200_000 * np.pi / 2.0
    weight = np.sin(angle) ** (2 * ahead) * np.cos(angle) ** (2 * behind)
    assert chance_better(*tables) == pytest.approx(weight[angle > np.pi / 4].sum() / weight.sum(), abs=1e-6)
    assert chance_better(*tables) + chance_better(*tables[::-1]) == pytest.approx(1.0)


@pytest.fixture(scope="module")
def empty_room(tmp_path_factory, tiny_text):
    """Return a spec without scatterers, its quick study, and what real drives gave."""
    path = tmp_path_factory.mktemp("empty") / "empty.toml"
    table = "[docking]\nfitted = false\ntrials = 12\ntransponder = [3.0, 1.0]\n"
    path.write_text(tiny_text + table, encoding="utf-8")
    spec = read_spec(path)
    study = TransponderPlacement.for_spec(spec, quick=True)
    ran = run_rounds(study, streams=Streams(seed=spec.seed), journal=None, progress=Silent())
    return spec, study, ran.evaluations


def test_in_an_empty_room_every_place_docks_every_drive(empty_room):
    """The identity: no error of the direction and success everywhere, by real drives."""
    _, study, evaluations = empty_room
    results = study.results(evaluations)
    assert len(results.raced) >= 4
    assert all(hits_of(outcomes) == len(outcomes) for outcomes in results.raced.values())
    assert all(place.scores["direction_error_mean"].value == 0.0 for place in study.places if place.scores)
    assert np.isnan(results.correlation("direction_error_mean")[0].value)
    assert [item.name for item in results.guides] == list(GUIDES)


def test_the_answer_writes_map_tables_drawing_and_a_layout_that_reads_back(empty_room, tmp_path):
    """The winner of the table is the transponder of the layout file; places without drives say why."""
    spec, study, evaluations = empty_room
    study.answer(evaluations, spec).write(tmp_path, streams=Streams(seed=spec.seed), quick=True)
    drawings = [f"drawings/transponder.{suffix}" for suffix in ("pdf", "svg", "dxf")]
    assert all((tmp_path / name).stat().st_size > 0 for name in ("figures/docking_map.png", *drawings))
    with (tmp_path / "tables" / "last_places.csv").open(encoding="utf-8") as stream:
        best = next(csv.DictReader(stream))
    _, layout = read_layout(tmp_path / "layouts" / f"{best['layout']}.toml")
    place_m = (float(best["x_m"]), float(best["y_m"]))
    assert layout.transponders[0].position_m[:2] == pytest.approx(place_m, abs=1e-6)
    with (tmp_path / "tables" / "places.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert any(row["refusal"] for row in rows)
    assert all(bool(row["drives"]) is not bool(row["refusal"]) for row in rows)
