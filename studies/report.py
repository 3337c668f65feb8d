"""The report of a cost-against-accuracy study: one HTML file that needs nothing else, on screen and on paper."""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib import resources
from pathlib import PurePosixPath
from types import MappingProxyType
from typing import TYPE_CHECKING, Final
from urllib.parse import quote, urlsplit

from layoutopt import registry
from layoutopt.citation import software, works_named
from layoutopt.layout import Layout, ReaderProfile
from layoutopt.parts import Scope
from layoutopt.plots.figures import SvgFrame
from layoutopt.protocols import ReaderCard
from layoutopt.result import Status
from layoutopt.score_text import NOT_KNOWN, euros, limit_text, score_name, score_text
from layoutopt.units import format_length
from studies import dead_reckoning, pairing, references, screening
from studies.choices import choices_of
from studies.cited import methods_of_findings
from studies.findings import Findings
from studies.first_page import REFUSALS, first_page
from studies.layout_cards import KINDS, LAYOUT_FILE, cards_of, page_data
from studies.page_script import content_policy, script_text
from studies.page_words import meanings_of
from studies.report_rows import (
    bills_of,
    limit_rows_of,
    recommended_of,
    recommended_rows,
    refusals_of,
    row_of,
    step_rows,
    validated_layouts,
)
from studies.report_words import bare_text, fault_words, interval_words, number_text
from studies.summary import passed_over_text, verdict
from studies.what_if import commands_of, worlds_of

if TYPE_CHECKING:
    from jinja2 import Environment

CAPTIONS: Final[Mapping[str, str]] = {
    "layout": "The recommended layout on its site, and the underside of one robot over the tags.",
    "error_over_time": "One held-out drive: how the error of each estimator goes over time. One drive shows the "
    "course; the tables give means over many.",
    "local_error": "Where on the floor the first recommended layout errs, over held-out drives, and how many came "
    "there. Hatched cells are not certain; local_error.csv has every cell with its standard error.",
}
VALIDATION_COLUMNS: Final = ("position_error_mean", "position_error_p95", "heading_error_mean", "lost_share")
_PLACED: Final = ("front", "layout", *CAPTIONS)
"""Figures with a place of their own; others follow in a section at the end."""
_FOR_A_DECISION: Final[Mapping[str, str]] = {
    "answer": "The answer in figures",
    "words": "Words used below",
    "front": "What can be chosen: cost against accuracy",
    "recommended": "Which layouts are recommended, and do they meet the demands?",
    "held-out": "How well do they do on new drives, and with other estimators?",
    "need": dead_reckoning.QUESTION,
    "more-accuracy": "What does more accuracy cost?",
    "one-step": "What would one step more or less change?",
    "alternatives": "Which other layouts are about as good?",
    "what-if": "What if prices, tolerances or tags are different?",
    "cost": "What is the cost made of?",
}
_TO_CHECK_IT: Final[Mapping[str, str]] = {
    "assumptions": "What was assumed?",
    "all-front": "Every layout of the front",
    "held-out-rest": "The other layouts on new drives",
    "references": "Where do published layouts lie?",
    "left-out": "Why were layouts left out?",
    "common-drives": "How much did common drives save?",
    "screen": "What would a screen have lost?",
    "further": "Further figures",
    "sources": "Seed, versions, methods and papers",
}
"""Sections by the name of their place on the page, in their order: what they answer."""
_WORDS: Final = (
    "front",
    "held-out",
    "optimism",
    "estimator",
    "trial, drive",
    "± and 95 % interval",
    "paired",
    "position error",
    "heading error",
    "95 % error",
    "lost",
    "odometry",
    "short key",
)
_KIND_WORDS: Final = ("Price of a tag", "Price of a reader module", "Price of an hour of labour")
_VERDICT_MARKS: Final = {"met": "✓", "broken": "✗", "undecided": "?", "untried": "?", NOT_KNOWN: "?"}
_VERDICT_CLASSES: Final = {
    "met": "met",
    "broken": "broken",
    "undecided": "undecided",
    "untried": "unknown",
    NOT_KNOWN: "unknown",
}


