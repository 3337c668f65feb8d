"""The study of liang2020: its cells, its page, and the running times that it tells beside it."""

import csv
import subprocess
import sys

import numpy as np
import pytest
from command_line import called

from layoutopt.evaluate import Evaluator
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in
from layoutopt.streams import Streams
from studies.page import Table
from studies.page_frame import closing_lines
from studies.published import liang2020_page
from studies.published.liang2020 import Liang2020
from studies.published.liang2020_cells import choices
from studies.published.liang2020_figures import middles_m, sensor_section
from studies.published.liang2020_orderings import FAILS, GOAL, HOLDS, NOT_SHOWN, Ordering
from studies.published.liang2020_printed import UPDATE_MS
from studies.published.medians import Median

STREAMS = Streams(seed=2020)
TINY = Liang2020(trials=2, quick=True, seed=STREAMS.seed)
FULL = Liang2020(trials=24, quick=False, seed=STREAMS.seed)
FIGURES = ("rho", "tracks_rho", "sensor_model", "error_over_time", "tracks")


@pytest.fixture(scope="module")
def evaluations():
    """All trials of a tiny study."""
    return Evaluator(STREAMS)(TINY.next_batch([]).tasks)


@pytest.fixture(scope="module")
def found(evaluations):
    """All places of a tiny study."""
    return TINY.finished(evaluations)


def test_places_share_trials_only_where_the_choice_is_the_same():
    """So that no row takes the walks of another; a change of the number of walks is another question."""
    groups = {}
    for place, cell in FULL.cells():
        groups.setdefault(cell.group, set()).add(choices()[place])
    assert all(len(same) == 1 for same in groups.values())
    assert len(groups) == len(set(choices().values()))
    assert {place for place, _ in TINY.cells()} < {place for place, _ in FULL.cells()}
    assert FULL.key != Liang2020(trials=23, quick=False, seed=STREAMS.seed).key


def test_the_page_tells_every_table_and_draws_every_figure(found):
    """Of a study with two walks a row: the printed numbers stand beside ours, and two walks give no interval."""
    assert set(found) == {place for place, _ in TINY.cells()}
    page = liang2020_page.page_of(found, STREAMS, failed=0)
    parts = [part for section in page.sections for part in section.parts]
    assert tuple(part.name for part in parts if hasattr(part, "drawn")) == FIGURES
    tables = {part.caption: part for part in parts if isinstance(part, Table)}
    (row,) = tables["Error by tag"].rows
    assert row[:3] == ("Squiggle", "+0", "0.77")
    fused = float(np.median(found["1", "Squiggle", "fused"].column(GOAL)))
    assert row[6:] == ("0.25", f"{fused:.3f}")
    assert [
        row[:2] for row in tables["Error by antenna, the person walking counter-clockwise unless told"].rows
    ] == [
        ("right", "0.58"),
        ("left", "0.66"),
        ("both", "0.25"),
    ]
    data = {item.name: item for item in page.data}
    assert len(data["errors"].rows) == len(found)
    assert {row[-1] for row in data["orderings"].rows} == {NOT_SHOWN}
    assert "not reproduced" in page.sections[-1].heading


def test_running_times_are_told_to_people_and_never_written(evaluations, found, tmp_path):
    """They differ from run to run; the page does not, nor do the lines without a folder."""
    answer = TINY.answer(evaluations, read_spec(built_in()))
    *rest, where, timed = answer.lines(tmp_path)
    assert all(f"N = {count}: " in timed for count in UPDATE_MS)
    assert " ms (0.137)" in timed
    assert where == f"report: {tmp_path / 'report.html'}"
    assert rest == answer.lines(None) == [*liang2020_page.summary(found), *closing_lines("published/liang2020")]
    assert not list(tmp_path.iterdir())
    assert answer.exit_code == 0
    assert liang2020_page.summary({}) == ["No cell is finished."]


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (0.9, 1.1, HOLDS),
        (0.95, 1.05, HOLDS),
        (0.89, 1.0, NOT_SHOWN),
        (1.0, 1.2, NOT_SHOWN),
        (0.5, 2.0, NOT_SHOWN),
        (-np.inf, np.inf, NOT_SHOWN),
        (1.11, 1.3, FAILS),
        (0.5, 0.89, FAILS),
    ],
)
def test_an_ordering_is_judged_by_its_interval_and_not_by_its_value(low, high, verdict):
    """The value lies in the band in every case, or at an end of the interval."""
    found = Median(value=1.0, low=low, high=high, count=24)
    assert Ordering(claim="one over other", found=found, least=0.9, most=1.1).verdict == verdict


def test_the_learned_mean_strength_is_that_of_the_lucky_ones():
    """Fig. 3: next to no bias where all readings succeed, more and more towards the edge of the range."""
    (table,) = (part for part in sensor_section(STREAMS).parts if isinstance(part, Table))
    shares = [float(row[1]) for row in table.rows]
    biases_db = [float(row[2]) for row in table.rows]
    assert shares == sorted(shares, reverse=True)
    assert abs(biases_db[1]) < 0.3
    assert biases_db[2:] == sorted(biases_db[2:])
    assert biases_db[-1] > 1.5


def test_middles_of_cells_lie_half_a_cell_beside_their_corners(sensor_model):
    """Of a model of two by three cells."""
    x_m, y_m = middles_m(sensor_model)
    assert x_m.tolist() == [-0.25, 0.25]
    assert y_m.tolist() == [0.25, 0.75, 1.25]


@pytest.fixture
def sensor_model():
    """A model of two by three cells."""
    from layoutopt.estimators.sensor_model import SensorModel

    cells = np.ones((2, 3))
    return SensorModel(
        cell_m=0.5,
        origin_m=(-0.5, 0.0),
        detection=cells,
        mean_dbm=-50.0 * cells,
        sigma_db=cells,
        readings=9.0 * cells,
    )


@pytest.mark.long
def test_a_quick_run_leaves_all_figures_and_resumes_to_the_same_bytes(tmp_path):
    """From the command line, in one process and again with two workers."""
    done = called("study", "published/liang2020", "--quick", "--jobs", 1, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "orderings of the paper are shown to hold" in done.stdout
    folder = tmp_path / "out/published/liang2020_quick"
    names = ["report.html", "results.jsonl", "tables/errors.csv", "tables/orderings.csv"]
    assert all((folder / f"figures/{name}.{kind}").stat().st_size for name in FIGURES for kind in ("svg", "png"))
    before = {name: (folder / name).read_bytes() for name in names}
    assert called("study", "published/liang2020", "--quick", "--resume", cwd=tmp_path).returncode == 0
    assert {name: (folder / name).read_bytes() for name in names} == before
    command = [sys.executable, "-m", "layoutopt", "study", "published/liang2020", "--quick", "--jobs", "2"]
    subprocess.run([*command, "--out", "two"], cwd=tmp_path, check=True, capture_output=True, timeout=280)
    for name in ("report.html", "tables/errors.csv", "tables/orderings.csv"):
        assert (tmp_path / "two" / name).read_bytes() == before[name], name
    with (folder / "tables/errors.csv").open(encoding="utf-8", newline="") as file:
        assert all(0.0 < float(row["error_median_m"]) < 10.0 for row in csv.DictReader(file))
