"""Runs a study into a folder: frozen spec and journal first, tables, figures, report and drawings at the end."""

from pathlib import Path

from layoutopt.errors import StudyDamaged
from layoutopt.journal import JOURNAL, Journal, manifest
from layoutopt.spec.building import Spec
from layoutopt.spec.writing import write_spec
from layoutopt.streams import Streams
from studies import output
from studies.cost_vs_accuracy import CostVersusAccuracy
from studies.findings import Findings
from studies.progress import Progress
from studies.runner import run_rounds

FROZEN_SPEC = "spec.toml"


def run_study(
    question: CostVersusAccuracy,
    spec: Spec,
    folder: Path,
    *,
    jobs: int,
    resume: bool,
    quick: bool,
    progress: Progress,
) -> Findings:
    """Return the findings, and leave everything that users and installers need in the folder.

    Where no layout can race at all, nothing is simulated and no folder is made.

    Raises
    ------
    StudyDamaged
        If the folder holds a study and ``resume`` is false, or it cannot be continued.
    """
    if not question.contenders:
        return question.findings(())
    if (folder / JOURNAL).exists() and not resume:
        raise StudyDamaged(
            f"{folder}: holds a study already; add --resume to go on with it, or choose another --out"
        )
    streams = Streams(seed=spec.seed)
    facts = {**manifest(streams, question.key), "quick": quick, "source": spec.site.source}
    with Journal(folder, facts=facts) as journal:
        if journal.dropped_torn_line:
            progress.note("the last line of the journal was torn, as a kill leaves it; it is run again")
        write_spec(spec, folder / FROZEN_SPEC)
        evaluations = run_rounds(question, streams=streams, jobs=jobs, journal=journal, progress=progress)
        findings = question.findings(evaluations)
        output.write_all(findings, spec, folder, streams=streams, quick=quick)
    return findings