def render_report(
    findings: Findings,
    *,
    figures: Mapping[str, str],
    facts: Mapping[str, str],
    drawings: Mapping[str, Mapping[str, str]],
    quick: bool = False,
    frame: SvgFrame | None = None,
    pictures: Mapping[str, str] = MappingProxyType({}),
    layout_files: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Return the report as one HTML page that loads nothing.

    All that it says stands in tables and pictures. The one script that its policy lets a browser run shows layouts
    of the front one at a time and moves limits and prices.

    Parameters
    ----------
    figures
        ``<svg>`` elements by name, from `layoutopt.plots.figures.as_svg`; ``"front"``, ``"layout"`` and
        ``"error_over_time"`` have places of their own, others follow at the end.
    facts
        Versions, seed and other facts of the manifest, by name; nothing that differs from run to run, so that
        the same study gives the same bytes.
    drawings
        For each role of a recommended layout the files made of it: name to link relative to the report.
    quick
        Whether so little was simulated that nothing may be built from it, which a banner then says.
    frame
        Where the axes of the figure ``"front"`` lie in it; without it the marks of the front lead nowhere.
    pictures, layout_files
        By key of a layout: its picture, an ``<svg>`` element, and the link to its file.

    Raises
    ------
    ValueError
        If a figure or picture is no ``<svg>`` element, or a link is not relative.
    """
    from markupsafe import Markup

    for name, svg in (*figures.items(), *pictures.items()):
        if not svg.lstrip().startswith("<svg"):
            raise ValueError(f"figure '{name}' is no <svg> element")
    problem, result = findings.problem, findings.result
    goal = problem.goals[1]
    chosen = recommended_of(findings)
    linked = {role: {name: _link(link) for name, link in links.items()} for role, links in drawings.items()}
    cards = cards_of(
        findings, frame=frame, pictures=pictures, files=_files_of_layouts(findings, linked, layout_files)
    )
    sources = methods_of_findings(findings)
    columns = tuple(dict.fromkeys((goal, *VALIDATION_COLUMNS)))
    validated_main = validated_layouts(findings, columns, recommended=True)
    validated_rest = validated_layouts(findings, columns, recommended=False)
    need, bills, steps = dead_reckoning.need_for_tags(findings), bills_of(findings), step_rows(findings)
    screened, refusals = screening.screening_of(findings), refusals_of(findings)
    paired = pairing.pairing_text(findings.pairing)
    further = [name for name in figures if name not in _PLACED]
    choices = choices_of(findings)
    shown = {
        "recommended": bool(chosen),
        "held-out": bool(validated_main) or "error_over_time" in figures,
        "need": bool(need.rows),
        "more-accuracy": bool(result.front.members),
        "one-step": bool(steps),
        "alternatives": findings.alternatives.instead_of is not None and bool(findings.alternatives.wish.count),
        "cost": bool(bills),
        "all-front": bool(result.front.members),
        "held-out-rest": bool(validated_rest),
        "references": bool(findings.references),
        "left-out": bool(refusals),
        "common-drives": bool(paired),
        "screen": bool(screened.agreements),
        "further": bool(further),
    }
    titles = {**_FOR_A_DECISION, **_TO_CHECK_IT}
    return (
        _environment()
        .get_template("report.html")
        .render(
            style=Markup(resources.files("studies").joinpath("style.css").read_text("utf-8")),
            policy=content_policy(),
            script=Markup(script_text()),
            data=Markup(page_data(findings, cards, frame)),
            page=first_page(findings, quick=quick),
            verdict_marks=_VERDICT_MARKS,
            verdict_classes=_VERDICT_CLASSES,
            titles=titles,
            shown={anchor for anchor in titles if shown.get(anchor, True)},
            contents=[
                (words, [anchor for anchor in anchors if shown.get(anchor, True)])
                for words, anchors in (("For a decision", _FOR_A_DECISION), ("To check it", _TO_CHECK_IT))
            ],
            cards=cards,
            frame=frame,
            first_role=next(iter(result.recommended), ""),
            front_drawing=_left_open(figures.get("front", "")),
            kinds=[(number, KINDS[number], words) for number, words in enumerate(_KIND_WORDS)],
            kind_names=KINDS,
            worlds_seen=worlds_of(findings, chosen) if chosen else [],
            commands=commands_of(chosen[0] if chosen else None),
            sources=sources,
            papers=[(software().key, software().text)]
            + [(work.key, work.text) for work in works_named(source.reference for source in sources)],
            findings=findings,
            problem=problem,
            ended=verdict(findings),
            stopped=result.status is Status.STOPPED_BY_LIMIT,
            refused=result.status in REFUSALS,
            quick=quick,
            failure=min(findings.failures.values(), default=""),
            goal=goal,
            cost=problem.goals[0],
            recommended=recommended_rows(findings),
            front=[row_of(item, findings) for item in result.front.members],
            half_gap=any("published_half_gap" in item.scores for item in result.front.members),
            limit_rows=limit_rows_of(findings),
            validated_main=validated_main,
            validated_rest=validated_rest,
            columns=columns,
            name_of=score_name,
            bills=bills,
            scopes=tuple(Scope),
            refusals=refusals,
            numbers={
                "layouts": len(findings.designs),
                "raced": sum(not design.refusal for design in findings.designs),
            },
            profiles=_profiles(findings),
            antennas=_antenna_sides(findings),
            worlds=[(scenario, fault_words(scenario.faults)) for scenario in (problem.design, *problem.held_out)],
            estimators=[(estimator.name, estimator.card) for estimator in problem.estimators],
            rfid_question=dead_reckoning.QUESTION,
            passed_over=passed_over_text(findings),
            need=need,
            words=meanings_of(_WORDS),
            step_rows=steps,
            step_layout=chosen[0].layout.short_key if chosen else "",
            pairing=paired,
            screening=screened,
            margins=["∞" if math.isinf(margin) else f"{margin:g}" for margin in screening.MARGINS],
            references=[(mark, _reconstructed(mark.layout)) for mark in findings.references],
            reference_note=_reference_note(findings),
            off_front=_off_front(findings),
            chassis_m=references.CHASSIS_M,
            reference_floor_m=references.FLOOR_SIDE_M,
            figures={name: Markup(svg) for name, svg in figures.items()},
            further=further,
            captions={
                **CAPTIONS,
                "front": f"Cost against {score_name(goal)}. Every point is a layout that was simulated; bars are "
                "95 % intervals. A step shows what a budget buys. The fuller a mark of the front, the likelier it "
                "is on the true front.",
            },
            facts=facts,
            drawings={role: list(links.items()) for role, links in linked.items()},
            not_known=NOT_KNOWN,
            **choices,
        )
    )


@lru_cache(maxsize=1)
def _environment() -> "Environment":
    """Return the templates with their filters; compiling them takes longer than filling them in."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined
    from markupsafe import Markup

    files = resources.files("studies")
    environment = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        loader=FunctionLoader(lambda name: files.joinpath(name).read_text("utf-8")),
    )
    environment.filters.update(
        score=_unbroken(score_text),
        interval=_unbroken(interval_words),
        euros=_unbroken(euros),
        metres=_unbroken(format_length),
        limit=limit_text,
        bare=_unbroken(bare_text),
        count=number_text,
        correlation=_unbroken(screening.correlation_text),
        svg=Markup,
    )
    return environment


