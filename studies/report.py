"""The report of a cost-against-accuracy study: one HTML file that needs nothing else, on screen and on paper."""

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import PurePosixPath
from typing import Final
from urllib.parse import quote, urlsplit

from layoutopt import registry
from layoutopt.layout import Layout, ReaderProfile
from layoutopt.parts import BillOfMaterial, Scope
from layoutopt.plots.front import known_interval
from layoutopt.problem import Limit
from layoutopt.protocols import ReaderCard
from layoutopt.result import Evaluated, Status, Validation
from layoutopt.scenario import Faults
from layoutopt.score_text import NOT_KNOWN, euros, interval_text, limit_text, score_name, score_text
from layoutopt.scores import Score, Scores
from layoutopt.units import format_length
from objectives.cost import Cost
from studies import dead_reckoning, pairing, references, screening
from studies.choices import choices_html
from studies.findings import Findings

CAPTIONS: Final[Mapping[str, str]] = {
    "layout": "The recommended layout on its site, and the underside of one robot over the tags.",
    "error_over_time": "One held-out drive: how the error of each estimator goes over time. One drive shows the "
    "course; the tables give means over many.",
}
VALIDATION_COLUMNS: Final = ("position_error_mean", "position_error_p95", "heading_error_mean", "lost_share")
_REASONS_SHOWN: Final = 6
_REFUSALS: Final = (Status.TARGET_NOT_MET, Status.BUDGET_TOO_SMALL, Status.INFEASIBLE, Status.STOPPED_BY_LIMIT)


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldOut:
    """How a layout did in one held-out scenario with the estimator that the search used."""

    scenario: str
    error: Score | None
    optimism: Score | None
    verdict: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A layout as the tables show it."""

    roles: tuple[str, ...]
    reason: str
    layout: Layout
    scores: Scores
    tags: int
    antennas: int
    modules: int
    extrapolated: bool
    held_out: tuple[HeldOut, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitRow:
    """A demand on one recommended layout: its score in the search, and each held-out one with the verdict."""

    role: str
    limit: Limit
    search: Score | None
    held_out: tuple[tuple[str, Score | None, str], ...]


def render_report(
    findings: Findings,
    *,
    figures: Mapping[str, str],
    facts: Mapping[str, str],
    drawings: Mapping[str, Mapping[str, str]],
    quick: bool = False,
) -> str:
    """Return the report as one HTML page without scripts or anything to be loaded.

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

    Raises
    ------
    ValueError
        If a figure is no ``<svg>`` element, or a link is not relative.
    """
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    for name, svg in figures.items():
        if not svg.lstrip().startswith("<svg"):
            raise ValueError(f"figure '{name}' is no <svg> element")
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters.update(
        score=_unbroken(score_text),
        interval=_unbroken(_interval_words),
        euros=_unbroken(euros),
        metres=_unbroken(format_length),
        limit=limit_text,
        correlation=_unbroken(screening.correlation_text),
    )
    files = resources.files("studies")
    template = environment.from_string(files.joinpath("report.html").read_text("utf-8"))
    problem, result = findings.problem, findings.result
    goal = problem.goals[1]
    recommended = _recommended_rows(findings)
    own = {row.layout.key for row in recommended}
    labels = _labels(findings)
    return template.render(
        style=Markup(files.joinpath("style.css").read_text("utf-8")),
        findings=findings,
        problem=problem,
        status=result.status,
        stopped=result.status is Status.STOPPED_BY_LIMIT,
        refused=result.status in _REFUSALS,
        quick=quick,
        failure=min(findings.failures.values(), default=""),
        goal=goal,
        cost=problem.goals[0],
        recommended=recommended,
        front=[_row(item, findings) for item in result.front.members],
        half_gap=any("published_half_gap" in item.scores for item in result.front.members),
        limit_rows=_limit_rows(findings),
        validated_main=_by_layout([row for row in findings.validations if row.layout_key in own], labels),
        validated_rest=_by_layout([row for row in findings.validations if row.layout_key not in own], labels),
        columns=tuple(dict.fromkeys((goal, *VALIDATION_COLUMNS))),
        name_of=score_name,
        bills=_bills(findings),
        scopes=tuple(Scope),
        refusals=_refusals(findings),
        numbers={
            "layouts": len(findings.designs),
            "raced": sum(not design.refusal for design in findings.designs),
        },
        profiles=_profiles(findings),
        antennas=_antenna_sides(findings),
        worlds=[(scenario, _fault_words(scenario.faults)) for scenario in (problem.design, *problem.held_out)],
        estimators=[(estimator.name, estimator.card) for estimator in problem.estimators],
        rfid_question=dead_reckoning.QUESTION,
        need=dead_reckoning.need_for_tags(findings),
        choices=Markup(choices_html(findings, environment)),
        pairing=pairing.pairing_text(findings.pairing),
        screening=screening.screening_of(findings),
        margins=["∞" if math.isinf(margin) else f"{margin:g}" for margin in screening.MARGINS],
        references=[(mark, _reconstructed(mark.layout)) for mark in findings.references],
        reference_note=_reference_note(findings),
        off_front=_off_front(findings),
        chassis_m=references.CHASSIS_M,
        reference_floor_m=references.FLOOR_SIDE_M,
        figures={name: Markup(svg) for name, svg in figures.items()},
        captions={
            **CAPTIONS,
            "front": f"Cost against {score_name(goal)}. Every point is a layout that was simulated; bars are 95 % "
            "intervals. A step shows what a budget buys. The fuller a mark of the front, the likelier it is "
            "on the true front.",
        },
        facts=facts,
        drawings={role: [(name, _link(link)) for name, link in links.items()] for role, links in drawings.items()},
        not_known=NOT_KNOWN,
    )


def _unbroken(write: Callable[..., str]) -> Callable[..., str]:
    """Return a filter whose text breaks over lines only before and within the words on replications."""

    def filtered(*arguments: object, **options: object) -> str:
        value, bracket, counted = write(*arguments, **options).partition(" (")
        counted = counted.replace("n = ", "n\u00a0=\u00a0")
        return value.replace(" ", "\u00a0") + bracket + counted

    return filtered


def _interval_words(score: Score | None, name: str = "") -> str:
    """Return the 95 % interval, or that it is not known: Student's is absurd for a handful of replications."""
    if score is not None and known_interval(score) is None:
        return f"interval {NOT_KNOWN} (n = {score.count})"
    return interval_text(score, name)


