"""A pattern for each zone, all chosen together to meet each zone's demand, against one pattern everywhere."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final

from layoutopt.identity import content_key
from layoutopt.protocols import Evaluation, Failure, Plan, Round, StudyCard, Task
from layoutopt.score_text import euros
from layoutopt.spec.building import Spec
from layoutopt.streams import Streams
from layoutopt.workers import Workers
from studies.cells import drives_in
from studies.held_out import failures_of
from studies.page import Page
from studies.page_answer import LayoutsAnswer, PageAnswer
from studies.zones_candidates import Effort
from studies.zones_page import page_of
from studies.zones_results import Results, results_of, summary
from studies.zones_search import COMPOSED, UNIFORM, Memory, Progress, progress_of
from studies.zones_setting import Setting, setting_of

CARD: Final = StudyCard(
    summary="Composes layouts with patterns by zone from paired outcomes of uniform ones, races them, and "
    "compares the cheapest with the cheapest of one pattern on held-out drives.",
    reference="own; estimators and error figures after mi2016",
    question="What do patterns of their own for each zone save?",
    adaptive=True,
    rests_on="Layouts are chosen on drives of the search and judged on held-out ones. Costs are exact "
    "for your prices; that a layout meets its limits is shown at one-sided 95 % or is called not "
    "shown.",
    next_step="Draw the layout from layouts/ with layoutopt draw. Where nothing is saved, one pattern "
    "for the whole floor is simpler to lay.",
    guide="zones",
)
_RACE_SHARE: Final = 3
"""Each of the two races gets a third of ``search_trials``, beyond the drives that its layouts had before; those
follow from the number of layouts and from how seldom drives enter a zone."""
_CLOSING_SHARE: Final = 2
"""The closing round gets so many times ``search_trials``: a layout far from its demand takes 20 to 40 drives."""
_QUICK_LAYOUTS: Final = 12
_PILOT_LAYOUTS: Final = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Zones:
    """The study of one spec."""

    setting: Setting
    effort: Effort
    card: ClassVar[StudyCard] = CARD
    memory: Memory = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "Zones":
        """Return the study that a spec asks for; a quick one has few reader groups and few drives.

        Raises
        ------
        InvalidInput
            If no zone of the spec has a target.
        """
        settings = spec.study
        if quick:
            effort = Effort(
                stages=(2, 4),
                most_times=2,
                shares=(1.0, 0.7),
                best=3,
                race_trials=24,
                looks=1,
                look_trials=2,
                most_tried=2,
                validation_trials=min(6, settings.validation_trials),
                spare_tries=1,
                closing_window=4,
                closing_block=2,
                closing_trials=16,
            )
        else:
            effort = Effort(
                stages=(4, 12),
                most_times=5,
                shares=(1.0, 0.9, 0.8, 0.7, 0.6),
                best=5,
                race_trials=settings.search_trials // _RACE_SHARE,
                looks=6,
                look_trials=min(40, settings.validation_trials),
                most_tried=8,
                validation_trials=settings.validation_trials,
                spare_tries=3,
                closing_window=24,
                closing_block=20,
                closing_trials=_CLOSING_SHARE * settings.search_trials,
            )
        return cls(setting=setting_of(spec, most_layouts=_QUICK_LAYOUTS if quick else None), effort=effort)

    @property
    def key(self) -> str:
        """Content key of the layouts, worlds, limits, prices and effort."""
        setting, problem = self.setting, self.setting.problem
        return content_key(
            "zones",
            sorted(item.layout.key for item in setting.layouts),
            [(slot.zone, [pattern.key for pattern in slot.patterns]) for slot in setting.slots],
            [scenario.key for scenario in (problem.design, *problem.held_out)],
            [estimator.key for estimator in problem.estimators],
            [(limit.score, limit.upper, limit.lower, limit.confidence) for limit in problem.limits],
            self.effort,
            setting.cost.key,
        )

    def plan(self) -> Plan:
        """Return the numbers of layouts and drives, and a pilot over uniform layouts in every world."""
        setting, effort, problem = self.setting, self.effort, self.setting.problem
        layouts = setting.layouts
        drives = effort.drives(setting)
        # That half of the layouts are needed after the first stage is a guess that fits a site of a few zones.
        uniform = len(layouts) * drives[0] + len(layouts) // 2 * (drives[-1] - drives[0])
        composed = 2 * effort.best * len(effort.shares) * drives[-1]
        search = uniform + composed + 2 * effort.race_trials
        worlds = len(problem.held_out)
        # A guess as well: two rounds of first looks and four tries of each kind.
        validation = worlds * 2 * (2 * effort.looks * effort.look_trials + 4 * effort.validation_trials)
        validation += effort.closing_trials
        options = [f"{slot.zone or 'floor'} {len(slot.patterns)}" for slot in setting.slots]
        lines = (
            f"{len(layouts)} uniform layouts in {len(setting.uniform)} reader groups; {setting.left_out} others "
            "cannot be built and judged",
            f"patterns to choose from: {', '.join(options)}",
            f"search: about {search} trials, {2 * effort.race_trials} of them by search_trials, the rest because "
            f"layouts need drives that enter each zone; validation: about {validation} trials, up to "
            f"{effort.closing_trials} of them for cheaper layouts that are still open",
        )
        chosen = layouts[:: max(1, len(layouts) // _PILOT_LAYOUTS)][:_PILOT_LAYOUTS]
        counts = [(problem.design, search), *((scenario, validation // worlds) for scenario in problem.held_out)]
        pilot = [
            (
                Task(layout=item.layout, scenario=scenario, estimator=problem.estimators[0], first=0, count=1),
                max(1, count // len(chosen)),
            )
            for scenario, count in counts
            for item in chosen
        ]
        return Plan(lines=lines, pilot=tuple(pilot))

    def next_batch(self, evaluations: Sequence[Evaluation | Failure]) -> Round:
        """Return the next round: uniform layouts, the race with what is composed of them, held-out drives."""
        progress = self._progress(evaluations)
        return Round(name=progress.stage, tasks=progress.tasks)

    def best_so_far(self, evaluations: Sequence[Evaluation | Failure]) -> str:
        """Return the costs of the layouts that hold, or the number of drives: predictions are no answers."""
        progress = self._progress(evaluations)
        shown = [
            f"{name} {euros(item.scores['cost'].value)}"
            for name in (COMPOSED, UNIFORM)
            if (item := progress.accepted(name)) is not None
        ]
        return ", ".join(shown) or f"{drives_in(evaluations)} drives"

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> LayoutsAnswer:
        """Return the comparison; the spec goes into the files of the layouts."""
        results = self.results(evaluations)
        failures = failures_of(evaluations)

        def page(_: Streams) -> Page:
            return page_of(results, facts=self._facts(evaluations, len(failures), spec))

        return LayoutsAnswer(
            page=PageAnswer(study="zones", summary=tuple(summary(results)), page=page, failures=failures),
            status=results.status,
            layouts=tuple(
                item.layout for kind in (COMPOSED, UNIFORM) if (item := results.accepted(kind)) is not None
            ),
            spec=spec,
        )

    def results(self, evaluations: Sequence[Evaluation | Failure]) -> Results:
        """Return what was found, of whatever is finished."""
        return results_of(self.setting, self.effort, self._progress(evaluations), evaluations)

    def _progress(self, evaluations: Sequence[Evaluation | Failure]) -> Progress:
        return progress_of(self.setting, self.effort, evaluations, self.memory)

    def _facts(self, evaluations: Sequence[Evaluation | Failure], failed: int, spec: Spec) -> dict[str, str]:
        effort, setting = self.effort, self.setting
        stages = " then ".join(map(str, effort.drives(setting)))
        return {
            "Seed": str(spec.seed),
            "Robots": str(spec.robot_count),
            "Reader profile": spec.reader_profile.name,
            "Prices": f"{spec.prices.name}, {spec.prices.date}",
            "Estimator": setting.problem.estimators[0].name,
            "Uniform layouts": f"{len(setting.layouts)}, with {stages} drives",
            "Held-out drives": f"{effort.look_trials} of each layout for a first look, {effort.validation_trials} "
            "of each one tried, in each scenario",
            "Closing round": f"at most {effort.closing_trials} held-out drives, in blocks that double from "
            f"{effort.closing_block}",
            "Drives of the search": str(
                drives_in([item for item in evaluations if item.group.scenario == setting.problem.design.name])
            ),
            "Trials": str(drives_in(evaluations)),
            "Failed tasks": str(failed),
        }
