"""`layoutopt expand` end to end: a floor as `layoutopt commission` leaves it, a larger plan, the extension."""

import csv

import numpy as np
import pytest
from command_line import called
from small_studies import SPEC
from small_studies import called as called_with_workers

from layoutopt.spec.layout_file import read_filed_layout, read_layout, write_layout
from layoutopt.spec.reading import read_spec
from layoutopt.tables.tag_files import read_tag_file

FLOOR = "[[0,0],[3,0],[3,2],[0,2]]"
LARGER = "[[0,0],[3,0],[3,1],[4.5,1],[4.5,2],[0,2]]"
MISSING, MOVED = 9, 20


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """A floor as built, with its tag map, of which one tag is missing and one moved; specs of larger floors."""
    folder = tmp_path_factory.mktemp("expand")
    (folder / "old.toml").write_text(SPEC, encoding="utf-8")
    # Errors of few short drives scatter so much that only a wide target is met for certain.
    new = SPEC.replace(FLOOR, LARGER).replace('"60 mm"', '"500 mm"').replace("count = 1", "count = 2", 1)
    (folder / "new.toml").write_text(new, encoding="utf-8")
    (folder / "hopeless.toml").write_text(new.replace('"500 mm"', '"0.1 mm"'), encoding="utf-8")
    (folder / "puck.toml").write_text(f'{new}\n[parts]\ntag = "puck"\n', encoding="utf-8")
    spec = read_spec(folder / "old.toml")
    layout = next(iter(spec.space.layouts()))
    write_layout(layout, spec, folder / "layout.toml", quick_look=True)
    tags = layout.floor_tags.lay_on(spec.site)
    xy_m = tags.xy_m.copy()
    xy_m[MOVED - 1] += (0.0, 0.03)
    scans = [f"{tag_id},E004015000{tag_id:04X}01" for tag_id in tags.ids.tolist() if tag_id != MISSING]
    rows = [f"{tag_id},{x},{y}" for tag_id, (x, y) in zip(tags.ids.tolist(), xy_m.tolist(), strict=True)]
    (folder / "scans.csv").write_text("\n".join(["tag_id,uid", *scans]), encoding="utf-8")
    (folder / "survey.csv").write_text("\n".join(["tag_id,x_m,y_m", *rows]), encoding="utf-8")
    found = called(
        *("commission", "layout.toml", "--scans", "scans.csv", "--survey", "survey.csv"),
        *("--out", "built", "--trials", 2, "--jobs", 1),
        cwd=folder,
    )
    assert found.returncode in (0, 1), found.stderr
    return folder


def expand(home, *arguments, spec="new.toml", out="grown"):
    """Run the command on the floor as built."""
    return called("expand", "built/as_built.toml", spec, *arguments, "--out", out, cwd=home)


@pytest.fixture(scope="module")
def done(home):
    """The command, run on that floor."""
    return expand(home, "--tags", "built/tags.csv")


def table(path):
    """Return the rows of a CSV file by column."""
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_the_installed_floor_is_as_it_was(home, done):
    """Every tag that lies has its place, number, identity and survey; the missing one is in no table."""
    assert done.returncode == 0, done.stderr + done.stdout
    before = {row.tag_id: row for row in read_tag_file(home / "built/tags.csv")}
    after = {row.tag_id: row for row in read_tag_file(home / "grown/tags.csv")}
    assert MISSING not in after
    for tag_id, row in before.items():
        if tag_id != MISSING:
            kept = after[tag_id]
            assert (kept.uid, kept.x_m, kept.y_m, kept.sigma_m) == (row.uid, row.x_m, row.y_m, row.sigma_m)
            assert (kept.surveyed_x_m, kept.surveyed_y_m) == (row.surveyed_x_m, row.surveyed_y_m)
            assert kept.install_status == "installed"
    new = [row for row in after.values() if row.tag_id not in before]
    assert [row.tag_id for row in new] == list(range(max(before) + 1, max(before) + 1 + len(new)))
    assert all(row.x_m > 3.0 and row.uid is None for row in new)
    assert read_tag_file(home / "grown/extension.csv") == tuple(new)
    assert f"kept: {len(before) - 1} tags with their numbers" in done.stdout
    assert f"new: {len(new)} tags, numbers {new[0].tag_id} to {new[-1].tag_id}" in done.stdout


def test_the_layout_file_is_the_floor_of_the_tables(home, done):
    """It reads back, and lays the tags of the map, number by number, with the readers of the robots.

    It has the mark of the quick look that chose the installed layout, as the file of what was built has.
    """
    assert done.returncode == 0
    spec, layout = read_layout(home / "grown/expanded.toml")
    laid = layout.floor_tags.lay_on(spec.site)
    rows = read_tag_file(home / "grown/tags.csv")
    assert laid.ids.tolist() == [row.tag_id for row in rows]
    assert laid.xy_m == pytest.approx(np.array([(row.x_m, row.y_m) for row in rows]), abs=1e-6)
    assert layout.readers == read_layout(home / "built/as_built.toml")[1].readers
    for name in ("built/as_built.toml", "grown/expanded.toml"):
        assert read_filed_layout(home / name).quick_look
    assert done.stderr.startswith("note: this layout comes from a quick look")