def _unbroken(write: Callable[..., str]) -> Callable[..., str]:
    """Return a filter whose text breaks over lines only before and within the words on replications."""

    def filtered(*arguments: object, **options: object) -> str:
        value, bracket, counted = write(*arguments, **options).partition(" (")
        counted = counted.replace("n = ", "n\u00a0=\u00a0")
        return value.replace(" ", "\u00a0") + bracket + counted

    return filtered


def _reference_note(findings: Findings) -> str:
    """Return why published layouts lie where they do in the figure of the front; empty if there are none."""
    if not findings.references:
        return ""
    length_m, width_m = references.CHASSIS_M
    outline_m = findings.problem.design.robot.outline_m
    sides_m = outline_m.max(axis=0) - outline_m.min(axis=0)
    chassis = f"stand on a chassis of {length_m:g} m × {width_m:g} m"
    if sides_m[1] < width_m:
        chassis += ", wider than this robot"
    counts = sorted({mark.error.count for mark in findings.references})
    trials = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    return (
        f"Where published arrays lie below the front, it is because they {chassis}, run on a clear floor and "
        "assume readers that never disturb each other; they cannot be mounted here. Each rests on "
        f"{trials} {'trial' if counts == [1] else 'trials'}."
    )


def _off_front(findings: Findings) -> str:
    """Return why the cheapest recommended layout is no member of the front; empty if it is one."""
    item = findings.result.recommended.get("cheapest")
    if item is None or item.layout.key in {member.layout.key for member in findings.result.front.members}:
        return ""
    goals = findings.problem.goals
    further = list(dict.fromkeys(limit.score for limit in findings.problem.limits if limit.score not in goals))
    if not further:
        return (
            "The cheapest layout is not on the front: it meets every demand on held-out drives, which the front's "
            "two goals do not show."
        )
    return (
        "The cheapest layout is not on the front: it meets demands that the front's two goals do not show: "
        f"{', '.join(score_name(score) for score in further)}."
    )


