"""The rounds of the study of zones: uniform layouts, what is composed of them, and held-out drives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from layoutopt.evaluate import outcomes_of
from layoutopt.layout import Layout
from layoutopt.protocols import Evaluation, Failure, Group, Task, group_of
from layoutopt.result import Evaluated
from layoutopt.scores import TrialOutcomes
from solvers.judging import meeting_limits
from solvers.racing import Racing, Standing
from studies import held_out
from studies.zones_candidates import Chosen, Effort, Predicted, chosen_from, composed_of
from studies.zones_setting import Setting

UNIFORM, COMPOSED = "uniform", "composed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """How the layouts of one kind stand: in the race, and on held-out drives."""

    race: Standing
    tried: tuple[Evaluated, ...] = ()
    accepted: Evaluated | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How the study stands; ``tasks`` is empty when it is done.

    ``possible`` is false where no composition was predicted to meet the limits.
    """

    stage: str
    tasks: tuple[Task, ...]
    composed: tuple[Predicted, ...] = ()
    kinds: Mapping[str, Kind] | None = None
    possible: bool = True


Memory = dict[tuple[tuple[str, TrialOutcomes], ...], Chosen]
"""What was chosen from which outcomes, so that no round chooses again what an earlier one has."""


def progress_of(
    setting: Setting, effort: Effort, evaluations: Sequence[Evaluation | Failure], memory: Memory
) -> Progress:
    """Return how the study stands: a pure function of the evaluations, so that a killed study resumes."""
    known, failed = outcomes_of(evaluations), held_out.failures_of(evaluations)
    alive = setting.layouts
    stages = effort.drives(setting)
    chosen = Chosen(compositions=(), uniform=(), possible=False)
    for number, drives in enumerate(stages, start=1):
        groups = [_design_group(setting, item.layout) for item in alive]
        tasks = _tasks(setting, alive, groups, drives, known, failed)
        if tasks:
            return Progress(stage=f"uniform layouts, {drives} drives, {len(alive)} layouts", tasks=tasks)
        tables = {
            item.layout.key: known[group].head(drives)
            for item, group in zip(alive, groups, strict=True)
            # A layout that failed later, in the race, must not change what was chosen before.
            if group in known and len(known[group]) >= drives
        }
        of = tuple(tables.items())
        if of not in memory:
            memory[of] = chosen_from(setting, effort, alive, tables, drives)
        chosen = memory[of]
        if number < len(effort.stages):
            parts = [part for _, parts in chosen.compositions for part in parts]
            alive = tuple({item.layout.key: item for item in (*parts, *chosen.uniform)}.values())
    composed = composed_of(setting, chosen)
    uniform = [setting.judged(item.layout) for item in chosen.uniform]
    contenders = {
        COMPOSED: [one.item for one in composed if not one.refusal],
        UNIFORM: [item for item, refusal in uniform if not refusal],
    }
    races = {
        kind: Racing(trials=effort.race_trials + len(items) * stages[-1]).standing(
            setting.problem, items, evaluations
        )
        if items
        else Standing(finalists=(), tasks=(), trials=0)
        for kind, items in contenders.items()
    }
    kinds = {kind: Kind(race=race) for kind, race in races.items()}
    tasks = tuple(task for race in races.values() for task in race.tasks)
    if tasks:
        return Progress(
            stage=f"race of {sum(map(len, contenders.values()))} layouts",
            tasks=tasks, composed=composed, kinds=kinds, possible=chosen.possible,
        )  # fmt: skip
    stage, tasks, kinds = _held_out(setting, effort, races, known, failed)
    return Progress(stage=stage, tasks=tasks, composed=composed, kinds=kinds, possible=chosen.possible)


def _held_out(
    setting: Setting,
    effort: Effort,
    races: Mapping[str, Standing],
    known: Mapping[Group, TrialOutcomes],
    failed: Mapping[Group, str],
) -> tuple[str, tuple[Task, ...], dict[str, Kind]]:
    """Return what is to be run on held-out drives, and how both kinds stand there."""
    problem = setting.problem
    meeting = {kind: meeting_limits(problem, race.finalists) for kind, race in races.items()}
    seen = [item for items in meeting.values() for item in _spread(items, effort.looks)]
    looks = held_out.tasks(
        [item.layout for item in seen], problem.held_out, problem.estimators, effort.look_trials, known, failed
    )
    if looks:
        return "first look at held-out drives", looks, {kind: Kind(race=race) for kind, race in races.items()}
    harder = held_out.transfer(problem, seen, known, effort.look_trials)
    kinds: dict[str, Kind] = {}
    tasks: list[Task] = []
    for kind, race in races.items():
        tried: list[Evaluated] = []
        accepted = None
        for item in held_out.promising(problem, meeting[kind], harder)[: effort.most_tried]:
            tried.append(item)
            verdict = held_out.holds(problem, item, known, failed, effort.validation_trials)
            if verdict is None:
                tasks += held_out.tasks(
                    [item.layout],
                    problem.held_out,
                    problem.estimators,
                    effort.validation_trials,
                    known,
                    failed,
                )
            if verdict is not False:
                accepted = item if verdict else None
                break
        kinds[kind] = Kind(race=race, tried=tuple(tried), accepted=accepted)
    return "held-out drives of the cheapest", tuple(tasks), kinds


def _spread(items: Sequence[Evaluated], count: int) -> list[Evaluated]:
    """Return so many items, evenly spread from the first to the last."""
    if len(items) <= count:
        return list(items)
    return [items[round(number * (len(items) - 1) / max(1, count - 1))] for number in range(count)]


def _design_group(setting: Setting, layout: Layout) -> Group:
    return group_of(layout, setting.problem.design, setting.problem.estimators[0])


def _tasks(
    setting: Setting,
    items: Sequence[Evaluated],
    groups: Sequence[Group],
    drives: int,
    known: Mapping[Group, TrialOutcomes],
    failed: Mapping[Group, str],
) -> tuple[Task, ...]:
    """Return what is missing for every layout to have so many drives of the search."""
    found = []
    for item, group in zip(items, groups, strict=True):
        first = len(known[group]) if group in known else 0
        if first < drives and group not in failed:
            found.append(
                Task(
                    layout=item.layout,
                    scenario=setting.problem.design,
                    estimator=setting.problem.estimators[0],
                    first=first,
                    count=drives - first,
                )
            )
    return tuple(found)
