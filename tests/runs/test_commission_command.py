"""`layoutopt commission` end to end: a floor with known faults of installation, found, judged and written."""

import numpy as np
import pytest
from command_line import called
from small_studies import SPEC

from layoutopt.commissioning.as_built import as_built, corrected
from layoutopt.commissioning.site_records import read_scans
from layoutopt.scenario import Faults, TruePlaces
from layoutopt.simulation.sensing import true_tags
from layoutopt.simulation.tag_use import TagUse, tag_use
from layoutopt.spec import writing
from layoutopt.spec.layout_file import read_filed_layout, read_layout, write_layout
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from layoutopt.tables.tag_files import read_tag_file
from studies.as_built import BuiltFloor
from studies.as_built_output import write_built

MISSING, MOVED = 9, 20


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """A layout file of the small spec, and a floor with one tag missing, one moved and two exchanged."""
    folder = tmp_path_factory.mktemp("commission")
    (folder / "spec.toml").write_text(SPEC, encoding="utf-8")
    spec = read_spec(folder / "spec.toml")
    layout = next(iter(spec.space.layouts()))
    write_layout(layout, spec, folder / "layout.toml")
    tags = layout.floor_tags.lay_on(spec.site)
    xy_m = tags.xy_m.copy()
    xy_m[[2, 3]] = xy_m[[3, 2]]
    xy_m[MOVED - 1] += (0.0, 0.03)
    scans = [f"{tag_id},E004015000{tag_id:04X}01" for tag_id in tags.ids.tolist() if tag_id != MISSING]
    rows = [f"{tag_id},{x},{y}" for tag_id, (x, y) in zip(tags.ids.tolist(), xy_m.tolist(), strict=True)]
    (folder / "scans.csv").write_text("\n".join(["tag_id,uid", *scans]), encoding="utf-8")
    (folder / "survey.csv").write_text("\n".join(["tag_id,x_m,y_m", *rows]), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def done(home):
    """The command, run on that floor."""
    return called(
        *("commission", "layout.toml", "--scans", "scans.csv", "--survey", "survey.csv"),
        *("--out", "built", "--trials", 4, "--jobs", 1),
        cwd=home,
    )


def test_every_fault_of_the_floor_is_told(home, done):
    """And nothing else; the scores carry drives, estimator and seed."""
    assert done.returncode in (0, 1), done.stderr
    assert f"tag {MISSING} was not scanned" in done.stdout
    assert f"tag {MOVED} is 30.0 mm from its place" in done.stdout
    assert "tags 3, 4 stand at each other's places" in done.stdout
    findings = (home / "built" / "findings.csv").read_text(encoding="utf-8").splitlines()
    assert [line.split(",")[0] for line in findings] == ["deviation", "missing", "swapped", "moved"]
    assert "of held-out/faults" in done.stdout
    assert "seed 3" in done.stdout


def test_the_corrected_map_holds_what_lies_on_the_floor(home, done):
    """Identities by place, states, measured places; the layout file reads back to the same floor."""
    rows = {row.tag_id: row for row in read_tag_file(home / "built" / "tags.csv")}
    assert (rows[3].uid, rows[4].uid) == ("E004015000000401", "E004015000000301")
    assert rows[MISSING].install_status == "missing"
    assert rows[MISSING].uid is None
    assert rows[MOVED].install_status == "moved"
    assert rows[MOVED].surveyed_y_m == pytest.approx(rows[MOVED].y_m)
    spec, built = read_layout(home / "built" / "as_built.toml")
    assert not read_filed_layout(home / "built" / "as_built.toml").quick_look
    laid = built.floor_tags.lay_on(spec.site)
    assert laid.ids.tolist() == [tag_id for tag_id in rows if tag_id != MISSING]
    for tag_id, place_m in zip(laid.ids.tolist(), laid.xy_m, strict=True):
        assert (rows[tag_id].x_m, rows[tag_id].y_m) == pytest.approx(tuple(place_m), abs=1e-6)


def test_a_second_run_gives_the_same_bytes(home, done):
    """Findings, use of tags, map and layout."""
    assert done.stdout
    again = called(
        *("commission", "layout.toml", "--scans", "scans.csv", "--survey", "survey.csv"),
        *("--out", "again", "--trials", 4, "--jobs", 2),
        cwd=home,
    )
    assert again.returncode == done.returncode
    for path in (home / "built").iterdir():
        assert (home / "again" / path.name).read_bytes() == path.read_bytes(), path.name


def test_a_layout_too_large_for_a_file_leaves_map_and_findings(home, tmp_path, monkeypatch):
    """The floor is not judged in vain: what can be written is, and an old layout file does not stay beside it."""
    spec, layout = read_layout(home / "layout.toml")
    found = as_built(layout.floor_tags.lay_on(spec.site), read_scans(home / "scans.csv"), None)
    count = len(found.tag_map)
    floor = BuiltFloor(
        **{"layout": layout, "built": corrected(layout, spec.site, found), "found": found},
        **{"problem": spec.problem(), "scenario": "held-out", "seed": 3, "first": 0, "trials": 2},
        **dict.fromkeys(("planned", "old_map", "new_map")),
        **{"limits": (), "repairs": (), "failures": {}},
        use=TagUse(reads=np.zeros(count), alone=np.zeros(count), drives=2),
    )
    written, left_out = write_built(floor, spec, tmp_path)
    assert (len(written), left_out) == (6, "")
    monkeypatch.setattr(writing, "MAXIMUM_BYTES", 1000)
    written, left_out = write_built(floor, spec, tmp_path)
    assert left_out.startswith("no as_built.toml for 1 tags beside their places: the frozen copy would have")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(path.name for path in written)
    assert {"tags.csv", "findings.csv"} <= {path.name for path in written}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--scans", "none.csv"), "there is no such file"),
        (("--scans", "survey.csv"), "survey.csv:1 uid: this column is missing"),
        (("--scans", "scans.csv", "--tolerance", "1 kg"), "--tolerance"),
        (("--scans", "scans.csv", "--survey", "scans.csv"), "unknown column"),
    ],
)
def test_bad_input_is_one_message_and_exit_2(home, arguments, words):
    """Nothing is simulated and nothing written."""
    failed = called("commission", "layout.toml", *arguments, "--out", "none", cwd=home)
    assert failed.returncode == 2
    assert words in failed.stderr
    assert "Traceback" not in failed.stderr
    assert not (home / "none").exists()