def _all_layouts(findings: Findings) -> list[Layout]:
    layouts = [design.evaluated.layout for design in findings.designs]
    return layouts + [mark.layout for mark in findings.references]


def _profiles(findings: Findings) -> list[ReaderProfile]:
    groups = [group for layout in _all_layouts(findings) for group in layout.floor_readers]
    found = {group.profile.key: group.profile for group in groups}
    return sorted(found.values(), key=lambda profile: (profile.name, profile.key))


def _antenna_sides(findings: Findings) -> list[tuple[float, bool]]:
    """Return the antenna sides of the design space, and whether the antenna model extrapolates to them."""
    groups = [group for design in findings.designs for group in design.evaluated.layout.floor_readers]
    return sorted({(group.antenna.side_m, group.antenna.extrapolated) for group in groups})


def _reconstructed(layout: Layout) -> bool:
    """Return whether a group's positions were inferred because their source does not print them."""
    cards = [registry.card("readers", group.name) for group in layout.floor_readers]
    return any(isinstance(card, ReaderCard) and card.reconstructed for card in cards)


def _left_open(svg: str) -> str:
    """Return an ``<svg>`` element without its end, so that a page can draw over it; empty if there is none."""
    from markupsafe import Markup

    return Markup(svg[: svg.rindex("</svg>")]) if svg else ""


def _files_of_layouts(
    findings: Findings, drawings: Mapping[str, Mapping[str, str]], layout_files: Mapping[str, str]
) -> dict[str, dict[str, str]]:
    """Return name and link of the files of each layout, by its key: its own file, and drawings of its roles."""
    found = {key: {LAYOUT_FILE: _link(link)} for key, link in layout_files.items()}
    for role, links in drawings.items():
        found.setdefault(findings.result.recommended[role].layout.key, {}).update(links)
    return found


def _link(link: str) -> str:
    """Return a link below the report's own folder, safe in a page.

    Raises
    ------
    ValueError
        If it is absolute, leaves the folder, or names another protocol.
    """
    parts = urlsplit(link)
    path = PurePosixPath(link)
    if parts.scheme or parts.netloc or path.is_absolute() or ".." in path.parts or "\\" in link or not link:
        raise ValueError(f"a link of the report is relative to it, not {link!r}")
    return quote(link)
