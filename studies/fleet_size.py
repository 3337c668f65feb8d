"""How the cheapest layout changes with the number of robots: the floor is paid once, readers for every robot."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Final

from layoutopt.errors import InvalidInput
from layoutopt.evaluate import outcomes_of
from layoutopt.identity import content_key
from layoutopt.layout import Layout
from layoutopt.parts import Need, PriceList, Scope, bill_of_needs
from layoutopt.problem import Problem
from layoutopt.protocols import Evaluation, Failure, Group, Plan, Round, StudyCard
from layoutopt.scores import Score, TrialOutcomes
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from solvers.exhaustive import entered
from studies.cells import Cell, missing, plan_of
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.reader_group_setting import spread
from studies.swept import GOAL, cost_of, world_text

CARD: Final = StudyCard(
    summary="The cheapest layout that meets the accuracy target, for 1 to 50 robots, and where its money goes.",
    reference="own",
    question="How does the best layout change when I buy more robots?",
    adaptive=True,
    rests_on="Each size has the cheapest layout that is shown to meet the demand on fresh drives, at "
    "one-sided 95 %; a cheaper one may meet it without being shown to. Costs are exact for your "
    "prices.",
    next_step="Set the size of your fleet as count under [robots], and run cost_vs_accuracy for "
    "held-out drives and drawings.",
    guide="study_fleet_size",
)
SIZES: Final = (1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 20, 25, 30, 40, 50)
MOST_TRIED: Final = 48
"""Layouts that are decided for one size, cheapest first, before it is given up: a short look flatters many."""
LOOK: Final = 6
"""Drives of every layout: enough to tell those that are far from the demand."""
DECIDING: Final = 48
QUICK_LOOK: Final = 2
QUICK_DECIDING: Final = 2
_AT_ONCE: Final = 6
"""Layouts of one size that get their deciding drives in one round."""
_QUICK_LAYOUTS: Final = 24


@dataclass(frozen=True, slots=True, kw_only=True)
class Priced:
    """A layout with what it takes for one robot, from which its cost for any number follows exactly."""

    layout: Layout
    needs: tuple[Need, ...]

    def split_eur(self, robots: int, prices: PriceList) -> tuple[float, float]:
        """Return what the floor and what the readers of all robots cost, EUR, spares and labour included."""
        floor = tuple(need for need in self.needs if need.scope is not Scope.ROBOT)
        readers = tuple(
            replace(need, quantity=need.quantity * robots) for need in self.needs if need.scope is Scope.ROBOT
        )
        return (
            bill_of_needs(floor, robots, prices).total_eur,
            bill_of_needs(readers, robots, prices).total_eur,
        )

    def cost_eur(self, robots: int, prices: PriceList) -> float:
        """Return the whole cost for so many robots, EUR."""
        return sum(self.split_eur(robots, prices))


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """What came of one number of robots.

    ``priced`` is the cheapest layout whose deciding drives show that it meets the demand, with its error there;
    ``None`` if none of those tried does. ``tried`` is how many got such drives, ``open`` which still lack them.
    """

    robots: int
    priced: Priced | None
    error: Score | None
    tried: int
    open: tuple[Priced, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FleetSize:
    """All layouts of a space, each driven once, and priced for every number of robots.

    Attributes
    ----------
    layouts
        Every layout that can be built and judged, by cost for one robot.
    target_m
        Demand on the mean position error; ``None`` for the error that the first layout of the space has.
    first_key
        Key of that layout.
    look, deciding
        Drives of every layout, and further ones of those that are decided.
    """

    problem: Problem
    layouts: tuple[Priced, ...]
    prices: PriceList
    target_m: float | None
    first_key: str
    sizes: tuple[int, ...]
    look: int
    deciding: int
    seed: int
    world: str
    left_out: int
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "FleetSize":
        """Return the study of a spec; a quick one has a few layouts, sizes and drives.

        Raises
        ------
        InvalidInput
            If no layout of the space can be built.
        """
        problem = replace(spec.problem(), limits=())
        entries = entered(problem)
        fit = [item.evaluated.layout for item in entries if not item.refusal]
        if not fit:
            reason = entries[0].refusal if entries else "the space is empty"
            raise InvalidInput.at("space", f"no layout can be built and judged: {reason}", "Widen its lists.")
        first_key = next(layout.key for layout in spec.space.layouts() if layout.key in {item.key for item in fit})
        one = replace(cost_of(spec), robot_count=1)
        kept = spread(fit, _QUICK_LAYOUTS) if quick else fit
        kept += [layout for layout in fit if layout.key == first_key and layout not in kept]
        return cls(
            problem=problem,
            layouts=tuple(Priced(layout=layout, needs=one.needs(layout, spec.design)) for layout in kept),
            prices=spec.prices,
            target_m=spec.target_error_m,
            first_key=first_key,
            sizes=(1, 4, 50) if quick else SIZES,
            look=QUICK_LOOK if quick else LOOK,
            deciding=QUICK_DECIDING if quick else DECIDING,
            seed=spec.seed,
            world=world_text(spec),
            left_out=len(fit) - len(kept),
        )

    @property
    def key(self) -> str:
        """Content key of layouts, drives and prices."""
        cells = [self._cell(item, self.look) for item in self.layouts]
        bills = [[item.cost_eur(size, self.prices) for size in self.sizes] for item in self.layouts]
        return content_key(
            type(self).__name__, [cell.group for cell in cells], bills, self.target_m, self.look, self.deciding
        )

    def plan(self) -> Plan:
        """Return the numbers of layouts and drives, and a pilot over them."""
        lines = [
            f"{len(self.layouts)} layouts, {self.look} drives each; then {self.deciding} more of those that are "
            "cheapest for a number of robots"
        ]
        return plan_of((self._cell(item, self.look) for item in self.layouts), lines)

    def next_batch(self, evaluations: Sequence[Evaluation | Failure]) -> Round:
        """Return the first look at all layouts, then the deciding drives, cheapest layouts first."""
        known, failed = outcomes_of(evaluations), failures_of(evaluations)
        first = missing((self._cell(item, self.look) for item in self.layouts), known, failed)
        if first:
            return Round(name=f"first look at {len(self.layouts)} layouts", tasks=first)
        wanted = {item.layout.key: item for chosen in self.chosen(known, failed) for item in chosen.open}
        cells = [self._cell(item, self.look + self.deciding) for item in wanted.values()]
        return Round(name=f"deciding {len(cells)} layouts", tasks=missing(cells, known, failed))

    def best_so_far(self, evaluations: Sequence[Evaluation | Failure]) -> str:
        """Return for how many sizes a layout was found."""
        known = outcomes_of(evaluations)
        if self.demand_m(known) is None:
            return ""
        found = [item for item in self.chosen(known, failures_of(evaluations)) if item.priced is not None]
        return f"{len(found)} of {len(self.sizes)} sizes have their layout"

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return the layouts, ready to be told; the spec has nothing to add."""
        # Imported here because the page needs what this module defines.
        from studies.fleet_size_page import page_of, summary

        known, failures = outcomes_of(evaluations), failures_of(evaluations)
        chosen, demand_m = self.chosen(known, failures), self.demand_m(known)
        drives = sum(map(len, known.values()))
        return PageAnswer(
            study="fleet_size",
            found=any(item.priced is not None for item in chosen),
            summary=tuple(summary(self, chosen, demand_m)),
            page=lambda _: page_of(self, chosen, demand_m, drives=drives, failed=len(failures)),
            failures=failures,
        )

    def demand_m(self, known: Mapping[Group, TrialOutcomes]) -> float | None:
        """Return the demand on the mean error, m; ``None`` while the error that stands for it is not known."""
        if self.target_m is not None:
            return self.target_m
        first = next(item for item in self.layouts if item.layout.key == self.first_key)
        table = self._cell(first, self.look).outcomes(known)
        return None if table is None else table.score(GOAL).value

    def chosen(self, known: Mapping[Group, TrialOutcomes], failed: Mapping[Group, str]) -> tuple[Chosen, ...]:
        """Return what came of each number of robots.

        A layout is a candidate if the mean of its first look meets the demand. Candidates are decided by further
        drives alone, the cheapest first.
        """
        demand_m = self.demand_m(known)
        if demand_m is None:
            return tuple(Chosen(robots=robots, priced=None, error=None, tried=0) for robots in self.sizes)
        candidates = []
        for item in self.layouts:
            cell = self._cell(item, self.look)
            table = None if cell.group in failed else cell.outcomes(known)
            if table is not None and table.score(GOAL).value <= demand_m:
                candidates.append(item)
        return tuple(self._chosen(robots, candidates, known, failed, demand_m) for robots in self.sizes)

    def _chosen(
        self,
        robots: int,
        candidates: Sequence[Priced],
        known: Mapping[Group, TrialOutcomes],
        failed: Mapping[Group, str],
        demand_m: float,
    ) -> Chosen:
        ordered = sorted(candidates, key=lambda item: (item.cost_eur(robots, self.prices), item.layout.key))
        undecided: list[Priced] = []
        for tried, item in enumerate(ordered[:MOST_TRIED]):
            cell = self._cell(item, self.look + self.deciding)
            table = None if cell.group in failed else cell.outcomes(known)
            if table is None:
                undecided += [] if cell.group in failed else [item]
            elif not undecided:
                error = tail(table, self.look).score(GOAL)
                if error.upper(0.95) <= demand_m:
                    return Chosen(robots=robots, priced=item, error=error, tried=tried + 1)
            if len(undecided) == _AT_ONCE:
                break
        return Chosen(
            robots=robots,
            priced=None,
            error=None,
            tried=min(len(ordered), MOST_TRIED) - len(undecided),
            open=tuple(undecided),
        )

    def _cell(self, item: Priced, trials: int) -> Cell:
        return Cell(
            layout=item.layout,
            scenario=self.problem.design,
            estimator=self.problem.estimators[0],
            trials=trials,
        )


def tail(table: TrialOutcomes, first: int) -> TrialOutcomes:
    """Return the replications from the number ``first`` on."""
    kept = table.replications >= first
    return TrialOutcomes(replications=table.replications[kept], columns=table.columns, values=table.values[kept])
