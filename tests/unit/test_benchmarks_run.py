"""The benchmarks run, on workloads too small to time anything, and what they compare is one filter."""

import importlib
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from layoutopt.evaluate import Evaluator
from layoutopt.streams import Streams

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def script(monkeypatch):
    """Import a benchmark's script by its name; the scripts find each other in their own folder."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    known = set(sys.modules)
    yield importlib.import_module
    for name in set(sys.modules) - known:
        if str(getattr(sys.modules[name], "__file__", None)).startswith(str(BENCHMARKS)):
            del sys.modules[name]


def test_peers_get_the_filter_of_this_project(script, tmp_path):
    """Kernel, twin and the numpy parts that peers use have the same error, so their times can be compared.

    Over 400 runs of this drive the error spread by 4 % (standard deviation), and none was off by a third.
    """
    mcl_peers = script("mcl_peers")
    log = script("workload").logged(step_count=300)
    log.save(tmp_path / "drive.npz")
    command = [sys.executable, str(BENCHMARKS / "peers" / "plain_numpy.py"), str(tmp_path / "drive.npz"), "500"]
    with mcl_peers.Worker(command) as worker:
        times_s, errors_m = mcl_peers.in_turn({**mcl_peers.own_runs(log, 500), "plain numpy": worker}, 3)
    assert mcl_peers.disagreements(errors_m) == []
    assert {mcl_peers.KERNEL, mcl_peers.TWIN, "plain numpy"} <= set(errors_m)
    assert all(len(taken_s) == 3 and (taken_s > 0.0).all() for taken_s in times_s.values())


def test_a_filter_that_is_off_is_named(script):
    """Another error stops the comparison: in the same filter either way, in another kind only a larger one."""
    mcl_peers = script("mcl_peers")
    same = {mcl_peers.KERNEL: 0.006, mcl_peers.TWIN: 0.006, "plain numpy": 0.006}
    assert mcl_peers.disagreements({**same, "layoutopt mcl_crossings": 0.002}) == []
    assert len(mcl_peers.disagreements({**same, "layoutopt mcl_crossings": 0.010})) == 1
    assert "Stone Soup" in mcl_peers.disagreements({**same, "Stone Soup": 0.003})[0]
    assert "Stone Soup" in mcl_peers.disagreements({**same, "Stone Soup": 0.010})[0]


def test_ratios_are_taken_round_by_round(script):
    """A machine that slows down between two rounds slows both sides, and their ratio stays."""
    mcl_peers = script("mcl_peers")
    times_s = {mcl_peers.KERNEL: np.array([0.01, 0.02, 0.04]), "plain numpy": np.array([0.2, 0.4, 0.8])}
    rows = mcl_peers.table(times_s, dict.fromkeys(times_s, 0.006), steps=1000, particles=500).splitlines()
    assert rows[2] == f"| {mcl_peers.KERNEL} | 25 | 6.00 | 20 (20 to 20) |"
    assert rows[3].endswith("| 1 |")


def test_scaling_runs(script):
    """Every table has a row for each size, and the shares of a trial's parts add up to all of it."""
    scaling = script("scaling")
    assert len(scaling.against_particles(2, particles=(10, 20), step_count=20)) == 2
    areas = scaling.against_area(2, sides_m=(2.0, 4.0), step_count=20)
    assert [row.split(" | ")[1] for row in areas] == ["400", "1600"]
    times_s = scaling.parts_of_a_trial(2, step_count=20)
    assert set(times_s) == {"drive", "sensing", "estimator", "outcomes"}
    assert len(scaling.shares(times_s)) == 5


def test_geometry_runs(script):
    """Every table has its rows, and our query finds what shapely's index finds."""
    geometry = script("geometry")
    assert len(geometry.single_calls(1)) == 8
    assert geometry.against_index(1, tags=2000, segments=50)[0].startswith("| 50 | 2,000 |")
    assert geometry.against_twin(1, directions=2, tile_count=1)[0].startswith("| tilted | 2 |")
    assert not geometry.same_pairs(np.zeros((2, 3)), np.ones((2, 3)))


def test_sweeps_run(script):
    """Shares are shares, and what was evaluated is in the journal when it is opened again."""
    sweeps = script("sweeps")
    found = sweeps.stage(4, trials_a_task=1)
    assert 0.0 < found.efficiency <= 1.0
    assert 0.0 < found.parent < 1.0
    assert 0.0 < sweeps.spinning(calls=2, spins=1000) <= 1.0
    assert len(sweeps.memory_and_resume(20)) == 5


