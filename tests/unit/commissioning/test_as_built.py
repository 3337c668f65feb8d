"""Scans and surveys beside the plan: what is missing, doubled, exchanged or moved is found, and nothing else."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.commissioning.as_built import Deviation, as_built, corrected
from layoutopt.commissioning.site_records import Scan, Survey, read_scans, read_survey
from layoutopt.commissioning.survey_fit import rigid_fit
from layoutopt.commissioning.tag_identity import TagIdentity, tag_identity
from layoutopt.errors import InvalidInput
from layoutopt.geometry import turned
from layoutopt.layout import EditKind, FloorTags, Layout, TagEdit, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.site import Site

SITE = Site(name="hall", floor=box(0, 0, 2, 1.5))
MOUNT = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.02, profile=COMMERCIAL)
EDITS = (TagEdit(kind=EditKind.DROPPED, from_m=(1.0, 0.4)),)
LAYOUT = Layout(
    floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.2)),), edits=EDITS),
    readers=(cross(count=4, mount=MOUNT),),
)
TAGS = LAYOUT.floor_tags.lay_on(SITE)


def uid(number):
    """Return an identity as tags have it."""
    return f"E00401500000{number:04X}"


def scans(identities):
    """Return a scan for each pair of tag and identity."""
    return [
        Scan(line=line, tag_id=tag_id, identity=TagIdentity(uid=identity))
        for line, (tag_id, identity) in enumerate(identities, start=2)
    ]


ALL = [(tag_id, uid(tag_id)) for tag_id in TAGS.ids.tolist()]


def survey(xy_m=TAGS.xy_m):
    return Survey(tag_id=TAGS.ids, xy_m=xy_m)


def test_a_floor_as_planned_has_no_finding():
    """All scanned, all within a millimetre: nothing is found, and the layout stays the same but for the noise."""
    noise_m = np.random.default_rng(1).normal(0.0, 0.0005, TAGS.xy_m.shape)
    found = as_built(TAGS, scans(ALL), survey(TAGS.xy_m + noise_m))
    assert found.findings == ()
    assert set(found.tag_map.status) == {"installed"}
    assert found.tag_map.uid == tuple(uid(tag_id) for tag_id in TAGS.ids.tolist())
    np.testing.assert_array_equal(found.tag_map.xy_m, TAGS.xy_m + noise_m)
    assert corrected(LAYOUT, SITE, as_built(TAGS, scans(ALL), survey())) == LAYOUT


def test_what_was_not_scanned_is_missing_and_leaves_the_layout():
    """The others keep their numbers and places."""
    found = as_built(TAGS, scans([pair for pair in ALL if pair[0] not in (1, 7)]), None)
    assert [(f.deviation, f.tag_ids) for f in found.findings] == [
        (Deviation.MISSING, (1,)),
        (Deviation.MISSING, (7,)),
    ]
    built = corrected(LAYOUT, SITE, found).floor_tags.lay_on(SITE)
    assert built.ids.tolist() == [tag_id for tag_id in TAGS.ids.tolist() if tag_id not in (1, 7)]


def test_an_identity_at_two_tags_makes_both_unclear():
    """Nobody can say which of the two was read; both stay on the floor."""
    pairs = [(tag_id, uid(5) if tag_id == 9 else identity) for tag_id, identity in ALL]
    found = as_built(TAGS, scans(pairs), None)
    assert [(f.deviation, f.tag_ids) for f in found.findings] == [(Deviation.DUPLICATE, (5, 9))]
    state = dict(
        zip(found.tag_map.ids.tolist(), zip(found.tag_map.status, found.tag_map.uid, strict=True), strict=True)
    )
    assert state[5] == state[9] == ("unclear", None)
    assert corrected(LAYOUT, SITE, found) == LAYOUT


def test_two_identities_at_one_tag_are_told_with_their_lines():
    """The installer scans it again."""
    found = as_built(TAGS, scans([*ALL, (4, uid(900))]), None)
    (finding,) = found.findings
    assert (finding.deviation, finding.tag_ids) == (Deviation.TWO_IDENTITIES, (4,))
    assert "(line 5)" in finding.text
    assert uid(900) in finding.text


def test_the_same_identity_twice_at_one_tag_is_no_finding():
    """Scanning again does no harm."""
    assert as_built(TAGS, scans([*ALL, ALL[3]]), None).findings == ()


def test_exchanged_tags_change_identities_and_not_places():
    """Two tags at each other's places, and three in a ring: the map holds who truly lies where."""
    rows = {tag_id: row for row, tag_id in enumerate(TAGS.ids.tolist())}
    xy_m = TAGS.xy_m.copy()
    for ring in ((1, 2), (20, 21, 30)):
        index = [rows[tag_id] for tag_id in ring]
        xy_m[index] = TAGS.xy_m[np.roll(index, -1)]
    found = as_built(TAGS, scans(ALL), survey(xy_m))
    assert [(f.deviation, f.tag_ids) for f in found.findings] == [
        (Deviation.SWAPPED, (1, 2)),
        (Deviation.SWAPPED, (20, 21, 30)),
    ]
    np.testing.assert_array_equal(found.tag_map.xy_m, TAGS.xy_m)
    named = dict(zip(found.tag_map.ids.tolist(), found.tag_map.uid, strict=True))
    assert (named[1], named[2]) == (uid(2), uid(1))
    assert (named[21], named[30], named[20]) == (uid(20), uid(21), uid(30))


