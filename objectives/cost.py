"""Money: the floor once, readers for every robot, spares and labour."""

from dataclasses import dataclass, field
from typing import ClassVar, Final

from layoutopt.identity import LATER, by_content
from layoutopt.layout import Layout, ReaderGroup, Transponder
from layoutopt.parts import BillOfMaterial, Need, PriceList, Scope, bill_of_needs, needs
from layoutopt.protocols import ObjectiveCard
from layoutopt.scenario import Scenario
from layoutopt.scores import SCORE_UNITS, Score, Scores, TrialOutcomes

CARD: Final = ObjectiveCard(
    summary="Cost of parts, spares and labour on the scenario's site, by a dated price list.",
    reference="the price list's own sources; own",
    scores={"cost": SCORE_UNITS["cost"]},
    fidelity="exact",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cost:
    """The total of the bill of material for a fleet of ``robot_count`` robots.

    Tags that are installed cost nothing, nor do readers that robots carry already and transponders that stand.

    Attributes
    ----------
    reader_part
        Item of the price list that reads: ``"reader_module"`` or ``"industrial_reader"``.
    equipped_count, equipped_with
        How many robots carry readers, and which. A layout with other readers pays them for every robot.
    standing, given_out
        Transponders that are there, and how many UHF tags are given out already.

    Raises
    ------
    ValueError
        If there is no robot, or more are equipped than there are.
    """

    prices: PriceList
    robot_count: int
    reader_part: str = "reader_module"
    equipped_count: int = 0
    equipped_with: tuple[ReaderGroup, ...] = ()
    standing: tuple[Transponder, ...] = field(default=(), metadata=LATER)
    given_out: int = field(default=0, metadata=LATER)
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Check the fleet."""
        if self.robot_count < 1:
            raise ValueError(f"a fleet needs at least one robot, got {self.robot_count}")
        if not 0 <= self.equipped_count <= self.robot_count:
            raise ValueError(f"of {self.robot_count} robots {self.equipped_count} cannot be equipped")

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return the exact cost.

        Raises
        ------
        ValueError
            If the layout needs something that no price list holds; see `layoutopt.parts.needs`.
        """
        return {"cost": Score(value=self.bill(layout, scenario).total_eur, unit=CARD.scores["cost"])}

    def bill(self, layout: Layout, scenario: Scenario) -> BillOfMaterial:
        """Return the bill of which the score is the total."""
        return bill_of_needs(self.needs(layout, scenario), self.robot_count, self.prices)

    def needs(self, layout: Layout, scenario: Scenario) -> tuple[Need, ...]:
        """Return what the layout takes that is not there yet."""
        tag_count = len(layout.floor_tags.lay_on(scenario.site).to_lay())
        equipped = self.robot_count - self.bare_count(layout)
        missing = layout.replace(
            transponders=tuple(item for item in layout.transponders if item not in self.standing),
            target_tags=max(0, layout.target_tags - self.given_out),
        )
        return needs(missing, tag_count, self.robot_count, self.reader_part, equipped)

    def bare_count(self, layout: Layout) -> int:
        """Return how many robots need the readers of a layout."""
        return self.robot_count - (self.equipped_count if layout.readers == self.equipped_with else 0)


def cost_split(objective: Cost, layout: Layout, scenario: Scenario) -> dict[Scope, float]:
    """Return how the cost, EUR, divides into floor, robots' readers, spares and labour."""
    bill = objective.bill(layout, scenario)
    return {scope: bill.total_of(scope) for scope in Scope}
