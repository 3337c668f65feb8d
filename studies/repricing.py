"""The front and the choices of a finished study made anew under other prices, from the drives that it has."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from layoutopt.errors import InvalidInput
from layoutopt.evaluate import outcomes_of
from layoutopt.journal import FROZEN_SPEC, MANIFEST, read_manifest, read_recorded
from layoutopt.parts import read_prices
from layoutopt.problem import Problem
from layoutopt.protocols import Group
from layoutopt.result import Evaluated, Result, Status, Validation
from layoutopt.score_text import counted_text, euros
from layoutopt.scores import TrialOutcomes
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from solvers.exhaustive import exceeds
from solvers.front import front_of
from solvers.judging import exact_scores, meeting_limits, nearest_miss, pointed_out
from studies import held_out
from studies.alternatives import alternatives_of, wish_of
from studies.cost_vs_accuracy import CostVersusAccuracy
from studies.findings import Design, Findings
from studies.one_steps import one_steps_of
from studies.runner import replay
from studies.shortfall import sentences
from studies.summary import passed_over_text, verdict
from studies.trade_off import trade_off_of

MAIN_STUDY: Final = "cost_vs_accuracy"
"""The study whose front can be priced anew."""
UNTRIED: Final = "cheapest untried"
"""Role of a layout that meets the limits in search for less than any that is known to hold on held-out drives."""
_UNDECIDED: Final = "Not decided: of what has all its held-out drives no layout is shown to meet every limit."
REPRICED_TRIALS: Final = 16
"""A layout needs that many trials to enter a repriced front: fewer would favour lucky ones."""


def reprice(folder: Path, prices_file: Path) -> tuple[Findings, int]:
    """Return the findings of a finished study with front and choices made anew under other prices.

    Nothing is simulated. The number says how many simulated layouts stayed out: those with fewer trials than
    any member of the old front, or than `REPRICED_TRIALS`, because few trials favour lucky ones.

    The cheapest is the first that holds on the held-out drives that the folder has, by the rule of the study
    (`CostVersusAccuracy.first_that_holds`), so the study's own prices give the study's own answer. A cheaper one
    that meets the limits in search and lacks held-out drives has a role of its own, `UNTRIED`.

    Raises
    ------
    StudyDamaged, InvalidInput
        If the folder holds no finished study, or the price list is faulty.
    """
    if not (folder / MANIFEST).exists():
        raise InvalidInput.at(str(folder), "holds no study", "Give the --out folder of a finished study.")
    facts = read_manifest(folder)
    if facts.get("study") != MAIN_STUDY:
        repair = f"Give the --out folder of a {MAIN_STUDY} study."
        raise InvalidInput.at(str(folder), f"the study {facts.get('study')!r} has no front of costs", repair)
    quick = bool(facts.get("quick"))
    spec = read_spec(folder / FROZEN_SPEC)
    question = CostVersusAccuracy.for_spec(spec, quick=quick)
    evaluations = replay(question, streams=Streams(seed=spec.seed), recorded=read_recorded(folder))
    before = question.findings(evaluations)
    problem = replace(spec, prices=read_prices(prices_file, place=str(prices_file))).problem()
    question = replace(question, problem=problem)
    known, failed = outcomes_of(evaluations), held_out.failures_of(evaluations)
    old_keys = {item.layout.key for item in before.result.front.members}
    old_trials = [item.trials for item in before.designs if item.evaluated.layout.key in old_keys]
    least = min([REPRICED_TRIALS, *old_trials])
    designs = [_repriced(design, problem) for design in before.designs]
    judged = [item.evaluated for item in designs if item.trials >= least and not item.refusal]
    front = front_of(judged, problem.goals)

    # What has all its held-out drives is judged by those, and needs no number of drives in the search.
    left = [item.evaluated for item in designs if item.trials and not item.refusal]
    verdicts = {
        item.layout.key: held_out.holds(problem, item, known, failed, question.validation_trials) for item in left
    }
    enough = {item.layout.key for item in judged} | {key for key, held in verdicts.items() if held is not None}
    cost, goal = problem.goals[:2]
    # A race sorts its finalists like that, so that layouts of one cost are tried in the same order.
    meeting = sorted(
        meeting_limits(problem, [item for item in left if item.layout.key in enough]),
        key=lambda item: (item.scores[cost].value, item.scores[goal].value, item.layout.key),
    )
    if problem.limits:
        promising = [
            item
            for item in question.promising(meeting, before.result.front.members, known)
            if verdicts[item.layout.key] is not None or not _broken(problem, before.validations, item)
        ]
        driven = [item for item in meeting if verdicts[item.layout.key] is not None]
        tried, cheapest = question.first_that_holds(driven, promising, known, failed)
        # What the study would try next under these prices, if it has any try left.
        walk, _ = question.first_that_holds(meeting, promising, known, failed)
        untried = next((item for item in walk if verdicts[item.layout.key] is None), None)
    else:
        tried, cheapest, untried, promising = [], next(iter(front.members), None), None, []
    roles = {"cheapest": cheapest, UNTRIED: untried, **pointed_out(front, None)}
    recommended = {role: item for role, item in roles.items() if item is not None}
    status, shortfall = _status(problem, before.result, designs, judged, meeting, recommended, known)
    on_front = {item.layout.key for item in front.members}
    findings = replace(
        before,
        problem=problem,
        designs=tuple(replace(item, on_front=item.evaluated.layout.key in on_front) for item in designs),
        result=replace(before.result, status=status, front=front, recommended=recommended, shortfall=shortfall),
        trade_off=trade_off_of(problem, judged, front, recommended, known, spec.seed),
        alternatives=alternatives_of(
            problem,
            judged,
            recommended,
            known,
            wish_of(spec.study),
            failed={key for key, held in verdicts.items() if held is False},
        ),
        one_steps=one_steps_of(problem, judged, next(iter(recommended.values()), None), known),
        candidates_validated=len(tried),
        passed_over=question.passed_over(meeting, [*tried, *promising], cheapest),
        reasons={
            role: _reason(problem, before.validations, role, item, question.validation_trials)
            for role, item in recommended.items()
        },
    )
    return findings, sum(0 < item.trials < least for item in designs)


def choice_lines(findings: Findings) -> list[str]:
    """Return what came of the limits, then what each recommended layout is, costs and was chosen for."""
    cost, result = findings.problem.goals[0], findings.result
    lines = [_UNDECIDED if result.status is Status.STOPPED_BY_LIMIT else verdict(findings)]
    lines = lines if findings.problem.limits else []
    if result.shortfall:
        lines.append(f"{'Why' if result.status is Status.STOPPED_BY_LIMIT else 'Shortfall'}: {result.shortfall}.")
    lines += [
        f"{role}: {item.layout.label} [{item.layout.short_key}], {euros(item.scores[cost].value)}, "
        f"{findings.reasons[role]}"
        for role, item in result.recommended.items()
    ]
    return [*lines, *([passed] if (passed := passed_over_text(findings)) else [])]


def _status(
    problem: Problem,
    before: Result,
    designs: Sequence[Design],
    judged: Sequence[Evaluated],
    meeting: Sequence[Evaluated],
    recommended: Mapping[str, Evaluated],
    known: Mapping[Group, TrialOutcomes],
) -> tuple[Status, str]:
    """Return what the held-out drives of a folder say under other prices, and what is missing."""
    if not problem.limits:
        return Status.SEARCHED, ""
    if "cheapest" in recommended:
        return Status.TARGET_MET, ""
    if UNTRIED in recommended:
        return Status.STOPPED_BY_LIMIT, (
            "of the layouts that have all their held-out drives none meets every limit under these prices, and "
            "reprice drives none; name the price list in the spec and run the study into another folder"
        )
    if meeting:
        number = counted_text(len(meeting), "layout")
        return Status.TARGET_NOT_MET, sentences(
            f"{number} met the limits in search, none of them was shown to on held-out drives",
            held_out.shortfall(problem, meeting, known),
        )
    if judged:
        return Status.TARGET_NOT_MET, nearest_miss(problem, judged)
    simulated = [item for item in designs if item.trials]
    if not simulated:
        anew = "name the price list in the spec and run the study into another folder"
        return before.status, f"the study simulated no layout under its own prices ({before.shortfall}); {anew}"
    if any(not item.refusal for item in simulated):
        return Status.TARGET_NOT_MET, "what is left of the simulated layouts has too few drives to be judged"
    cost = problem.goals[0]
    refused = min(simulated, key=lambda item: item.evaluated.scores[cost].value).refusal
    return Status.TARGET_NOT_MET, f"no layout that was simulated is left; the cheapest: {refused}"


def _reason(problem: Problem, validations: Sequence[Validation], role: str, item: Evaluated, trials: int) -> str:
    """Return in words why the layout of a role was chosen, and what its held-out drives in the study say of it."""
    if role == "cheapest" and problem.limits:
        return (
            "under the new prices the cheapest layout that meets every limit, in search and on all held-out "
            "drives of the study"
        )
    chosen = "by the search, under the new prices; not validated anew"
    if not problem.limits:
        return chosen
    told = held_out.verdict_text(problem, validations, item)
    if not told:
        return f"{chosen}, and untried on held-out drives"
    few = f"; {counted_text(trials, 'held-out drive')} of each kind decide" if role == UNTRIED else ""
    return f"{chosen}; in the study it {told}{few}"


def _broken(problem: Problem, validations: Sequence[Validation], item: Evaluated) -> bool:
    """Whether the held-out drives of a layout, few as they may be, already show that it breaks a limit."""
    return any(
        limit.broken(score)
        for row in held_out.own_rows(problem, validations, item.layout)
        for limit, score in problem.limits_on(row.scores or {})
    )


def _repriced(design: Design, problem: Problem) -> Design:
    """Return a design with its exact scores under the problem's prices, refused if one breaks a limit."""
    if design.refusal and not design.trials:
        return design
    layout = design.evaluated.layout
    scores = {**design.evaluated.scores, **exact_scores(problem, layout)}
    broken = [reason for limit in problem.limits if (reason := exceeds(limit, scores, problem))]
    return replace(
        design,
        evaluated=Evaluated(layout=layout, scores=scores),
        refusal=broken[0][1] if broken else design.refusal,
    )
