"""The report of a finished study written anew from its journal, without any trial of the study."""

from pathlib import Path

from layoutopt import machine, registry
from layoutopt.errors import InvalidInput, StudyDamaged
from layoutopt.journal import FROZEN_SPEC, MANIFEST, Journal, read_manifest, read_recorded
from layoutopt.progress import Progress
from layoutopt.protocols import Answer, Study
from layoutopt.simulation.trials import MODEL_VERSION
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from layoutopt.workers import Workers
from studies.runner import recorded_rounds
from studies.status import FINISHED, StatusFile, read_status


def written_anew(folder: Path, *, workers: Workers, progress: Progress) -> Answer:
    """Return the answer of the finished study in a folder, after its tables, figures and report were written anew.

    ``workers`` compute exact scores, where the question needs them; no trial of the study is run.

    Raises
    ------
    InvalidInput
        If the folder holds no study.
    StudyDamaged
        If the study is not finished, another version of the models made it, or another run holds the folder.
    """
    if not (folder / MANIFEST).exists():
        raise InvalidInput.at(str(folder), "holds no study", "Give the --out folder of a finished study.")
    facts = read_manifest(folder)
    if facts.get("model") != MODEL_VERSION:
        raise StudyDamaged(
            f"{folder}: its trials are of models of version {facts.get('model')}, and this is version "
            f"{MODEL_VERSION}; run the study again into another --out"
        )
    recorded = read_recorded(folder)
    spec = read_spec(folder / FROZEN_SPEC)
    quick = bool(facts.get("quick"))
    study = registry.load("studies", str(facts.get("study")), place=str(folder / MANIFEST))
    question: Study = study.for_spec(spec, quick=quick, workers=workers)
    if (facts.get("seed"), facts.get("spec")) != (spec.seed, question.key):
        raise StudyDamaged(
            f"{folder}: spec and manifest do not belong together, or another version of layoutopt made them; run "
            "the study again into another --out"
        )
    streams = Streams(seed=spec.seed)
    evaluations, batch = recorded_rounds(question, streams=streams, recorded=recorded)
    if batch.tasks:
        go_on = read_status(folder).go_on or f"layoutopt study {facts['study']} ... --out {folder} --resume"
        raise StudyDamaged(
            f"{folder}: the study is not finished, round '{batch.name}' is open, so there is no whole report; "
            f"go on with: {go_on}"
        )
    with Journal(folder, facts={**facts, "environments": [machine.environment()]}) as journal:
        for note in journal.notes:
            progress.note(note)
        answer = question.answer(evaluations, spec)
        answer.write(folder, streams=streams, quick=quick)
        status = StatusFile(folder, go_on="")
        status.best(question.best_so_far(evaluations))
        status.end(FINISHED)
    return answer
