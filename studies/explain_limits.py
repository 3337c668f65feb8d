"""How much of each limit a layout uses, and which limits bind it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from layoutopt.problem import Limit
from layoutopt.scores import Score, Scores
from solvers.judging import trials_needed

BINDING_USE: Final = 0.9
"""A limit of which the confidence bound uses this much or more binds: a tenth is soon lost on a real floor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitUse:
    """A limit and how much of it the layout uses.

    Attributes
    ----------
    score
        The exact score, or that of the worst held-out scenario; ``None`` if it is not known.
    bound
        Its confidence bound on the side of the limit; NaN if the score is not known.
    slack
        What is left to the limit, in its unit; negative where the limit is not met.
    use
        Bound over limit, 1 at the limit; see `layoutopt.problem.Limit.ratio`.
    broken_by
        What the next cheaper layout one step away changes, if that misses the limit; else empty.
    more_trials
        Trials that would show a share never seen to be within the limit; zero where trials are not what lacks.
    """

    limit: Limit
    score: Score | None
    bound: float
    slack: float
    use: float
    broken_by: str = ""
    more_trials: int = 0

    @property
    def met(self) -> bool:
        """Whether the confidence bound meets the limit."""
        return self.slack >= 0.0

    @property
    def broken(self) -> bool:
        """Whether the opposite bound shows that the limit is missed; neither met nor broken is not decided."""
        return self.score is not None and not math.isnan(self.score.value) and self.limit.broken(self.score)

    @property
    def binding(self) -> bool:
        """Whether the bound uses most of the limit, or the next cheaper layout misses it."""
        return not self.met or self.use >= BINDING_USE or bool(self.broken_by)


def limit_uses(
    limits: Sequence[Limit], scores: Scores, next_cheaper: str, missed: Sequence[Limit]
) -> tuple[LimitUse, ...]:
    """Return how much of each limit some scores use.

    Parameters
    ----------
    next_cheaper, missed
        What the next cheaper layout one step away changes, and the limits that it misses.
    """
    found = []
    for limit in limits:
        score = scores.get(limit.score)
        if score is None or math.isnan(score.value):
            found.append(LimitUse(limit=limit, score=score, bound=math.nan, slack=-math.inf, use=math.inf))
            continue
        bound = limit.bound(score)
        found.append(
            LimitUse(
                limit=limit,
                score=score,
                bound=bound,
                slack=-limit.excess(bound),
                use=limit.ratio(bound),
                broken_by=next_cheaper if limit in missed else "",
                more_trials=trials_needed(limit, score),
            )
        )
    return tuple(found)
