"""The cost of a layout as an objective."""

import pickle

import pytest
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import FloorTags, Layout, ReaderGroup, ZonePattern
from layoutopt.parts import Scope, bill_of_material, default_prices
from layoutopt.patterns.square import square
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.site import Site
from objectives.cost import Cost, cost_split


def layout(pitch_m=0.1, antennas=4, ports=4):
    """Return a layout with a row of antennas."""
    group = ReaderGroup(
        name="row",
        poses=[(0.1 * number, 0.0, 0.02, 0.0) for number in range(antennas)],
        antenna=SphereAntenna(side_m=0.06),
        profile=COMMERCIAL,
        slots=tuple(number % ports for number in range(antennas)),
        antennas_per_module=ports,
    )
    floor_tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=pitch_m)),))
    return Layout(floor_tags=floor_tags, readers=(group,))


def scenario(width_m=2.0):
    """Return a scenario on a floor of that width and 1.1 m depth."""
    return Scenario(
        name="design",
        role=Role.DESIGN,
        site=Site(name="room", floor=box(0, 0, width_m, 1.1)),
        robot=Robot(outline_m=[(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)]),
    )


def test_the_score_is_the_total_of_the_bill():
    """Objective and bill of material are one and the same reckoning."""
    cost, world = Cost(prices=default_prices(), robot_count=3), scenario()
    bill = bill_of_material(layout(), layout().floor_tags.lay_on(world.site), 3, default_prices())
    score = cost(layout(), world, None)["cost"]
    assert score.value == bill.total_eur
    assert (score.unit, score.exact) == ("EUR", True)
    assert cost.bill(layout(), world) == bill


def test_a_known_cost():
    """190 labels on 2.0 m by 1.1 m (19 by 10) and one robot with one module for four antennas: 726.25 EUR.

    Floor 47.50; module 25, multiplexer 60, antennas 24; spares 4 × 0.25 + 25; labour (190 × 1.5 + 20 + 10 + 40 +
    180 + 190) min at 0.75 EUR.
    """
    expected = 47.50 + 25 + 60 + 24 + 1 + 25 + (285 + 20 + 10 + 40 + 180 + 190) * 0.75
    assert (
        Cost(prices=default_prices(), robot_count=1)(layout(), scenario(), None)["cost"].value
        == expected
        == 726.25
    )


def test_the_split_adds_up():
    """Floor, readers, spares and labour are all there is."""
    cost, world = Cost(prices=default_prices(), robot_count=2), scenario()
    split = cost_split(cost, layout(), world)
    assert set(split) == set(Scope)
    assert sum(split.values()) == pytest.approx(cost(layout(), world, None)["cost"].value)
    assert all(value > 0 for value in split.values())


@pytest.mark.parametrize(
    ("cheaper", "dearer"),
    [
        ({"pitch_m": 0.2}, {"pitch_m": 0.1}),
        ({"antennas": 4}, {"antennas": 8}),
        ({"antennas": 1, "ports": 1}, {"antennas": 4, "ports": 1}),
    ],
)
def test_more_of_anything_costs_more(cheaper, dearer):
    """Denser tags and more antennas are never free."""
    cost = Cost(prices=default_prices(), robot_count=1)
    assert (
        cost(layout(**cheaper), scenario(), None)["cost"].value
        < cost(layout(**dearer), scenario(), None)["cost"].value
    )


def test_a_larger_floor_costs_more():
    """The same layout on a larger site has more tags."""
    cost = Cost(prices=default_prices(), robot_count=1)
    assert cost(layout(), scenario(2.0), None)["cost"].value < cost(layout(), scenario(4.0), None)["cost"].value


def test_industrial_readers_cost_more():
    """The reader is an item of the price list, chosen by name."""
    plain, industrial = (
        Cost(prices=default_prices(), robot_count=1, reader_part=part)
        for part in ("reader_module", "industrial_reader")
    )
    difference = industrial.bill(layout(), scenario()).total_eur - plain.bill(layout(), scenario()).total_eur
    assert difference == 2 * (450 - 25)  # one module and its spare


def test_other_prices_are_another_objective():
    """Equality goes by content, so a front that was priced anew is not taken for the old one."""
    cost = Cost(prices=default_prices(), robot_count=1)
    assert pickle.loads(pickle.dumps(cost)) == cost
    assert cost != Cost(prices=default_prices().replace_item("label", price_eur=0.1), robot_count=1)
    assert cost != Cost(prices=default_prices(), robot_count=2)


def test_a_fleet_has_a_robot():
    """No robot, no cost of one."""
    with pytest.raises(ValueError, match="at least one robot"):
        Cost(prices=default_prices(), robot_count=0)
