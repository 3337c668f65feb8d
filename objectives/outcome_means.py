"""What objectives share that are nothing but means of what trials gave."""

from typing import ClassVar

from layoutopt.layout import Layout
from layoutopt.protocols import ObjectiveCard
from layoutopt.scenario import Scenario
from layoutopt.scores import Scores, TrialOutcomes


class OutcomeMeans:
    """The mean of every column of trials that the card names, those of zones included."""

    __slots__ = ()
    card: ClassVar[ObjectiveCard]

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return each mean with its standard error; nothing without outcomes, or with those of other trials."""
        return {} if outcomes is None else outcomes.scores(self.card.scores)
