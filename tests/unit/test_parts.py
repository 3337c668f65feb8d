"""Price lists and bills of material."""

import math
import pickle
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.errors import InvalidInput, UnknownName
from layoutopt.layout import FloorTags, Layout, ReaderGroup, ZonePattern
from layoutopt.parts import (
    READER_ITEMS,
    TAG_ITEMS,
    Need,
    Scope,
    bill_of_material,
    bill_of_needs,
    default_prices,
    module_of_antennas,
    needs,
    read_prices,
)
from layoutopt.patterns.square import square
from layoutopt.prices import FINDER_ITEMS, ITEM_KEYS
from layoutopt.readers.profiles import COMMERCIAL, MI2016
from layoutopt.site import Site

OWN = """schema = 1
name = "quotes"
date = 2026-12-01
base = "default-2026"
[items.label]
price = "0.12 EUR"
source = "quote 4711"
"""


def group(count, ports=1, side_m=0.06, profile=COMMERCIAL, slots=None):
    """Return antennas in a row."""
    return ReaderGroup(
        name="row",
        poses=[(0.1 * number, 0.0, 0.02, 0.0) for number in range(count)],
        antenna=SphereAntenna(side_m=side_m),
        profile=profile,
        slots=slots or tuple(number % ports for number in range(count)),
        antennas_per_module=ports,
    )


def layout(*groups, tag_part="label"):
    """Return a layout with the square pattern of 0.1 m."""
    floor_tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.1)),), tag_part=tag_part)
    return Layout(floor_tags=floor_tags, readers=groups)


def written(tmp_path, text):
    """Write a price list and return its path."""
    path = tmp_path / "prices.toml"
    path.write_text(text, encoding="utf-8")
    return path


def quantities(candidate, tag_count=100, robot_count=1):
    """Return what a layout takes, by item."""
    return {need.item: need.quantity for need in needs(candidate, tag_count, robot_count)}


def lines(bill, scope):
    """Return quantity and total of the lines of a scope, by item and description."""
    return {
        (line.item, line.description): (line.quantity, line.total_eur)
        for line in bill.lines
        if line.scope is scope
    }


def test_the_default_list_is_complete():
    """Every item has a price, a source and a date; tags have a size and a time to place them."""
    prices = default_prices()
    assert set(prices.items) == set(ITEM_KEYS)
    assert all(price.source and price.date for price in prices.items.values())
    assert all(prices.items[tag].size_m and prices.items[tag].labour_s > 0 for tag in TAG_ITEMS)
    assert (prices.name, prices.currency) == ("default-2026", "EUR")


def test_the_default_list_holds_the_numbers_of_its_sources():
    """The prices, times and sizes from which the default list was made, in the order of its items."""
    prices = default_prices().items
    names = [*TAG_ITEMS, *READER_ITEMS, "antenna", "multiplexer_4", "multiplexer_8", "labour"]
    assert [prices[name].price_eur for name in names] == [
        0.25,
        0.60,
        1.80,
        3.0,
        25.0,
        450.0,
        6.0,
        60.0,
        60.0,
        45.0,
    ]
    assert [prices[name].labour_s for name in ("label", "puck", "survey", "survey_tag")] == [90, 360, 10800, 60]
    assert (prices["label"].spare_share, prices["antenna"].base_side_m) == (0.02, 0.06)


def test_a_bill_reckoned_by_hand():
    """100 labels, two robots with two modules of four 60 mm antennas each: every line by hand."""
    candidate = layout(group(8, ports=4))
    site = Site(name="room", floor=box(0, 0, 1.1, 1.1))
    tag_map = candidate.floor_tags.lay_on(site)
    assert len(tag_map) == 100
    bill = bill_of_material(candidate, tag_map, 2, default_prices())
    text = {name: price.description for name, price in default_prices().items.items()}
    board = text["antenna"] + ", 60 mm × 60 mm"
    assert lines(bill, Scope.FLOOR) == {("label", text["label"]): (100, 25.0)}
    assert lines(bill, Scope.ROBOT) == {
        ("reader_module", text["reader_module"]): (4, 100.0),
        ("multiplexer_4", text["multiplexer_4"]): (4, 240.0),
        ("antenna", board): (16, 96.0),
    }
    assert lines(bill, Scope.SPARES) == {
        ("label", text["label"]): (2, 0.5),
        ("reader_module", text["reader_module"]): (1, 25.0),
    }
    hours = {description: quantity for (_, description), (quantity, _) in lines(bill, Scope.LABOUR).items()}
    assert hours == {
        f"place and scan: {text['label']}": pytest.approx(2.5),
        f"mount: {text['reader_module']}": pytest.approx(4 / 3),
        f"mount: {text['multiplexer_4']}": pytest.approx(2 / 3),
        f"mount: {board}": pytest.approx(8 / 3),
        f"carry out: {text['survey']}": 3.0,
        f"carry out: {text['survey_tag']}": pytest.approx(5 / 3),
    }
    assert bill.total_of(Scope.LABOUR) == pytest.approx(112.5 + 60 + 30 + 120 + 135 + 75)
    assert bill.total_eur == pytest.approx(25 + 436 + 25.5 + 532.5)


