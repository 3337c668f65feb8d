"""The command line; the only place that looks upward to studies, and only inside its functions."""

import io
import json
import math
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from layoutopt import cli_floor, cli_help
from layoutopt.cli_help import Commands, Version
from layoutopt.cli_parts import (
    QUICK_LOOK,
    Jobs,
    LayoutFile,
    Out,
    SpecFile,
    attended,
    filed_layout,
    fit_for_file,
    fit_for_folder,
    job_count,
    print_lines,
    spec_of,
)
from layoutopt.errors import Interrupted, InvalidInput, LayoutoptError, StudyStopped
from layoutopt.units import positive_quantity, printable

if TYPE_CHECKING:
    from layoutopt.workers import Backend

INTERNAL_ERROR: Final = 4
_SETTINGS_OF_OTHERS: Final = (".numba_config.yaml", "matplotlibrc")

app = typer.Typer(
    cls=Commands,
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def main() -> None:
    """Run the command line; every error of the user's ends in one message and its exit code."""
    try:
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                # A terminal or pipe without ± or ² shows something else rather than nothing at all.
                stream.reconfigure(errors="replace")
        # Without standalone mode the exit code of a command comes back as the value of the call.
        sys.exit(app(standalone_mode=False) or 0)
    except LayoutoptError as error:
        print(printable(str(error)), file=sys.stderr)
        sys.exit(error.exit_code)
    except OSError as error:
        print(f"{error.filename or 'system'}: {error.strerror or error}; choose another place", file=sys.stderr)
        sys.exit(InvalidInput.exit_code)
    except Exception as error:
        _usage_or_internal(error)


@app.callback()
def start(version: Version = False) -> None:
    """Design RFID positioning systems for indoor mobile robots: readers, antennas and floor tags."""
    from layoutopt import registry

    for name in _SETTINGS_OF_OTHERS:
        if Path(name).exists():
            raise InvalidInput.at(
                str(Path(name).absolute()),
                "would change how libraries of layoutopt work, and may come from a stranger",
                "Start layoutopt from another folder.",
            )
    # A user's own studies.py would be imported in place of ours; say so before anything else fails of it.
    for point in ("objectives", "solvers", "studies"):
        registry.rows(point)


@app.command()
def study(
    name: Annotated[str, typer.Argument(help="Name of a study, or 'list'.")],
    spec_file: SpecFile = None,
    out: Out = None,
    jobs: Jobs = 0,
    quick: Annotated[bool, typer.Option("--quick", help="A short look; nothing to build from.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on where an earlier run in --out stopped.")] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say what would run and how long, then stop.")
    ] = False,
    backend: Annotated[
        str, typer.Option("--backend", help="Who computes: loky (processes here), dask (a cluster) or serial.")
    ] = "",
    scheduler: Annotated[
        str, typer.Option("--scheduler", help="Address of a dask scheduler, such as tcp://head:8786.")
    ] = "",
    shard: Annotated[
        str | None, typer.Option("--shard", help="Run part i/n of a round, such as 3/16; see layoutopt merge.")
    ] = None,
    time_limit: Annotated[
        str | None, typer.Option("--time-limit", help="Stop after a time such as '2 h'; not reproducible.")
    ] = None,
    max_trials: Annotated[
        int | None, typer.Option("--max-trials", min=1, help="Stop after so many trials; reproducible.")
    ] = None,
    longest_task: Annotated[
        str, typer.Option("--longest-task", help="A task that takes longer counts as one that never ends.")
    ] = "15 min",
    json_progress: Annotated[
        bool, typer.Option("--json-progress", help="Progress as JSON lines on standard error.")
    ] = False,
) -> None:
    """Run a study: report, figures, drawings and tables go to --out."""
    from layoutopt import registry

    if name == "list":
        for known in registry.names("studies"):
            print(f"{known}: {registry.card('studies', known).question}")
        return
    study_type = registry.load("studies", name, place="layoutopt study")
    from layoutopt.console import ConsoleProgress, JsonProgress
    from layoutopt.stopping import StopReason, StopRequest, asked_by_signals
    from layoutopt.workers import Workers
    from studies import effort, folder, shards

    place = out or Path("out") / (f"{name}_quick" if quick else name)
    fit_for_folder("--out", place)
    part = None if shard is None else shards.parse_shard(shard)
    stop = StopRequest(time_limit_s=math.inf if time_limit is None else _duration("--time-limit", time_limit))
    longest_s = _duration("--longest-task", longest_task)
    if part is not None and max_trials is not None:
        raise InvalidInput.at(
            "--max-trials", "counts for a whole study, not for a shard", "Leave one of them out."
        )
    chosen = _backend(backend, scheduler)
    spec = spec_of(spec_file)
    go_on = _go_on(sys.argv[1:])
    code = 0
    try:
        with (JsonProgress if json_progress else ConsoleProgress)() as progress:
            workers = Workers(
                chosen,
                jobs=job_count(jobs),
                scheduler=scheduler,
                longest_s=longest_s,
                stop=stop,
                note=progress.note,
            )
            run = folder.Run(
                resume=resume, quick=quick, workers=workers, stop=stop, most_trials=max_trials, go_on=go_on
            )
            with asked_by_signals(stop, progress.note):
                question = study_type.for_spec(spec, quick=quick, workers=workers)
                if dry_run:
                    lines = effort.plan_lines(question.plan(), spec.seed, workers)
                elif part is not None:
                    lines = folder.run_shard(name, question, spec, place, part, run=run, progress=progress)
                else:
                    answer = folder.run_study(name, question, spec, place, run=run, progress=progress)
                    lines, code = answer.lines(place), answer.exit_code
    except (StudyStopped, KeyboardInterrupt) as error:
        stopped = error if isinstance(error, StudyStopped) else Interrupted("stopped at once")
        code = Interrupted.exit_code if stop.reason is StopReason.ASKED else stopped.exit_code
        print(f"{stopped}\ngo on with: {go_on}", file=sys.stderr)
        raise typer.Exit(code) from None
    if quick and not dry_run:
        print(QUICK_LOOK)
    print_lines(lines)
    if code == StudyStopped.exit_code:
        print(f"go on with: {go_on}", file=sys.stderr)
    raise typer.Exit(code)


