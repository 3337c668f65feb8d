"""What an installed floor is within a larger plan: what is kept, what competes, and what does not fit."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from shapely.affinity import translate
from shapely.geometry import box
from small_studies import SPEC

from layoutopt.commissioning.expansion import (
    FLOOR_TOLERANCE_M,
    MOST_INSTALLED,
    equipped_parts,
    expanded_space,
    expansion_of,
    recorded_tags,
    with_records,
)
from layoutopt.errors import InvalidInput
from layoutopt.layout import EditKind, InstalledTags, TagEdit, TagPattern, ZonePattern
from layoutopt.spec.installed_table import installed_table
from layoutopt.spec.layout_file import read_layout, write_layout
from layoutopt.spec.reading import read_spec
from layoutopt.spec.source import MAXIMUM_BYTES
from layoutopt.spec.writing import write_document
from layoutopt.tables.tag_files import tag_header, write_tag_files
from layoutopt.tables.tags import tag_rows

FLOOR = "[[0,0],[3,0],[3,2],[0,2]]"
LARGER = "[[0,0],[5,0],[5,2],[0,2]]"
ZONES = """
zone = [
  { name = "dock", region = [[0,0],[1,0],[1,1],[0,1]] },
  { name = "new", region = [[4,0],[5,0],[5,1],[4,1]] },
]
[robots]"""


@pytest.fixture(scope="module")
def specs(tmp_path_factory):
    """Return a reader of texts as specs."""
    folder = tmp_path_factory.mktemp("specs")

    def read(text):
        path = folder / "spec.toml"
        path.write_text(text, encoding="utf-8")
        return read_spec(path)

    return read


@pytest.fixture(scope="module")
def old(specs):
    """The small spec and its first layout with a tag moved and another missing, its pattern shifted and turned."""
    spec = specs(SPEC)
    layout = next(iter(spec.space.layouts()))
    base = replace(layout.floor_tags.base, origin_m=(0.03, 0.05), angle_rad=0.1)
    tags = replace(layout.floor_tags, zones=(base,))
    first, second = (tuple(place) for place in tags.lay_on(spec.site).xy_m[[7, 11]].tolist())
    edits = (
        TagEdit(kind=EditKind.MOVED, from_m=first, to_m=(first[0] + 0.03, first[1])),
        TagEdit(kind=EditKind.DROPPED, from_m=second),
    )
    return spec, layout.replace(floor_tags=replace(tags, edits=edits))


@pytest.fixture(scope="module")
def new(specs):
    """The small spec on a larger floor."""
    return specs(SPEC.replace(FLOOR, LARGER))


def faults(old_spec, layout, new_spec):
    """Return place and problem of everything that does not fit."""
    with pytest.raises(InvalidInput) as caught:
        expansion_of(old_spec, layout, new_spec)
    return [f"{fault.place}: {fault.problem}" for fault in caught.value.faults]


def test_every_candidate_holds_the_installed_floor(old, new):
    """Places, gaps in the numbers, readers; and new tags lie beyond the old floor, in each pattern of the plan."""
    expansion = expansion_of(*old, new)
    lying = old[1].floor_tags.lay_on(old[0].site)
    assert 12 not in lying.ids
    layouts = list(expanded_space(expansion, new, new_readers=False).layouts())
    assert len(layouts) == 3
    for layout in layouts:
        laid = layout.floor_tags.lay_on(new.site)
        kept = len(lying)
        assert laid.ids[:kept].tolist() == lying.ids.tolist()
        assert np.array_equal(laid.xy_m[:kept], lying.xy_m)
        assert laid.xy_m[kept:, 0].min() > 3.0 + FLOOR_TOLERANCE_M
        assert layout.readers == old[1].readers


def test_the_installed_pattern_goes_on_as_if_the_floor_had_been_one(old, new, specs):
    """Same origin and turn; it competes also where the plan does not list it."""
    sparse = specs(SPEC.replace(FLOOR, LARGER).replace("150 mm", "200 mm"))
    for spec, count in ((new, 3), (sparse, 4)):
        layouts = list(expanded_space(expansion_of(*old, spec), spec, new_readers=False).layouts())
        assert len(layouts) == count
        (same,) = [item for item in layouts if item.floor_tags.base == old[1].floor_tags.base]
        at_once = replace(old[1].floor_tags, edits=()).lay_on(spec.site).xy_m
        beyond = at_once[at_once[:, 0] > 3.0 + FLOOR_TOLERANCE_M]
        lying = old[1].floor_tags.lay_on(old[0].site).xy_m
        apart = [np.hypot(*(lying - place).T).min() >= 0.02 for place in beyond]
        assert same.floor_tags.lay_on(spec.site).to_lay().xy_m == pytest.approx(beyond[apart])


def test_tags_without_a_period_are_kept_but_not_carried_on(old, new):
    """A list of places says nothing of what lies beyond it."""
    xy_m = old[1].floor_tags.lay_on(old[0].site).xy_m
    listed = ZonePattern(zone="", pattern=TagPattern(name="square", points_m=xy_m))
    layout = old[1].replace(floor_tags=replace(old[1].floor_tags, zones=(listed,), edits=()))
    expansion = expansion_of(old[0], layout, new)
    assert expansion.continued is None
    assert {
        item.floor_tags.base.origin_m for item in expanded_space(expansion, new, new_readers=False).layouts()
    } == {(0.0, 0.0)}


def test_readers_of_the_plan_compete_only_if_asked(old, new, specs):
    """By default the robots keep theirs, whatever the plan lists."""
    other = specs(SPEC.replace(FLOOR, LARGER).replace("count = 4", "count = [4, 6]"))
    expansion = expansion_of(*old, other)
    kept = {item.readers for item in expanded_space(expansion, other, new_readers=False).layouts()}
    assert kept == {old[1].readers}
    both = {item.readers for item in expanded_space(expansion, other, new_readers=True).layouts()}
    assert len(both) == 2
    assert old[1].readers in both
    two = replace(old[1], readers=old[1].readers * 2)
    space = expanded_space(expansion_of(old[0], two, new), new, new_readers=False)
    assert {item.readers for item in space.layouts()} == {two.readers}


def test_patterns_of_zones_that_are_equipped_already_are_left_out(old, specs):
    """They would race against themselves; a plan with nothing else is refused."""
    text = SPEC.replace(FLOOR, LARGER).replace("[robots]", ZONES)
    own = '{ family = "square", pitch = "100 mm", zone = "%s" }'
    listed = 'patterns = [{ family = "square", pitch = { from = "150 mm", to = "300 mm", steps = 3 } }]'
    more = specs(text.replace(listed, f"{listed[:-1]}, {own % 'dock'}, {own % 'new'}]"))
    assert set(expanded_space(expansion_of(*old, more), more, new_readers=False).patterns) == {"", "new"}
    none = specs(text.replace(listed, f"patterns = [{own % 'dock'}]"))
    with pytest.raises(
        InvalidInput, match=r"space.patterns: every pattern is for a zone that is equipped already"
    ):
        expanded_space(expansion_of(*old, none), none, new_readers=False)
    with pytest.raises(ValueError, match="has a finish"):
        expanded_space(
            expansion_of(*old, more), replace(more, space=replace(more.space, finish=tuple)), new_readers=False
        )


def test_a_plan_that_does_not_hold_the_old_floor_is_told_where(old, new):
    """A shifted plan is named by the farthest corner; a difference within the tolerance is none."""
    shifted = replace(new, site=replace(new.site, floor=translate(new.site.floor, 0.4)))
    (told,) = faults(*old, shifted)
    assert told == "site.floor: the installed floor reaches 400 mm beyond the plan near (0.000, 0.000) m"
    shaken = replace(new, site=replace(new.site, floor=translate(new.site.floor, 0.8 * FLOOR_TOLERANCE_M)))
    assert expansion_of(*old, shaken).installed.ids[0] == 1


def test_tags_where_the_plan_lets_none_lie_are_named(old, new):
    """By number, place and reason, twenty at most."""
    site = replace(new.site, obstacles=(box(0.0, 0.0, 3.0, 0.3),))
    told = faults(*old, replace(new, site=site))
    assert told[0].startswith("site: installed tag 1 at (")
    assert told[0].endswith("lies where the plan lets none lie: obstacle 1")
    assert len(told) == 21
    assert "more installed tags lie so" in told[-1]


def test_another_tag_reader_or_no_new_floor_is_refused(old, new):
    """All that does not fit, at once."""
    spec, layout = old
    puck = replace(new, space=replace(new.space, tag_part="puck"), reader_part="industrial_reader")
    assert faults(spec, layout, puck) == [
        "parts.tag: 'label' tags are installed, and the plan lays 'puck'",
        "parts.reader: the robots carry 'reader_module' readers, and the plan has 'industrial_reader'",
    ]
    small = replace(new, space=replace(new.space, tag_size_m=(0.015, 0.01)))
    assert faults(spec, layout, small) == [
        "parts.prices: tags of 20 mm × 10 mm are installed, and those of the price list have 15 mm × 10 mm"
    ]
    assert faults(spec, layout, spec) == ["site.floor: the plan adds no floor to the installed one"]
    dropped = [
        TagEdit(kind=EditKind.DROPPED, from_m=tuple(place))
        for place in replace(layout.floor_tags, edits=()).lay_on(spec.site).xy_m.tolist()
    ]
    empty = layout.replace(floor_tags=replace(layout.floor_tags, edits=tuple(dropped)))
    assert faults(spec, empty, new) == ["installed layout: no tag is installed"]


def test_more_tags_than_a_layout_file_holds_are_refused_before_the_search(old, new, monkeypatch):
    """Not after it, when the answer cannot be written."""
    spec, layout = old
    count = len(layout.floor_tags.lay_on(spec.site))
    monkeypatch.setattr("layoutopt.commissioning.expansion.MOST_INSTALLED", count - 1)
    assert faults(spec, layout, new) == [
        f"installed layout: {count} tags are installed, and a layout file lists {count - 1} at most"
    ]


def test_the_most_tags_fit_into_a_layout_file(tmp_path):
    """At places and numbers that take the most digits; a tenth of them takes less than a tenth of the room."""
    xy_m = -np.random.default_rng(0).uniform(100.0, 1000.0, (MOST_INSTALLED // 10, 2))
    installed = InstalledTags(ids=np.arange(len(xy_m)) + 10_000_000, xy_m=xy_m, area=box(0, 0, 1, 1))
    write_document({"layout": {"installed": installed_table(installed)}}, tmp_path / "table.toml")
    assert (tmp_path / "table.toml").stat().st_size < 0.98 * MAXIMUM_BYTES / 10


def test_the_layout_file_reads_back_to_the_last_bit(old, new, tmp_path):
    """Also for an area in parts with holes; and a floor that was expanded can be expanded again."""
    expansion = expansion_of(*old, new)
    holed = expansion.installed.area.difference(box(1, 1, 1.2, 1.2)).difference(box(2, -1, 2.1, 3))
    expansion = replace(expansion, installed=replace(expansion.installed, area=holed))
    layout = next(iter(expanded_space(expansion, new, new_readers=False).layouts()))
    write_layout(layout, new, tmp_path / "expanded.toml")
    spec, again = read_layout(tmp_path / "expanded.toml")
    assert again == layout
    assert [round(part.area, 2) for part in equipped_parts(expansion)] == pytest.approx([4.08, 1.88], abs=0.05)
    largest = replace(new, site=replace(new.site, floor=box(0, 0, 5, 4)))
    twice = expansion_of(spec, again, largest)
    laid = again.floor_tags.lay_on(spec.site)
    assert twice.installed.ids.tolist() == laid.ids.tolist()
    assert np.array_equal(twice.installed.xy_m, laid.xy_m)
    assert all(a < b for a, b in pairwise(twice.installed.ids.tolist()))


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("numbers", "numbers = [2, 1]", "the numbers of installed tags rise"),
        ("numbers", "numbers = [0]", "installed.numbers"),
        ("numbers", "numbers = [1]", "1 numbers of installed tags but"),
        ("area", "area = [[[[0, 0], [1, 1], [1, 0], [0, 1]]]]", "these rings bound no area"),
        ("area", "area = [[]]", "a part of the area has no ring"),
        ("area", "area = [[[[0, 0], [1, 1]]]]", "installed.area"),
        ("area", "areas = []", "unknown key"),
    ],
)
def test_a_faulty_table_of_installed_tags_is_one_message(old, new, tmp_path, key, value, words):
    """With the key, and no traceback."""
    layout = next(iter(expanded_space(expansion_of(*old, new), new, new_readers=False).layouts()))
    write_layout(layout, new, tmp_path / "expanded.toml")
    text = (tmp_path / "expanded.toml").read_text(encoding="utf-8")
    head, table = text.split("[layout.installed]\n")
    start = table.index(f"{key} = [")
    end = table.index("\n]\n", start) + 3
    (tmp_path / "faulty.toml").write_text(
        f"{head}[layout.installed]\n{table[:start]}{value}\n{table[end:]}", encoding="utf-8"
    )
    with pytest.raises(InvalidInput, match=words):
        read_layout(tmp_path / "faulty.toml")


def test_records_of_installed_tags_are_kept_by_number(old, new, tmp_path):
    """Identities, surveyed places and deviations; what was recorded as missing is not asked for."""
    spec, layout = old
    laid = layout.floor_tags.lay_on(spec.site)
    uids = tuple(f"E00401500000{number:04X}" for number in laid.ids)
    known = replace(laid, uid=uids, sigma_m=np.full(len(laid), 0.001), status=("installed",) * len(laid))
    rows = [*tag_rows(known, spec.site, "label", known.xy_m)]
    rows.append(replace(rows[0], tag_id=12, uid=None, install_status="missing"))
    write_tag_files(tmp_path, tag_header(layout, spec.site, len(rows)), rows)
    expansion = expansion_of(spec, layout, new)
    recorded = recorded_tags(tmp_path / "tags.csv", expansion.installed)
    grown = next(iter(expanded_space(expansion, new, new_readers=False).layouts())).floor_tags.lay_on(new.site)
    tags, surveyed_m = with_records(grown, recorded)
    kept = len(laid)
    assert tags.uid == uids + (None,) * (len(grown) - kept)
    assert tags.sigma_m[:kept].tolist() == [0.001] * kept
    assert tags.sigma_m[kept:].tolist() == grown.sigma_m[kept:].tolist()
    assert surveyed_m[:kept] == pytest.approx(laid.xy_m, abs=1e-6)
    assert np.isnan(surveyed_m[kept:]).all()


def test_records_of_another_floor_are_refused(old, new, tmp_path):
    """A tag too few, one too many, and one elsewhere: each by its number."""
    spec, layout = old
    laid = layout.floor_tags.lay_on(spec.site)
    rows = [*tag_rows(laid, spec.site, "label")][1:]
    rows[0] = replace(rows[0], x_m=rows[0].x_m + 0.005)
    rows.append(replace(rows[-1], tag_id=9999))
    write_tag_files(tmp_path, tag_header(layout, spec.site, len(rows)), rows)
    with pytest.raises(InvalidInput) as caught:
        recorded_tags(tmp_path / "tags.csv", expansion_of(spec, layout, new).installed)
    assert [fault.problem for fault in caught.value.faults] == [
        "installed tag 1 is not in it",
        "tag 2 lies 5 mm from its place in the layout",
        "the layout has no tag 9999",
    ]
