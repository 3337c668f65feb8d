"""What the commands of the command line do, for programs and notebooks: ``layoutopt.solve`` and its like.

Like the command line this module looks upward to studies, and only inside its functions. Every function takes the
spec that `layoutopt.read_spec` gives, and ``jobs`` worker processes; one job works in this process. Results do not
depend on the number of jobs.
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from layoutopt.layout import Layout
    from layoutopt.protocols import Answer
    from layoutopt.spec.building import Spec
    from layoutopt.workers import Workers
    from studies.answers import Scored
    from studies.explain import Explained
    from studies.findings import Findings


def solve(
    spec: "Spec",
    *,
    target_error_m: float | None = None,
    budget_eur: float | None = None,
    quick: bool = False,
    jobs: int = 1,
) -> "Findings":
    """Return the front of cost against error and the layouts to build, as ``layoutopt solve`` finds them.

    The layouts are in ``findings.result.recommended``, by role: ``"cheapest"``, ``"knee"``, ``"most accurate"``.
    There is no ``"cheapest"`` where none was shown to meet the demand; ``findings.result.shortfall`` then says
    what is missing.

    Parameters
    ----------
    target_error_m, budget_eur
        Demand in place of the spec's own. The spec stays as it is, so a layout file that is written with it states
        the old one.
    quick
        Look at few layouts on few drives: nothing to build from.

    Raises
    ------
    ValueError
        If a demand is not positive.
    """
    from layoutopt.progress import Silent
    from layoutopt.stopping import StopRequest
    from studies import answers

    for name, value in (("target_error_m", target_error_m), ("budget_eur", budget_eur)):
        if value is not None and not value > 0.0:
            raise ValueError(f"{name} must be positive, got {value}")
    if target_error_m is not None:
        spec = replace(spec, target_error_m=target_error_m)
    if budget_eur is not None:
        spec = replace(spec, budget_eur=budget_eur)
    return answers.solve(spec, workers=_workers(jobs), stop=StopRequest(), quick=quick, progress=Silent())


def study(
    name: str,
    spec: "Spec",
    folder: Path | str,
    *,
    quick: bool = False,
    resume: bool = False,
    jobs: int = 1,
) -> "Answer":
    """Return the answer of a study, after its report, figures and tables were written into a folder.

    Parameters
    ----------
    name
        One of ``layoutopt.names("studies")``.
    resume
        Go on with what the folder holds; without it, a folder that holds a study is refused.

    Raises
    ------
    UnknownName, StudyDamaged, StudyStopped
        If there is no such study, the folder holds one already or another one, or the study cannot be ended.
    """
    from layoutopt import registry
    from layoutopt.progress import Silent
    from studies.folder import Run, run_study

    workers = _workers(jobs)
    question = registry.load("studies", name, place="layoutopt.study").for_spec(spec, quick=quick, workers=workers)
    run = Run(resume=resume, quick=quick, workers=workers)
    return run_study(name, question, spec, Path(folder), run=run, progress=Silent())


def score(layout: "Layout", spec: "Spec", *, trials: int = 100, jobs: int = 1) -> "Scored":
    """Return every score of a layout, by scenario and estimator; ``as_text()`` is what ``layoutopt score`` prints.

    Raises
    ------
    ValueError
        If there are fewer than two trials, which have no standard error.
    """
    from studies import answers

    if trials < 2:
        raise ValueError(f"a standard error needs at least two trials, got {trials}")
    return answers.score(spec, layout, trials=trials, workers=_workers(jobs))


def explain(layout: "Layout", spec: "Spec", *, trials: int = 150, jobs: int = 1) -> "Explained":
    """Return which limits bind a layout, what each of its parts is worth, and what the next euro buys.

    Raises
    ------
    ValueError
        If there are fewer than two trials, which have no standard error.
    """
    from studies import explain as question

    if trials < 2:
        raise ValueError(f"a standard error needs at least two trials, got {trials}")
    return question.explain(spec, layout, trials=trials, workers=_workers(jobs))


def draw(
    layout: "Layout", spec: "Spec", folder: Path | str, *, title: str = "", quick_look: bool = False
) -> list[Path]:
    """Write what installer and robot team need into a folder, and return the files.

    These are the sheet with the whole layout, tag map, reader poses, bill and work plan, and in ``sheets`` the set
    of sheets with templates. A floor of very many tags gets a part of them only; for its tag plans give
    ``layoutopt draw`` an area.

    Parameters
    ----------
    quick_look
        A quick look chose the layout: the sheets say that nobody should install from them.
    """
    from layoutopt.drawings.installation import write_overview, write_sheets

    place = Path(folder)
    sheets, _ = write_sheets(spec, layout, place / "sheets", title=title or spec.site.name, quick_look=quick_look)
    overview = write_overview(spec, layout, place, title=title, quick_look=quick_look)
    return [*overview, *sheets]


def _workers(jobs: int) -> "Workers":
    from layoutopt.workers import Backend, Workers

    if jobs < 1:
        raise ValueError(f"at least one job is needed, got {jobs}")
    return Workers(Backend.LOKY if jobs > 1 else Backend.SERIAL, jobs=jobs)