@app.command()
def merge(
    folder: Annotated[Path, typer.Argument(help="The --out folder of a study that ran in shards.")],
    others: Annotated[
        list[Path] | None, typer.Argument(help="Folders of shards that lie elsewhere, if there are any.")
    ] = None,
) -> None:
    """Bring the shards of a study together: the answer if it is done, else what is to be run next (exit 3)."""
    from layoutopt.console import ConsoleProgress
    from studies import shards

    with ConsoleProgress() as progress:
        merged = shards.merge(folder, others or [], progress)
    print_lines(merged.lines)
    if merged.answer is None:
        raise typer.Exit(StudyStopped.exit_code)
    print_lines(merged.answer.lines(folder))
    raise typer.Exit(merged.answer.exit_code)


@app.command()
def status(
    folder: Annotated[Path, typer.Argument(help="The --out folder of a study, running or not.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of lines.")] = False,
) -> None:
    """Say how a study stands: round, rate, time left, best so far, failures; writes nothing."""
    from studies.status import read_status

    found = read_status(folder)
    if as_json:
        print(json.dumps(found.as_json(), indent=2, allow_nan=False))
    else:
        print_lines(found.lines())


@app.command()
def check(
    spec_file: SpecFile = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", help="Draw plan, rooms and free space to this name + .svg, .png.")
    ] = None,
) -> None:
    """Read spec, plan and prices; print every fault at once, or extents, rooms, areas, counts and effort."""
    from layoutopt import registry
    from layoutopt.result import Status
    from layoutopt.workers import Backend, Workers
    from studies import effort

    if picture is not None:
        fit_for_file("--picture", picture)
    spec = spec_of(spec_file)
    print_lines(effort.describe(spec))
    if picture is not None:
        print_lines(f"picture: {path}" for path in effort.draw_plan(spec, picture))
    workers = Workers(Backend.LOKY, jobs=job_count(0))
    plan = registry.load("studies", "cost_vs_accuracy").for_spec(spec, quick=False, workers=workers).plan()
    if plan.pilot:
        print("trying out a few drives, to predict how long a study takes here", file=sys.stderr)
    print_lines(effort.plan_lines(plan, spec.seed, workers))
    if not plan.pilot:
        words = ("layoutopt", "check", *([] if spec_file is None else [str(spec_file)]))
        print_lines([f"next: {shlex.join(words)}    (once the spec is changed)"])
        raise typer.Exit(Status.INFEASIBLE.exit_code)
    if spec_file is not None:
        words = ("layoutopt", "study", "cost_vs_accuracy", str(spec_file), "--out", f"out/{spec_file.stem}")
        print_lines([f"next: {shlex.join(words)}    (a first look: add --quick)"])


@app.command()
def solve(
    spec_file: SpecFile = None,
    target_error: Annotated[str | None, typer.Option("--target-error", help="For example '10 mm'.")] = None,
    budget: Annotated[str | None, typer.Option("--budget", help="For example '3000 EUR' or 3000.")] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Layout file to write.")] = None,
    jobs: Jobs = 0,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer layouts and trials.")] = False,
) -> None:
    """Find the cheapest layout that meets a target error, or the most accurate one within a budget."""
    from layoutopt.spec.layout_file import write_layout
    from studies import answers, summary

    if out is not None:
        fit_for_file("--out", out)
    spec = answers.with_demand(spec_of(spec_file), target_error=target_error, budget=budget)
    with attended(jobs, apart=True) as by:
        findings = answers.solve(spec, workers=by.workers, stop=by.stop, quick=quick, progress=by.progress)
    chosen = answers.chosen(findings, by_budget=target_error is None and budget is not None)
    if quick:
        print(QUICK_LOOK)
    print_lines(summary.findings_lines(findings, None))
    if out is not None and chosen is not None and not findings.result.status.exit_code:
        write_layout(chosen.layout, spec, out, quick_look=quick)
        print(f"wrote {out}")
    elif out is not None:
        print(f"{out} was not written: no layout answers the demand")
    raise typer.Exit(findings.result.status.exit_code)


