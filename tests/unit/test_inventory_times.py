"""Inventory times of ISO 15693 against bits counted by hand, and slots against draws."""

import itertools

import numpy as np
import pytest

from layoutopt.readers.inventory import (
    SLOTS,
    all_apart_probability,
    expected_singles,
    single_tag_inventory_s,
    slotted_inventory_s,
)


def test_one_tag_in_one_slot():
    """Request 1.62, reply 3.93, and the pauses: 6.2 ms, 160 reads a second at most."""
    assert 1e3 * single_tag_inventory_s() == pytest.approx(1.62 + 0.323 + 3.93 + 0.309, abs=0.01)
    assert 1e3 * single_tag_inventory_s() == pytest.approx(6.2, abs=0.05)
    assert 1.0 / single_tag_inventory_s() == pytest.approx(160.0, abs=2.0)


@pytest.mark.parametrize(("tags", "round_ms"), [(1, 13.9), (2, 17.9), (3, 22.0), (4, 26.1), (6, 34.3), (8, 42.5)])
def test_rounds_of_16_slots(tags, round_ms):
    """A slot with a tag takes a reply, an empty one about half a millisecond."""
    assert 1e3 * slotted_inventory_s(tags) == pytest.approx(round_ms, abs=0.05)


def test_every_tag_takes_its_reply_and_no_empty_slot():
    """The time grows by the same for every tag, up to one in each slot."""
    grown = np.diff([slotted_inventory_s(tags) for tags in range(SLOTS + 1)])
    assert grown == pytest.approx([grown[0]] * SLOTS)
    assert 1e3 * grown[0] == pytest.approx(4.085, abs=0.005)


@pytest.mark.parametrize("tags", [-1, 17])
def test_a_round_has_16_slots(tags):
    """More tags than slots have no round in which each is alone."""
    with pytest.raises(ValueError, match="16 slots"):
        slotted_inventory_s(tags)


def test_tags_that_share_a_slot():
    """Mean singles and the chance that all are apart, against every way in which three tags may fall."""
    ways = list(itertools.product(range(SLOTS), repeat=3))
    singles = [sum(way.count(slot) == 1 for slot in way) for way in ways]
    assert expected_singles(3) == pytest.approx(np.mean(singles))
    assert all_apart_probability(3) == pytest.approx(np.mean([found == 3 for found in singles]))
    assert [round(expected_singles(tags), 2) for tags in (0, 1, 2, 8)] == [0.0, 1.0, 1.88, 5.09]
    assert all_apart_probability(0) == all_apart_probability(1) == 1.0
    assert all_apart_probability(SLOTS + 5) == 0.0
