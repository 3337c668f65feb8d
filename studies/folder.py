"""Runs a study into a folder: frozen spec and journal first, then whatever its answer writes."""

import errno
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, TypeVar

from layoutopt.errors import AnswerNotWritten, Interrupted, StoppedByLimit, StudyDamaged, StudyStopped
from layoutopt.evaluate import Evaluator
from layoutopt.journal import FROZEN_SPEC, JOURNAL, Journal, manifest
from layoutopt.progress import Progress, Together
from layoutopt.protocols import Answer, AnswersSoFar, Study
from layoutopt.spec.building import Spec
from layoutopt.spec.writing import write_spec
from layoutopt.stopping import StopReason, StopRequest
from layoutopt.streams import Streams
from layoutopt.units import format_duration
from layoutopt.workers import Workers
from studies.runner import Ran, run_rounds
from studies.shards import Shard, open_round
from studies.status import FINISHED, STOPPED, StatusFile

_Found = TypeVar("_Found")
_NO_ROOM: Final = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO)


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """How a study is run; nothing of it changes a result, but for a time limit.

    Attributes
    ----------
    resume
        Go on with what the folder holds; without it, a folder that holds a study is refused.
    quick
        The study is a quick look.
    workers
        Who computes; this process, if nobody is named.
    stop
        Asked between tasks. The workers must ask the same request.
    most_trials
        Budget of trials, those in the journal included.
    go_on
        The command that goes on with the study, for those who ask how it stands.
    """

    resume: bool = False
    quick: bool = False
    workers: Workers = field(default_factory=Workers)
    stop: StopRequest = field(default_factory=StopRequest)
    most_trials: int | None = None
    go_on: str = ""


def run_study(name: str, question: Study, spec: Spec, folder: Path, *, run: Run, progress: Progress) -> Answer:
    """Return the answer of the study of that name, and leave everything that its readers need in the folder.

    A question that is refused before any trial, because nothing can be built or bought, leaves no folder.

    Raises
    ------
    StudyDamaged
        If the folder holds a study and it is not to be resumed, or it cannot be continued.
    StudyStopped
        If it ended early without an answer; what was finished is in the journal.
    """
    if not question.next_batch(()).tasks and (refused := question.answer((), spec)).exit_code:
        return refused
    if (folder / JOURNAL).exists() and not run.resume:
        raise StudyDamaged(
            f"{folder}: holds a study already; add --resume to go on with it, or choose another --out"
        )

    def answered(journal: Journal, watched: Progress) -> tuple[Answer, str]:
        ran = run_rounds(
            question,
            streams=streams,
            journal=journal,
            progress=watched,
            workers=run.workers,
            stop=run.stop,
            most_trials=run.most_trials,
        )
        answer = _answer(question, ran, spec, run)
        with _room_in(folder):
            answer.write(folder, streams=streams, quick=run.quick)
        return answer, STOPPED if ran.stopped else FINISHED

    streams = Streams(seed=spec.seed)
    return _in_folder(name, question, spec, folder, run=run, progress=progress, work=answered)


def run_shard(
    name: str, question: Study, spec: Spec, folder: Path, shard: Shard, *, run: Run, progress: Progress
) -> list[str]:
    """Run a shard's share of the first round that the study's folder does not hold in full, and say what is next.

    A shard always goes on with what its own folder holds, so that a batch system may start it again.

    Raises
    ------
    StudyDamaged, StudyStopped
        As with `run_study`.
    """
    streams = Streams(seed=spec.seed)
    batch = open_round(question, folder, streams)
    if not batch.tasks:
        return [f"{shard}: nothing is left to be run; write the answer with: layoutopt merge {folder}"]
    share = shard.share(batch.tasks)

    def computed(journal: Journal, watched: Progress) -> tuple[list[str], str]:
        evaluate = Evaluator(streams, workers=run.workers, journal=journal, on_result=watched.result)
        missing = evaluate.missing(share)
        watched.round(f"{batch.name}, {shard}", len(missing), sum(task.count for task in missing))
        if len(evaluate(share)) < len(share):
            raise _stopped(run.stop.reason, run)
        lines = [
            f"{shard}: {len(share)} of {len(batch.tasks)} tasks of round '{batch.name}' are done",
            f"when all {shard.count} shards are: layoutopt merge {folder}",
        ]
        return lines, FINISHED

    return _in_folder(name, question, spec, shard.folder(folder), run=run, progress=progress, work=computed)


def _in_folder(
    name: str,
    question: Study,
    spec: Spec,
    folder: Path,
    *,
    run: Run,
    progress: Progress,
    work: Callable[[Journal, Progress], tuple[_Found, str]],
) -> _Found:
    """Return what work gives that is done with the journal of a folder open, and keep its status up to date.

    Work returns, beside what it found, the state in which it leaves the study.
    """
    facts = {
        **manifest(Streams(seed=spec.seed), question.key),
        "study": name,
        "quick": run.quick,
        "source": spec.site.source,
    }
    with Journal(folder, facts=facts) as journal:
        for note in journal.notes:
            progress.note(note)
        with _room_in(folder):
            write_spec(spec, folder / FROZEN_SPEC)
        status = StatusFile(folder, go_on=run.go_on)
        try:
            found, state = work(journal, Together(progress, status))
        except BaseException:
            status.end(STOPPED)
            raise
        status.end(state)
    return found


@contextmanager
def _room_in(folder: Path) -> Iterator[None]:
    """Turn a lack of room into a study that stopped, whose trials are kept in the journal."""
    try:
        yield
    except OSError as error:
        if error.errno not in _NO_ROOM:
            raise
        raise AnswerNotWritten(
            f"{error.filename or folder}: cannot be written ({error.strerror or error}); all trials are kept"
        ) from error


def _answer(question: Study, ran: Ran, spec: Spec, run: Run) -> Answer:
    """Return the answer of a study, or of as much of it as was run before a limit.

    Raises
    ------
    StudyStopped
        If somebody asked for the end, or the study cannot answer from a part of its trials.
    """
    if not ran.stopped:
        return question.answer(ran.evaluations, spec)
    if ran.stopped is StopReason.ASKED or not isinstance(question, AnswersSoFar):
        raise _stopped(ran.stopped, run)
    return question.answer_so_far(ran.evaluations, spec, _why(ran.stopped, run))


def _stopped(reason: StopReason, run: Run) -> StudyStopped:
    if reason is StopReason.ASKED:
        return Interrupted("stopped as asked; what was finished is kept")
    return StoppedByLimit(f"{_why(reason, run)}; what was finished is kept, but there is no answer yet")


def _why(reason: StopReason, run: Run) -> str:
    if reason is StopReason.TRIALS:
        return f"stopped by --max-trials {run.most_trials}: the same trials count whoever runs this again"
    return (
        f"stopped by --time-limit after {format_duration(run.stop.time_limit_s)}: another machine, or this one on "
        "another day, would stop elsewhere, so these numbers cannot be had again"
    )