def test_only_the_extension_is_paid_for(home, done):
    """New tags, and readers for the second robot; work and bill count the same hours, scores the same cost."""
    assert done.returncode == 0
    bill = table(home / "grown/bill_of_material.csv")
    count = len(table(home / "grown/extension.csv"))
    quantities = {(row["scope"], row["item"]): row["quantity"] for row in bill if row["scope"] != "labour"}
    assert quantities["floor", "label"] == str(count)
    assert quantities["robot", "antenna"] == "4"
    assert "readers for 1 more robot are part of the cost" in done.stdout
    hours = sum(float(row["quantity"]) for row in bill if row["scope"] == "labour")
    work = table(home / "grown/work_plan.csv")
    assert float(work[-1]["hours"]) == pytest.approx(hours, abs=1e-3)
    assert {row["where"] for row in work} == {"whole site", "robot 1", ""}
    scores = table(home / "grown/scores.csv")
    assert float(scores[0]["value"]) == float(bill[-1]["total_eur"])
    assert scores[0]["where"] == "extension"


def test_every_simulated_score_tells_how_sure_it_is(home, done):
    """Interval, drives and seed; the installed area before and after, and the change between them."""
    assert done.returncode == 0
    rows = {row["where"]: row for row in table(home / "grown/scores.csv")}
    assert list(rows)[-3:] == ["installed, before", "installed, after", "installed, change"]
    for where, row in rows.items():
        if where != "extension":
            assert float(row["low"]) < float(row["value"]) < float(row["high"])
            assert int(row["n"]) > 1
            assert row["seed"] == "3"
    before, after, change = (float(rows[f"installed, {word}"]["value"]) for word in ("before", "after", "change"))
    assert change == pytest.approx(after - before, abs=1e-8)
    assert (
        "the installed area with the layout “cheapest”, mean position error, drives 8 to 15 of held-out/faults"
        in done.stdout
    )


def test_a_second_run_gives_the_same_bytes(home, done):
    """Layout, tables and what is told, computed by two worker processes in place of this one."""
    again = called_with_workers(
        *("expand", "built/as_built.toml", "new.toml", "--tags", "built/tags.csv", "--out", "again", "--jobs", 2),
        cwd=home,
    )
    assert again.stdout.replace("again/", "grown/") == done.stdout
    assert {path.name for path in (home / "again").iterdir()} == {path.name for path in (home / "grown").iterdir()}
    for path in (home / "grown").iterdir():
        assert (home / "again" / path.name).read_bytes() == path.read_bytes(), path.name


def test_a_target_out_of_reach_is_told_with_the_shortfall(home):
    """Exit 1, and nothing is written."""
    failed = expand(home, spec="hopeless.toml", out="none")
    assert failed.returncode == 1
    assert "No layout of the design space was shown to meet every limit." in failed.stdout
    assert "Shortfall:" in failed.stdout
    assert "none was not written: no layout answers the demand" in failed.stdout
    assert "the installed area with the layout “most accurate”, mean position error" in failed.stdout
    assert "by itself it breaks the demand, and tags elsewhere change little here" in failed.stdout
    assert not (home / "none").exists()


def test_a_budget_is_for_the_extension(home):
    """One that the whole floor would exceed many times over is enough; one below the new tags is refused."""
    few = expand(home, "--budget", "1 EUR", out="none")
    assert few.returncode == 1
    assert "more than the budget of 1.00 EUR" in few.stdout
    bill = table(home / "grown/bill_of_material.csv")
    enough = expand(home, "--budget", f"{bill[-1]['total_eur']} EUR", "--target-error", "1 m", out="within")
    assert enough.returncode == 0, enough.stdout
    assert float(table(home / "within/bill_of_material.csv")[-1]["total_eur"]) <= float(bill[-1]["total_eur"])


@pytest.mark.parametrize(
    ("arguments", "spec", "words"),
    [
        ((), "none.toml", "none.toml"),
        ((), "old.toml", "the plan adds no floor to the installed one"),
        ((), "puck.toml", "'label' tags are installed, and the plan lays 'puck'"),
        (("--tags", "scans.csv"), "new.toml", "the header is not that of a tag map"),
        (("--tags", "none.csv"), "new.toml", "none.csv"),
        (("--target-error", "1 kg"), "new.toml", "--target-error"),
    ],
)
def test_bad_input_is_one_message_and_exit_2(home, arguments, spec, words):
    """Nothing is simulated and nothing written."""
    failed = expand(home, *arguments, spec=spec, out="none")
    assert failed.returncode == 2
    assert words in failed.stderr
    assert "Traceback" not in failed.stderr
    assert not (home / "none").exists()


def test_a_spec_is_no_installed_floor(home):
    """The message says which file is wanted."""
    failed = called("expand", "old.toml", "new.toml", cwd=home)
    assert failed.returncode == 2
    assert "the file has no [layout]" in failed.stderr
