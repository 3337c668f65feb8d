"""Lettering: clean one-line texts and their size in the font of all sheets (DejaVu Sans, shipped by matplotlib).

Heights are the height of capitals in millimetres (ISO 3098), from which font sizes follow.
"""

import functools
import unicodedata
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.ft2font import FT2Font

SMALLEST_MM = 1.8
"""Smallest letters that are still read from a copy."""
UNPRINTABLE = "\N{REPLACEMENT CHARACTER}"
ELLIPSIS = "\N{HORIZONTAL ELLIPSIS}"
LINE_PITCH = 1.55
"""Distance of the base lines of a text in several lines, in heights of a capital."""


class _Glyph(NamedTuple):
    """Advance and vertical ink of one character, in heights of a capital."""

    advance: float
    low: float
    high: float


def single_line(text: str) -> str:
    r"""Return ``text`` without anything that could break a line or a file: it may come from a user's file.

    Control characters and line ends become spaces; what is no character (half a surrogate pair, unassigned
    code points) becomes the replacement character.

    Examples
    --------
    >>> single_line("ward\n  5")
    'ward   5'
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(_clean(character) for character in text)


def _clean(character: str) -> str:
    category = unicodedata.category(character)
    if category in ("Cc", "Zl", "Zp"):
        return " "
    return UNPRINTABLE if category in ("Cs", "Cn") else character


@functools.cache
def font_file() -> "Path":
    """Return the path of the font: the copy inside matplotlib, equal on every computer."""
    from pathlib import Path

    import matplotlib

    return Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"


@functools.cache
def _font() -> "FT2Font":
    from matplotlib.ft2font import FT2Font

    # A face of its own: that of matplotlib's cache keeps the turn of the last text that was drawn with it.
    return FT2Font(str(font_file()))


@functools.cache
def _characters() -> frozenset[int]:
    return frozenset(_font().get_charmap())


@functools.cache
def capital_em() -> float:
    """Return the height of a capital as a share of the font size (em)."""
    top = _outline("H")[2]
    return top / _font().units_per_EM


def _outline(character: str) -> tuple[int, int, int]:
    """Return advance, lowest and highest ink of a character, in font units."""
    from matplotlib.ft2font import LoadFlags

    glyph = _font().load_char(ord(character), flags=LoadFlags.NO_SCALE)
    return glyph.horiAdvance, glyph.bbox[1], glyph.bbox[3]


@functools.cache
def _glyph(character: str) -> _Glyph:
    capital = capital_em() * _font().units_per_EM
    advance, low, high = _outline(character)
    return _Glyph(advance / capital, low / capital, high / capital)


def printable(text: str) -> str:
    """Return ``text`` with the replacement character for each character the font lacks."""
    if text.isascii():
        return text
    known = _characters()
    return "".join(character if ord(character) in known else UNPRINTABLE for character in text)


def points(height_mm: float) -> float:
    """Return the font size in points (1/72 inch) whose capitals are ``height_mm`` high."""
    return height_mm / capital_em() * 72.0 / 25.4


def width_mm(text: str, height_mm: float) -> float:
    """Return the printed width of ``text``, the sum of its advance widths."""
    return height_mm * sum(_glyph(character).advance for character in printable(text))


def ink_mm(text: str, height_mm: float) -> tuple[float, float]:
    """Return the lowest and highest ink of ``text`` above its base line."""
    glyphs = [_glyph(character) for character in printable(text)]
    if not glyphs:
        return 0.0, 0.0
    return height_mm * min(glyph.low for glyph in glyphs), height_mm * max(glyph.high for glyph in glyphs)


def fit_text(text: str, room_mm: float, height_mm: float, smallest_mm: float = SMALLEST_MM) -> tuple[str, float]:
    """Return ``text`` and a height at which it fits into ``room_mm``.

    The height shrinks in steps of 0.1 mm down to ``smallest_mm``; a text too long even then is cut and ends in
    an ellipsis.

    Examples
    --------
    >>> fit_text("Ward 5", 50.0, 3.5)
    ('Ward 5', 3.5)
    >>> fit_text("Ward 5, ground floor", 15.0, 3.5)
    ('Ward 5, g…', 1.8)
    """
    text = single_line(text)
    per_height = width_mm(text, 1.0)
    if per_height * height_mm <= room_mm:
        return text, height_mm
    fitting = int(room_mm / per_height * 10) / 10
    if fitting >= smallest_mm:
        return text, fitting
    kept = ""
    for character in text:
        if width_mm(kept + character + ELLIPSIS, smallest_mm) > room_mm:
            break
        kept += character
    return kept.rstrip() + ELLIPSIS, smallest_mm


@functools.lru_cache(maxsize=512)
def wrapped(text: str, room_mm: float, height_mm: float) -> tuple[str, ...]:
    """Return ``text`` in lines that fit into ``room_mm``, broken at spaces, or within a word longer than a line.

    Examples
    --------
    >>> wrapped("measure from the datum", 30.0, 2.5)
    ('measure from', 'the datum')
    """
    lines = [""]
    for word in single_line(text).split():
        joined = f"{lines[-1]} {word}".strip()
        if width_mm(joined, height_mm) <= room_mm:
            lines[-1] = joined
            continue
        if lines[-1]:
            lines.append("")
        for character in word:
            if lines[-1] and width_mm(lines[-1] + character, height_mm) > room_mm:
                lines.append("")
            lines[-1] += character
    return tuple(lines)


def fit_lines(
    text: str, room_mm: float, height_mm: float, letter_mm: float, smallest_mm: float = SMALLEST_MM
) -> tuple[tuple[str, ...], float]:
    """Return ``text`` in lines, and the largest height of letters at which they fill no more than the room.

    Letters shrink in steps of 0.1 mm from ``letter_mm`` to ``smallest_mm``; only what is too long even then is
    cut and ends in an ellipsis. ``room_mm`` is the width, ``height_mm`` the height of the room.

    Examples
    --------
    >>> fit_lines("Ward 5, ground floor", 30.0, 12.0, 3.5)
    (('Ward 5,', 'ground floor'), 3.5)
    """
    text = single_line(text)
    if width_mm(text, letter_mm) <= room_mm:
        return (text,), letter_mm
    steps = round((letter_mm - smallest_mm) * 10.0)
    lines: tuple[str, ...] = ()
    for step in range(steps + 1):
        letter = round(letter_mm - 0.1 * step, 3)
        lines = wrapped(text, room_mm, letter)
        if len(lines) * LINE_PITCH * letter <= height_mm:
            return lines, letter
    most = max(1, int(height_mm / (LINE_PITCH * smallest_mm)))
    rest, _ = fit_text(" ".join(lines[most - 1 :]), room_mm, smallest_mm, smallest_mm)
    return (*lines[: most - 1], rest), smallest_mm
