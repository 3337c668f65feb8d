"""Runs a study into a folder: frozen spec and journal first, then whatever its answer writes."""

from pathlib import Path

from layoutopt.errors import StudyDamaged
from layoutopt.journal import JOURNAL, Journal, manifest
from layoutopt.protocols import Answer, Study
from layoutopt.spec.building import Spec
from layoutopt.spec.writing import write_spec
from layoutopt.streams import Streams
from studies.progress import Progress
from studies.runner import run_rounds

FROZEN_SPEC = "spec.toml"


def run_study(
    name: str,
    question: Study,
    spec: Spec,
    folder: Path,
    *,
    jobs: int,
    resume: bool,
    quick: bool,
    progress: Progress,
) -> Answer:
    """Return the answer of the study of that name, and leave everything that its readers need in the folder.

    A question that is refused before any trial, because nothing can be built or bought, leaves no folder.

    Raises
    ------
    StudyDamaged
        If the folder holds a study and ``resume`` is false, or it cannot be continued.
    """
    if not question.next_batch(()).tasks and (refused := question.answer((), spec)).exit_code:
        return refused
    if (folder / JOURNAL).exists() and not resume:
        raise StudyDamaged(
            f"{folder}: holds a study already; add --resume to go on with it, or choose another --out"
        )
    streams = Streams(seed=spec.seed)
    facts = {**manifest(streams, question.key), "study": name, "quick": quick, "source": spec.site.source}
    with Journal(folder, facts=facts) as journal:
        if journal.dropped_torn_line:
            progress.note("the last line of the journal was torn, as a kill leaves it; it is run again")
        write_spec(spec, folder / FROZEN_SPEC)
        evaluations = run_rounds(question, streams=streams, jobs=jobs, journal=journal, progress=progress)
        answer = question.answer(evaluations, spec)
        answer.write(folder, streams=streams, quick=quick)
    return answer