def test_tracking_runs(script):
    """Every tracker has its row, and its two forms give one track."""
    rows = script("tracking").rows(1, duration_s=4.0)
    assert [row.split(" | ")[0] for row in rows] == ["| uhf_laser", "| uhf_laser_heading"]


def test_racing_runs(script):
    """A race keeps to its trials, and the front of the reference has all of the reference's hypervolume."""
    racing = script("racing")
    problem, contenders = racing.question(thinning=160)
    problem = replace(problem, design=replace(problem.design, step_count=200))
    table = racing.reference(problem, contenders, 16, Evaluator(Streams(seed=1)))
    assert table.ratio(table.front, logarithmic=True) == 1.0
    evaluate = racing.looked_up(problem, contenders, table.errors)
    found = racing.race(problem, contenders, racing.Racing(trials=3 * len(contenders)), evaluate)
    assert 0 < found.trials_on_front <= found.trials <= 3 * len(contenders)
    assert 0.0 < table.ratio(found.rows, logarithmic=False) <= 1.0
    assert len(racing.compared(problem, contenders, table, 4, 1)) == 5


@pytest.fixture
def blocks(script):
    """Return the module, a small ward, and two blocks of its trials with their references."""
    search_peers = script("search_peers")
    space = search_peers.ward((20, 5, 1))
    problem = replace(space.problem, design=replace(space.problem.design, step_count=200))
    table = search_peers.racing.reference(problem, space.contenders, 8, Evaluator(Streams(seed=1)))
    return search_peers, space, search_peers.racing.blocks(table, 2)


def test_searches_by_trials_are_compared(blocks):
    """Race, equal shares and random search keep to the same budget, and every one has its row."""
    search_peers, space, parts = blocks
    assert space.places.max(axis=0).tolist() == [1, 1, 1]
    assert len(space.contenders) == 8
    found = search_peers.own(space, parts, 20)
    command = [sys.executable, str(BENCHMARKS / "peers" / "search_random.py")]
    searched = search_peers.asked(command, space, parts, [12, 20])
    assert len(searched[12]) == len(searched[20]) == 4
    found |= {"random search": search_peers.best(searched[20]), "all": search_peers.all_trials(parts)}
    for name, score in found.items():
        assert score.trials.tolist() == ([32.0] * 2 if name == "all" else [20.0] * 2)
        assert ((score.plain > 0.0) & (score.plain <= 100.0)).all()
    rows = search_peers.rows_of(found, 8)
    assert len(rows) == 7
    assert rows[4].startswith("| equal shares |  | 2.50 | ")


def test_a_search_that_reads_all_selects_the_front_of_its_block(blocks):
    """Whoever reads every trial of a block selects what the means over the block say."""
    search_peers, space, parts = blocks
    command = [sys.executable, str(BENCHMARKS / "peers" / "search_random.py")]
    for score in search_peers.asked(command, space, parts, [32])[32].values():
        assert score.trials.tolist() == [32.0, 32.0]
        assert score.logarithmic.tolist() == search_peers.all_trials(parts).logarithmic.tolist()


@pytest.mark.long
def test_searches_of_other_packages_run(blocks):
    """Every peer keeps to the budget with each of its settings."""
    python = BENCHMARKS.parent / ".venv-search-peers" / "bin" / "python"
    if not python.exists():
        pytest.skip("no environment of the peers: make benchmark-search-peers makes it")
    search_peers, space, parts = blocks
    for name, (file, *words) in search_peers.PEERS.items():
        command = [str(python), str(BENCHMARKS / "peers" / file), *words]
        scores = search_peers.asked(command, space, parts, [20])[20]
        assert all(score.trials.tolist() == [20.0, 20.0] for score in scores.values()), name
        assert len(scores) >= 8


def test_covering_runs(script):
    """Three solvers agree on a small grid, the table has a row for each, and a missed aim is named."""
    covering = script("covering")
    problem, places = covering.instance(6)
    assert np.bincount(problem.sees.row).tolist()[:3] == [8, 11, 13]
    assert places[7].tolist() == [1, 1]
    found = covering.own(6, limit_s=5.0)
    assert found[covering.OURS].value == found[covering.HIGHS].value <= found[covering.GREEDY].value
    assert found[covering.OURS].gap == 0.0
    assert covering.rows_of(6, found)[1].startswith("| 6 | greedy | ")
    assert covering.missed(20, found) == []
    worse = {**found, covering.OURS: replace(found[covering.OURS], value=30)}
    assert len(covering.missed(20, worse)) == 2
    with pytest.raises(RuntimeError, match="36 cells are not covered"):
        covering.measured(problem, lambda: (np.zeros(36, dtype=np.bool_), None))
