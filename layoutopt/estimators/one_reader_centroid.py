"""Position and orientation from one reader: centroid of its tags, chords and wheels, variances."""

from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.estimators.one_reader import ReaderSettings
from layoutopt.identity import by_content
from layoutopt.protocols import EstimatorCard

CARD: Final = EstimatorCard(
    summary="Centroid of the tags of one reader, heading from chords and wheels, gain by variances.",
    reference="own, after han2006",
    estimates="robot",
    needs="tag_read",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OneReaderCentroid(ReaderSettings):
    """Centroid in place of the midrange, wheels in place of arcs, variances in place of a fixed gain."""

    compensation: str = "variance"
    orientation: str = "wheels"
    card: ClassVar[EstimatorCard] = CARD
    row: ClassVar[str] = "one_reader_centroid"
    place: ClassVar[str] = "centroid"

    def __post_init__(self) -> None:
        """Check the settings."""
        self.check()
