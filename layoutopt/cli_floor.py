"""Commands about floors and robots that exist: drawings, snapping, commissioning, extension, replay of drives."""

import sys
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from layoutopt.cli_parts import (
    QUICK_LOOK,
    Jobs,
    LayoutFile,
    Out,
    attended,
    filed_layout,
    fit_for_folder,
    print_lines,
    spec_of,
)
from layoutopt.errors import InvalidInput
from layoutopt.units import positive_quantity


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
    from layoutopt.drawings.installation import MOST_ON_ONE_SHEET, write_overview, write_sheets
    from layoutopt.drawings.sheet_set import TEMPLATE_PAPERS

    folder = out or Path("drawings")
    fit_for_folder("--out", folder)
    paper = next((name for name in TEMPLATE_PAPERS if name == templates), None)
    if paper is None:
        raise InvalidInput.at("--templates", f"there is no {templates!r}", f"Give {' or '.join(TEMPLATE_PAPERS)}.")
    bounds_m = None if area is None else _bounds(area)
    filed = filed_layout(layout_file)
    spec, layout = filed.spec, filed.layout
    sheets, left_out = write_sheets(
        spec,
        layout,
        folder / "sheets",
        title=spec.site.name,
        area_m=bounds_m,
        template_paper=paper,
        quick_look=filed.quick_look,
        note=partial(print, file=sys.stderr, flush=True),
    )
    overview = write_overview(spec, layout, folder, quick_look=filed.quick_look)
    for path in (*overview, *sheets):
        print(path)
    if folder / "sheet.pdf" not in overview:
        left_out = f"{left_out}\nno sheet.pdf: over {MOST_ON_ONE_SHEET} tags on one sheet are a grey area".strip()
    if left_out:
        print(left_out)


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
    from layoutopt.snapping.marks import marks_of
    from layoutopt.snapping.snapped import snapped
    from studies.snapping import judge
    from studies.snapping_output import fate_lines, price_lines, write_snapped

    folder = out or Path("out") / "snap"
    fit_for_folder("--out", folder)
    if obstacles not in ("drop", "move"):
        raise InvalidInput.at(f"--obstacles {obstacles}", "there is no such rule", "Give drop or move.")
    reach_m = positive_quantity("--reach", reach, "length", "100 mm")
    spacing_m = (
        None if chalk_spacing is None else positive_quantity("--chalk-spacing", chalk_spacing, "length", "50 mm")
    )
    filed = filed_layout(layout_file)
    spec, layout = filed.spec, filed.layout
    tags = layout.floor_tags
    marks = marks_of(
        spec.site,
        to,
        margin_m=max(tags.tag_size_m) / 2.0,
        tag_part=tags.tag_part,
        chalk_spacing_m=spacing_m,
    )
    result = snapped(tags, spec.site, marks, move=obstacles == "move", reach_m=reach_m)
    print_lines(fate_lines(result))
    with attended(jobs) as by:
        price = judge(spec, layout, result, trials=trials, workers=by.workers, progress=by.progress)
    print_lines(price_lines(price))
    for path in write_snapped(price, spec, folder, quick_look=filed.quick_look):
        print(path)
    raise typer.Exit(price.exit_code)


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
    from studies.as_built import judge, reach_of_several_m
    from studies.as_built_output import found_lines, judged_lines, write_built

    folder = out or Path("out") / "commission"
    fit_for_folder("--out", folder)
    if own_frame and survey is None:
        raise InvalidInput.at("--own-frame", "speaks of a survey, and none is given", "Add --survey FILE.")
    filed = filed_layout(layout_file)
    spec, layout = filed.spec, filed.layout
    found = as_built(
        layout.floor_tags.lay_on(spec.site),
        read_scans(scans),
        None if survey is None else read_survey(survey),
        tolerance_m=positive_quantity("--tolerance", tolerance, "length", "10 mm"),
        survey_sigma_m=positive_quantity("--survey-sigma", survey_sigma, "length", "1 mm"),
        own_frame=own_frame,
        reach_m=reach_of_several_m(layout),
    )
    print_lines(found_lines(found))
    with attended(jobs) as by:
        floor = judge(spec, layout, found, trials=trials, workers=by.workers, progress=by.progress)
    print_lines(judged_lines(floor))
    written, left_out = write_built(floor, spec, folder, quick_look=filed.quick_look)
    for path in written:
        print(path)
    if left_out:
        print(left_out)
    raise typer.Exit(floor.exit_code)


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
    from studies import answers
    from studies.expand import expand as expanded
    from studies.expand_output import expanded_lines, write_expanded

    folder = out or Path("out") / "expand"
    fit_for_folder("--out", folder)
    filed = filed_layout(installed)
    old = filed.spec, filed.layout
    spec = answers.with_demand(spec_of(new_spec), target_error=target_error, budget=budget)
    kept = expansion_of(*old, spec)
    recorded = {} if tags is None else recorded_tags(tags, kept.installed)
    with attended(jobs, apart=True) as by:
        found = expanded(
            kept,
            old,
            spec,
            by_budget=target_error is None and budget is not None,
            new_readers=new_readers,
            workers=by.workers,
            stop=by.stop,
            quick=quick,
            progress=by.progress,
        )
    if quick:
        print(QUICK_LOOK)
    print_lines(expanded_lines(found))
    if found.chosen is None:
        print(f"{folder} was not written: no layout answers the demand")
    else:
        for path in write_expanded(found, folder, recorded, quick_look=quick or filed.quick_look):
            print(path)
    raise typer.Exit(found.exit_code)


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
    from layoutopt.plots.drive_replay import draw_replay
    from layoutopt.plots.figures import save

    folder = out or Path("out") / "replay"
    fit_for_folder("--out", folder)
    filed = filed_layout(layout_file)
    spec, layout = filed.spec, filed.layout
    chosen = estimator_of(estimator or spec.study.validate_with[0], spec)
    pose = None if start is None else pose_in(start)
    log = read_log(log_file, layout=layout, tag_map=layout.floor_tags.lay_on(spec.site), robot=spec.robot)
    replayed = replay_log(log, spec, layout, chosen, seed=spec.seed if seed is None else seed, start=pose)
    fit = fit_drive(replayed)
    print_lines(replay_lines(replayed, fit))
    written = write_replay(replayed, fit, folder, quick_look=filed.quick_look)
    drawn = draw_replay(
        layout=layout,
        site=spec.site,
        tag_map=replayed.knowledge.tags,
        step_s=replayed.drive.observations.step_s,
        trajectory=replayed.trajectory,
        true_poses=replayed.drive.truth,
        read_tags=replayed.read_tags,
        name=chosen.name,
    )
    for path in (*written, *save(drawn, folder / "path")):
        print(path)


def _bounds(text: str) -> tuple[float, float, float, float]:
    """Return xmin, ymin, xmax and ymax of an area, m."""
    from layoutopt.units import parse_quantity

    parts = text.split(",")
    if len(parts) != 4:
        raise InvalidInput.at(f"--area {text!r}", f"{len(parts)} lengths, not 4", "Write '0 m, 0 m, 10 m, 8 m'.")
    try:
        xmin, ymin, xmax, ymax = (parse_quantity(part, "length") for part in parts)
    except ValueError as error:
        raise InvalidInput.at(f"--area {text!r}", str(error), "Write '0 m, 0 m, 10 m, 8 m'.") from None
    if not (xmin < xmax and ymin < ymax):
        repair = "Give the lower left corner, then the upper right one."
        raise InvalidInput.at(f"--area {text!r}", "it holds no area", repair)
    return xmin, ymin, xmax, ymax
