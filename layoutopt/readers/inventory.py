"""How long a reader takes to ask which tags are in view, by ISO/IEC 15693.

Times follow from the bits that parts 2 and 3 of the standard send: requests coded 1 out of 4, replies at the high
data rate with one subcarrier, 26.48 kbit/s both ways. What a host adds stands apart.
"""

import math
from typing import Final

HOST_S: Final = 0.010
"""What a host adds to an inventory (FEIG application note N11200: response time = inventory + 10 ms)."""
TAGS_IN_VIEW: Final = 4
"""For how many tags a scan of several has room unless told otherwise."""
SLOTS: Final = 16
_CARRIER_HZ: Final = 13.56e6
_BIT_S: Final = 512.0 / _CARRIER_HZ
_REQUEST_BITS: Final = 8 + 8 + 8 + 16
"""Flags, command, length of the mask, check sum: an inventory without mask and application family."""
_REPLY_BITS: Final = 8 + 8 + 64 + 16
"""Flags, storage format, identity, check sum."""
_REQUEST_S: Final = (2 + _REQUEST_BITS + 1) * _BIT_S
"""Start of frame as long as two bits, end of frame as long as one."""
_REPLY_S: Final = (4 + _REPLY_BITS + 4) * _BIT_S
"""Start and end of frame as long as four bits each."""
_BEFORE_REPLY_S: Final = 4384.0 / _CARRIER_HZ
"""t1, longest: a scan must have room for the slowest tag; nominal are 4352 periods, 2 µs less."""
_AFTER_REPLY_S: Final = 4192.0 / _CARRIER_HZ
"""t2, least."""
_EMPTY_SLOT_S: Final = _BEFORE_REPLY_S + 4.0 * _BIT_S
"""t3, least: as long as a tag may take to begin, and the start of its frame."""
_NEXT_SLOT_S: Final = _BIT_S
"""The end of frame with which the reader calls the next slot."""


def single_tag_inventory_s() -> float:
    """Return the time in which a reader asks for one tag in one slot, s.

    Two tags that answer collide, and none is read.

    Examples
    --------
    >>> round(1000.0 * single_tag_inventory_s(), 1)
    6.2
    """
    return _REQUEST_S + _BEFORE_REPLY_S + _REPLY_S + _AFTER_REPLY_S


def slotted_inventory_s(tag_count: int) -> float:
    """Return the time of one round of 16 slots in which so many tags answer, each in a slot of its own, s.

    Tags that share a slot collide and take the round less time; reading them takes another round. See
    `expected_singles`.

    Raises
    ------
    ValueError
        If there are fewer tags than none or more than slots.

    Examples
    --------
    >>> [round(1000.0 * slotted_inventory_s(tags), 1) for tags in (1, 2, 3, 4, 6, 8)]
    [13.9, 17.9, 22.0, 26.1, 34.3, 42.5]
    """
    if not 0 <= tag_count <= SLOTS:
        raise ValueError(f"a round has {SLOTS} slots for 0 to {SLOTS} tags, got {tag_count} tags")
    with_a_tag_s = _BEFORE_REPLY_S + _REPLY_S + _AFTER_REPLY_S
    in_slots_s = tag_count * with_a_tag_s + (SLOTS - tag_count) * _EMPTY_SLOT_S
    return _REQUEST_S + in_slots_s + (SLOTS - 1) * _NEXT_SLOT_S


def expected_singles(tag_count: int) -> float:
    """Return how many of so many tags answer alone in one round of 16 slots, on average over identities.

    A tag's slot is the last four bits of its identity, no draw of its own: two tags with the same bits collide in
    every round without a mask. The mean is over tags whose identities nobody chose.

    Examples
    --------
    >>> [round(expected_singles(tags), 2) for tags in (2, 4, 8)]
    [1.88, 3.3, 5.09]
    """
    return tag_count * (1.0 - 1.0 / SLOTS) ** max(tag_count - 1, 0)


def all_apart_probability(tag_count: int) -> float:
    """Return the chance that no two of so many tags share a slot, over identities that nobody chose.

    Examples
    --------
    >>> round(all_apart_probability(2), 4), all_apart_probability(17)
    (0.9375, 0.0)
    """
    return math.prod(1.0 - taken / SLOTS for taken in range(min(tag_count, SLOTS + 1)))


def scan_period_s(*, tags_per_scan: str, tags_in_view: int, host_s: float = HOST_S) -> float:
    """Return the time that one scan of one antenna takes with its host, s.

    Parameters
    ----------
    tags_per_scan
        ``"one"`` for a reader that asks in one slot, ``"several"`` for 16 slots.
    tags_in_view
        How many tags the scan must have room for; 1 where ``tags_per_scan`` is ``"one"``.
    host_s
        What the host adds.

    Raises
    ------
    ValueError
        If such a reader cannot read so many tags in a scan.

    Examples
    --------
    >>> round(1000.0 * scan_period_s(tags_per_scan="several", tags_in_view=4), 1)
    36.1
    """
    if tags_per_scan == "several":
        return slotted_inventory_s(tags_in_view) + host_s
    if tags_in_view != 1:
        raise ValueError(f"a reader of one tag a scan reads none where {tags_in_view} are in view")
    return single_tag_inventory_s() + host_s
