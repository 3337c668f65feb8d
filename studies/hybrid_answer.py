"""What the study of a hybrid found: a layout of three parts, each as its own study tells it, with one bill."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from layoutopt.drawings.installation import write_overview
from layoutopt.feasibility import check
from layoutopt.layout import Layout
from layoutopt.parts import BillOfMaterial
from layoutopt.plots.cost_bars import draw_cost_bars
from layoutopt.plots.layout_plan import draw_layout_plan
from layoutopt.protocols import Answer, Evaluation, Failure
from layoutopt.result import Evaluated, Status
from layoutopt.scenario import Scenario
from layoutopt.score_text import euros, limit_text, score_name, score_text
from layoutopt.scores import TRACKING_UNITS, Score
from layoutopt.spec.building import Spec
from layoutopt.spec.layout_file import write_layout
from layoutopt.streams import Streams
from objectives.cost import Cost
from studies.antenna_yaw import AntennaYaw
from studies.antenna_yaw_results import fresh_scores, verdict_of
from studies.antenna_yaw_setting import ERROR
from studies.front_answer import FrontAnswer
from studies.page import REPORT, Data, Page, Picture, Section, Table, write_page
from studies.page_frame import closing_lines
from studies.transponder_placement import TransponderPlacement
from studies.transponder_placement_race import SUCCESS
from studies.transponder_placement_words import place_text

_MOST_BARS: Final = 12
_ASSUMPTIONS: Final = (
    "Each part is chosen by a study of its own on its own trials; their reports lie beside this one. In the model "
    "the parts do not disturb each other: floor tags are read at 13.56 MHz, UHF works at 860 to 960 MHz and the "
    "transponder in between, and nothing is shared but the robot. The error of the robot's own pose is not added "
    "to that of the people whom it finds. A laser scanner is not in the price: robots carry one to keep from "
    "running into things."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """One of the parts.

    Attributes
    ----------
    name, folder
        What it is called, and the folder of its own report.
    layout
        What its study recommends, ``None`` where it recommends nothing.
    choice
        That in words.
    judged
        Name and value of the score that it was chosen by; ``None`` where it has none.
    limits
        Its limits in words.
    status, shortfall
        How its search ended, and what is missing.
    answer
        All that its study found.
    cheapest
        Whether it is the cheapest that meets its limits; if not it was chosen by cost and error together.
    others
        Layouts of its front of cost and error, with scores; those of the floor tags only.
    """

    name: str
    folder: str
    layout: Layout | None
    choice: str
    judged: tuple[str, Score] | None
    limits: tuple[str, ...]
    status: Status
    shortfall: str
    answer: Answer
    cheapest: bool = True
    others: tuple[Evaluated, ...] = ()


def floor_part(answer: FrontAnswer) -> Part:
    """Return the part of the floor tags: the cheapest layout that meets every limit."""
    findings = answer.findings
    goal, item = findings.problem.goals[1], findings.result.recommended.get("cheapest")
    return Part(
        name="floor tags",
        folder="floor",
        layout=None if item is None else item.layout,
        choice="none" if item is None else item.layout.label,
        judged=None if item is None or goal not in item.scores else (goal, item.scores[goal]),
        limits=tuple(limit_text(limit) for limit in findings.problem.limits),
        status=findings.result.status,
        shortfall=findings.result.shortfall,
        answer=answer,
        others=findings.result.front.members,
    )


def tracking_part(study: AntennaYaw, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> Part:
    """Return the part of the UHF antennas."""
    verdict = verdict_of(study.problem, study.driven(evaluations))
    chosen = verdict.recommended
    judged = None
    if chosen is not None:
        scores = chosen.item.scores if chosen.fresh is None else fresh_scores(study.problem, chosen)
        judged = (ERROR, scores[ERROR])
    return Part(
        name="UHF antennas",
        folder="tracking",
        layout=None if chosen is None else chosen.choice.layout,
        choice="none" if chosen is None else chosen.choice.label,
        judged=judged,
        limits=tuple(limit_text(limit) for limit in study.problem.limits),
        status=verdict.status,
        shortfall=verdict.shortfall,
        answer=study.answer(evaluations, spec),
        cheapest=any(limit.score in TRACKING_UNITS for limit in study.problem.limits),
    )


def docking_part(study: TransponderPlacement, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> Part:
    """Return the part of the transponder."""
    results = study.results(evaluations)
    best = results.best
    missed = [
        f"{limit_text(limit)} is not shown: {score_text(score, limit.score)}" for limit, score in results.misses
    ]
    return Part(
        name="docking",
        folder="docking",
        layout=None if best is None else best.layout,
        choice="none" if best is None else f"transponder at {place_text(best)}",
        judged=None if best is None else (SUCCESS, results.finalists[0].drives.score(SUCCESS)),
        limits=tuple(limit_text(limit) for limit in (*study.asked.exact_limits, *study.asked.limits)),
        status=results.status,
        shortfall="; ".join(missed) if best is not None else "no place was left",
        answer=study.answer(evaluations, spec),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class HybridAnswer:
    """The parts together.

    Attributes
    ----------
    parts
        Floor tags, UHF antennas, docking.
    cost, scenario
        What prices a layout, and on which site.
    budget_eur
        What the whole may cost; ``None`` for no limit.
    trials
        Drives of all parts.
    """

    parts: tuple[Part, ...]
    cost: Cost
    scenario: Scenario
    budget_eur: float | None
    spec: Spec
    trials: int

    @property
    def layout(self) -> Layout | None:
        """The whole; ``None`` where a part is missing."""
        found = tuple(part.layout for part in self.parts if part.layout is not None)
        return _together(found) if len(found) == len(self.parts) else None

    @property
    def bill(self) -> BillOfMaterial | None:
        """Bill of the whole."""
        layout = self.layout
        return None if layout is None else self.cost.bill(layout, self.scenario)

    @property
    def over_budget_eur(self) -> float:
        """By how much the whole costs more than the budget; zero within it or without one."""
        bill = self.bill
        if bill is None or self.budget_eur is None:
            return 0.0
        return max(0.0, bill.total_eur - self.budget_eur)

    @property
    def met(self) -> bool:
        """Whether every part is found within its limits, and a whole that can be built within the budget."""
        found = self.layout is not None and not any(part.status.exit_code for part in self.parts)
        return found and not self.over_budget_eur and not self._unbuildable()

    @property
    def exit_code(self) -> int:
        """Zero if what was asked for is found and no task of a part failed."""
        codes = [code for part in self.parts for code in (part.status.exit_code, part.answer.exit_code)]
        return max(codes) or int(not self.met)

    def lines(self, folder: Path | None) -> list[str]:
        """Return the answer in a few lines, how sure it is, what to do next, and where to look."""
        lines = [*self._summary(), *closing_lines("hybrid", found=self.met)]
        return lines if folder is None else [*lines, f"report: {folder / REPORT}"]

    def write(self, folder: Path, *, streams: Streams, quick: bool) -> None:
        """Write the report of the whole with bill, layout and drawings, and each part's own in a folder below."""
        for part in self.parts:
            own = folder / part.folder
            own.mkdir(exist_ok=True)
            part.answer.write(own, streams=streams, quick=quick)
        reports = {f"{part.folder}/{REPORT}": f"report of {part.name}" for part in self.parts}
        links = {link: told for link, told in reports.items() if (folder / link).exists()}
        layout = self.layout
        if layout is not None:
            whole = f"layouts/{layout.short_key}.toml"
            (folder / "layouts").mkdir(exist_ok=True)
            write_layout(layout, self.spec, folder / whole, quick_look=quick)
            links[whole] = "the whole layout"
            write_overview(self.spec, layout, folder / "drawings", title=self.spec.site.name, quick_look=quick)
        write_page(self.page(), folder, quick=quick, links=links)

    def _unbuildable(self) -> tuple[str, ...]:
        layout = self.layout
        return () if layout is None else tuple(found.message for found in check(layout, self.scenario))

    def _summary(self) -> tuple[str, ...]:
        bill = self.bill
        lines = []
        if bill is None:
            lacking = " and ".join(part.name for part in self.parts if part.layout is None)
            lines.append(f"There is no whole: nothing was found for {lacking}.")
        else:
            costs = ", ".join(
                f"{euros(cost)} {part.name}" for part, cost in zip(self.parts, self._costs_eur(), strict=True)
            )
            robots = f"{bill.robot_count} robots" if bill.robot_count > 1 else "one robot"
            lines.append(f"The whole costs {euros(bill.total_eur)} for {robots}: {costs}.")
        lines += [_part_line(part) for part in self.parts]
        if self.over_budget_eur:
            lines.append(f"That is {euros(self.over_budget_eur)} more than the budget. {self._cheaper()}")
        lines += [f"It cannot be built: {message}." for message in self._unbuildable()]
        return tuple(lines)

    def _cheaper(self) -> str:
        """Return whether the whole could be cheaper."""
        missed = [part.name for part in self.parts if part.status.exit_code]
        if missed:
            return f"Even so not every limit is met: {' and '.join(missed)}."
        priced = [part.name for part in self.parts if not part.cheapest]
        if priced:
            return (
                f"No limit says how accurate is enough for {' and '.join(priced)}, so cost and error chose "
                "together; a limit asks for the cheapest within it, and the whole may then be cheaper."
            )
        return "It is the cheapest whole whose parts meet their limits."

    def _costs_eur(self) -> list[float]:
        """Return what each part costs by itself, EUR; the parts share no item of the bill, so they add up."""
        return [
            0.0 if part.layout is None else self.cost.bill(part.layout, self.scenario).total_eur
            for part in self.parts
        ]

    def page(self) -> Page:
        """Return the page of the whole, whose parts have pages of their own."""
        return Page(
            study="hybrid",
            title="Pose, finding people and docking together",
            summary=self._summary(),
            sections=tuple(section for section in (self._parts_section(), self._bill_section()) if section.parts),
            facts={
                "Seed": str(self.spec.seed),
                "Robots": str(self.spec.robot_count),
                "Prices": f"{self.spec.prices.name}, {self.spec.prices.date}",
                "Trials": f"{self.trials}, those of the three studies together",
            },
            data=(self._parts_data(), *self._bill_data()),
            found=self.met,
        )

    def _parts_section(self) -> Section:
        rows = tuple(
            (
                part.name,
                part.choice,
                "–"
                if part.judged is None
                else f"{score_name(part.judged[0])} {score_text(part.judged[1], part.judged[0])}",
                "; ".join(part.limits) or "none",
                part.status.value,
                euros(cost),
            )
            for part, cost in zip(self.parts, self._costs_eur(), strict=True)
        )
        head = ("part", "choice", "judged by", "limits", "how the search ended", "cost")
        parts: list[Table | Picture] = [*self._plan(), Table(caption="The parts", head=head, rows=rows, words=5)]
        bars = self._bars()
        if bars:
            caption = (
                "What the whole costs with each layout of the front of the floor tags: UHF antennas and docking "
                "stay as chosen. Beside each bar the mean position error."
            )
            parts.append(Picture(name="costs", caption=caption, drawn=draw_cost_bars(bars)))
        return Section(
            heading="What is chosen",
            paragraphs=(_ASSUMPTIONS,),
            parts=tuple(parts),
        )

    def _plan(self) -> list[Picture]:
        found = {part.name: part.layout for part in self.parts if part.layout is not None}
        if not found:
            return []
        layout, site = _together(tuple(found.values())), self.scenario.site
        caption = f"To scale, as far as it was found: {', '.join(found)}."
        drawn = draw_layout_plan(
            layout=layout, site=site, robot=self.spec.robot, tag_map=layout.floor_tags.lay_on(site)
        )
        return [Picture(name="plan", caption=caption, drawn=drawn)]

    def _bars(self) -> dict[str, dict[str, float]]:
        floor, *rest = self.parts
        fixed = dict(zip((part.name for part in rest), self._costs_eur()[1:], strict=True))
        goal = "position_error_mean" if floor.judged is None else floor.judged[0]
        members = floor.others[:: max(1, -(-len(floor.others) // _MOST_BARS))]
        return {
            score_text(item.scores[goal], goal): {floor.name: item.scores["cost"].value, **fixed}
            for item in members
            if goal in item.scores
        }

    def _bill_section(self) -> Section:
        bill = self.bill
        rows = (
            ()
            if bill is None
            else tuple(
                (
                    line.scope.value,
                    line.description,
                    f"{round(line.quantity, 2):g} {line.unit}",
                    euros(line.price_eur),
                    euros(line.total_eur),
                )
                for line in bill.lines
            )
        )
        head = ("for", "what", "quantity", "price of one", "total")
        return Section(
            heading="The bill",
            parts=(Table(caption="Bill of the whole", head=head, rows=rows, words=2),) if rows else (),
        )

    def _parts_data(self) -> Data:
        rows = []
        for part, cost in zip(self.parts, self._costs_eur(), strict=True):
            name, score = part.judged or ("", None)
            low, high = ("", "") if score is None else (f"{end:.9g}" for end in score.interval())
            value = "" if score is None else f"{score.value:.9g}"
            key = "" if part.layout is None else part.layout.key
            rows.append((part.folder, key, name, value, low, high, part.status.name, f"{cost:.2f}"))
        head = ("part", "layout", "score", "value", "low", "high", "status", "cost_eur")
        return Data(name="parts", head=head, rows=tuple(rows))

    def _bill_data(self) -> tuple[Data, ...]:
        bill = self.bill
        if bill is None:
            return ()
        rows = tuple(
            (line.scope.value, line.item, f"{line.quantity:.9g}", f"{line.price_eur:.2f}", f"{line.total_eur:.2f}")
            for line in bill.lines
        )
        return (Data(name="bill", head=("scope", "item", "quantity", "price_eur", "total_eur"), rows=rows),)


def _together(layouts: Sequence[Layout]) -> Layout:
    """Return one layout of some parts, of which only the first may lay tags on the floor."""
    return Layout(
        floor_tags=layouts[0].floor_tags,
        readers=tuple(group for layout in layouts for group in layout.readers),
        transponders=tuple(transponder for layout in layouts for transponder in layout.transponders),
        target_tags=sum(layout.target_tags for layout in layouts),
    )


def _part_line(part: Part) -> str:
    judged = ""
    if part.judged is not None:
        judged = f"; {score_name(part.judged[0])} {score_text(part.judged[1], part.judged[0])}"
    shortfall = part.shortfall[:1].upper() + part.shortfall[1:]
    lacking = f" {part.status.value} {shortfall}." if part.status.exit_code else ""
    return f"{part.name.capitalize() if part.name.islower() else part.name}: {part.choice}{judged}.{lacking}"
