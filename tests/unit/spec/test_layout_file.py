import dataclasses
import itertools
import re

import numpy as np
import pytest

from layoutopt.errors import InvalidInput
from layoutopt.layout import EditKind, FloorTags, Layout, TagEdit, TagPattern, Transponder, ZonePattern
from layoutopt.patterns.listed import listed as listed_tags
from layoutopt.protocols import Mount
from layoutopt.readers.listed import listed as listed_readers
from layoutopt.spec.layout_file import read_filed_layout, read_layout, write_layout
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in, template

SHORT = """
[site]
floor = [[0, 0], [8, 0], [8, 5], [0, 5]]
[layout.readers]
family = "cross"
count = 8
antenna_side = "60 mm"
antenna_height = "24 mm"
[[layout.tags]]
zone = ""
family = "square"
pitch = "100 mm"
"""


@pytest.fixture(scope="module")
def ward():
    return read_spec(built_in())


@pytest.fixture
def save(tmp_path):
    def to(text):
        path = tmp_path / "layout.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return to


def test_layouts_of_a_space_are_rebuilt_bit_by_bit(ward, tmp_path):
    """Layouts of every family come back with the same key and, as a spec of their own, the same problem."""
    layouts = list(ward.space.layouts())
    for layout in layouts[:: len(layouts) // 23]:
        write_layout(layout, ward, tmp_path / "one.toml")
        spec, again = read_layout(tmp_path / "one.toml")
        assert again == layout
        assert spec.site == ward.site
    assert spec.problem() == ward.problem()


def test_what_no_family_rebuilds_is_listed(ward, tmp_path):
    """Edited tags, turned zones, listed points, sheared cells and several groups come back as they were."""
    mount = ward.mounts[0][0]
    sheared = TagPattern(
        name="own",
        points_m=np.array([[0.01, 1 / 3]]),
        cell_m=np.array([[0.2, 1 / 7], [0.0, 0.3]]),
        parameters={"n": 1},
    )
    tags = FloorTags(
        zones=(
            ZonePattern(zone="", pattern=listed_tags(points_m=[(1.0, 4.0), (2.5, 4.0 + 1 / 3)])),
            ZonePattern(zone="dock", pattern=sheared, origin_m=(1 / 9, 0.5), angle_rad=0.3),
        ),
        edits=(
            TagEdit(kind=EditKind.MOVED, from_m=(1.0, 4.0), to_m=(1.0, 4.0 + 1 / 7)),
            TagEdit(kind=EditKind.DROPPED, from_m=(2.5, 4.0 + 1 / 3)),
        ),
        tag_part="disc",
        tag_size_m=(0.025, 0.025),
        placement_sigma_m=1 / 300,
    )
    group = listed_readers(points_m=[(0.1, 1 / 30), (-0.1, 0.05)], mount=mount)
    other = next(ward.space.readers[-1].options())
    layout = Layout(floor_tags=tags, readers=(group, other))
    write_layout(layout, ward, tmp_path / "odd.toml")
    assert read_layout(tmp_path / "odd.toml")[1] == layout


def test_a_short_table_by_hand_is_enough(save):
    """Family, parameters and the antenna make a layout; all else comes from the spec beside it."""
    spec, layout = read_layout(save(SHORT))
    assert layout.label == "cross 8 × 60 mm, square 100 mm"
    assert layout.readers[0].profile == spec.reader_profile
    assert layout.floor_tags.tag_part == spec.space.tag_part
    assert layout.floor_tags.tag_size_m == spec.space.tag_size_m
    mount = Mount(antenna=spec.mounts[0][0].antenna, height_m=0.024, profile=spec.reader_profile)
    assert layout.readers[0].poses[0, 2] == mount.height_m


def test_an_example_with_a_layout_is_still_a_spec(save):
    """A layout table does not disturb a reader of the spec alone."""
    text = template() + SHORT[SHORT.index("[layout.readers]") :]
    assert read_spec(save(text)).space.size == read_spec(built_in()).space.size
    assert read_layout(save(text))[1].label == "cross 8 × 60 mm, square 100 mm"


def test_a_changed_layout_is_noticed(ward, save, tmp_path):
    """A file whose key is not that of its layout is refused, and read once the key is gone."""
    layout = next(itertools.islice(ward.space.layouts(), 5, 6))
    write_layout(layout, ward, tmp_path / "one.toml")
    head, table = (tmp_path / "one.toml").read_text(encoding="utf-8").split("[layout]")
    edited = table.replace('antenna_height = "20 mm"', 'antenna_height = "21 mm"')
    assert edited != table
    with pytest.raises(InvalidInput, match=r"layout\.key.*changed since it was written"):
        read_layout(save(f"{head}[layout]{edited}"))
    without_key = re.sub(r'key = "[0-9a-f]+"\n', "", edited)
    assert read_layout(save(f"{head}[layout]{without_key}"))[1].readers[0].poses[0, 2] == 0.021


def test_the_mark_of_a_quick_look_survives_and_changes_no_layout(ward, tmp_path):
    """A comment on top and a key; what is left without them is the unmarked file, byte by byte."""
    layout = next(ward.space.layouts())
    plain, marked = tmp_path / "plain.toml", tmp_path / "marked.toml"
    write_layout(layout, ward, plain)
    write_layout(layout, ward, marked, quick_look=True)
    filed = read_filed_layout(marked)
    assert (filed.quick_look, read_filed_layout(plain).quick_look) == (True, False)
    assert filed.layout.key == layout.key
    text = marked.read_text(encoding="utf-8")
    assert text.startswith("# QUICK LOOK, NOT FOR INSTALLATION: ")
    comment, gap, rest = text.partition("# Written by layoutopt")
    assert all(line.startswith("#") for line in comment.splitlines())
    assert rest.count("quick_look = true\n") == 1
    assert f"{gap}{rest}".replace("quick_look = true\n", "") == plain.read_text(encoding="utf-8")


def test_a_mark_that_is_neither_true_nor_false_is_refused(save):
    """A mark that is taken back with false is none."""
    text = SHORT.replace("[layout.readers]", "[layout]\nquick_look = {}\n[layout.readers]")
    assert not read_filed_layout(save(text.format("false"))).quick_look
    with pytest.raises(InvalidInput, match=r"layout\.quick_look"):
        read_filed_layout(save(text.format('"no"')))


def test_hybrid_layouts_come_back_by_their_key(ward, tmp_path):
    """UHF and docking antennas, transponders, tags that are given out; and a floor without any tag."""
    uhf, docking = ward.tracking.antennas(count=3, yaw_rad=1.0 / 3.0, interval_s=0.2), ward.docking.antennas()
    layout = next(ward.space.layouts())
    hybrid = layout.replace(
        readers=(*layout.readers, uhf, docking),
        transponders=(Transponder(name="t", position_m=(1.0 / 3.0, 1.0, 0.5)),),
        target_tags=7,
    )
    for other in (hybrid, hybrid.replace(readers=(docking, uhf)), bare(hybrid)):
        write_layout(other, ward, tmp_path / "t.toml")
        assert read_layout(tmp_path / "t.toml")[1].key == other.key
    text = (tmp_path / "t.toml").read_text(encoding="utf-8")
    (tmp_path / "t.toml").write_text(text.replace('kind = "signal"', 'kind = "sound"'), encoding="utf-8")
    with pytest.raises(InvalidInput, match="'tag_read', 'signal' or 'direction'"):
        read_layout(tmp_path / "t.toml")


def bare(layout):
    """Return a layout without tags on the floor."""
    return layout.replace(floor_tags=dataclasses.replace(layout.floor_tags, zones=()))


@pytest.mark.parametrize(
    ("old", "new", "key", "said"),
    [
        ("count = 8", "cont = 8", "layout.readers.cont", "Did you mean 'count'?"),
        ("count = 8", "count = [4, 8]", "layout.readers", "one value"),
        ("count = 8", "count = 7", "layout.readers", "multiple of four"),
        ('antenna_side = "60 mm"', "", "layout.readers.antenna_side", "missing"),
        ('antenna_side = "60 mm"', 'antenna_side = "60 kg"', "layout.readers.antenna_side", "none of length"),
        ('pitch = "100 mm"', 'pitch = "10 mm"', "layout.tags[0]", "20 mm long"),
        ('pitch = "100 mm"', 'pitch = "0 mm"', "layout.tags[0]", "positive"),
        ('zone = ""', 'zone = "dock"', "layout.tags[0].zone", "no such zone"),
        (
            "[[layout.tags]]",
            "[[layout.edits]]\nkind = 'moved'\nfrom = [1, 1.01]\nto = [1, 1]\n[[layout.tags]]",
            "edits",
            "no tag lies at",
        ),
        ("[[layout.tags]]", "[layout]\nkey = 'abc'\n[[layout.tags]]", "layout.key", "no key of a layout"),
        ('family = "square"', 'family = "hexagonal"', "layout.tags[0].family", "no pattern named"),
    ],
)
def test_faults_of_a_layout_table(save, old, new, key, said):
    """What is wrong in a layout table is said with its key, as in any spec."""
    with pytest.raises(InvalidInput) as caught:
        read_layout(save(SHORT.replace(old, new)))
    assert any(key in str(fault) and said in str(fault) for fault in caught.value.faults)


def test_a_spec_is_no_layout(save):
    """A spec without a layout table is refused with a hint what to name."""
    with pytest.raises(InvalidInput, match=r"no \[layout\]"):
        read_layout(save(SHORT[: SHORT.index("[layout.readers]")]))
