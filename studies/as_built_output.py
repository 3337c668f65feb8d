"""What commissioning says and leaves: lines for the terminal, findings and use of tags as tables, the new map."""

from pathlib import Path

from layoutopt.commissioning.as_built import AsBuilt, Deviation
from layoutopt.errors import InvalidInput
from layoutopt.score_text import limit_text, score_name, score_text, shown_unit
from layoutopt.scores import TrialOutcomes, paired_difference
from layoutopt.spec.building import Spec
from layoutopt.spec.layout_file import write_layout
from layoutopt.tables.cells import text_cell, write_csv
from layoutopt.tables.tag_files import tag_header, write_tag_files
from layoutopt.tables.tags import tag_rows
from solvers.judging import trials_needed
from studies.as_built import CONFIDENCE, BuiltFloor
from studies.columns import named, pair, unit_of

_MOST_SHOWN = 10


def found_lines(found: AsBuilt) -> list[str]:
    """Return what scans and survey showed."""
    states = {state: found.tag_map.status.count(state) for state in ("installed", "moved", "unclear", "missing")}
    lines = [f"{len(found.tag_map)} tags: " + ", ".join(f"{count} {state}" for state, count in states.items())]
    if found.frame is not None:
        lines.append(
            f"survey: {found.frame.used} tags fit the plan to {1000.0 * found.frame.sigma_m:.1f} mm per axis "
            "(robust standard deviation; a shift and a turn that all share are taken out)"
        )
    for deviation in Deviation:
        findings = [finding for finding in found.findings if finding.deviation is deviation]
        lines += [f"  {finding.text}" for finding in findings[:_MOST_SHOWN]]
        if len(findings) > _MOST_SHOWN:
            lines.append(f"  {len(findings) - _MOST_SHOWN} more {deviation.value}: see findings.csv")
    return lines


def judged_lines(floor: BuiltFloor) -> list[str]:
    """Return what the floor is worth as built, and which tags matter."""
    goal = floor.problem.goals[1]
    factor, unit = shown_unit(goal)
    lines = [
        f"held-out drives {floor.first} to {floor.first + floor.trials - 1} of {floor.scenario}, "
        f"estimator {floor.problem.estimators[0].name}, seed {floor.seed}",
        f"{score_name(goal)} as planned: {_score(floor.planned, goal)}",
    ]
    for words, outcomes in (("map of the plan", floor.old_map), ("corrected map", floor.new_map)):
        text = f"{_score(outcomes, goal)}{_change(floor, outcomes)}"
        lines.append(f"  as built, robots with the {words}: {text}")
    lines += [f"failed: {text}" for text in sorted(set(floor.failures.values()))]
    for limit, score, met in floor.limits:
        word = "met" if met else "MISSED"
        more = trials_needed(limit, score)
        rare = f"; never seen, which {more} trials would show to be within the limit" if more else ""
        lines.append(f"{word}: {limit_text(limit)}: {score_text(score, limit.score)}{rare}")
    if not floor.repairs:
        lines.append(
            f"no missing or moved tag was read on {floor.use.drives} drives: putting one right changes nothing"
        )
    else:
        lines.append(
            f"tags that matter (put right one at a time, on the same drives; all {len(floor.repairs)} intervals "
            f"together hold at {CONFIDENCE:.0%})"
        )
        for repair in floor.repairs:
            low, high = (end * factor for end in repair.interval)
            lines.append(
                f"  tag {repair.tag_id} ({repair.status}): {repair.difference.value * factor:+.2g} {unit} "
                f"({low:+.2g} to {high:+.2g}, n = {repair.difference.count})"
            )
        if not any(repair.interval[1] < 0.0 for repair in floor.repairs):
            lines.append("  for none of them it is shown that a visit makes robots more accurate")
    return lines


def write_built(
    floor: BuiltFloor, spec: Spec, folder: Path, *, quick_look: bool = False
) -> tuple[tuple[Path, ...], str]:
    """Write findings, use of each tag, the corrected tag map and the layout as built.

    The tag map holds every tag of the plan, those that are missing too, with their state. ``quick_look`` says
    that a quick look chose the layout that was built: its mark goes on to the new file.

    Returns
    -------
        The files, and why there is no layout file; empty if there is one. A layout names each tag that is not in
        its place, so that one of tens of thousands of them would be larger than a layout file may be.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = (*write_found(floor, folder), *_write_map(floor, spec, folder))
    layout_file = folder / "as_built.toml"
    try:
        write_layout(floor.built, spec, layout_file, quick_look=quick_look)
    except InvalidInput as error:
        # One of an earlier run would be taken for that of this floor.
        layout_file.unlink(missing_ok=True)
        edits = len(floor.built.floor_tags.edits)
        return written, f"no as_built.toml for {edits} tags beside their places: {error.faults[0].problem}"
    return (*written, layout_file), ""


def write_found(floor: BuiltFloor, folder: Path) -> tuple[Path, Path]:
    """Write ``findings.csv`` and ``tag_use.csv``."""
    findings, use = folder / "findings.csv", folder / "tag_use.csv"
    rows = [
        [finding.deviation.value, " ".join(map(str, finding.tag_ids)), text_cell(finding.text)]
        for finding in floor.found.findings
    ]
    write_csv(findings, ("deviation", "tag_ids", "what"), rows)
    goal = floor.problem.goals[1]
    repairs = {repair.tag_id: pair(repair.difference) for repair in floor.repairs}
    # A tag without a repair was not among those that are simulated.
    header = ("tag_id", "install_status", "reads_per_drive", "steps_alone_per_drive", "drives")
    tags = floor.found.tag_map
    write_csv(
        use,
        (*header, *named(f"{goal}_if_repaired", unit_of(goal))),
        (
            [
                str(tag_id),
                status,
                f"{reads:.4g}",
                f"{alone:.4g}",
                str(floor.use.drives),
                *repairs.get(tag_id, ("", "")),
            ]
            for tag_id, status, reads, alone in zip(
                tags.ids.tolist(), tags.status, floor.use.reads.tolist(), floor.use.alone.tolist(), strict=True
            )
        ),
    )
    return findings, use


def _write_map(floor: BuiltFloor, spec: Spec, folder: Path) -> tuple[Path, ...]:
    tags = floor.found.tag_map
    rows = tag_rows(tags, spec.site, floor.layout.floor_tags.tag_part, floor.found.surveyed_m)
    return write_tag_files(folder, tag_header(floor.built, spec.site, len(tags)), rows)


def _score(outcomes: TrialOutcomes | None, goal: str) -> str:
    return "not known, a task failed" if outcomes is None else score_text(outcomes.score(goal), goal)


def _change(floor: BuiltFloor, outcomes: TrialOutcomes | None) -> str:
    """Return the paired difference to the plan, with its 95 % interval."""
    if outcomes is None or floor.planned is None:
        return ""
    goal = floor.problem.goals[1]
    factor, unit = shown_unit(goal)
    difference = paired_difference(outcomes, floor.planned, goal)
    low, high = (end * factor for end in difference.interval())
    return f", {difference.value * factor:+.2g} {unit} on the plan ({low:+.2g} to {high:+.2g})"
