"""What does accuracy cost? The front of cost against localisation error, and the layouts to build."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Final

from layoutopt.evaluate import outcomes_of
from layoutopt.identity import content_key
from layoutopt.problem import Problem
from layoutopt.protocols import Evaluation, Failure, Group, Plan, Round, StudyCard, group_of
from layoutopt.result import Evaluated, Front, Result, Status
from layoutopt.score_text import counted_text, euros, score_name, score_text
from layoutopt.scores import TrialOutcomes
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from solvers.exhaustive import Screened, entered, scored
from solvers.judging import exact_scores, meeting_limits, nearest_miss, pointed_out, simulated_scores
from solvers.racing import Racing, Standing
from studies import held_out, race_plan, references
from studies.alternatives import Wish, alternatives_of, wish_of
from studies.cells import ENOUGH_HELD_OUT
from studies.findings import Design, Findings, ReferenceMark
from studies.front_answer import FrontAnswer
from studies.one_steps import one_steps_of
from studies.pairing import pairing_of
from studies.shortfall import held_out_conflict, refused, search_conflict, sentences
from studies.trade_off import trade_off_of

CARD: Final = StudyCard(
    summary="Enumerates the design space, races it by simulation, validates the front on held-out drives.",
    reference="own; estimators and error figures after mi2016",
    question="Which layout is the cheapest that meets my accuracy target, and what would more accuracy cost?",
    adaptive=True,
    rests_on="The search is simulated; what is recommended was judged again on held-out drives that "
    "no search saw, with 95 % bounds. No robot of yours has driven yet.",
    next_step="Draw the recommended layout with layoutopt draw, or ask layoutopt explain what binds it.",
    guide="guide",
)
_FRONT_TRIALS: Final = 40
QUICK_SHARE: Final = 8
"""A quick run has so many times fewer held-out drives."""
_QUICK_LAYOUTS: Final = 80
_QUICK_SEARCH_SHARE: Final = 20
_QUICK_CANDIDATES: Final = 3
_WISH: Final = Wish()


@dataclass(frozen=True, slots=True, kw_only=True)
class CostVersusAccuracy:
    """The main study.

    Attributes
    ----------
    screened
        Every layout of the space with its exact scores.
    racing
        The search.
    validation_trials
        Held-out replications of each recommended layout, in each scenario and with each estimator.
    front_trials
        The same for the other members of the front.
    most_candidates
        How many layouts, cheapest first, are tried on held-out trials before the study gives up.
    reference_trials
        Replications of each published layout; zero leaves them out.
    wish
        How many alternatives to the recommended layout are offered, and what makes a layout one.
    thinning
        Only every so many-th layout that can be built races; 1 is all of them, more is for a quick look.
    """

    problem: Problem
    seed: int
    screened: tuple[Screened, ...]
    racing: Racing
    validation_trials: int = 200
    front_trials: int = 40
    most_candidates: int = 8
    reference_trials: int = 40
    wish: Wish = _WISH
    thinning: int = 1
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def of(
        cls,
        problem: Problem,
        *,
        seed: int,
        search_trials: int,
        validation_trials: int,
        front_trials: int,
        reference_trials: int,
        most_candidates: int = 8,
        wish: Wish = _WISH,
        most_layouts: int | None = None,
        workers: Workers | None = None,
    ) -> "CostVersusAccuracy":
        """Return the study of a problem, with its design space enumerated and thinned to ``most_layouts``.

        Layouts that are left out are priced, and get no other score.
        """
        entries = entered(problem)
        racing = sum(not item.refusal for item in entries)
        thinning = 1 if most_layouts is None else max(1, racing // most_layouts)
        return cls(
            problem=problem,
            seed=seed,
            screened=scored(problem, _thinned(entries, thinning), workers=workers),
            racing=Racing(trials=search_trials),
            validation_trials=validation_trials,
            front_trials=min(front_trials, validation_trials),
            most_candidates=most_candidates,
            reference_trials=reference_trials,
            wish=wish,
            thinning=thinning,
        )

    @classmethod
    def for_spec(
        cls, spec: Spec, *, quick: bool, workers: Workers | None = None, problem: Problem | None = None
    ) -> "CostVersusAccuracy":
        """Return the study that a spec asks for; a quick one looks at fewer layouts on fewer drives.

        ``problem`` takes the place of the spec's own, where it says more than a spec can.
        """
        settings = spec.study
        return cls.of(
            problem or spec.problem(),
            seed=spec.seed,
            search_trials=settings.search_trials // (_QUICK_SEARCH_SHARE if quick else 1),
            validation_trials=max(2, settings.validation_trials // (QUICK_SHARE if quick else 1)),
            front_trials=_FRONT_TRIALS // (QUICK_SHARE if quick else 1),
            reference_trials=_FRONT_TRIALS // (QUICK_SHARE if quick else 1),
            most_candidates=_QUICK_CANDIDATES if quick else 8,
            wish=wish_of(settings),
            most_layouts=_QUICK_LAYOUTS if quick else None,
            workers=workers,
        )

    @property
    def key(self) -> str:
        """Content key of the question: what a study folder is bound to, prices and effort aside."""
        scenarios = (self.problem.design, *self.problem.held_out)
        return content_key(
            sorted(item.evaluated.layout.key for item in self.screened),
            [scenario.key for scenario in scenarios],
            [estimator.key for estimator in self.problem.estimators],
            self.thinning,
        )

    @property
    def contenders(self) -> tuple[Evaluated, ...]:
        """The layouts that can be built and judged, and keep to the budget."""
        return tuple(item.evaluated for item in self.screened if not item.refusal)

    def next_batch(self, evaluations: Sequence[Evaluation | Failure]) -> Round:
        """Return the next round: search, then held-out trials of the front, of the recommended, references."""
        if not self.contenders:
            return Round(name="nothing can be built and judged", tasks=())
        standing = self.racing.standing(self.problem, self.contenders, evaluations)
        if standing.tasks:
            return Round(name=f"search, {counted_text(len(standing.tasks), 'layout')}", tasks=standing.tasks)
        known, failed = outcomes_of(evaluations), held_out.failures_of(evaluations)
        front = self._front(standing)
        chosen = self._chosen(standing, known, failed)
        steps = (
            ("held-out trials of the front", front.members, self.front_trials),
            ("held-out trials of the recommended", chosen, self.validation_trials),
        )
        for name, items, replications in steps:
            tasks = held_out.tasks(
                [item.layout for item in items],
                self.problem.held_out,
                self.problem.estimators,
                replications,
                known,
                failed,
            )
            if tasks:
                return Round(name=f"{name}, {counted_text(len(items), 'layout')}", tasks=tasks)
        tasks = held_out.tasks(
            [layout for _, layout in references.layouts(self.problem.space)] if self.reference_trials else [],
            [references.scenario(self.problem)],
            self.problem.estimators[:1],
            self.reference_trials,
            known,
            failed,
        )
        return Round(name="published layouts as references", tasks=tasks)

    def best_so_far(self, evaluations: Sequence[Evaluation | Failure]) -> str:
        """Return the smallest error while layouts race, then the cheapest that meets the limits as far as known.

        That is a layout that met them in search until one meets them on all its held-out drives.
        """
        standing = self.racing.standing(self.problem, self.contenders, evaluations)
        goal = self.problem.goals[1]
        if standing.tasks:
            tables = outcomes_of(evaluations)
            groups = [
                (table.score(goal), key)
                for (key, *_), table in tables.items()
                if len(table) > self.racing.first_trials
            ]
            if not groups:
                return ""
            score, key = min(groups, key=lambda entry: (entry[0].value, entry[1]))
            return f"smallest {score_name(goal)} {score_text(score, goal)} ({key[:10]})"
        known, failed = outcomes_of(evaluations), held_out.failures_of(evaluations)
        tried, accepted = self._cheapest(standing, known, failed)
        item = accepted or next(iter(tried[-1:]), None)
        if item is None:
            return "no layout meets the limits" if self.problem.limits else "every layout failed"
        named = f"{euros(item.scores[self.problem.goals[0]].value)}, the cheapest"
        if not self.problem.limits:
            return f"{named} of all ({item.layout.short_key})"
        if accepted is not None:
            drives = counted_text(self.validation_trials, "held-out drive")
            few = ", too few to decide" if self.validation_trials < ENOUGH_HELD_OUT else ""
            return f"{named} that meets the limits on {drives} of each kind{few} ({item.layout.short_key})"
        if held_out.holds(self.problem, item, known, failed, self.validation_trials) is not None:
            return f"{counted_text(len(tried), 'layout')} tried on held-out drives, none met the limits there"
        meeting = meeting_limits(self.problem, standing.finalists)
        left = "" if item is meeting[0] else " and may meet them on held-out drives"
        return f"{named} that meets the limits in search{left} ({item.layout.short_key})"

    def plan(self) -> Plan:
        """Return how many layouts would race, and how many trials that takes at most."""
        return race_plan.plan_of(self)

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> FrontAnswer:
        """Return the findings with the spec that they answer."""
        return FrontAnswer(findings=self.findings(evaluations), spec=spec)

    def answer_so_far(self, evaluations: Sequence[Evaluation | Failure], spec: Spec, stopped: str) -> FrontAnswer:
        """Return what is known before the study is done, marked as stopped."""
        return FrontAnswer(findings=self.findings(evaluations, stopped=stopped), spec=spec)

    def findings(self, evaluations: Sequence[Evaluation | Failure], *, stopped: str = "") -> Findings:
        """Return what the study found; every number in it comes from the evaluations or is exact.

        ``stopped`` says why a study ended before it was done. Then layouts may stand in the front on a few trials,
        and the cheapest may lack its held-out drives, which its reason says.
        """
        standing = self.racing.standing(self.problem, self.contenders, evaluations)
        known, failed = outcomes_of(evaluations), held_out.failures_of(evaluations)
        front = self._front(standing)
        tried, accepted = self._cheapest(standing, known, failed)
        unproven = accepted is None and bool(stopped)
        cheapest = next(iter(meeting_limits(self.problem, front.members)), None) if unproven else accepted
        recommended = pointed_out(front, cheapest)
        result = self._result(standing, known, recommended, tried, accepted)
        if stopped:
            result = replace(result, status=Status.STOPPED_BY_LIMIT, shortfall=stopped)
        verdicts = {
            item.layout.key: held_out.holds(self.problem, item, known, failed, self.validation_trials)
            for item in standing.finalists
        }
        judged = [item for item in standing.finalists if verdicts[item.layout.key] is not None]
        shown = _unique([*recommended.values(), *tried, *front.members, *judged])
        designs = self._designs(standing, front, known, failed)
        raced = [design.evaluated for design in designs if not design.refusal]
        return Findings(
            problem=self.problem,
            result=result,
            designs=designs,
            validations=held_out.validate(self.problem, shown, known, failed),
            references=self._references(known),
            pairing=pairing_of(self.problem, standing.finalists, front, known),
            trade_off=trade_off_of(
                self.problem, self.contenders, front, recommended, known, self.seed, standing.misjudged
            ),
            alternatives=alternatives_of(
                self.problem,
                raced,
                recommended,
                known,
                self.wish,
                failed={key for key, held in verdicts.items() if held is False},
            ),
            one_steps=one_steps_of(self.problem, raced, next(iter(recommended.values()), None), known),
            candidates_validated=len(tried),
            passed_over=self.passed_over(meeting_limits(self.problem, standing.finalists), tried, accepted),
            seed=self.seed,
            reasons={role: self._reason(role, unproven=unproven) for role in recommended},
            failures=failed,
        )

    def _front(self, standing: Standing) -> Front:
        return Front(goals=self.problem.goals, members=standing.front)

    def _cheapest(
        self, standing: Standing, known: Mapping[Group, TrialOutcomes], failed: Mapping[Group, str]
    ) -> tuple[list[Evaluated], Evaluated | None]:
        """Return the candidates tried on held-out trials so far, and the one that held, if any.

        Tried are layouts that met the limits in search and would still meet them if they lost as much on
        held-out drives as the front did, cheapest first. The last one may still lack trials; then it is next.
        """
        front = self._front(standing).members
        if not self.problem.limits:
            return [], front[0] if front else None
        meeting = meeting_limits(self.problem, standing.finalists)
        return self.first_that_holds(meeting, self.promising(meeting, front, known), known, failed)

    def promising(
        self, meeting: Sequence[Evaluated], front: Sequence[Evaluated], known: Mapping[Group, TrialOutcomes]
    ) -> list[Evaluated]:
        """Return those of the layouts that would meet the limits if they lost on held-out drives what a front did.

        See `held_out.promising`; the loss is that of the front's first ``front_trials`` held-out drives.
        """
        ratios = held_out.transfer(self.problem, front, known, self.front_trials)
        return held_out.promising(self.problem, meeting, ratios)

    def first_that_holds(
        self,
        meeting: Sequence[Evaluated],
        promising: Sequence[Evaluated],
        known: Mapping[Group, TrialOutcomes],
        failed: Mapping[Group, str],
    ) -> tuple[list[Evaluated], Evaluated | None]:
        """Return the layouts tried on held-out drives, in order, and the first that meets every limit there.

        Tried are the promising ones of those that met the limits in search, ``most_candidates`` at most; the last
        one may still lack trials. A layout that has all its held-out drives for another reason, as the knee has,
        is judged by them and counts among those tried, promising or not.
        """
        hopeful = {item.layout.key for item in promising}
        tried: list[Evaluated] = []
        spent = 0
        for item in meeting:
            verdict = held_out.holds(self.problem, item, known, failed, self.validation_trials)
            promises = item.layout.key in hopeful
            if verdict is None and (not promises or spent >= self.most_candidates):
                continue
            spent += promises
            tried.append(item)
            if verdict:
                return tried, item
            if verdict is None:
                break
        return tried, None

    def passed_over(
        self, meeting: Sequence[Evaluated], tried: Sequence[Evaluated], accepted: Evaluated | None
    ) -> tuple[Evaluated, ...]:
        """Return what met the limits in search for less than the layout that held, and was not tried."""
        if accepted is None or not self.problem.limits:
            return ()
        cost, seen = self.problem.goals[0], {item.layout.key for item in tried}
        return tuple(
            item
            for item in meeting
            if item.scores[cost].value < accepted.scores[cost].value and item.layout.key not in seen
        )

    def _chosen(
        self, standing: Standing, known: Mapping[Group, TrialOutcomes], failed: Mapping[Group, str]
    ) -> list[Evaluated]:
        """Return the layouts that need the full number of held-out trials."""
        tried, accepted = self._cheapest(standing, known, failed)
        return _unique([*tried[-1:], *pointed_out(self._front(standing), accepted).values()])

    def _reason(self, role: str, *, unproven: bool) -> str:
        """Return in words why the layout of a role was chosen."""
        if role == "knee":
            return "where the front bends: more accuracy gets dear, and saving more loses much of it"
        if role == "most accurate":
            return f"smallest {score_name(self.problem.goals[1])} of the front"
        if self.problem.limits and unproven:
            return "cheapest of the front that meets every limit in search; its held-out drives are not complete"
        if self.problem.limits:
            return "cheapest layout that meets every limit, in search and on all held-out drives"
        return "cheapest layout of the front; no limit was set"

    def _result(
        self,
        standing: Standing,
        known: Mapping[Group, TrialOutcomes],
        recommended: Mapping[str, Evaluated],
        tried: Sequence[Evaluated],
        accepted: Evaluated | None,
    ) -> Result:
        status, shortfall = Status.TARGET_MET if self.problem.limits else Status.SEARCHED, ""
        if not self.contenders:
            status, shortfall = refused(self.problem, self.screened)
        elif not standing.finalists:
            status, shortfall = Status.TARGET_NOT_MET, "every layout failed in simulation; see designs.csv"
        elif accepted is None and tried:
            status = Status.TARGET_NOT_MET
            seen = [*tried, *self._front(standing).members]
            shortfall = sentences(
                f"{counted_text(len(tried), 'layout')} met the limits in search, none of them on held-out drives",
                held_out.shortfall(self.problem, tried, known),
                held_out_conflict(self.problem, seen, known),
            )
        elif accepted is None:
            status, shortfall = Status.TARGET_NOT_MET, nearest_miss(self.problem, standing.finalists)
            shortfall = sentences(shortfall, search_conflict(self.problem, standing.finalists, self.screened))
        return Result(
            status=status,
            front=self._front(standing),
            recommended=recommended,
            trials=standing.trials,
            shortfall=shortfall,
        )

    def _designs(
        self,
        standing: Standing,
        front: Front,
        known: Mapping[Group, TrialOutcomes],
        failed: Mapping[Group, str],
    ) -> tuple[Design, ...]:
        scored = {item.layout.key: item for item in standing.finalists}
        on_front = {item.layout.key for item in front.members}
        designs = []
        for item in self.screened:
            layout = item.evaluated.layout
            group = group_of(layout, self.problem.design, self.problem.estimators[0])
            table = known.get(group)
            simulated = simulated_scores(self.problem, layout, self.problem.design, table)
            scores = {**item.evaluated.scores, **simulated}
            designs.append(
                Design(
                    evaluated=scored.get(layout.key, Evaluated(layout=layout, scores=scores)),
                    refusal=f"failed: {failed[group]}" if group in failed else item.refusal,
                    trials=0 if table is None else len(table),
                    on_front=layout.key in on_front,
                )
            )
        return tuple(designs)

    def _references(self, known: Mapping[Group, TrialOutcomes]) -> tuple[ReferenceMark, ...]:
        world = references.scenario(self.problem)
        marks = []
        for label, layout in references.layouts(self.problem.space):
            table = known.get(group_of(layout, world, self.problem.estimators[0]))
            if table is None:
                continue
            marks.append(
                ReferenceMark(
                    label=label,
                    layout=layout,
                    cost=exact_scores(self.problem, layout)[self.problem.goals[0]],
                    error=table.score(self.problem.goals[1]),
                )
            )
        return tuple(marks)


def _thinned(screened: Sequence[Screened], thinning: int) -> tuple[Screened, ...]:
    """Return the same layouts, all but every ``thinning``-th of those that can be built refused."""
    count, found = 0, []
    for item in screened:
        if item.refusal or (count := count + 1) % thinning == 0:
            found.append(item)
        else:
            refusal = f"left out: a quick run looks at one layout in {thinning}"
            found.append(replace(item, refusal=refusal, rule="a quick run"))
    return tuple(found)


def _unique(items: Sequence[Evaluated]) -> list[Evaluated]:
    return list({item.layout.key: item for item in items}.values())
