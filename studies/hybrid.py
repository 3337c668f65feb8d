"""Floor tags for the pose, UHF antennas for finding people, a transponder to dock at: in one study with one bill.

The three parts share the robots and the bill and nothing else in the model, so each is chosen by the study that is
about it, on its own trials, and the cheapest whole is the sum of the cheapest parts that meet their limits.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar, Final

from layoutopt import registry
from layoutopt.identity import content_key
from layoutopt.protocols import Evaluation, Failure, Plan, Round, Study, StudyCard
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from objectives.cost import Cost
from studies.antenna_yaw import AntennaYaw
from studies.cells import drives_in
from studies.cost_vs_accuracy import CostVersusAccuracy
from studies.hybrid_answer import HybridAnswer, docking_part, floor_part, tracking_part
from studies.transponder_placement import TransponderPlacement

CARD: Final = StudyCard(
    summary="Floor tags, UHF antennas and a docking transponder, each chosen by its own study, with one bill.",
    reference="own; mi2016, liang2020 and kim2009 for the three systems",
    question="What do a robot's pose, finding people and docking cost together?",
    adaptive=True,
    rests_on="Each part is as sure as its own report says; the sum of their costs is exact for your "
    "prices. That the three do not disturb each other is taken for granted.",
    next_step="Read the reports of the parts, then draw the whole layout with layoutopt draw.",
    guide="hybrid",
)
COST: Final = "cost"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hybrid:
    """The three studies, run side by side.

    Attributes
    ----------
    floor, tracking, docking
        The studies of the parts, without any limit on cost.
    cost
        Prices the whole and its parts.
    budget_eur
        What the whole may cost; ``None`` for no limit.
    """

    floor: CostVersusAccuracy
    tracking: AntennaYaw
    docking: TransponderPlacement
    cost: Cost
    budget_eur: float | None
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "Hybrid":
        """Return the study of a spec; a quick one asks for quick answers of its parts.

        Whatever UHF antennas and transponder the spec names are left to the studies about them.

        Raises
        ------
        InvalidInput
            As the studies of the parts.
        """
        limits = tuple(limit for limit in spec.own_limits if limit.score != COST)
        space = replace(spec.space, finders=(), transponders=(), target_tags=0)
        parts = replace(spec, space=space, budget_eur=None, own_limits=limits)
        ends = [limit.upper for limit in spec.limits if limit.score == COST and limit.upper is not None]
        return cls(
            floor=CostVersusAccuracy.for_spec(parts, quick=quick, workers=workers),
            tracking=AntennaYaw.for_spec(parts, quick=quick, workers=workers),
            docking=TransponderPlacement.for_spec(parts, quick=quick, workers=workers),
            cost=Cost(prices=spec.prices, robot_count=spec.robot_count, reader_part=spec.reader_part),
            budget_eur=min(ends, default=None),
        )

    @property
    def parts(self) -> Mapping[str, Study]:
        """The studies by what their estimators estimate."""
        return {"robot": self.floor, "target": self.tracking, "bearing": self.docking}

    @property
    def key(self) -> str:
        """Content key of the questions of all parts."""
        return content_key("hybrid", [study.key for study in self.parts.values()])

    def plan(self) -> Plan:
        """Return what the parts would run."""
        plans = {WORDS[what]: study.plan() for what, study in self.parts.items()}
        return Plan(
            lines=tuple(f"{part}: {line}" for part, plan in plans.items() for line in plan.lines),
            pilot=tuple(entry for plan in plans.values() for entry in plan.pilot),
        )

    def next_batch(self, evaluations: Sequence[Evaluation | Failure]) -> Round:
        """Return the next round of every part that still has one."""
        rounds = {WORDS[what]: study.next_batch(of_kind(evaluations, what)) for what, study in self.parts.items()}
        return Round(
            name="; ".join(f"{part}: {batch.name}" for part, batch in rounds.items() if batch.tasks) or "done",
            tasks=tuple(task for batch in rounds.values() for task in batch.tasks),
        )

    def best_so_far(self, evaluations: Sequence[Evaluation | Failure]) -> str:
        """Return what the parts have found so far."""
        found = {WORDS[what]: study.best_so_far(of_kind(evaluations, what)) for what, study in self.parts.items()}
        return "; ".join(f"{part}: {text}" for part, text in found.items() if text)

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> HybridAnswer:
        """Return the parts that were chosen, together and with one bill."""
        floor, tracking, docking = (of_kind(evaluations, what) for what in self.parts)
        return HybridAnswer(
            parts=(
                floor_part(self.floor.answer(floor, spec)),
                tracking_part(self.tracking, tracking, spec),
                docking_part(self.docking, docking, spec),
            ),
            cost=self.cost,
            scenario=self.floor.problem.design,
            budget_eur=self.budget_eur,
            spec=spec,
            trials=drives_in(evaluations),
        )


WORDS: Final = {"robot": "floor tags", "target": "UHF antennas", "bearing": "docking"}
"""What the parts are called, by what their estimators estimate."""


def of_kind(evaluations: Sequence[Evaluation | Failure], estimates: str) -> tuple[Evaluation | Failure, ...]:
    """Return the evaluations whose estimators estimate this."""
    return tuple(item for item in evaluations if _estimates(item.group.estimator) == estimates)


@lru_cache(maxsize=64)
def _estimates(estimator: str) -> str:
    estimates: str = registry.card("estimators", estimator).estimates
    return estimates
