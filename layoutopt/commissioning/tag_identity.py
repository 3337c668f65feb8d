"""Identities of HF tags as people and readers write them, brought to one form.

ISO/IEC 15693 gives a tag eight bytes: E0h, the maker of the chip, a serial number. Readers print them in this
order or from the last byte to the first, with or without separators; the end that holds E0 tells which.
"""

import re
from dataclasses import dataclass
from typing import Final

_SEPARATORS: Final = re.compile(r"[\s:.\-_]")
_DIGITS: Final = re.compile(r"[0-9A-F]{16}")
_SPREADSHEET: Final = re.compile(r"\d+(\.\d+)?E\+?\d+", re.IGNORECASE)
_FIRST: Final = "E0"


@dataclass(frozen=True, slots=True, kw_only=True)
class TagIdentity:
    """An identity in its canonical form: 16 capital hexadecimal digits, first byte first.

    ``turned`` says that it was written with the last byte first, ``ambiguous`` that both ends hold E0, so that it
    may have been.
    """

    uid: str
    turned: bool = False
    ambiguous: bool = False


def tag_identity(text: str) -> TagIdentity:
    """Return the identity that a text stands for.

    Raises
    ------
    ValueError
        With a sentence, if it is none of ISO/IEC 15693.

    Examples
    --------
    >>> tag_identity("e0:04:01:50:0a:1b:2c:3d").uid
    'E00401500A1B2C3D'
    >>> tag_identity("3D2C1B0A500104E0")
    TagIdentity(uid='E00401500A1B2C3D', turned=True, ambiguous=False)
    """
    digits = _SEPARATORS.sub("", text.strip()).upper().removeprefix("0X")
    if not _DIGITS.fullmatch(digits):
        if _SPREADSHEET.fullmatch(text.strip()):
            raise ValueError("a spreadsheet has made a number of it; format the column as text and export again")
        raise ValueError(f"it has {len(digits)} digits; an identity has 16, from 0 to 9 and A to F")
    backwards = "".join(digits[place : place + 2] for place in range(14, -1, -2))
    first, last = digits.startswith(_FIRST), backwards.startswith(_FIRST)
    if not first and not last:
        raise ValueError("neither its first nor its last byte is E0, as those of an ISO 15693 tag are")
    return TagIdentity(uid=digits if first else backwards, turned=not first, ambiguous=first and last)
