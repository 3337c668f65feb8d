"""The parallelogram tile of kim2010, side by side or sheared."""

from typing import Final

import numpy as np

from layoutopt.layout import TagPattern
from layoutopt.patterns.checks import check_lengths
from layoutopt.protocols import PatternCard

CARD: Final = PatternCard(
    summary="Tiles of four tags whose upper pair is shifted to the right and lower pair to the left.",
    reference="kim2010, Fig. 5b and 6b",
)
FORMS: Final = ("zigzag", "sheared")


def parallelogram(*, tile_m: float, shift_m: float, form: str = "zigzag") -> TagPattern:
    """Return square tiles of four tags, the upper two shifted to the right by ``shift_m``, the others to the left.

    The pitch s is half the tile (kim2010 writes the tile's side as 2s). Tiles side by side (``"zigzag"``) shift
    the rows to and fro; with ``"sheared"`` every row of tiles is moved on by four shifts, so that each row of tags
    lies two shifts to the right of the one below: a lattice. At a shift of s/4 both are the isosceles pattern of
    han2006, at 0 and s/2 the square one.

    Raises
    ------
    ValueError
        If the tile is not positive and finite, the shift lies outside 0 to a quarter of the tile, or the form is
        unknown.
    """
    check_lengths(tile_m=tile_m)
    pitch_m = tile_m / 2.0
    if not 0.0 <= shift_m <= pitch_m / 2.0 * (1.0 + 1e-9):
        raise ValueError(f"shift must lie between 0 and a quarter of the tile, {tile_m / 4.0} m, got {shift_m}")
    if form not in FORMS:
        raise ValueError(f"form is one of {', '.join(FORMS)}, not {form!r}")
    lower, upper = (pitch_m / 2.0 - shift_m, pitch_m / 2.0), (pitch_m / 2.0 + shift_m, 1.5 * pitch_m)
    zigzag = form == "zigzag"
    return TagPattern(
        name="parallelogram",
        points_m=np.array([lower, upper] if zigzag else [lower]),
        cell_m=np.diag([pitch_m, tile_m]) if zigzag else np.array([(pitch_m, 0.0), (2.0 * shift_m, pitch_m)]),
        parameters={"tile_m": tile_m, "shift_m": shift_m, "form": form},
    )