def test_the_floor_is_paid_once_and_readers_for_every_robot():
    """Four robots need four times the readers of one and the same floor."""
    candidate = layout(group(8, ports=4))
    one, four = (bill_of_needs(needs(candidate, 500, n), n, default_prices()) for n in (1, 4))
    assert four.total_of(Scope.FLOOR) == one.total_of(Scope.FLOOR)
    assert four.total_of(Scope.ROBOT) == 4 * one.total_of(Scope.ROBOT)


def test_independent_readers_have_a_module_each_and_no_multiplexer():
    """The profile of mi2016 takes 96 modules for 96 antennas, at the same prices."""
    assert quantities(layout(group(96, side_m=0.03, profile=MI2016))) == {
        "label": 100,
        "reader_module": 96,
        "antenna": 96,
        "survey": 1,
        "survey_tag": 100,
    }


@pytest.mark.parametrize(
    ("count", "ports", "small", "large"),
    [
        (4, 1, 0, 0),
        (1, 8, 0, 0),
        (2, 2, 1, 0),
        (8, 4, 2, 0),
        (5, 4, 1, 0),
        (5, 8, 0, 1),
        (16, 8, 0, 2),
        (9, 8, 0, 1),
    ],
)
def test_modules_with_several_antennas_need_a_multiplexer(count, ports, small, large):
    """None for one antenna, 4 ports for up to four, 8 for more; a module left with one antenna needs none."""
    found = quantities(layout(group(count, ports=ports)))
    assert (found.get("multiplexer_4", 0), found.get("multiplexer_8", 0)) == (small, large)


def test_no_multiplexer_has_nine_ports():
    """What cannot be bought is not priced."""
    with pytest.raises(ValueError, match="no multiplexer with more than 8 ports"):
        needs(layout(group(9, ports=9)), 100, 1)


@given(st.integers(1, 8), st.integers(1, 30), st.randoms(use_true_random=False))
def test_a_module_has_one_antenna_a_slot(ports, count, random):
    """No two antennas of a module share a scan slot, and there are as many modules as the group says."""
    slots = tuple(random.randrange(ports) for _ in range(count))
    row = group(count, ports=ports, slots=slots)
    modules = module_of_antennas(row)
    assert len(set(zip(modules, slots, strict=True))) == count
    assert set(modules) == set(range(row.module_count))


@pytest.mark.parametrize(("side_m", "price_eur"), [(0.03, 6.0), (0.06, 6.0), (0.12, 24.0), (0.08, 10.67)])
def test_a_large_antenna_costs_by_its_area(side_m, price_eur):
    """Up to 60 mm the base price, above it in proportion to the area, rounded to the cent."""
    bill = bill_of_needs(needs(layout(group(1, side_m=side_m)), 0, 1), 1, default_prices())
    assert [line.price_eur for line in bill.lines if line.item == "antenna"] == [price_eur]


def test_groups_of_one_side_share_a_line():
    """Two groups of the same antenna are bought together; another side is another line."""
    found = needs(layout(group(2), group(3), group(1, side_m=0.03)), 10, 2)
    assert [(need.side_m, need.quantity) for need in found if need.item == "antenna"] == [(0.03, 2), (0.06, 10)]


@pytest.mark.parametrize(("count", "spares"), [(0, 0), (1, 1), (50, 1), (51, 2), (9401, 189)])
def test_spares_are_rounded_up(count, spares):
    """Two of a hundred tags, and never less than the share: 2 % of 50 is exactly one."""
    bill = bill_of_needs(needs(layout(group(1)), count, 1), 1, default_prices())
    assert (
        sum(line.quantity for line in bill.lines if line.scope is Scope.SPARES and line.item == "label") == spares
    )


@given(st.integers(0, 100_000), st.integers(1, 50), st.integers(1, 12), st.floats(0.0, 1000.0))
def test_printed_lines_add_up_to_the_printed_total(tags, robots, antennas, price_eur):
    """To the cent, for any price: totals of scopes and the grand total are sums of what the lines say."""
    prices = default_prices().replace_item("label", price_eur=price_eur)
    bill = bill_of_needs(needs(layout(group(antennas, ports=4)), tags, robots), robots, prices)
    printed = sum(Fraction(f"{line.total_eur:.2f}") for line in bill.lines)
    assert printed == Fraction(f"{bill.total_eur:.2f}")
    assert printed == sum(Fraction(f"{bill.total_of(scope):.2f}") for scope in Scope)
    for line in bill.lines:
        assert line.total_eur == pytest.approx(line.quantity * line.price_eur, abs=0.0051)