def _reference_note(findings: Findings) -> str:
    """Return why published layouts lie where they do in the figure of the front; empty if there are none."""
    if not findings.references:
        return ""
    length_m, width_m = references.CHASSIS_M
    outline_m = findings.problem.design.robot.outline_m
    sides_m = outline_m.max(axis=0) - outline_m.min(axis=0)
    wider = "are wider than this robot" if sides_m[1] < width_m else "have a chassis of their own"
    counts = sorted({mark.error.count for mark in findings.references})
    trials = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    return (
        f"Where published arrays lie below the front, it is because they {wider} (chassis {length_m:g} m × "
        f"{width_m:g} m), run on a clear floor and assume readers that never disturb each other; they cannot be "
        f"mounted here. Each rests on {trials} {'trial' if counts == [1] else 'trials'}."
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


def _recommended_rows(findings: Findings) -> list[Row]:
    """Return one row for each recommended layout, whatever the number of its roles."""
    unique = {item.layout.key: item for item in findings.result.recommended.values()}
    return [_row(item, findings) for item in unique.values()]


def _row(item: Evaluated, findings: Findings) -> Row:
    roles = tuple(
        role for role, chosen in findings.result.recommended.items() if chosen.layout.key == item.layout.key
    )
    reasons = [findings.reasons[role] for role in roles if role in findings.reasons]
    return Row(
        roles=roles,
        reason="; ".join(dict.fromkeys(reasons)),
        layout=item.layout,
        scores=item.scores,
        tags=len(item.layout.floor_tags.lay_on(findings.problem.design.site)),
        antennas=sum(group.count for group in item.layout.readers),
        modules=sum(group.module_count for group in item.layout.readers),
        extrapolated=item.layout.extrapolated,
        held_out=tuple(
            HeldOut(
                scenario=row.scenario,
                error=(row.scores or {}).get(findings.problem.goals[1]),
                optimism=row.optimism,
                verdict=_verdict_of_all(findings.problem.limits, _with_exact(item.scores, row.scores)),
            )
            for row in _own_validations(findings, item)
        ),
    )


def _own_validations(findings: Findings, item: Evaluated) -> list[Validation]:
    """Return the held-out rows of a layout with the estimator of the search."""
    own = findings.problem.estimators[0].name if findings.problem.estimators else ""
    return [row for row in findings.validations if row.layout_key == item.layout.key and row.estimator == own]


def _with_exact(search: Scores, held_out: Scores | None) -> dict[str, Score]:
    """Return held-out scores with the exact ones of the search, which hold in every world."""
    return {**{name: score for name, score in search.items() if score.exact}, **(held_out or {})}


def _verdict(limit: Limit, scores: Scores) -> str:
    score = scores.get(limit.score)
    if score is None:
        return NOT_KNOWN
    return "met" if limit.met(score) else "broken" if limit.broken(score) else "undecided"


def _verdict_of_all(limits: Sequence[Limit], scores: Scores) -> str:
    """Return the worst verdict over all limits: broken, not known, undecided, met; empty without limits."""
    verdicts = {_verdict(limit, scores) for limit in limits}
    return next((word for word in ("broken", NOT_KNOWN, "undecided", "met") if word in verdicts), "")


def _limit_rows(findings: Findings) -> list[LimitRow]:
    rows = []
    for role, item in findings.result.recommended.items():
        held_out = [
            (row.scenario, _with_exact(item.scores, row.scores)) for row in _own_validations(findings, item)
        ]
        rows += [
            LimitRow(
                role=role,
                limit=limit,
                search=item.scores.get(limit.score),
                held_out=tuple(
                    (scenario, scores.get(limit.score), _verdict(limit, scores)) for scenario, scores in held_out
                ),
            )
            for limit in findings.problem.limits
        ]
    return rows


def _labels(findings: Findings) -> dict[str, tuple[str, Layout]]:
    """Return role (or short key) and layout by key, for every layout that the findings hold."""
    items = [design.evaluated.layout for design in findings.designs]
    items += [item.layout for item in (*findings.result.front.members, *findings.result.recommended.values())]
    found = {layout.key: (layout.short_key, layout) for layout in items}
    for role, item in reversed(list(findings.result.recommended.items())):
        found[item.layout.key] = (role, item.layout)
    return found


def _by_layout(
    rows: Iterable[Validation], labels: Mapping[str, tuple[str, Layout]]
) -> list[tuple[str, str, list[Validation]]]:
    """Return name, label and rows of each layout, in the order of the rows."""
    grouped: dict[str, list[Validation]] = {}
    for row in rows:
        grouped.setdefault(row.layout_key, []).append(row)
    found = []
    for key, own in grouped.items():
        name, label = (labels[key][0], labels[key][1].label) if key in labels else (key[:10], "")
        found.append((name, label, own))
    return found


def _bills(findings: Findings) -> list[tuple[str, BillOfMaterial]]:
    """Return role and bill of each recommended layout; none if the problem has no prices."""
    cost = next((item for item in findings.problem.objectives if isinstance(item, Cost)), None)
    if cost is None:
        return []
    return [
        (role, cost.bill(item.layout, findings.problem.design))
        for role, item in findings.result.recommended.items()
    ]


def _refusals(findings: Findings) -> list[tuple[int, str]]:
    """Return how many layouts were refused for which reason, an example of each, most frequent first."""
    examples: dict[str, str] = {}
    numbers: Counter[str] = Counter()
    for design in findings.designs:
        if design.refusal:
            kind = re.sub(r"\b\d[\d.]*\b", "#", design.refusal)
            examples.setdefault(kind, design.refusal)
            numbers[kind] += 1
    ordered = sorted(numbers.items(), key=lambda entry: (-entry[1], entry[0]))
    return [(count, examples[kind]) for kind, count in ordered[:_REASONS_SHOWN]]


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


def _fault_words(faults: Faults) -> str:
    """Return what goes wrong in a world, in words."""
    words = []
    for value, text in (
        (faults.tag_placement_sigma_m, f"tags {format_length(faults.tag_placement_sigma_m)} off on each axis"),
        (faults.dead_tag_share, f"{faults.dead_tag_share:.3g} of the tags dead"),
        (faults.missed_read_share, f"{faults.missed_read_share:.3g} of the reads missed"),
        (faults.wrong_identity_share, f"{faults.wrong_identity_share:.3g} of the reads with a wrong identity"),
        (faults.antenna_height_error_m, f"antennas {format_length(faults.antenna_height_error_m)} too high"),
        (faults.read_edge_m, f"read discs with a soft edge of {format_length(faults.read_edge_m)}"),
        (faults.direction_noise_rad, f"directions {faults.direction_noise_rad:.3g} rad off"),
        (faults.clock_error_s, f"readings {faults.clock_error_s:g} s late"),
    ):
        if value != 0.0:
            words.append(text)
    if faults.tag_offset_m != (0.0, 0.0):
        words.append(f"all tags shifted by {' and '.join(format_length(shift) for shift in faults.tag_offset_m)}")
    if faults.kidnapped_at_s is not None:
        words.append(f"the robot lifted to another place after {faults.kidnapped_at_s:g} s")
    return "; ".join(words) or "nothing goes wrong"


def _reconstructed(layout: Layout) -> bool:
    """Return whether a group's positions were inferred because their source does not print them."""
    cards = [registry.card("readers", group.name) for group in layout.floor_readers]
    return any(isinstance(card, ReaderCard) and card.reconstructed for card in cards)


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
