"""What the commands share: types of their arguments, checks of their outputs, printing."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from layoutopt.errors import InvalidInput
from layoutopt.machine import usable_processors
from layoutopt.units import printable

if TYPE_CHECKING:
    from layoutopt.progress import Progress
    from layoutopt.spec.building import Spec
    from layoutopt.spec.layout_file import FiledLayout
    from layoutopt.stopping import StopRequest
    from layoutopt.workers import Workers

BUILT_IN: Final = "hospital_ward"
"""The spec that is taken where none is given."""

QUICK_LOOK: Final = "QUICK LOOK on few layouts and drives: nothing to build from. Run without --quick."

FROM_QUICK_LOOK: Final = "this layout comes from a quick look at few layouts and drives; do not install from it"

SpecFile = Annotated[Path | None, typer.Argument(help="Spec file (TOML); without one the built-in hospital ward.")]
LayoutFile = Annotated[Path, typer.Argument(help="Layout file, as a study writes it to layouts/KEY.toml.")]
Out = Annotated[Path | None, typer.Option("--out", help="Folder to write to.")]
Jobs = Annotated[int, typer.Option("--jobs", min=0, help="Worker processes; 0 takes every processor.")]


def spec_of(file: Path | None) -> "Spec":
    """Return the spec of a file, or the built-in one.

    Raises
    ------
    InvalidInput
        With every fault of the file.
    """
    from layoutopt.spec.reading import read_spec
    from layoutopt.spec.template import built_in

    return read_spec(file if file is not None else built_in(BUILT_IN))


def filed_layout(file: Path) -> "FiledLayout":
    """Return what a layout file holds; if a quick look chose its layout, say so on standard error.

    Raises
    ------
    InvalidInput
        With every fault of the file.
    """
    from layoutopt.spec.layout_file import read_filed_layout

    filed = read_filed_layout(file)
    if filed.quick_look:
        print(f"note: {FROM_QUICK_LOOK}", file=sys.stderr)
    return filed


def print_lines(lines: Iterable[str]) -> None:
    """Print lines with what no terminal can show made visible."""
    print("\n".join(printable(line) for line in lines))


def job_count(jobs: int) -> int:
    """Return how many processes to use: so many, or for zero one for each processor that is ours."""
    return jobs or usable_processors()


@dataclass(frozen=True, slots=True, kw_only=True)
class Attended:
    """Workers whose progress is shown and who end when a signal asks for it."""

    workers: "Workers"
    progress: "Progress"
    stop: "StopRequest"


@contextmanager
def attended(jobs: int, *, apart: bool = False) -> Iterator[Attended]:
    """Give workers for a question that keeps nothing of its own.

    One job works in this process; with ``apart`` in one of its own all the same, so that a layout that kills it or
    hangs costs only itself.
    """
    from layoutopt.console import ConsoleProgress
    from layoutopt.stopping import StopRequest, asked_by_signals
    from layoutopt.workers import Backend, Workers

    stop, count = StopRequest(), job_count(jobs)
    with ConsoleProgress() as progress, asked_by_signals(stop, progress.note):
        backend = Backend.LOKY if apart or count > 1 else Backend.SERIAL
        workers = Workers(backend, jobs=count, stop=stop, note=progress.note)
        yield Attended(workers=workers, progress=progress, stop=stop)


def fit_for_folder(option: str, folder: Path) -> None:
    """Refuse an output folder that cannot be one, before any work is done for it."""
    blocking = next((path for path in (folder, *folder.parents) if path.exists()), None)
    if blocking is not None and not blocking.is_dir():
        raise InvalidInput.at(f"{option} {folder}", f"{blocking} is a file", "Choose a folder.")


def fit_for_file(option: str, file: Path) -> None:
    """Refuse an output file that cannot be written, before any work is done for it."""
    if file.is_dir():
        raise InvalidInput.at(f"{option} {file}", "it is a folder", "Choose the name of a file.")
    if not file.parent.is_dir():
        raise InvalidInput.at(f"{option} {file}", f"there is no folder {file.parent}", "Make it first.")
