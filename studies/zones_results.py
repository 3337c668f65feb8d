"""What the study of zones found: the two layouts, the saving and how sure it is, and how well predictions held."""

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from layoutopt.evaluate import outcomes_of
from layoutopt.layout import Layout
from layoutopt.protocols import Evaluation, Failure, Group, group_of
from layoutopt.result import Evaluated, Status
from layoutopt.score_text import euros
from layoutopt.scores import Score, Scores, TrialOutcomes, paired_difference
from solvers.judging import nearest_miss, simulated_scores, worst_ratio
from solvers.zone_terms import zone_terms
from studies import held_out
from studies.cells import status_text
from studies.zones_candidates import Effort
from studies.zones_closing import MISSED
from studies.zones_search import COMPOSED, UNIFORM, Progress
from studies.zones_setting import Setting
from studies.zones_validation import Kind, Outlook, first_held_out

WORDS: Final = {COMPOSED: "layout with patterns by zone", UNIFORM: "layout with one pattern"}
_MANY: Final = {COMPOSED: "layouts with patterns by zone", UNIFORM: "layouts with one pattern"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """A score of a composed layout as predicted and as simulated, on the same drives of the search.

    ``off`` is the paired difference, simulated less predicted.
    """

    layout: Layout
    name: str
    predicted: Score
    simulated: Score
    off: Score


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """How a layout did on held-out drives.

    Attributes
    ----------
    worst
        Its worst bound; of a layout left out the one that its first look lets expect.
    word
        ``"held"``, ``"missed"``, or ``"left out"`` after its first look.
    """

    kind: str
    item: Evaluated
    worst: Outlook
    word: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Money:
    """Where the money of a layout goes, EUR: readers, and the floor by slot with its tags."""

    total_eur: float
    readers_eur: float
    tags: tuple[int, ...]
    floor_eur: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """All that was found.

    Attributes
    ----------
    kinds
        The layouts of both kinds in the race and on held-out drives.
    held_out
        Scores on held-out drives of what had a first look or more, by key of the layout and scenario.
    compared
        Predictions beside simulations.
    open_layouts
        For each kind the cheapest layout that was simulated and not shown to miss a limit, also in the closing
        round, if one is cheaper than the one accepted, and how many such layouts there are.
    shortfall
        For each kind without an accepted layout, what is missing.
    """

    setting: Setting
    progress: Progress
    kinds: Mapping[str, Kind]
    held_out: Mapping[tuple[str, str], Scores]
    compared: tuple[Compared, ...]
    open_layouts: Mapping[str, tuple[Evaluated | None, int]]
    shortfall: Mapping[str, str]

    def accepted(self, kind: str) -> Evaluated | None:
        """Return the layout of a kind that meets every limit on held-out drives."""
        return self.progress.accepted(kind)

    @property
    def saving_eur(self) -> float | None:
        """What patterns by zone save, negative if they cost more; ``None`` unless both layouts are shown."""
        composed, uniform = self.accepted(COMPOSED), self.accepted(UNIFORM)
        return None if composed is None or uniform is None else _cost(uniform) - _cost(composed)

    @property
    def saving_ends_eur(self) -> tuple[float, float] | None:
        """The saving if every cheaper layout with one pattern that is not shown to miss a limit met them all.

        And the same for layouts with patterns by zone, among those that were simulated.
        """
        composed, uniform = self.accepted(COMPOSED), self.accepted(UNIFORM)
        if composed is None or uniform is None:
            return None
        cheaper = {kind: self.open_layouts[kind][0] for kind in (UNIFORM, COMPOSED)}
        low = _cost(cheaper[UNIFORM] or uniform) - _cost(composed)
        return low, _cost(uniform) - _cost(cheaper[COMPOSED] or composed)

    def verdicts(self) -> tuple[Verdict, ...]:
        """Return how every layout with held-out drives did there, kind by kind, by rising cost."""
        found = []
        for name, kind in self.kinds.items():
            tried = {item.layout.key for item in kind.tried}
            for item in kind.looked:
                key = item.layout.key
                worst = self._worst_held_out(item) if key in tried else kind.outlooks[key]
                if worst is None:
                    continue
                held = kind.accepted is not None and key == kind.accepted.layout.key
                word = "held" if held else "missed" if key in tried else "left out"
                found.append(Verdict(kind=name, item=item, worst=worst, word=word))
        return tuple(found)

    def _worst_held_out(self, item: Evaluated) -> Outlook | None:
        """Return the held-out bound of a layout that is worst beside its demand."""
        found = []
        for scenario in self.setting.problem.held_out:
            scores = self.held_out.get((item.layout.key, scenario.name), {})
            worst = worst_ratio(self.setting.problem, scores)
            if worst is not None:
                ratio, limit, score = worst
                found.append(Outlook(ratio=ratio, limit=limit, score=score, scenario=scenario.name))
        return max(found, key=lambda one: one.ratio, default=None)

    @property
    def status(self) -> Status:
        """Whether any layout, of either kind, was shown to meet every limit."""
        met = any(self.accepted(kind) is not None for kind in (COMPOSED, UNIFORM))
        if not self.setting.layouts:
            return Status.INFEASIBLE
        return Status.TARGET_MET if met else Status.TARGET_NOT_MET

    @property
    def fewest_drives(self) -> int:
        """On how few held-out drives the least tried of the accepted layouts was judged; 0 if there is none."""
        accepted = [item for kind in (COMPOSED, UNIFORM) if (item := self.accepted(kind)) is not None]
        goal = self.setting.problem.goals[1]
        scores = (
            self.held_out[item.layout.key, scenario.name][goal]
            for item in accepted
            for scenario in self.setting.problem.held_out
        )
        return min((score.count for score in scores), default=0)

    def money(self, item: Evaluated) -> Money:
        """Return where the money of a layout goes; the floor's by the number of tags of each slot."""
        tags = self.setting.tags_by_slot(item.layout)
        readers_eur = self.setting.cost_eur(item.layout, 0)
        floor_eur = _cost(item) - readers_eur
        each = tuple(floor_eur * count / max(1, sum(tags)) for count in tags)
        return Money(total_eur=_cost(item), readers_eur=readers_eur, tags=tags, floor_eur=each)


def results_of(
    setting: Setting, effort: Effort, progress: Progress, evaluations: Sequence[Evaluation | Failure]
) -> Results:
    """Return what was found; every number in it comes from the evaluations or is exact."""
    every = outcomes_of(evaluations)
    known = first_held_out(setting.problem, effort, every)
    kinds = progress.kinds or {}
    problem = setting.problem
    closed = {} if progress.closing is None else progress.closing.accepted
    seen = {item.layout.key: (item, known) for kind in kinds.values() for item in kind.looked}
    # What held in the closing round held on all its drives, and not on those of a first look.
    seen.update({item.layout.key: (item, every) for item in closed.values()})
    scores = {}
    for key, (item, tables) in seen.items():
        for scenario in problem.held_out:
            table = tables.get(group_of(item.layout, scenario, problem.estimators[0]))
            if table is not None:
                scores[key, scenario.name] = simulated_scores(problem, item.layout, scenario, table)
    return Results(
        setting=setting,
        progress=progress,
        kinds=kinds,
        held_out=scores,
        compared=_compared(setting, progress, known),
        open_layouts={kind: _open(progress, kind) for kind in (COMPOSED, UNIFORM)},
        shortfall={kind: _shortfall(setting, one, known) for kind, one in kinds.items() if one.accepted is None},
    )


def summary(results: Results) -> list[str]:
    """Return the answer in a few sentences."""
    lines = [status_text(results.status, results.fewest_drives)]
    if not results.setting.layouts:
        return [*lines, "No reader group can be built and judged with any of the patterns."]
    composed, uniform = results.accepted(COMPOSED), results.accepted(UNIFORM)
    for kind in (COMPOSED, UNIFORM):
        item = results.accepted(kind)
        words = WORDS[kind]
        if item is not None:
            lines.append(
                f"Cheapest {words} that meets every limit on held-out drives: {euros(_cost(item))}, "
                f"{item.layout.label} ({item.layout.short_key}). {_tried(results.kinds[kind])}"
            )
        elif kind in results.shortfall:
            lines.append(
                f"No {words} was shown to meet every limit on held-out drives; {results.shortfall[kind]}."
            )
    if not results.progress.possible:
        lines.append("The drives of the search let expect of no combination of patterns that it meets all limits.")
    if results.progress.cut:
        lines.append(
            f"{results.progress.cut} searches for combinations of patterns ended before they were through; what "
            f"they left out costs at least {euros(results.progress.rest_eur)} by the prediction."
        )
    saving, ends = results.saving_eur, results.saving_ends_eur
    if saving is None or ends is None or composed is None or uniform is None:
        if composed is not None and uniform is None:
            lines.append("What patterns by zone save cannot be told, because no single pattern was shown to do.")
        return [line for line in (*lines, _closing(results)) if line]
    share = saving / _cost(uniform)
    if saving > 0.0:
        lines.append(f"Patterns by zone save {euros(saving)}, {share:.1%} of the layout with one pattern.")
    else:
        lines.append(
            f"Patterns by zone save nothing: the cheapest layout that has them costs {euros(-saving)} more."
        )
    lines += [_sure(results, ends), _closing(results), _why(results, composed, uniform)]
    return [line for line in lines if line]


def _tried(kind: Kind) -> str:
    """Return how many layouts were tried until one held; each verdict by itself has its confidence."""
    count = len(kind.tried)
    before = "It was the first one tried" if count == 1 else f"{count} were tried until it held"
    return f"{before}, of {len(kind.looked)} with a first look; each verdict is at 95 % confidence by itself."


def _sure(results: Results, ends: tuple[float, float]) -> str:
    """Return how sure the saving is."""
    (_, uniform), (_, composed) = results.open_layouts[UNIFORM], results.open_layouts[COMPOSED]
    if not uniform and not composed:
        return "Costs are exact, and every cheaper layout that was simulated was shown to miss a limit."
    low, high = (euros(end) if end >= 0.0 else f"−{euros(-end)}" for end in ends)
    return (
        f"Costs are exact; open is which cheaper layouts would do. {uniform} with one pattern and {composed} with "
        "patterns by zone were simulated and neither shown to meet every limit nor to miss one; the saving lies "
        f"between {low} and {high}, whichever of them would."
    )


def _closing(results: Results) -> str:
    """Return what the closing round decided, and what holds of all verdicts of missing together."""
    closing = results.progress.closing
    if closing is None or not closing.closed:
        return ""
    words = []
    for kind in (one for one in (UNIFORM, COMPOSED) if one in closing.closed):
        held = closing.accepted.get(kind)
        missed = sum(entry.word == MISSED for entry in closing.closed[kind])
        words.append(
            f"of {closing.entered[kind]} cheaper {_MANY[kind]} that were open {missed} were shown to miss "
            f"a limit, {len(closing.still_open(kind))} are open"
            + ("" if held is None else f", and the one of {euros(_cost(held))} was accepted")
        )
    return (
        f"Closing round, {closing.spent} held-out drives: {'; '.join(words)}. At 95 % confidence together, none "
        "accepted in this round misses a limit, and of each kind the cheapest layout that would do is none of "
        "those shown to miss, here or in search."
    )


def _why(results: Results, composed: Evaluated, uniform: Evaluated) -> str:
    """Return in words where the difference comes from."""
    ours, theirs = results.money(composed), results.money(uniform)
    parts = [
        f"{zone or 'elsewhere'} {_signed(mine - other)}"
        for zone, mine, other in zip(results.setting.zones, ours.floor_eur, theirs.floor_eur, strict=True)
    ]
    return (
        f"Against one pattern, readers cost {_signed(ours.readers_eur - theirs.readers_eur)} and tags by place: "
        f"{', '.join(parts)}."
    )


def agreement(results: Results) -> str:
    """Return how well predictions held, over all layouts and limited scores that were predicted."""
    ratios = [one.simulated.value / one.predicted.value for one in results.compared if one.predicted.value > 0.0]
    if not ratios:
        return "No composed layout was simulated, so that nothing is known of how well predictions hold."
    outside = sum(not one.off.interval()[0] <= 0.0 <= one.off.interval()[1] for one in results.compared)
    return (
        f"Simulated over predicted, {len(ratios)} scores of composed layouts: median "
        f"{statistics.median(ratios):.3f}, from {min(ratios):.3f} to {max(ratios):.3f}. In {outside} of "
        f"{len(results.compared)} the 95 % interval of the paired difference leaves out zero, where one in twenty "
        "is expected of perfect predictions."
    )


def _cost(item: Evaluated) -> float:
    return item.scores["cost"].value


def _signed(amount_eur: float) -> str:
    return f"{'+' if amount_eur >= 0.005 else '−' if amount_eur <= -0.005 else '±'}{euros(abs(amount_eur))}"


def _compared(setting: Setting, progress: Progress, known: Mapping[Group, TrialOutcomes]) -> tuple[Compared, ...]:
    """Return predictions beside simulations, on the drives that the composed layout and all its parts have."""
    design, estimator = setting.problem.design, setting.problem.estimators[0]
    names = tuple(limit.score for limit in setting.simulated_limits)
    found = []
    for one in progress.composed:
        tables = [known.get(group_of(layout, design, estimator)) for layout in (one.item.layout, *one.parts)]
        complete = [table for table in tables if table is not None]
        if len(complete) < len(tables):
            continue
        drives = min(len(table) for table in complete)
        mine, *parts = (table.head(drives) for table in complete)
        shares = setting.shares(drives)
        terms = [zone_terms(table, names, setting.zones, shares)[slot] for slot, table in enumerate(parts)]
        predicted = TrialOutcomes(replications=np.arange(drives), columns=names, values=np.sum(terms, axis=0).T)
        for name in names:
            off = paired_difference(mine, predicted, name)
            found.append(
                Compared(
                    layout=one.item.layout,
                    name=name,
                    predicted=predicted.score(name),
                    simulated=mine.score(name),
                    off=replace(off, share=False),
                )
            )
    return tuple(found)


def _open(progress: Progress, kind: str) -> tuple[Evaluated | None, int]:
    """Return the cheapest layout below the accepted one that nothing shows to miss, and how many there are."""
    found = () if progress.closing is None else progress.closing.still_open(kind)
    return (found[0].item if found else None), len(found)


def _shortfall(setting: Setting, kind: Kind, known: Mapping[Group, TrialOutcomes]) -> str:
    """Return what is missing: on held-out drives if any layout got there, else in search."""
    problem = setting.problem
    if kind.tried:
        return (
            f"{len(kind.candidates)} were not shown to miss a limit in search, {len(kind.looked)} of them had a "
            f"first look there, {len(kind.tried)} were tried, and {held_out.shortfall(problem, kind.tried, known)}"
        )
    if kind.race.finalists:
        return f"in search, {nearest_miss(problem, kind.race.finalists)}"
    return "none could be built within the limits on exact scores"
