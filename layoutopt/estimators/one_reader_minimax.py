"""Position and orientation from one reader: the best place for its tags, chords and wheels, variances."""

from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.estimators.one_reader import ReaderSettings
from layoutopt.identity import by_content
from layoutopt.protocols import EstimatorCard

CARD: Final = EstimatorCard(
    summary="Centre of the places that read the same tags, heading from chords and wheels, gain by variances.",
    reference="own, after han2006; Welzl, New Results and New Trends in Computer Science, 1991",
    estimates="robot",
    needs="tag_read",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OneReaderMinimax(ReaderSettings):
    """Centre of all places that read the same, wheels in place of arcs, variances in place of a fixed gain."""

    compensation: str = "variance"
    orientation: str = "wheels"
    card: ClassVar[EstimatorCard] = CARD
    row: ClassVar[str] = "one_reader_minimax"
    place: ClassVar[str] = "minimax"

    def __post_init__(self) -> None:
        """Check the settings."""
        self.check()