@given(seed=st.integers(0, 10_000), count=st.integers(0, 20))
@settings(max_examples=30, deadline=None)
def test_any_exchange_among_tags_is_undone(seed, count):
    """However many were mixed up among each other: every place gets the identity of the tag that lies there."""
    draws = np.random.default_rng(seed)
    mixed = draws.permutation(len(TAGS))[:count]
    stands_at = np.arange(len(TAGS))
    stands_at[mixed] = draws.permutation(mixed)
    found = as_built(TAGS, scans(ALL), survey(TAGS.xy_m[stands_at]))
    wanted = [""] * len(TAGS)
    for row, place in enumerate(stands_at.tolist()):
        wanted[place] = uid(int(TAGS.ids[row]))
    assert list(found.tag_map.uid) == wanted
    assert {finding.deviation for finding in found.findings} <= {Deviation.SWAPPED}


def test_a_moved_tag_is_told_and_goes_where_it_lies():
    """By 30 mm, with 10 mm allowed; another by 9 mm is no finding, but its place is used all the same."""
    xy_m = TAGS.xy_m.copy()
    xy_m[0] += (0.03, 0.0)
    xy_m[5] += (0.0, 0.009)
    found = as_built(TAGS, scans(ALL), survey(xy_m))
    (finding,) = found.findings
    assert (finding.deviation, finding.tag_ids) == (Deviation.MOVED, (1,))
    assert "30.0 mm" in finding.text
    built = corrected(LAYOUT, SITE, found).floor_tags.lay_on(SITE)
    np.testing.assert_allclose(built.xy_m, xy_m, atol=1e-12)
    assert built.status[0] == built.status[5] == "moved"


def test_a_tag_at_the_place_of_one_that_was_not_measured_is_told():
    """Without the other's place nothing can be said of an exchange."""
    keep = TAGS.ids != 2
    xy_m = TAGS.xy_m.copy()
    xy_m[0] = TAGS.xy_m[1]
    found = as_built(TAGS, scans(ALL), Survey(tag_id=TAGS.ids[keep], xy_m=xy_m[keep]))
    assert {(f.deviation, f.tag_ids) for f in found.findings} == {
        (Deviation.ELSEWHERE, (1, 2)),
        (Deviation.MOVED, (1,)),
    }


def test_a_survey_in_a_frame_of_its_own_is_refused_until_it_is_said():
    """The message names turn and shift; with --own-frame it is brought into the plan."""
    angle_rad, shift_m = 0.7, np.array([1200.0, -30.0])
    own_m = turned(TAGS.xy_m - shift_m, -angle_rad)
    with pytest.raises(InvalidInput, match="--own-frame"):
        as_built(TAGS, scans(ALL), survey(own_m))
    found = as_built(TAGS, scans(ALL), survey(own_m), own_frame=True)
    assert found.findings == ()
    np.testing.assert_allclose(found.tag_map.xy_m, TAGS.xy_m, atol=1e-9)
    assert found.frame.angle_rad == pytest.approx(angle_rad)


def test_the_frame_is_found_although_a_third_of_the_tags_are_elsewhere():
    """Outliers of half a metre do not pull at it; noise of 2 mm is found again."""
    draws = np.random.default_rng(3)
    planned_m = draws.uniform(0, 10, (300, 2))
    surveyed_m = turned(planned_m, -0.2) + draws.normal(0, 0.002, (300, 2))
    surveyed_m[:100] += draws.uniform(-0.5, 0.5, (100, 2))
    fit = rigid_fit(surveyed_m, planned_m)
    assert fit.angle_rad == pytest.approx(0.2, abs=3e-4)
    assert math.hypot(*fit.shift_m) < 2e-3
    # Five standard errors of a median over 200 tags: a false alarm once in a million.
    assert fit.sigma_m == pytest.approx(0.0026, abs=0.0012)
    assert fit.used < 230


