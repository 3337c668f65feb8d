"""`layoutopt snap` end to end: the snapped layout, what became of each tag, the price, and bad input."""

import csv

import pytest
from command_line import called
from small_studies import SPEC

from layoutopt.geometry import turned
from layoutopt.site import Zone
from layoutopt.spec.layout_file import read_filed_layout, read_layout, write_layout
from layoutopt.spec.reading import read_spec

SITE = """tiling = { size = "0.4 m", origin = [0.1, 0.05], angle = "7 deg" }
obstacles = [[[1.2, 0.9], [1.5, 0.9], [1.5, 1.1], [1.2, 1.1]]]
[[site.zone]]
name = "plate"
metal = true
region = [[2, 1], [2.4, 1], [2.4, 1.4], [2, 1.4]]
[robots]"""
JOINTS = ("--to", "joints", "--obstacles", "move", "--trials", 4)


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """Layout files of the small spec: of a quick look with turned tiles, obstacle and plate; without tiles."""
    folder = tmp_path_factory.mktemp("snap")
    for name, text in (("layout", SPEC.replace("[robots]", SITE, 1)), ("bare", SPEC)):
        (folder / "spec.toml").write_text(text, encoding="utf-8")
        spec = read_spec(folder / "spec.toml")
        write_layout(next(iter(spec.space.layouts())), spec, folder / f"{name}.toml", quick_look=name == "layout")
    return folder


@pytest.fixture(scope="module")
def done(home):
    """The command, run on that floor."""
    return called("snap", "layout.toml", *JOINTS, "--out", "snapped", "--jobs", 1, cwd=home)


def table(path):
    """Return the rows of a table by the names of its columns."""
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_the_snapped_layout_lies_on_joints_and_is_told_tag_by_tag(home, done):
    """The file reads back; the list holds just the tags that differ from the original, with places and reasons."""
    assert done.returncode in (0, 1), done.stderr
    spec, before = read_layout(home / "layout.toml")
    _, after = read_layout(home / "snapped" / "snapped.toml")
    assert read_filed_layout(home / "snapped" / "snapped.toml").quick_look
    tags, laid = (layout.floor_tags.lay_on(spec.site) for layout in (before, after))
    local_m = turned(laid.xy_m - spec.site.tiling.origin_m, -spec.site.tiling.angle_rad) / 0.4
    assert abs(local_m - local_m.round()).min(axis=1).max() <= 1e-9
    old = dict(zip(tags.ids.tolist(), tags.xy_m.tolist(), strict=True))
    new = dict(zip(laid.ids.tolist(), laid.xy_m.tolist(), strict=True))
    rows = table(home / "snapped" / "snapping.csv")
    told = {int(row["tag_id"]): row for row in rows if row["tag_id"]}
    assert set(told) == {tag_id for tag_id in old | new if old.get(tag_id) != new.get(tag_id)}
    for tag_id, row in told.items():
        assert row["why"]
        if tag_id in new:
            assert (float(row["to_x_m"]), float(row["to_y_m"])) == pytest.approx(tuple(new[tag_id]), abs=1e-6)
            assert row["what"] == laid.status[laid.ids.tolist().index(tag_id)]
        else:
            assert (row["what"], row["to_x_m"], row["by_mm"]) == ("dropped", "", "")
    reasons = {row["why"].split(";")[0] for row in rows if row["what"] in ("not laid", "added")}
    assert reasons <= {"near the wall", "obstacle 1", "near obstacle 1", "zone 'plate' (metal = true)"}
    assert {"near the wall", "obstacle 1"} <= reasons
    assert table(home / "snapped" / "cut_tiles.csv")


def test_the_price_names_drives_interval_and_seed(home, done):
    """Scores of both layouts on the same drives, with the difference; coverage on the same runs; exact costs."""
    assert "held-out drives 8 to 11 of each scenario, estimator mcl_adaptive, seed 3" in done.stdout
    rows = table(home / "snapped" / "price.csv")
    names = [(row["where"], row["score"]) for row in rows]
    assert names == [
        ("held-out/point_to_point", "position_error_mean"),
        ("held-out/faults", "position_error_mean"),
        ("the floor as laid", "pose_coverage"),
        ("the floor as laid", "run_coverage"),
        ("the floor as laid", "cost"),
    ]
    for row in rows:
        before, after, difference, low, high = (
            float(row[name]) for name in ("before", "after", "difference", "low_95", "high_95")
        )
        assert difference == pytest.approx(after - before, abs=1e-8)
        assert low <= difference <= high
        assert (low < high) == (row["score"] != "cost")
    assert [row["n"] for row in rows] == ["4", "4", "4000", "4000", "0"]
    assert "cost: " in done.stdout


