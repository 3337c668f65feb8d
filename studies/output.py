"""Everything that a study leaves in its folder for people: tables, layouts, figures, report, drawings."""

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.atomic_file import replacing
from layoutopt.drawings.installation import write_overview
from layoutopt.identity import FloatArray
from layoutopt.journal import MANIFEST
from layoutopt.layout import Layout
from layoutopt.machine import versions_text
from layoutopt.result import Evaluated
from layoutopt.scores import SCORE_UNITS, Score
from layoutopt.spec.building import Spec
from layoutopt.spec.layout_file import write_layout
from layoutopt.streams import Streams
from layoutopt.tables.cells import text_cell, write_csv
from studies.columns import named, number, pair, unit_of
from studies.findings import Findings
from studies.front_tables import write_exchange_rates, write_portfolio
from studies.local_error import local_error_of, write_local_error
from studies.pairing import Pairing, VarianceRatio
from studies.screening import Screening, screening_of
from studies.trade_off import TradeOff

if TYPE_CHECKING:
    from layoutopt.plots.figures import Drawn

_MADE_ANEW: Final = ("layouts", "recommended", "figures")
LOCAL_ERRORS: Final = "local_error.csv"


def write_all(findings: Findings, spec: Spec, folder: Path, *, streams: Streams, quick: bool) -> None:
    """Write tables, layout files, drawings of the recommended layouts, figures and report.

    A quick run draws the first recommended layout only. What an earlier run left of layouts, drawings and
    figures goes first, so that nobody builds from a drawing that is no longer recommended.
    """
    for name in _MADE_ANEW:
        shutil.rmtree(folder / name, ignore_errors=True)
    write_designs(findings, folder / "designs.csv")
    write_front(findings, folder / "front.csv")
    write_validation(findings, folder / "validation.csv")
    write_references(findings, folder / "references.csv")
    write_screening(screening_of(findings), folder / "screening.csv")
    write_pairing(findings.pairing, folder / "pairing.csv")
    write_exchange_rates(findings.trade_off, folder / "exchange_rates.csv")
    write_portfolio(findings, folder / "portfolio.csv")
    layouts = folder / "layouts"
    layouts.mkdir(exist_ok=True)
    files: dict[str, str] = {}
    for item in _shown(findings):
        path = layouts / f"{item.layout.short_key}.toml"
        write_layout(item.layout, spec, path, quick_look=quick)
        files[item.layout.key] = path.relative_to(folder).as_posix()
    links: dict[str, dict[str, str]] = {}
    for role, item in list(findings.result.recommended.items())[: 1 if quick else None]:
        drawings = folder / "recommended" / role.replace(" ", "_")
        title = f"{spec.site.name}: {role} layout"
        paths = write_overview(spec, item.layout, drawings, title=title, quick_look=quick)
        links[role] = {path.name: path.relative_to(folder).as_posix() for path in paths}
    write_report(findings, spec, folder, links=links, layout_files=files, streams=streams, quick=quick)


def write_designs(findings: Findings, path: Path) -> None:
    """Write every layout of the design space: what it is, why it is out, and all its scores."""
    names = _score_names([design.evaluated for design in findings.designs])
    header = ["layout", "label", "refusal", "on_front", "membership"]
    header += ["antennas", "modules", "extrapolated", "trials", *_score_header(names)]
    rows = [
        [
            design.evaluated.layout.short_key,
            text_cell(design.evaluated.layout.label),
            text_cell(design.refusal),
            _yes(design.on_front),
            _membership(design.evaluated.layout, findings.trade_off),
            *_counts(design.evaluated.layout),
            _yes(design.evaluated.layout.extrapolated),
            str(design.trials),
            *_score_cells(design.evaluated.scores, names),
        ]
        for design in findings.designs
    ]
    write_csv(path, header, rows)


def write_front(findings: Findings, path: Path) -> None:
    """Write the members of the front by rising cost, with all their scores.

    ``membership`` is the probability that a layout is on the true front of all layouts with trials.
    """
    members = findings.result.front.members
    names = _score_names(members)
    header = ["layout", "label", "recommended_as", "membership", "antennas", "modules", "extrapolated"]
    header += _score_header(names)
    roles: dict[str, str] = {}
    for role, item in findings.result.recommended.items():
        roles[item.layout.key] = ", ".join(filter(None, [roles.get(item.layout.key, ""), role]))
    rows = [
        [
            item.layout.short_key,
            text_cell(item.layout.label),
            roles.get(item.layout.key, ""),
            _membership(item.layout, findings.trade_off),
            *_counts(item.layout),
            _yes(item.layout.extrapolated),
            *_score_cells(item.scores, names),
        ]
        for item in members
    ]
    write_csv(path, header, rows)


