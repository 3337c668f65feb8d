"""The rounds of the study of zones: uniform layouts, what is composed of them, and held-out drives."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from layoutopt.evaluate import outcomes_of
from layoutopt.layout import Layout
from layoutopt.protocols import Evaluation, Failure, Group, Task, group_of
from layoutopt.result import Evaluated
from layoutopt.scores import TrialOutcomes
from solvers.racing import Racing, Standing
from studies import held_out
from studies.zones_candidates import Chosen, Effort, Predicted, chosen_from, composed_of
from studies.zones_closing import Closing, Evidence, closing_of
from studies.zones_setting import Setting
from studies.zones_validation import Kind, first_held_out, kind_of

UNIFORM, COMPOSED = "uniform", "composed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How the study stands; ``tasks`` is empty when it is done.

    Attributes
    ----------
    possible
        False where no composition was predicted to meet the limits.
    cut, rest_eur
        How many searches for compositions ended before they were through, over all stages, and what those that
        they left out cost at least by the prediction.
    closing
        The closing round; ``None`` before it.
    """

    stage: str
    tasks: tuple[Task, ...]
    composed: tuple[Predicted, ...] = ()
    kinds: Mapping[str, Kind] | None = None
    possible: bool = True
    cut: int = 0
    rest_eur: float = math.inf
    closing: Closing | None = None

    def accepted(self, kind: str) -> Evaluated | None:
        """Return the cheapest layout of a kind that held, in the closing round or before."""
        if self.closing is not None and kind in self.closing.accepted:
            return self.closing.accepted[kind]
        return self.kinds[kind].accepted if self.kinds is not None and kind in self.kinds else None


Memory = dict[tuple[tuple[str, TrialOutcomes], ...], Chosen]
"""What was chosen from which outcomes, so that no round chooses again what an earlier one has."""


def progress_of(
    setting: Setting, effort: Effort, evaluations: Sequence[Evaluation | Failure], memory: Memory
) -> Progress:
    """Return how the study stands: a pure function of the evaluations, so that a killed study resumes."""
    known, failed = outcomes_of(evaluations), held_out.failures_of(evaluations)
    alive = setting.layouts
    stages = effort.drives(setting)
    chosen = Chosen()
    cut, rest_eur = 0, math.inf
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
            memory[of] = chosen_from(setting, effort, alive, tables, drives, last=number == len(stages))
        chosen = memory[of]
        cut, rest_eur = cut + chosen.cut, min(rest_eur, chosen.rest_eur)
        if number < len(stages):
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
    progress = Progress(
        stage=f"race of {sum(map(len, contenders.values()))} layouts",
        tasks=tuple(task for race in races.values() for task in race.tasks),
        composed=composed,
        kinds={kind: Kind(race=race) for kind, race in races.items()},
        possible=chosen.possible,
        cut=cut,
        rest_eur=rest_eur,
    )
    if progress.tasks:
        return progress
    looked = first_held_out(setting.problem, effort, known)
    standing = {kind: kind_of(setting.problem, effort, race, looked, failed) for kind, race in races.items()}
    progress = replace(
        progress,
        stage="held-out drives",
        tasks=tuple(task for _, wanted in standing.values() for task in wanted),
        kinds={kind: one for kind, (one, _) in standing.items()},
    )
    if progress.tasks:
        return progress
    evidence = Evidence(
        problem=setting.problem,
        limits=setting.simulated_limits,
        block=effort.closing_block,
        known=known,
        failed=failed,
    )
    simulated = {
        COMPOSED: contenders[COMPOSED],
        UNIFORM: [item for item in setting.layouts if not setting.judged(item.layout)[1]],
    }
    closing, tasks = closing_of(evidence, effort, progress.kinds or {}, simulated)
    return replace(progress, stage="closing round", tasks=tasks, closing=closing)


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