def test_half_a_cent_is_rounded_up():
    """Three labels at 0.125 EUR cost 0.38 EUR: the price is the decimal number that was written."""
    prices = default_prices().replace_item("label", price_eur=0.125, spare_share=0.0, labour_s=0.0)
    bill = bill_of_needs((Need(item="label", scope=Scope.FLOOR, quantity=3),), 1, prices)
    assert [line.total_eur for line in bill.lines] == [0.38]
    tenth = default_prices().replace_item("label", price_eur=0.145, spare_share=0.0, labour_s=0.0)
    assert bill_of_needs((Need(item="label", scope=Scope.FLOOR, quantity=1),), 1, tenth).total_eur == 0.15


def test_free_things_stay_on_the_bill():
    """A tag that costs nothing is still listed; survey without a fee is listed as labour only."""
    prices = default_prices().replace_item("label", price_eur=0.0)
    bill = bill_of_needs(needs(layout(group(1)), 10, 1), 1, prices)
    assert [line.total_eur for line in bill.lines if line.scope is Scope.FLOOR] == [0.0]
    assert not [line for line in bill.lines if line.item.startswith("survey")]
    paid = bill_of_needs(needs(layout(group(1)), 10, 1), 1, prices.replace_item("survey", price_eur=200.0))
    assert [line.total_eur for line in paid.lines if line.item == "survey"] == [200.0]


@pytest.mark.parametrize("item", [*TAG_ITEMS, *READER_ITEMS, "antenna", "multiplexer_4", "labour"])
def test_a_dearer_item_never_makes_a_cheaper_layout(item):
    """Double one price: the total grows if the item is used, and stays if it is not."""
    candidate = layout(group(8, ports=4))
    found = needs(candidate, 100, 2)
    prices = default_prices()
    dearer = prices.replace_item(item, price_eur=2 * prices.items[item].price_eur)
    before, after = (bill_of_needs(found, 2, each).total_eur for each in (prices, dearer))
    used = item in {need.item for need in found} or item == "labour"
    assert (after > before) is used
    assert after >= before


def test_what_no_list_holds_is_refused():
    """Unknown tags and readers, and no robot, have no price, and none is invented."""
    with pytest.raises(ValueError, match=r"no tag named 'lable'. Did you mean 'label'?"):
        needs(layout(group(1), tag_part="lable"), 1, 1)
    with pytest.raises(ValueError, match="no reader named 'antenna'"):
        needs(layout(group(1)), 1, 1, reader_part="antenna")
    with pytest.raises(ValueError, match="at least one robot"):
        needs(layout(group(1)), 1, 0)


def test_an_own_list_replaces_what_it_names(tmp_path):
    """With a base, one item changes and all others stay; time and size of the item stay too."""
    own, base = read_prices(written(tmp_path, OWN)), default_prices()
    assert (own.name, own.date) == ("quotes", "2026-12-01")
    label = own.items["label"]
    assert (label.price_eur, label.source, label.date) == (0.12, "quote 4711", "2026-12-01")
    assert (label.labour_s, label.size_m) == (base.items["label"].labour_s, base.items["label"].size_m)
    assert {name: item for name, item in own.items.items() if name != "label"} == {
        name: item for name, item in base.items.items() if name != "label"
    }


def test_an_own_list_without_base_names_everything(tmp_path):
    """Without a base nothing is filled in: missing items are one fault, missing keys of an item one each."""
    path = written(tmp_path, OWN.replace('base = "default-2026"\n', ""))
    with pytest.raises(InvalidInput) as caught:
        read_prices(path)
    faults = {fault.place.split(" ")[1]: str(fault) for fault in caught.value.faults}
    assert set(faults) == {"items", *(f"items.label.{key}" for key in ("labour", "spare", "size"))}
    missing = [name for name in ITEM_KEYS if name not in ("label", *FINDER_ITEMS)]
    assert all(name in faults["items"] for name in missing)
    assert 'base = "default-2026"' in faults["items"]


def test_a_copy_of_the_default_list_reads_as_such(tmp_path):
    """The list that comes with layoutopt is complete by its own rules."""
    from importlib import resources

    text = (resources.files("layoutopt") / "prices" / "default-2026.toml").read_text(encoding="utf-8")
    assert read_prices(written(tmp_path, text)) == default_prices()


def test_lists_are_known_by_name():
    """An unknown name is answered with the known ones."""
    with pytest.raises(UnknownName, match="Did you mean 'default-2026'"):
        default_prices("default-2025")


def test_lists_travel_to_workers_and_differ_by_content():
    """A list survives pickling; one price more or less is another list."""
    prices = default_prices()
    assert pickle.loads(pickle.dumps(prices)) == prices
    assert prices.replace_item("disc", price_eur=0.61) != prices


@pytest.mark.parametrize(
    "change", [{"price_eur": -1.0}, {"price_eur": math.nan}, {"labour_s": np.inf}, {"spare_share": -0.1}]
)
def test_prices_are_finite_and_not_negative(change):
    """Also those that a program makes."""
    with pytest.raises(ValueError, match="finite and not negative"):
        default_prices().replace_item("label", **change)
