"""Studies that are done in a second and a command line within this process, for tests of how studies are run."""

import contextlib
import io
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar
from unittest.mock import patch

import studies
from layoutopt.cli import main
from layoutopt.estimators.midrange import Midrange
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.protocols import StudyCard
from studies import output
from studies.cells import Cell, CellStudy
from studies.held_out import failures_of

SPEC = """
schema = 1
seed = 3
[site]
floor = [[0,0],[3,0],[3,2],[0,2]]
[robots]
count = 1
outline = [["-0.2 m","-0.2 m"],["0.2 m","-0.2 m"],["0.2 m","0.2 m"],["-0.2 m","0.2 m"]]
[space]
antenna_side = "40 mm"
antenna_height = "20 mm"
antennas_per_module = 1
readers = [{ family = "ring", count = 4, radius = "0.15 m" }]
patterns = [{ family = "square", pitch = { from = "150 mm", to = "300 mm", steps = 3 } }]
[goal]
target_error = "60 mm"
[study]
search_trials = 16
validation_trials = 8
duration = "4 s"
particles = 50
validate_with = ["mcl_adaptive", "midrange"]
"""
TABLES = (
    "designs.csv",
    "front.csv",
    "validation.csv",
    "references.csv",
    "pairing.csv",
    "screening.csv",
    "exchange_rates.csv",
    "portfolio.csv",
)


def called(*arguments, cwd):
    """Return what a process of the command line would: exit code and what it printed; its workers are its own."""
    words = ["layoutopt", *map(str, arguments)]
    out, err, code = io.StringIO(), io.StringIO(), None
    with (
        contextlib.chdir(cwd),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        patch.object(sys, "argv", words),
    ):
        try:
            main()
        except SystemExit as ended:
            code = ended.code
    return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())


def tables(folder):
    """Return the bytes of all derived tables."""
    return {name: (folder / name).read_bytes() for name in TABLES}


def leave_out_drawings(monkeypatch):
    """Have no drawings and reports made, which take most of the time of a small study."""
    monkeypatch.setattr(output, "write_overview", lambda *_, **__: [])
    monkeypatch.setattr(output, "write_report", lambda *_, **__: None)


class Other:
    """An estimator under another's name and key."""

    def __init__(self, estimator):
        self._estimator = estimator

    def __getattr__(self, name):
        return getattr(self._estimator, name)


class Faulty(Other):
    """One that raises."""

    def run(self, *known):
        raise RuntimeError("a wheel came off")


class Slow(Other):
    """One that takes its time."""

    def run(self, *known):
        time.sleep(SmallCells.pause_s)
        return self._estimator.run(*known)


CARD = StudyCard(
    summary="Three layouts, two estimators.",
    reference="own",
    question="What do cells say?",
    adaptive=False,
    rests_on="Cells that are made up.",
    next_step="Nothing.",
    guide="index",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SmallCells(CellStudy[tuple[str, str]]):
    """A study of one round of a dozen tasks, whose answer is one table."""

    spec: object
    trials: int
    card: ClassVar[StudyCard] = CARD
    faulty: ClassVar[bool] = False
    pause_s: ClassVar[float] = 0.0

    @classmethod
    def for_spec(cls, spec, *, quick, workers=None):
        return cls(spec=spec, trials=2 if quick else 20)

    def cells(self) -> Iterator[tuple[tuple[str, str], Cell]]:
        problem = self.spec.problem()
        for layout in problem.space.layouts():
            for estimator in (Midrange(), OdometryAlone()):
                used = Faulty(estimator) if self.faulty and estimator.name == "midrange" else Slow(estimator)
                yield (
                    (layout.label, estimator.name),
                    Cell(layout=layout, scenario=problem.design, estimator=used, trials=self.trials),
                )

    def answer(self, evaluations, spec):
        return TableAnswer(self.finished(evaluations), failures_of(evaluations))


@dataclass(frozen=True)
class TableAnswer:
    """An answer that is one table of mean errors."""

    found: dict
    failures: dict

    @property
    def exit_code(self):
        return 1 if self.failures else 0

    def lines(self, folder):
        return [f"{len(self.found)} cells", *(f"failed: {text}" for text in self.failures.values())]

    def write(self, folder, *, streams, quick):
        rows = [
            f"{label},{estimator},{table.score('position_error_mean').value!r}\n"
            for (label, estimator), table in self.found.items()
        ]
        (folder / "cells.csv").write_text("".join(rows), encoding="utf-8")


def begin_slow_cells(*arguments, cwd, stderr):
    """Begin a study of `SmallCells` that takes its time in a process of its own, and return the process."""
    program = (
        "import small_studies, studies, layoutopt.cli\n"
        "studies.ROWS['cells'] = 'small_studies:SmallCells'\n"
        "small_studies.SmallCells.pause_s = 0.05\n"
        "layoutopt.cli.main()\n"
    )
    path = os.pathsep.join(filter(None, [str(Path(__file__).parent), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-c", program, "study", "cells", *map(str, arguments)]
    return subprocess.Popen(command, cwd=cwd, env={**os.environ, "PYTHONPATH": path}, stderr=stderr)


def register_cells(monkeypatch):
    """Have the command line know `SmallCells` by the name ``cells``."""
    monkeypatch.setitem(studies.ROWS, "cells", "small_studies:SmallCells")
