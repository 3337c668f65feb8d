"""What expand says and leaves: lines for the terminal, the layout, bill, work and tags of the extension."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from layoutopt.commissioning.expansion import with_records
from layoutopt.result import Evaluated
from layoutopt.score_text import counted_text, euros, interval_text, score_name, score_text
from layoutopt.scores import Score
from layoutopt.spec.layout_file import write_layout
from layoutopt.tables.bill import write_bill_csv
from layoutopt.tables.cells import write_csv
from layoutopt.tables.tag_files import tag_header, write_tag_files, write_tags_csv
from layoutopt.tables.tags import TagRow, tag_rows
from layoutopt.tables.work_plan import work_plan, write_work_plan_csv
from studies import summary
from studies.columns import number
from studies.expand import Expanded, OldArea
from studies.findings import Findings

LAYOUT_FILE: Final = "expanded.toml"
_SCORE_COLUMNS: Final = (
    "where",
    "scenario",
    "estimator",
    "score",
    "unit",
    "value",
    "standard_error",
    "low",
    "high",
    "n",
    "seed",
)


def _kept_lines(found: Expanded) -> list[str]:
    """Return what is kept of the installed floor, and what of it competes."""
    kept = found.expansion
    antennas = sum(group.count for group in kept.readers)
    bare = found.spec.robot_count - kept.equipped_count
    lines = [
        f"kept: {counted_text(len(kept.installed.ids), 'tag')} with their numbers, {kept.installed.ids[0]} to "
        f"{kept.installed.ids[-1]}, and the readers of {counted_text(kept.equipped_count, 'robot')} "
        f"({counted_text(antennas, 'antenna')} each)"
    ]
    if bare:
        lines.append(f"readers for {counted_text(bare, 'more robot')} are part of the cost")
    if kept.continued is None:
        lines.append("the installed tags follow no period that could go on, so the plan's patterns alone compete")
    else:
        lines.append(f"the installed pattern, {kept.continued.pattern.name}, goes on as one of the candidates")
    return lines


def expanded_lines(found: Expanded) -> list[str]:
    """Return how the search ended, what is new and what it costs, and what becomes of the installed area."""
    lines = [
        *_kept_lines(found),
        "costs are those of the extension: what lies or is mounted already is free",
        *summary.findings_lines(found.findings, None),
    ]
    if found.chosen is not None:
        tags = found.chosen.layout.floor_tags.lay_on(found.spec.site).to_lay()
        numbers = f", numbers {tags.ids[0]} to {tags.ids[-1]}" if len(tags) else ""
        bill = found.cost.bill(found.chosen.layout, found.findings.problem.design)
        lines.append(f"new: {counted_text(len(tags), 'tag')}{numbers}, for {euros(bill.total_eur)}")
    return lines if found.old_area is None else [*lines, *_old_area_lines(found.old_area, found.findings)]


def write_expanded(
    found: Expanded, folder: Path, recorded: Mapping[int, TagRow], *, quick_look: bool = False
) -> tuple[Path, ...]:
    """Write layout file, bill and work of the extension, the tag map of the whole floor, new tags, scores.

    ``recorded`` holds what is known of installed tags, by number: identities, surveyed places, deviations.
    ``quick_look`` says that a quick look chose the installed part or the extension; the layout file is marked so.

    Raises
    ------
    InvalidInput
        If the layout cannot be written as a file.
    ValueError
        If there is no layout to be written.
    """
    if (chosen := found.chosen) is None:
        raise ValueError("no layout answers the demand, so there is none to be written")
    layout, spec, design = chosen.layout, found.spec, found.findings.problem.design
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / name for name in (LAYOUT_FILE, "bill_of_material.csv", "work_plan.csv", "extension.csv")]
    write_layout(layout, spec, files[0], quick_look=quick_look)
    tags = layout.floor_tags.lay_on(spec.site)
    needed = found.cost.needs(layout, design)
    write_bill_csv(files[1], found.cost.bill(layout, design))
    steps = work_plan(needed, tags.to_lay(), spec.site, found.cost.bare_count(layout), spec.prices)
    write_work_plan_csv(files[2], steps)
    write_tags_csv(files[3], tag_rows(tags.to_lay(), spec.site, layout.floor_tags.tag_part))
    scores = folder / "scores.csv"
    write_csv(scores, _SCORE_COLUMNS, _score_rows(found, chosen))
    known, surveyed_m = with_records(tags, recorded)
    rows = tag_rows(known, spec.site, layout.floor_tags.tag_part, surveyed_m)
    return (*files, *write_tag_files(folder, tag_header(layout, spec.site, len(tags)), rows), scores)


def _old_area_lines(area: OldArea, findings: Findings) -> list[str]:
    lines = [
        f"the installed area with the layout “{area.role}”, {score_name(area.score)}, drives {area.first} to "
        f"{area.first + area.trials - 1} of {area.scenario}, estimator {area.estimator}, seed {findings.seed}"
    ]
    limits = [limit for limit in findings.problem.limits if limit.score == area.score]
    for part in area.parts:
        name = "" if len(area.parts) == 1 else f"{part.zone} ({part.area_m2:.0f} m²): "
        lines += [
            f"  {name}before, robots that drive the old floor: {score_text(part.before, area.score)}",
            f"  {name}after, robots that drive the whole floor: {score_text(part.after, area.score)}",
        ]
        if part.change is not None:
            low, high = part.change.interval()
            word = "worse" if low > 0.0 else "better" if high < 0.0 else "no change shown"
            verdict = f"{word} on these drives, which pass other places of the area than before"
            lines.append(
                f"  {name}change {score_text(part.change, area.score, signed=True)}, 95 %: "
                f"{interval_text(part.change, area.score, signed=True)}: {verdict}"
            )
        if part.before is not None and any(limit.broken(part.before) for limit in limits):
            lines.append(f"  {name}by itself it breaks the demand, and tags elsewhere change little here")
    return [*lines, *(f"failed: {text}" for text in area.failures)]


def _score_rows(found: Expanded, chosen: Evaluated) -> Iterator[list[str]]:
    """Yield the scores of the layout: in the search, on held-out drives, and in the installed area."""
    problem = found.findings.problem
    names = tuple(dict.fromkeys((*problem.goals, *(limit.score for limit in problem.limits))))

    def row(where: str, scenario: str, estimator: str, name: str, score: Score) -> list[str]:
        low, high = score.interval()
        numbers = [number(value) for value in (score.value, score.standard_error, low, high)]
        return [where, scenario, estimator, name, score.unit, *numbers, str(score.count), str(found.findings.seed)]

    for name in names:
        if name in chosen.scores:
            simulated = not chosen.scores[name].exact
            used = (problem.design.name, problem.estimators[0].name) if simulated else ("", "")
            where = "extension" if name == problem.goals[0] else "whole floor, search"
            yield row(where, *used, name, chosen.scores[name])
    for item in found.findings.validations:
        if item.layout_key == chosen.layout.key and item.scores is not None:
            for name in names:
                if name in item.scores:
                    yield row("whole floor, held out", item.scenario, item.estimator, name, item.scores[name])
    area = found.old_area
    if area is None:
        return
    for part in area.parts:
        for when, known in (("before", part.before), ("after", part.after), ("change", part.change)):
            if known is not None:
                yield row(f"{part.zone}, {when}", area.scenario, area.estimator, area.score, known)
