"""The table [placement]: read, frozen and refused key by key."""

import pytest

from layoutopt.errors import InvalidInput
from layoutopt.spec.reading import read_spec
from layoutopt.spec.writing import write_spec

FULL = """
[placement]
slots = "grid"
pitch = "70 mm"
spacing = "15 cm"
tags_per_tile = 3
installed = [[0.5, 0.5], ["2 m", 1]]
forbidden = [[1, 1]]
required = [[1.5, 1]]
unserved = "0.5 %"
stages = [["dock"], [""]]
reader = 2
demand = [
    { zone = "dock", length = "0.4 m", tags = 2, along = "everywhere", without = [] },
    { length = "2 m" },
]
"""


def _read(tmp_path, text):
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    return read_spec(path)


def test_every_key_is_read_in_si(tmp_path, tiny_text):
    """Lengths in metres, shares below one, zones without tags left out unless said otherwise."""
    found = _read(tmp_path, tiny_text + FULL).placement
    assert (found.slots, found.pitch_m, found.spacing_m, found.tags_per_tile) == ("grid", 0.07, 0.15, 3)
    assert (found.installed_m, found.forbidden_m) == (((0.5, 0.5), (2.0, 1.0)), ((1.0, 1.0),))
    assert found.required_m == ((1.5, 1.0),)
    assert (found.unserved_share, found.stages, found.reader) == (0.005, (("dock",), ("",)), 2)
    first, second = found.demands
    assert (first.zone, first.length_m, first.tags, first.along_routes, first.without) == (
        "dock",
        0.4,
        2,
        False,
        (),
    )
    assert (second.zone, second.tags, second.along_routes, second.without) == ("", 1, True, ("plate",))


@pytest.mark.parametrize(
    "table",
    [
        "",
        FULL,
        '[placement]\nslots = [[1, 1], [1.2, "1.1 m"]]\naim = "gap"\nbudget = "300 EUR"',
        '[placement]\naim = "front"',
        '[placement]\nslots = "joints"\naim = "coverage"\nbudget = "0.5 EUR"',
    ],
)
def test_the_frozen_copy_asks_the_same(tmp_path, tiny_text, table):
    """Written and read again, nothing has changed."""
    spec = _read(tmp_path, tiny_text + table)
    write_spec(spec, tmp_path / "frozen.toml")
    assert read_spec(tmp_path / "frozen.toml").placement == spec.placement


@pytest.mark.parametrize(
    ("line", "place", "words"),
    [
        ('slots = "joint"', "placement.slots", "Did you mean 'joints'"),
        ("slots = []", "placement.slots", "or a list of points"),
        ("slots = [[1, 1], [1]]", "placement.slots[1]", "x and y"),
        ("slots = [[1, 1], [3.5, 2.5]]", "placement.slots[1]", "no tag may lie here"),
        ("slots = [[1, 1], [1, 1]]", "placement.slots[1]", "stands twice"),
        ('pitch = "0 mm"', "placement.pitch", "more than 0"),
        ('pitch = "1 mm"', "placement.pitch", "slots"),
        ('slots = "joints"\npitch = "50 mm"', "placement.pitch", "only a grid has a pitch"),
        ('spacing = "-1 mm"', "placement.spacing", "at least 0"),
        ("tags_per_tile = 0", "placement.tags_per_tile", "greater than or equal to 1"),
        ("installed = [[9, 9]]", "placement.installed[0]", "no tag may lie here"),
        ("installed = [[1, 1], [1.001, 1]]", "placement.installed[1]", "overlap"),
        ("forbidden = [1]", "placement.forbidden[0]", "x and y"),
        ("required = [1]", "placement.required[0]", "x and y"),
        ('stages = [[""]]\naim = "front"', "placement.stages", "planned for the least cost"),
        ('unserved = "100 %"', "placement.unserved", "nothing is demanded"),
        ('aim = "price"', "placement.aim", "'cost'"),
        ('aim = "coverage"', "placement.aim", "needs a budget"),
        ('aim = "gap"\nbudget = "9 EUR"\ndemand = { length = "0 m" }', "placement.aim", "every length is 0"),
        ('budget = "0 EUR"', "placement.budget", "more than 0"),
        ('stages = [["dok"], [""]]', "placement.stages[0][0]", "Did you mean 'dock'"),
        ('stages = [["dock"]]', "placement.demand[0]", "no stage equips the whole floor"),
        ('stages = [["", ""]]', "placement.stages[0][1]", "two stages"),
        ('stages = [["dock"], [""]]', "placement.stages[0]", "nothing is demanded up to this stage"),
        ('stages = [[""]]\nbudget = "9 EUR"', "placement.stages", "without a budget"),
        ("reader = 9", "placement.reader", "4 reader options"),
        ("demand = []", "placement.demand", "needs 1"),
        ('demand = { zone = "duck" }', "placement.demand[0].zone", "Did you mean 'dock'"),
        ('demand = { zone = "plate" }', "placement.demand[0].zone", "no tag may lie there"),
        ('demand = { without = ["plat"] }', "placement.demand[0].without[0]", "Did you mean 'plate'"),
        ("demand = { tags = 0 }", "placement.demand[0].tags", "greater than or equal to 1"),
        ('demand = { length = "-1 m" }', "placement.demand[0].length", "at least 0"),
        ('demand = { along = "walls" }', "placement.demand[0].along", "'routes'"),
        ("demands = 1", "placement.demands", "Did you mean 'demand'"),
    ],
)
def test_a_bad_value_is_refused_at_its_key(tmp_path, tiny_text, line, place, words):
    """Place, fault and repair are told."""
    with pytest.raises(InvalidInput) as refused:
        _read(tmp_path, f"{tiny_text}[placement]\n{line}\n")
    text = str(refused.value)
    assert place in text
    assert words in text


def test_faults_are_told_all_at_once(tmp_path, tiny_text):
    """Three keys, three faults."""
    with pytest.raises(InvalidInput) as refused:
        _read(tmp_path, tiny_text + '[placement]\naim = "gap"\nreader = 9\ninstalled = [[9, 9]]\n')
    assert len(refused.value.faults) == 3


def test_joints_and_tile_limits_need_tiles(tmp_path, tiny_text):
    """Without a tiling both are refused."""
    bare = tiny_text.replace('tiling = { size = "0.5 m" }\n', "")
    with pytest.raises(InvalidInput) as refused:
        _read(tmp_path, bare + '[placement]\nslots = "centres"\ntags_per_tile = 1\n')
    assert str(refused.value).count("no floor tiles") == 2
