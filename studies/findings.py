"""What a study found, in the form that tables, figures, report and drawings are made from."""

from collections.abc import Mapping
from dataclasses import dataclass

from layoutopt.layout import Layout
from layoutopt.problem import Problem
from layoutopt.protocols import Group
from layoutopt.result import Evaluated, Result, Validation
from layoutopt.scores import Score
from studies.alternatives import Alternatives
from studies.one_steps import OneStep
from studies.pairing import Pairing
from studies.trade_off import TradeOff


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """A layout of the design space as the study left it.

    ``refusal`` says why it cannot be built (empty if it can), ``trials`` how many simulated drives it got, and
    ``evaluated.scores`` holds the exact scores and, after at least one trial, the simulated ones.
    """

    evaluated: Evaluated
    refusal: str
    trials: int
    on_front: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceMark:
    """A published layout beside the front: its cost on the user's site, its error on a clear floor."""

    label: str
    layout: Layout
    cost: Score
    error: Score


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """Everything that a cost-against-accuracy study hands to its readers.

    Attributes
    ----------
    designs
        All layouts of the space, by cost and key.
    validations
        Held-out scores, a row for each validated layout, scenario and estimator.
    references
        Published layouts, never members of the front.
    pairing
        What common drives saved in the comparisons of the search.
    trade_off
        What more accuracy costs along the front, and how sure the front is.
    alternatives
        Layouts about as good as the first recommended one that truly differ from it.
    one_steps
        Layouts of the search that differ from the first recommended one in a single choice.
    candidates_validated
        How many layouts were tried on held-out trials before one met every limit there.
    passed_over
        Layouts that cost less than the first recommended one and met every limit in search, but were not tried for
        that on held-out trials: they would miss a limit there if they lost as much as the front did. Some were
        driven there as members of the front. Cheapest first.
    reasons
        Why each recommended layout was chosen, in words, by role: ``"cheapest"``, ``"knee"``, ``"most accurate"``.
    failures
        What tasks raised, by layout, scenario and estimator; empty when all went well.
    """

    problem: Problem
    result: Result
    designs: tuple[Design, ...]
    validations: tuple[Validation, ...]
    references: tuple[ReferenceMark, ...]
    pairing: Pairing
    trade_off: TradeOff
    alternatives: Alternatives
    one_steps: tuple[OneStep, ...]
    candidates_validated: int
    passed_over: tuple[Evaluated, ...]
    seed: int
    reasons: Mapping[str, str]
    failures: Mapping[Group, str]

    def _repr_html_(self) -> str:
        """Return the result with its front and its held-out scores, for a notebook."""
        from layoutopt.notebook import html_of_result
        from layoutopt.score_text import limit_text, score_text
        from studies.summary import verdict

        goal, estimator = self.problem.goals[1], self.problem.estimators[0].name
        rows = [("demand", limit_text(limit)) for limit in self.problem.limits]
        rows += [
            (f"{role}, {row.scenario}", score_text(row.scores[goal], goal))
            for role, item in self.result.recommended.items()
            for row in self.validations
            if row.layout_key == item.layout.key and row.estimator == estimator and row.scores is not None
        ]
        return html_of_result(self.result, verdict(self), rows)
