"""The command line; the only place that looks upward to studies, and only inside its functions."""

import io
import json
import math
import os
import shlex
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from layoutopt.errors import Interrupted, InvalidInput, LayoutoptError, StudyStopped
from layoutopt.units import positive_quantity, printable

if TYPE_CHECKING:
    from layoutopt.spec.building import Spec
    from layoutopt.workers import Backend

INTERNAL_ERROR: Final = 4
BUILT_IN: Final = "hospital_ward"
_SETTINGS_OF_OTHERS: Final = (".numba_config.yaml", "matplotlibrc")

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

SpecFile = Annotated[Path | None, typer.Argument(help="Spec file (TOML); without one the built-in hospital ward.")]
LayoutFile = Annotated[Path, typer.Argument(help="Layout file, as a study writes it to layouts/KEY.toml.")]
Out = Annotated[Path | None, typer.Option("--out", help="Folder to write to.")]
Jobs = Annotated[int, typer.Option("--jobs", min=0, help="Worker processes; 0 takes every processor.")]


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
def start() -> None:
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
    _fit_for_folder("--out", place)
    part = None if shard is None else shards.parse_shard(shard)
    stop = StopRequest(time_limit_s=math.inf if time_limit is None else _duration("--time-limit", time_limit))
    longest_s = _duration("--longest-task", longest_task)
    if part is not None and max_trials is not None:
        raise InvalidInput.at(
            "--max-trials", "counts for a whole study, not for a shard", "Leave one of them out."
        )
    chosen = _backend(backend, scheduler)
    spec = _spec(spec_file)
    go_on = _go_on(sys.argv[1:])
    code = 0
    try:
        with (JsonProgress if json_progress else ConsoleProgress)() as progress:
            workers = Workers(
                chosen,
                jobs=_jobs(jobs),
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
        print("QUICK LOOK on few layouts and drives: nothing to build from. Run without --quick.")
    _print(lines)
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
    _print(merged.lines)
    if merged.answer is None:
        raise typer.Exit(StudyStopped.exit_code)
    _print(merged.answer.lines(folder))
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
        _print(found.lines())


@app.command()
def new(
    file: Annotated[Path, typer.Argument(help="Spec file to write.")],
    example: Annotated[str, typer.Option("--from", help="Built-in example to start from.")] = BUILT_IN,
) -> None:
    """Write a commented spec that runs as it is."""
    from layoutopt.atomic_file import replacing
    from layoutopt.spec.template import template

    if file.exists():
        raise InvalidInput.at(str(file), "it exists already", "Choose another name.")
    _fit_for_file("FILE", file)
    text = template(example)
    with replacing(file) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    print(f"wrote {file}; next: layoutopt check {file}")


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
        _fit_for_file("--picture", picture)
    spec = _spec(spec_file)
    _print(effort.describe(spec))
    if picture is not None:
        _print(f"picture: {path}" for path in effort.draw_plan(spec, picture))
    workers = Workers(Backend.LOKY, jobs=_jobs(0))
    plan = registry.load("studies", "cost_vs_accuracy").for_spec(spec, quick=False, workers=workers).plan()
    _print(effort.plan_lines(plan, spec.seed, workers))
    if not plan.pilot:
        raise typer.Exit(Status.INFEASIBLE.exit_code)


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
    from layoutopt.console import ConsoleProgress
    from layoutopt.spec.layout_file import write_layout
    from layoutopt.stopping import StopRequest, asked_by_signals
    from layoutopt.workers import Backend, Workers
    from studies import answers, summary

    if out is not None:
        _fit_for_file("--out", out)
    spec = answers.with_demand(_spec(spec_file), target_error=target_error, budget=budget)
    stop = StopRequest()
    with ConsoleProgress() as progress, asked_by_signals(stop, progress.note):
        workers = Workers(Backend.LOKY, jobs=_jobs(jobs), stop=stop, note=progress.note)
        findings = answers.solve(spec, workers=workers, stop=stop, quick=quick, progress=progress)
    chosen = answers.chosen(findings, by_budget=target_error is None and budget is not None)
    _print(summary.findings_lines(findings, None))
    if out is not None and chosen is not None and not findings.result.status.exit_code:
        write_layout(chosen.layout, spec, out)
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
    from layoutopt.spec.layout_file import read_layout
    from layoutopt.workers import Backend, Workers
    from studies import answers

    spec, layout = read_layout(layout_file)
    workers = Workers(Backend.LOKY if _jobs(jobs) > 1 else Backend.SERIAL, jobs=_jobs(jobs))
    scored = answers.score(spec, layout, trials=trials, workers=workers)
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
    from layoutopt.console import ConsoleProgress
    from layoutopt.spec.layout_file import read_layout
    from layoutopt.stopping import StopRequest, asked_by_signals
    from layoutopt.workers import Backend, Workers
    from studies import explain as question
    from studies.explain_lines import explained_json, explained_lines

    spec, layout = read_layout(layout_file)
    stop = StopRequest()
    with ConsoleProgress() as progress, asked_by_signals(stop, progress.note):
        backend = Backend.LOKY if _jobs(jobs) > 1 else Backend.SERIAL
        workers = Workers(backend, jobs=_jobs(jobs), stop=stop, note=progress.note)
        found = question.explain(spec, layout, trials=trials, workers=workers, progress=progress)
    if as_json:
        print(json.dumps(explained_json(found), indent=2, allow_nan=False))
    else:
        _print(explained_lines(found))
    raise typer.Exit(found.exit_code)


@app.command()
def draw(
    layout_file: LayoutFile,
    out: Out = None,
    area: Annotated[
        str | None,
        typer.Option("--area", help="Tag plans and schedules of this part only: '0 m, 0 m, 10 m, 8 m'."),
    ] = None,
    templates: Annotated[str, typer.Option("--templates", help="Paper of the 1:1 templates: A3 or A4.")] = "A3",
) -> None:
    """Write what installer and robot team need: sheets (PDF, SVG, DXF), tag map, poses, bill, work plan."""
    from layoutopt.drawings.installation import write_overview, write_sheets
    from layoutopt.drawings.sheet_set import TEMPLATE_PAPERS
    from layoutopt.spec.layout_file import read_layout

    folder = out or Path("drawings")
    _fit_for_folder("--out", folder)
    paper = next((name for name in TEMPLATE_PAPERS if name == templates), None)
    if paper is None:
        raise InvalidInput.at("--templates", f"there is no {templates!r}", f"Give {' or '.join(TEMPLATE_PAPERS)}.")
    bounds_m = None if area is None else _bounds(area)
    spec, layout = read_layout(layout_file)
    sheets, left_out = write_sheets(
        spec, layout, folder / "sheets", title=spec.site.name, area_m=bounds_m, template_paper=paper
    )
    title = "Installation of floor tags and readers"
    for path in (*write_overview(spec, layout, folder, title=title), *sheets):
        print(path)
    if left_out:
        print(printable(left_out))


def _bounds(text: str) -> tuple[float, float, float, float]:
    """Return xmin, ymin, xmax and ymax of an area, m."""
    from layoutopt.units import parse_quantity

    try:
        xmin, ymin, xmax, ymax = (parse_quantity(part, "length") for part in text.split(","))
    except ValueError as error:
        raise InvalidInput.at(f"--area {text!r}", str(error), "Write '0 m, 0 m, 10 m, 8 m'.") from None
    if not (xmin < xmax and ymin < ymax):
        repair = "Give the lower left corner, then the upper right one."
        raise InvalidInput.at(f"--area {text!r}", "it holds no area", repair)
    return xmin, ymin, xmax, ymax


@app.command()
def reprice(
    folder: Annotated[Path, typer.Argument(help="Folder of a finished study.")],
    prices: Annotated[Path, typer.Argument(help="Price list (TOML).")],
    out: Annotated[Path | None, typer.Option("--out", help="CSV file for the new front.")] = None,
) -> None:
    """Print the front of a finished study under other prices, without any new simulation."""
    from studies import answers, output, summary

    if out is not None:
        _fit_for_file("--out", out)
    findings, left_out = answers.reprice(folder, prices)
    _print(summary.front_lines(findings))
    if left_out:
        print(f"left out: {left_out} simulated layouts with too few trials to be compared with the front")
    if out is not None:
        output.write_front(findings, out)
        print(f"wrote {out}")


@app.command()
def replay(
    log_file: Annotated[Path, typer.Argument(help="Log of a drive (CSV): time, odometry, reads, truth.")],
    layout_file: LayoutFile,
    estimator: Annotated[
        str | None, typer.Option("--estimator", help="Name of an estimator; by default that of the search.")
    ] = None,
    start: Annotated[
        str | None, typer.Option("--start", help="Known start: 'X, Y, HEADING', such as '1.2 m, 3 m, 90 deg'.")
    ] = None,
    out: Out = None,
    seed: Annotated[int | None, typer.Option("--seed", min=0, help="Seed; by default the layout file's.")] = None,
) -> None:
    """Estimate the path of a real drive, and fit noise and read rates from it as values of a spec."""
    from layoutopt.commissioning.fitting import fit_drive
    from layoutopt.commissioning.log_reading import read_log
    from layoutopt.commissioning.output import replay_lines, write_replay
    from layoutopt.commissioning.replay import estimator_of, pose_in, replay_log
    from layoutopt.plots.drive_plan import draw_drive_plan
    from layoutopt.plots.figures import save
    from layoutopt.spec.layout_file import read_layout

    folder = out or Path("out") / "replay"
    _fit_for_folder("--out", folder)
    spec, layout = read_layout(layout_file)
    chosen = estimator_of(estimator or spec.study.validate_with[0], spec)
    pose = None if start is None else pose_in(start)
    log = read_log(log_file, layout=layout, tag_map=layout.floor_tags.lay_on(spec.site), robot=spec.robot)
    replayed = replay_log(log, spec, layout, chosen, seed=spec.seed if seed is None else seed, start=pose)
    fit = fit_drive(replayed)
    _print(replay_lines(replayed, fit))
    written = write_replay(replayed, fit, folder)
    axes = draw_drive_plan(
        layout=layout,
        site=spec.site,
        tag_map=replayed.knowledge.tags,
        path_m=replayed.trajectory.poses[:, :2],
        true_m=replayed.drive.truth[:, :2],
        read_tags=replayed.read_tags,
        lost=replayed.lost,
    )
    for path in (*written, *save(axes, folder / "path")):
        print(path)


@app.command()
def commission(
    layout_file: LayoutFile,
    scans: Annotated[Path, typer.Option("--scans", help="Scanned identities (CSV): tag_id, uid.")],
    survey: Annotated[
        Path | None, typer.Option("--survey", help="Measured places (CSV): tag_id, x_m, y_m.")
    ] = None,
    own_frame: Annotated[
        bool, typer.Option("--own-frame", help="The survey is in a frame of its own: fit it to the plan.")
    ] = False,
    tolerance: Annotated[str, typer.Option("--tolerance", help="A tag farther off than this is moved.")] = "10 mm",
    survey_sigma: Annotated[str, typer.Option("--survey-sigma", help="Error of a measured place.")] = "1 mm",
    trials: Annotated[int, typer.Option("--trials", min=2, help="Drives on which the floor is judged.")] = 150,
    out: Out = None,
    jobs: Jobs = 0,
) -> None:
    """Read back what was built: faults of the installation, its accuracy as built, the corrected tag map."""
    from layoutopt.commissioning.as_built import as_built
    from layoutopt.commissioning.site_records import read_scans, read_survey
    from layoutopt.console import ConsoleProgress
    from layoutopt.spec.layout_file import read_layout
    from layoutopt.stopping import StopRequest, asked_by_signals
    from layoutopt.workers import Backend, Workers
    from studies.as_built import judge, reach_of_several_m
    from studies.as_built_output import found_lines, judged_lines, write_built

    folder = out or Path("out") / "commission"
    _fit_for_folder("--out", folder)
    spec, layout = read_layout(layout_file)
    found = as_built(
        layout.floor_tags.lay_on(spec.site),
        read_scans(scans),
        None if survey is None else read_survey(survey),
        tolerance_m=positive_quantity("--tolerance", tolerance, "length", "10 mm"),
        survey_sigma_m=positive_quantity("--survey-sigma", survey_sigma, "length", "1 mm"),
        own_frame=own_frame,
        reach_m=reach_of_several_m(layout),
    )
    _print(found_lines(found))
    stop = StopRequest()
    with ConsoleProgress() as progress, asked_by_signals(stop, progress.note):
        backend = Backend.LOKY if _jobs(jobs) > 1 else Backend.SERIAL
        workers = Workers(backend, jobs=_jobs(jobs), stop=stop, note=progress.note)
        floor = judge(spec, layout, found, trials=trials, workers=workers, progress=progress)
    _print(judged_lines(floor))
    for path in write_built(floor, spec, folder):
        print(path)
    raise typer.Exit(floor.exit_code)


@app.command()
def snap(
    layout_file: LayoutFile,
    to: Annotated[str, typer.Option("--to", help="Marks: corners, joints or centres of floor tiles, or chalk.")],
    chalk_spacing: Annotated[
        str | None, typer.Option("--chalk-spacing", help="Distance of chalk lines, such as '50 mm'.")
    ] = None,
    obstacles: Annotated[
        str, typer.Option("--obstacles", help="What becomes of tags whose place is barred: drop or move.")
    ] = "drop",
    reach: Annotated[str, typer.Option("--reach", help="How far such a tag may go to a free mark.")] = "100 mm",
    trials: Annotated[int, typer.Option("--trials", min=2, help="Drives of each layout and scenario.")] = 150,
    out: Out = None,
    jobs: Jobs = 0,
) -> None:
    """Lay tags on marks that an installer finds: the snapped layout, what became of each tag, and the price."""
    from layoutopt.console import ConsoleProgress
    from layoutopt.snapping.marks import marks_of
    from layoutopt.snapping.snapped import snapped
    from layoutopt.spec.layout_file import read_layout
    from layoutopt.stopping import StopRequest, asked_by_signals
    from layoutopt.workers import Backend, Workers
    from studies.snapping import judge
    from studies.snapping_output import fate_lines, price_lines, write_snapped

    folder = out or Path("out") / "snap"
    _fit_for_folder("--out", folder)
    if obstacles not in ("drop", "move"):
        raise InvalidInput.at(f"--obstacles {obstacles}", "there is no such rule", "Give drop or move.")
    reach_m = positive_quantity("--reach", reach, "length", "100 mm")
    spacing_m = (
        None if chalk_spacing is None else positive_quantity("--chalk-spacing", chalk_spacing, "length", "50 mm")
    )
    spec, layout = read_layout(layout_file)
    tags = layout.floor_tags
    marks = marks_of(
        spec.site,
        to,
        margin_m=max(tags.tag_size_m) / 2.0,
        tag_part=tags.tag_part,
        chalk_spacing_m=spacing_m,
    )
    result = snapped(tags, spec.site, marks, move=obstacles == "move", reach_m=reach_m)
    _print(fate_lines(result))
    stop = StopRequest()
    with ConsoleProgress() as progress, asked_by_signals(stop, progress.note):
        backend = Backend.LOKY if _jobs(jobs) > 1 else Backend.SERIAL
        workers = Workers(backend, jobs=_jobs(jobs), stop=stop, note=progress.note)
        price = judge(spec, layout, result, trials=trials, workers=workers, progress=progress)
    _print(price_lines(price))
    for path in write_snapped(price, spec, folder):
        print(path)
    raise typer.Exit(price.exit_code)


@app.command()
def expand(
    installed: Annotated[Path, typer.Argument(help="Layout file of the installed floor, such as as_built.toml.")],
    new_spec: Annotated[Path, typer.Argument(help="Spec file (TOML) of the larger floor, in the same frame.")],
    tags: Annotated[
        Path | None, typer.Option("--tags", help="Tag map of the installed floor: its identities are kept.")
    ] = None,
    target_error: Annotated[str | None, typer.Option("--target-error", help="For example '10 mm'.")] = None,
    budget: Annotated[
        str | None, typer.Option("--budget", help="For the extension, for example '3000 EUR'.")
    ] = None,
    new_readers: Annotated[
        bool, typer.Option("--new-readers", help="Let other readers compete; all robots would get them.")
    ] = False,
    out: Out = None,
    jobs: Jobs = 0,
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer layouts and trials; nothing to build from.")
    ] = False,
) -> None:
    """Keep what is installed and design the next area: the cheapest tags for it, with their own bill."""
    from layoutopt.commissioning.expansion import expansion_of, recorded_tags
    from layoutopt.console import ConsoleProgress
    from layoutopt.spec.layout_file import read_layout
    from layoutopt.stopping import StopRequest, asked_by_signals
    from layoutopt.workers import Backend, Workers
    from studies import answers
    from studies.expand import expand as expanded
    from studies.expand_output import expanded_lines, write_expanded

    folder = out or Path("out") / "expand"
    _fit_for_folder("--out", folder)
    old = read_layout(installed)
    spec = answers.with_demand(_spec(new_spec), target_error=target_error, budget=budget)
    kept = expansion_of(*old, spec)
    recorded = {} if tags is None else recorded_tags(tags, kept.installed)
    stop = StopRequest()
    with ConsoleProgress() as progress, asked_by_signals(stop, progress.note):
        found = expanded(
            kept,
            old,
            spec,
            by_budget=target_error is None and budget is not None,
            new_readers=new_readers,
            workers=Workers(Backend.LOKY, jobs=_jobs(jobs), stop=stop, note=progress.note),
            stop=stop,
            quick=quick,
            progress=progress,
        )
    if quick:
        print("QUICK LOOK on few layouts and drives: nothing to build from. Run without --quick.")
    _print(expanded_lines(found))
    if found.chosen is None:
        print(f"{folder} was not written: no layout answers the demand")
    else:
        for path in write_expanded(found, folder, recorded):
            print(path)
    raise typer.Exit(found.exit_code)


def _spec(file: Path | None) -> "Spec":
    from layoutopt.spec.reading import read_spec
    from layoutopt.spec.template import built_in

    return read_spec(file if file is not None else built_in(BUILT_IN))


def _print(lines: Iterable[str]) -> None:
    print("\n".join(printable(line) for line in lines))


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


def _fit_for_folder(option: str, folder: Path) -> None:
    """Refuse an output folder that cannot be one, before any work is done for it."""
    blocking = next((path for path in (folder, *folder.parents) if path.exists()), None)
    if blocking is not None and not blocking.is_dir():
        raise InvalidInput.at(f"{option} {folder}", f"{blocking} is a file", "Choose a folder.")


def _fit_for_file(option: str, file: Path) -> None:
    """Refuse an output file that cannot be written, before any work is done for it."""
    if file.is_dir():
        raise InvalidInput.at(f"{option} {file}", "it is a folder", "Choose the name of a file.")
    if not file.parent.is_dir():
        raise InvalidInput.at(f"{option} {file}", f"there is no folder {file.parent}", "Make it first.")


def _jobs(jobs: int) -> int:
    return (
        jobs or len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else jobs or os.cpu_count() or 1
    )


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