def test_tags_that_the_layout_does_not_have_are_refused_all_at_once():
    """A scan and a survey with foreign numbers."""
    with pytest.raises(InvalidInput) as caught:
        as_built(TAGS, scans([(9000, uid(1))]), Survey(tag_id=np.array([8000]), xy_m=np.zeros((1, 2))))
    assert "no tag 9000 (line 2)" in str(caught.value)
    assert "no tag 8000" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("E00401500A1B2C3D", TagIdentity(uid="E00401500A1B2C3D")),
        ("e0-04-01-50-0a-1b-2c-3d", TagIdentity(uid="E00401500A1B2C3D")),
        (" 0xE00401500A1B2C3D ", TagIdentity(uid="E00401500A1B2C3D")),
        ("3D2C1B0A500104E0", TagIdentity(uid="E00401500A1B2C3D", turned=True)),
        ("E0040150 0A1B2CE0", TagIdentity(uid="E00401500A1B2CE0", ambiguous=True)),
    ],
)
def test_identities_come_to_one_form(text, wanted):
    """Either order of bytes, any common separator, any case."""
    assert tag_identity(text) == wanted


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "0 digits"),
        ("E0041E50", "8 digits"),
        ("1.61E+19", "spreadsheet"),
        ("0004015000000000", "neither its first nor its last byte"),
        ("E00401500A1B2C3G", "from 0 to 9 and A to F"),
    ],
)
def test_what_is_no_identity_says_why(text, words):
    """Short ones, numbers of a spreadsheet, other kinds of tags."""
    with pytest.raises(ValueError, match=words):
        tag_identity(text)


def test_files_come_back_with_all_their_faults(tmp_path):
    """Line and column of each."""
    path = tmp_path / "scans.csv"
    path.write_text(f"tag_id,uid\n1,{uid(1)}\nx,{uid(2)}\n3,123\n4\n", encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        read_scans(path)
    message = str(caught.value)
    for words in (
        "scans.csv:3 tag_id: 'x' is no number",
        "scans.csv:4 uid: '123' is no identity",
        "scans.csv:5: this row",
    ):
        assert words in message
    path.write_text("tag_id,x_m,y_m\n1,0.1,0.2\n1,0.1,0.2\n2,,nan\n", encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        read_survey(path)
    for words in ("measured in line 2 already", "scans.csv:4 x_m: this cell is empty", "no finite number"):
        assert words in str(caught.value)


def test_good_files_are_read(tmp_path):
    """In any order of columns; the survey is what was written."""
    path = tmp_path / "scans.csv"
    path.write_text(f"uid,tag_id\n{uid(1)},1\n{uid(1)[14:]}{uid(1)[12:14]}00000050010 4E0,2\n", encoding="utf-8")
    with pytest.raises(InvalidInput):
        read_scans(path)
    path.write_text(f"uid,tag_id\n{uid(1)},1\n{uid(2)},2\n", encoding="utf-8")
    assert [(scan.tag_id, scan.identity.uid) for scan in read_scans(path)] == [(1, uid(1)), (2, uid(2))]
    path.write_text("tag_id,x_m,y_m\n3,0.5,-0.25\n", encoding="utf-8")
    measured = read_survey(path)
    assert (measured.tag_id.tolist(), measured.xy_m.tolist()) == ([3], [[0.5, -0.25]])


def test_places_that_an_earlier_edit_moved_are_edited_anew():
    """A snapped tag that was measured elsewhere: the pattern's place stays the name of the edit."""
    snapped = TagEdit(kind=EditKind.SNAPPED, from_m=(0.2, 0.2), to_m=(0.25, 0.25))
    floor_tags = dataclasses.replace(LAYOUT.floor_tags, edits=(*EDITS, snapped))
    layout = LAYOUT.replace(floor_tags=floor_tags)
    tags = floor_tags.lay_on(SITE)
    xy_m = tags.xy_m.copy()
    xy_m[0] += 0.001
    built = corrected(layout, SITE, as_built(tags, scans(ALL), Survey(tag_id=tags.ids, xy_m=xy_m)))
    np.testing.assert_allclose(built.floor_tags.lay_on(SITE).xy_m, xy_m, atol=1e-12)


def test_identities_that_answer_in_one_slot_are_told_where_both_can_be_in_a_field():
    """Tags 1 and 2 end in the same digit and lie 200 mm apart: a clash for a reach of 110 mm, none for 90 mm."""
    pairs = [
        (tag_id, f"E00401500000A{tag_id:02X}{'7' if tag_id in (1, 2, 9) else tag_id % 2}") for tag_id, _ in ALL
    ]
    far = as_built(TAGS, scans(pairs), None, reach_m=0.09)
    assert far.findings == ()
    near = as_built(TAGS, scans(pairs), None, reach_m=0.11)
    clashes = [finding.tag_ids for finding in near.findings if finding.deviation is Deviation.CLASH]
    assert (1, 2) in clashes
    assert (1, 9) not in clashes
    xy_m = {tag_id: TAGS.xy_m[row] for row, tag_id in enumerate(TAGS.ids.tolist())}
    ends = {tag_id: uid[-1] for tag_id, uid in pairs}
    expected = sorted(
        (a, b)
        for a in xy_m
        for b in xy_m
        if a < b and ends[a] == ends[b] and np.linalg.norm(xy_m[a] - xy_m[b]) <= 0.22
    )
    assert clashes == expected