def write_validation(findings: Findings, path: Path) -> None:
    """Write the held-out scores: a row for each layout, scenario and estimator, or why it does not apply."""
    names = list(
        dict.fromkeys(name for row in findings.validations if row.scores is not None for name in row.scores)
    )
    units = [unit_of(name) for name in names]
    optimism_names = named("optimism", unit_of(findings.problem.goals[1]))
    header = ["layout", "scenario", "estimator", "does_not_apply", "trials", *optimism_names]
    header += [cell for name, unit in zip(names, units, strict=True) for cell in named(name, unit)]
    rows = []
    for row in findings.validations:
        scores = row.scores or {}
        trials = max((score.count for score in scores.values()), default=0)
        optimism = ["", ""] if row.optimism is None else pair(row.optimism)
        start = [
            row.layout_key[:10],
            row.scenario,
            row.estimator,
            text_cell(row.does_not_apply),
            str(trials),
            *optimism,
        ]
        rows.append([*start, *_score_cells(scores, names)])
    write_csv(path, header, rows)


def write_references(findings: Findings, path: Path) -> None:
    """Write the published layouts with their cost on the user's site and their error on a clear floor."""
    goal = findings.problem.goals[1]
    header = ["reference", "layout", "antennas", "modules", "trials", "cost_eur", *named(goal, unit_of(goal))]
    rows = [
        [
            mark.label,
            mark.layout.short_key,
            *_counts(mark.layout),
            str(mark.error.count),
            number(mark.cost.value),
            *pair(mark.error),
        ]
        for mark in findings.references
    ]
    write_csv(path, header, rows)


def write_screening(found: Screening, path: Path) -> None:
    """Write for every closed-form score and margin what a screen would have kept and lost.

    The margin ``inf`` is that of the study. Losses are differences of simulated scores, in their unit.
    """
    unit = unit_of(found.goal)
    header = ["closed_form", "layouts_raced"]
    header += [f"{kind}{end}" for kind in ("rank_correlation", "at_equal_cost") for end in ("", "_low", "_high")]
    header += ["margin", "layouts_kept", "front_members", "front_members_dropped"]
    header += [*named("largest_loss", unit), *named("mean_loss", unit)]
    agreements = {item.score: item for item in found.agreements}
    rows = []
    for screen in found.screens:
        agreement = agreements[screen.score]
        rows.append(
            [
                screen.score,
                str(found.raced),
                *(
                    number(end)
                    for kind in (agreement.overall, agreement.at_equal_cost)
                    for end in (kind.value, kind.low, kind.high)
                ),
                f"{screen.margin:g}",
                str(screen.kept),
                str(found.front),
                str(screen.dropped_members),
                *pair(screen.largest_loss),
                *pair(screen.mean_loss),
            ]
        )
    write_csv(path, header, rows)


def write_pairing(found: Pairing, path: Path) -> None:
    """Write what common drives saved in each comparison of the search, and on average.

    ``trials`` counts the replications that both layouts have, of a mean those of the comparison with the fewest.
    """
    header = ["comparison", "layout", "rival", "trials", *named("difference", unit_of(found.goal))]
    header += [f"variance_ratio{end}" for end in ("", "_low", "_high")]
    rows = [
        [
            "front" if item.on_front else "finalist",
            item.layout.short_key,
            item.rival.short_key,
            str(item.trials),
            *pair(item.difference),
            *_ends(item.ratio),
        ]
        for item in found.comparisons
    ]
    rows += [
        [name, "", "", str(mean.fewest_trials), "", "", *_ends(mean.ratio)]
        for name, mean in (("mean of front", found.front), ("mean of all", found.finalists))
        if mean.comparisons
    ]
    write_csv(path, header, rows)