@app.command()
def score(
    layout_file: LayoutFile,
    trials: Annotated[int, typer.Option("--trials", min=2, help="Replications a scenario and estimator.")] = 100,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    jobs: Jobs = 0,
) -> None:
    """Print every objective of one layout, simulated ones with standard error and number of trials."""
    from layoutopt.workers import Backend, Workers
    from studies import answers

    filed = filed_layout(layout_file)
    workers = Workers(Backend.LOKY if job_count(jobs) > 1 else Backend.SERIAL, jobs=job_count(jobs))
    scored = answers.score(filed.spec, filed.layout, trials=trials, workers=workers)
    print(json.dumps(scored.as_json(), indent=2, allow_nan=False) if as_json else scored.as_text())
    raise typer.Exit(1 if scored.violations or scored.failures else 0)


@app.command()
def explain(
    layout_file: LayoutFile,
    trials: Annotated[int, typer.Option("--trials", min=2, help="Drives of each layout and scenario.")] = 150,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of lines.")] = False,
    jobs: Jobs = 0,
) -> None:
    """Say which limits bind, what each reader and tag row is worth, and what would be cheaper."""
    from studies import explain as question
    from studies.explain_lines import explained_json, explained_lines

    filed = filed_layout(layout_file)
    with attended(jobs) as by:
        found = question.explain(filed.spec, filed.layout, trials=trials, workers=by.workers, progress=by.progress)
    if as_json:
        print(json.dumps(explained_json(found), indent=2, allow_nan=False))
    else:
        print_lines(explained_lines(found))
    raise typer.Exit(found.exit_code)


@app.command()
def reprice(
    folder: Annotated[Path, typer.Argument(help="Folder of a finished study.")],
    prices: Annotated[Path, typer.Argument(help="Price list (TOML).")],
    out: Annotated[Path | None, typer.Option("--out", help="CSV file for the new front.")] = None,
) -> None:
    """Print front and choices of a finished study under other prices, without any new simulation."""
    from studies import output, repricing, summary

    if out is not None:
        fit_for_file("--out", out)
    findings, left_out = repricing.reprice(folder, prices)
    print_lines([*summary.front_lines(findings), *repricing.choice_lines(findings)])
    if left_out:
        print(f"left out: {left_out} simulated layouts with too few trials to be compared with the front")
    if out is not None:
        output.write_front(findings, out)
        print(f"wrote {out}")
    raise typer.Exit(findings.result.status.exit_code)


_ELSEWHERE: Final[tuple[Callable[..., None], ...]] = (
    *(cli_floor.draw, cli_floor.snap, cli_floor.commission, cli_floor.expand, cli_floor.replay),
    *(cli_help.new, cli_help.report, cli_help.prices, cli_help.cite, cli_help.doctor),
)
for _command in _ELSEWHERE:
    app.command()(_command)


def _backend(name: str, scheduler: str) -> "Backend":
    """Return who computes; an address of a scheduler alone asks for its cluster."""
    from layoutopt.errors import UnknownName, did_you_mean
    from layoutopt.workers import Backend

    name = name or (Backend.DASK if scheduler else Backend.LOKY)
    if name not in tuple(Backend):
        raise UnknownName.at("--backend", f"there is none called {name!r}", did_you_mean(name, Backend))
    if name == Backend.DASK and not scheduler:
        raise InvalidInput.at("--backend dask", "needs a scheduler", "Add --scheduler tcp://HOST:8786.")
    if name != Backend.DASK and scheduler:
        raise InvalidInput.at(f"--scheduler {scheduler}", f"--backend {name} has none", "Leave one of them out.")
    return Backend(name)


def _duration(option: str, text: str) -> float:
    return positive_quantity(option, text, "time", "2 h")


def _go_on(arguments: list[str]) -> str:
    """Return the command that goes on with a study which these arguments began, beyond a limit on its trials."""
    kept, values = [], iter(arguments)
    for argument in values:
        if argument == "--max-trials":
            next(values, None)
        elif not argument.startswith("--max-trials="):
            kept.append(argument)
    # A shard goes on by itself.
    resuming = [] if any(argument.startswith(("--resume", "--shard")) for argument in kept) else ["--resume"]
    return shlex.join(["layoutopt", *kept, *resuming])


def _usage_or_internal(error: Exception) -> None:
    """Report a wrong option (click's own errors carry an exit code) or a bug of ours."""
    show = getattr(error, "show", None)
    if callable(show):
        show()
        sys.exit(getattr(error, "exit_code", InvalidInput.exit_code))
    import traceback

    traceback.print_exc()
    print("layoutopt: this is a bug in layoutopt; please report it with the lines above", file=sys.stderr)
    sys.exit(INTERNAL_ERROR)