def test_true_places_are_where_tags_answer(home):
    """The robot's map stays the plan; the world is what was measured, with the silent ones left out."""
    spec, layout = read_layout(home / "layout.toml")
    tags = layout.floor_tags.lay_on(spec.site)
    places = TruePlaces(tag_id=tags.ids[[4, 7]], xy_m=np.array([(0.5, 0.5), (0.25, 0.75)]), silent=tags.ids[[0]])
    truth = true_tags(tags, Faults(true_places=places, tag_offset_m=(0.01, 0.0)), np.random.default_rng(0))
    assert truth.tag.tolist() == list(range(1, len(tags)))
    np.testing.assert_allclose(truth.xy_m[3], (0.51, 0.5))
    np.testing.assert_allclose(truth.xy_m[6], (0.26, 0.75))
    others = np.setdiff1d(np.arange(1, len(tags)), [4, 7])
    np.testing.assert_allclose(truth.xy_m[others - 1], tags.xy_m[others] + (0.01, 0.0))


def test_the_use_of_a_tag_is_what_its_readers_see(home):
    """Reads of all tags add up to those of the drives, and no step has more than one tag alone."""
    from layoutopt.simulation.motion import drive
    from layoutopt.simulation.sensing import observe

    spec, layout = read_layout(home / "layout.toml")
    scenario, streams = spec.problem().design, Streams(seed=1)
    tags = layout.floor_tags.lay_on(spec.site)
    use = tag_use(layout, scenario, streams, 5, 3)
    seen = [observe(drive(scenario, streams, r), layout, scenario, tags, streams, r) for r in range(5, 8)]
    assert use.reads.sum() * 3 == pytest.approx(sum(len(item.read_tag) for item in seen))
    alone = 0
    for item in seen:
        for start, end in zip(item.read_start[:-1], item.read_start[1:], strict=True):
            alone += len(set(item.read_tag[start:end].tolist())) == 1
    assert use.alone.sum() * 3 == pytest.approx(alone)