def write_report(
    findings: Findings,
    spec: Spec,
    folder: Path,
    *,
    links: Mapping[str, Mapping[str, str]],
    layout_files: Mapping[str, str],
    streams: Streams,
    quick: bool,
) -> None:
    """Write the figures, as SVG and PNG, the table of the map of errors, and the report that holds them."""
    from layoutopt.plots.error_over_time import draw_error_over_time
    from layoutopt.plots.figures import inline_svg, save, svg_frame
    from layoutopt.plots.front import draw_front
    from layoutopt.plots.layout_plan import draw_layout_plan
    from layoutopt.plots.local_error import draw_local_error
    from layoutopt.plots.thumbnails import underside_svg
    from studies.report import render_report

    figures = folder / "figures"
    figures.mkdir(exist_ok=True)
    result, problem = findings.result, findings.problem
    target = next((limit.upper for limit in problem.limits if limit.score == problem.goals[1]), None)
    front = draw_front(
        designs=findings.designs,
        front=result.front,
        recommended=result.recommended,
        membership=findings.trade_off.membership,
        references=findings.references,
        target_m=target,
        budget_eur=spec.budget_eur,
    )
    drawn: dict[str, Drawn] = {"front": front}
    main = next(iter(result.recommended.values()), None)
    if main is not None:
        drawn["layout"] = draw_layout_plan(
            layout=main.layout,
            site=spec.site,
            robot=spec.robot,
            tag_map=main.layout.floor_tags.lay_on(spec.site),
        )
        time_s, position, heading = _one_drive(findings, main.layout, streams)
        drawn["error_over_time"] = draw_error_over_time(
            time_s=time_s, position_error_m=position, heading_error_rad=heading
        )
    errors = local_error_of(findings, streams)
    (folder / LOCAL_ERRORS).unlink(missing_ok=True)
    if errors is not None:
        write_local_error(errors, folder / LOCAL_ERRORS)
        drawn["local_error"] = draw_local_error(
            site=spec.site,
            errors=errors,
            title=f"{problem.estimators[0].name}, {problem.held_out[0].name}, seed {findings.seed}",
        )
    texts = {}
    for name, axes in drawn.items():
        svg, _ = save(axes, figures / name)
        texts[name] = inline_svg(svg.read_text(encoding="utf-8"))
    facts = {
        "Site": f"{spec.site.name} ({spec.site.source})",
        "Seed": str(findings.seed),
        "Search trials": str(result.trials),
        "Kind of run": "quick look, nothing to build from" if quick else "full",
        "Prices": f"{spec.prices.name} of {spec.prices.date}",
        "Versions": versions_text(),
        "Manifest": MANIFEST,
    }
    pictures = {
        item.layout.key: underside_svg(
            layout=item.layout,
            site=spec.site,
            robot=spec.robot,
            tag_map=item.layout.floor_tags.lay_on(spec.site),
        )
        for item in [*result.front.members, *result.recommended.values()]
    }
    page = render_report(
        findings,
        figures=texts,
        facts=facts,
        drawings=links,
        quick=quick,
        frame=svg_frame(front),
        pictures=pictures,
        layout_files={key: link for key, link in layout_files.items() if key in pictures},
    )
    with replacing(folder / "report.html") as temporary:
        temporary.write_text(page, encoding="utf-8", newline="\n")


def _one_drive(
    findings: Findings, layout: Layout, streams: Streams
) -> tuple[FloatArray, dict[str, FloatArray], dict[str, FloatArray]]:
    """Return times, and position and heading errors of every estimator that applies, of one held-out drive."""
    from layoutopt.geometry import wrapped
    from layoutopt.simulation.trials import record_trial

    problem = findings.problem
    scenario = problem.held_out[0] if problem.held_out else problem.design
    position: dict[str, FloatArray] = {}
    heading: dict[str, FloatArray] = {}
    for estimator in problem.estimators:
        if estimator.applies(layout):
            continue
        record = record_trial(layout, scenario, estimator, streams, 0)
        error = record.trajectory.poses - record.drive.poses[1:]
        position[estimator.name] = np.hypot(error[:, 0], error[:, 1])
        heading[estimator.name] = np.abs(wrapped(error[:, 2]))
    time_s = np.asarray(scenario.step_s * np.arange(1, scenario.step_count + 1), dtype=np.float64)
    return time_s, position, heading


def _shown(findings: Findings) -> list[Evaluated]:
    items = [*findings.result.front.members, *findings.result.recommended.values()]
    items += [entry.item for entry in findings.alternatives.found]
    return list({item.layout.key: item for item in items}.values())


def _membership(layout: Layout, found: TradeOff) -> str:
    return number(found.membership[layout.key]) if layout.key in found.membership else ""


def _yes(answer: bool) -> str:
    return "yes" if answer else "no"


def _counts(layout: Layout) -> list[str]:
    return [
        str(sum(group.count for group in layout.readers)),
        str(sum(group.module_count for group in layout.readers)),
    ]


def _score_names(items: Sequence[Evaluated]) -> list[str]:
    """Return the scores that occur, those of the whole floor first, in a fixed order."""
    found = {name for item in items for name in item.scores}
    order = {name: number for number, name in enumerate(SCORE_UNITS)}
    return sorted(
        found,
        key=lambda name: (
            "." in name,
            name.partition(".")[0] if "." in name else "",
            order[name.rpartition(".")[2]],
        ),
    )


def _score_header(names: Sequence[str]) -> list[str]:
    return [cell for name in names for cell in named(name, unit_of(name))]


def _score_cells(scores: Mapping[str, Score], names: Sequence[str]) -> list[str]:
    cells: list[str] = []
    for name in names:
        cells += pair(scores[name]) if name in scores else ["", ""]
    return cells


def _ends(ratio: VarianceRatio) -> list[str]:
    return [number(value) for value in (ratio.value, ratio.low, ratio.high)]
