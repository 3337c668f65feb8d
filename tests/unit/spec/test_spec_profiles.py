"""Reader profiles of a spec: a period that is stated, and one that follows from a protocol."""

import pytest

from layoutopt.errors import InvalidInput
from layoutopt.readers.inventory import scan_period_s, single_tag_inventory_s, slotted_inventory_s
from layoutopt.spec.writing import write_spec

HALL = """
[site]
floor = [[0, 0], [8, 0], [8, 5], [0, 5]]
[parts]
reader_profile = """


@pytest.mark.parametrize(
    ("table", "period_s"),
    [
        ('{ name = "own" }', 0.05),
        ('{ scan_period = "40 ms" }', 0.04),
        ('{ protocol = "iso15693" }', slotted_inventory_s(4) + 0.01),
        ('{ protocol = "iso15693", tags_in_view = 1 }', slotted_inventory_s(1) + 0.01),
        ('{ protocol = "iso15693", tags_in_view = 16, host_time = "0 ms" }', slotted_inventory_s(16)),
        ('{ protocol = "iso15693", tags_per_scan = "one" }', single_tag_inventory_s() + 0.01),
        ('{ protocol = "iso15693", tags_per_scan = "one", tags_in_view = 1 }', single_tag_inventory_s() + 0.01),
    ],
)
def test_the_period_of_a_profile(read, tmp_path, table, period_s):
    """Stated, or inventory and host together; the frozen copy keeps it to the last bit."""
    spec = read(HALL + table)
    assert spec.reader_profile.scan_period_s == period_s
    write_spec(spec, tmp_path / "copy.toml")
    assert read((tmp_path / "copy.toml").read_text(encoding="utf-8")).reader_profile == spec.reader_profile


@pytest.mark.parametrize(
    ("table", "key", "words"),
    [
        ('{ protocol = "iso15693", scan_period = "40 ms" }', "scan_period", "Keep scan_period or protocol"),
        ("{ tags_in_view = 4 }", "tags_in_view", 'Write protocol = "iso15693"'),
        ('{ host_time = "10 ms" }', "host_time", 'Write protocol = "iso15693"'),
        ('{ protocol = "iso15693", tags_in_view = 17 }', "tags_in_view", "16"),
        ('{ protocol = "iso14443" }', "protocol", "iso15693"),
        ('{ protocol = "iso15693", tags_per_scan = "one", tags_in_view = 2 }', "tags_in_view", "tags_in_view = 1"),
    ],
)
def test_profiles_that_contradict_themselves_are_refused(read, table, key, words):
    """With the key and what would be right."""
    with pytest.raises(InvalidInput) as caught:
        read(HALL + table)
    assert f"parts.reader_profile.{key}" in str(caught.value)
    assert words in str(caught.value)


def test_a_reader_of_one_tag_has_no_room_for_two():
    """The function says so itself."""
    with pytest.raises(ValueError, match="reads none where 2 are in view"):
        scan_period_s(tags_per_scan="one", tags_in_view=2)


def test_the_speed_of_readers_can_be_demanded(read, tmp_path):
    """At least so fast, in m/s; the share that is passed without a read is limited from above."""
    goal = '\n[goal]\nlimits = ["speed_limit >= 0.3 m/s", "missed_crossing_share <= 5 %"]'
    spec = read(HALL + '"commercial"' + goal)
    assert [(limit.score, limit.lower, limit.upper) for limit in spec.own_limits] == [
        ("speed_limit", 0.3, None),
        ("missed_crossing_share", None, 0.05),
    ]
    write_spec(spec, tmp_path / "copy.toml")
    assert read((tmp_path / "copy.toml").read_text(encoding="utf-8")).own_limits == spec.own_limits


@pytest.mark.parametrize(
    ("limit", "words"),
    [
        ("speed_limit <= 0.3 m/s", "more is better"),
        ("speed_limit >= 300 mm", "speed"),
        ("dock.speed_limit >= 0.3 m/s", "not known for a zone alone"),
    ],
)
def test_wrong_demands_on_speed_are_refused(read, limit, words):
    """Senses, units and zones are checked."""
    zone = '\n[[site.zone]]\nname = "dock"\nregion = [[0, 0], [1, 0], [1, 1], [0, 1]]\n'
    with pytest.raises(InvalidInput, match=words):
        read(HALL + f'"commercial"\n[goal]\nlimits = ["{limit}"]' + zone)