def test_a_second_run_gives_the_same_bytes(home, done):
    """Layout, lists and price."""
    assert done.stdout
    again = called("snap", "layout.toml", *JOINTS, "--out", "again", "--jobs", 2, cwd=home)
    assert again.returncode == done.returncode
    for path in (home / "snapped").iterdir():
        assert (home / "again" / path.name).read_bytes() == path.read_bytes(), path.name


def test_a_limit_that_snapping_loses_ends_in_exit_1(home):
    """With 4 corners a square metre the small robot misses the target that 44 tags a square metre meet."""
    _, layout = read_layout(home / "layout.toml")
    text = (home / "layout.toml").read_text(encoding="utf-8").replace("quick_look = true\n", "")
    assert 'target_error = "60 mm"' in text
    for target, ending, word in (("60 mm", 1, "LOST BY SNAPPING"), ("1 m", 0, "met: mean position error")):
        changed = text.replace('target_error = "60 mm"', f'target_error = "{target}"')
        (home / "limited.toml").write_text(changed, encoding="utf-8")
        found = called(
            *("snap", "limited.toml", "--to", "chalk", "--chalk-spacing", "0.5 m", "--trials", 12),
            *("--out", "lost", "--jobs", 1),
            cwd=home,
        )
        assert word in found.stdout
        assert found.returncode == ending
    assert read_layout(home / "lost" / "snapped.toml")[1].readers == layout.readers
    assert not read_filed_layout(home / "lost" / "snapped.toml").quick_look


def test_a_layout_on_its_marks_stays_as_it_is(home):
    """A pitch of 150 mm lies on chalk lines 50 mm apart: the same layout, driven once, with a price of nothing."""
    arguments = ("--to", "chalk", "--chalk-spacing", "50 mm", "--trials", 4, "--out", "same", "--jobs", 1)
    found = called("snap", "layout.toml", *arguments, cwd=home)
    assert "stays as it is: every tag lies on its mark" in found.stdout
    assert read_layout(home / "same" / "snapped.toml")[1] == read_layout(home / "layout.toml")[1]
    assert {float(row["difference"]) for row in table(home / "same" / "price.csv")} == {0.0}


def test_zones_that_bar_drilling_come_back_from_files(home):
    """A frozen spec holds the rule."""
    spec, _ = read_layout(home / "layout.toml")
    assert isinstance(spec.site.zone("plate"), Zone)
    text = (home / "layout.toml").read_text(encoding="utf-8")
    assert "drill = true" in text
    (home / "barred.toml").write_text(text.replace("drill = true", "drill = false"), encoding="utf-8")
    assert read_layout(home / "barred.toml")[0].site.zone("plate").drill is False


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("bare.toml", "--to", "corners"), "Add tiling"),
        (("layout.toml", "--to", "seams"), "there are no such marks"),
        (("layout.toml", "--to", "chalk"), "Add --chalk-spacing"),
        (("layout.toml", "--to", "chalk", "--chalk-spacing", "5 kg"), "--chalk-spacing"),
        (("layout.toml", "--to", "joints", "--chalk-spacing", "50 mm"), "Leave it out"),
        (("layout.toml", "--to", "joints", "--obstacles", "keep"), "Give drop or move"),
        (("layout.toml", "--to", "joints", "--reach", "-1 mm"), "--reach"),
        (("layout.toml", "--to", "joints", "--obstacles", "move", "--reach", "1 km"), "Give 4 m or less"),
        (("none.toml", "--to", "joints"), "none.toml"),
    ],
)
def test_bad_input_is_one_message_and_exit_2(home, arguments, words):
    """Nothing is simulated and nothing written."""
    failed = called("snap", *arguments, "--out", "none", cwd=home)
    assert failed.returncode == 2
    assert words in failed.stderr
    assert "Traceback" not in failed.stderr
    assert not (home / "none").exists()
