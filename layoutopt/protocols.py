"""Signatures of everything that comes in many kinds, and the cards on which each kind says what it can do."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np

from layoutopt.errors import FailureKind
from layoutopt.identity import BoolArray, FloatArray, IntArray, content_key
from layoutopt.layout import Layout, ReaderGroup, ReaderProfile, TagMap, TagPattern
from layoutopt.readings import Estimate, Motion, Observations, Prior, Reading, Trajectory
from layoutopt.scenario import Scenario
from layoutopt.scores import Scores, TrialOutcomes

if TYPE_CHECKING:
    from pathlib import Path

    from layoutopt.problem import Problem
    from layoutopt.result import Result
    from layoutopt.spec.building import Spec
    from layoutopt.streams import Streams
    from layoutopt.workers import Workers


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """What every kind of extension says of itself: one sentence, and its source."""

    summary: str
    reference: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternCard(Card):
    """``periodic``: whether the pattern has a cell, which exact bounds need."""

    periodic: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class ReaderCard(Card):
    """``reconstructed``: whether positions were inferred because the source does not print them."""

    reconstructed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class AntennaCard(Card):
    """``valid_side_m``: antenna sides for which the model is calibrated; outside it extrapolates.

    ``reads`` is the kind of reader group whose antennas are of this model.
    """

    valid_side_m: tuple[float, float]
    reads: str = "tag_read"


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimatorCard(Card):
    """``estimates`` what the answer is of; ``needs`` the kind of reading; ``states_covariance`` for NEES.

    An answer is of the ``"robot"`` itself, of a ``"target"`` that it tracks, or is a ``"bearing"``.
    """

    estimates: str
    needs: str
    states_covariance: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectiveCard(Card):
    """What scores an objective makes.

    ``scores`` maps names to units; ``fidelity`` is ``"exact"``, ``"published"``, ``"sampled"`` (random places of
    the site, no drive) or ``"simulated"``; ``bounds`` names the score of which it is a proven lower bound, empty
    if it is none; ``per_zone`` whether the scores exist for each zone too.
    """

    scores: Mapping[str, str]
    fidelity: str
    bounds: str = ""
    per_zone: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class SolverCard(Card):
    """Whether a solver proves its answer, handles several goals, and copes with noise."""

    exact: bool
    multi_objective: bool
    handles_noise: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyCard(Card):
    """What a study asks, and what its readers have to know of every answer.

    ``question`` is the user's question; ``adaptive`` tells whether rounds depend on outcomes. ``rests_on`` says
    what an answer rests on and what it leaves out, ``next_step`` what to do with it, and ``guide`` is the name of
    the page in ``docs/`` that explains it.
    """

    question: str
    adaptive: bool
    rests_on: str
    next_step: str
    guide: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Mount:
    """How the antennas of a group are built: model, height above the floor, profile, antennas a module."""

    antenna: "AntennaModel"
    height_m: float
    profile: ReaderProfile
    antennas_per_module: int = 1


PatternFamily = Callable[..., TagPattern]
ReaderFamily = Callable[..., ReaderGroup]


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """What else bears on a read: depth of metal below the floor (``None``: none), and the tag's tilt."""

    metal_depth_m: float | None = None
    tag_tilt_rad: float = 0.0


class AntennaModel(Protocol):
    """Read volume of one antenna: a frozen value with a content key."""

    card: ClassVar[AntennaCard]

    @property
    def side_m(self) -> float:
        """Side of the square antenna."""
        ...

    @property
    def key(self) -> str:
        """Content key."""
        ...

    @property
    def extrapolated(self) -> bool:
        """Whether the side lies outside the calibrated range."""
        ...

    def read_probability(self, offset_m: FloatArray, surroundings: Surroundings) -> FloatArray:
        """Return the chance that one scan reads a tag at offsets, shape (..., 3), m, in the antenna frame.

        The antenna frame has its z axis up, so a tag below the antenna has a negative z.
        """
        ...

    def read_radius_m(self, height_m: float) -> float:
        """Return the radius of the disc on a plane ``height_m`` below the antenna; zero out of reach."""
        ...

    def disc_error_m(self, height_m: float) -> float:
        """Return by how much the model's own outline on that plane leaves the disc at most."""
        ...

    def reads_beside_disc(self, height_m: float) -> bool:
        """Return whether the model also reads tags apart from the disc, which nothing else knows of."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Antennas:
    """All antennas of a layout in columns, in the order in which readings count them.

    Attributes
    ----------
    xy_m
        Centres in ``base_link``, shape (n, 2), m.
    height_m, radius_m
        Height above the floor, and radius of the read disc there, shape (n,).
    period_steps, phase_steps
        An antenna scans in step i if ``i % period_steps == phase_steps``; shape (n,).
    one_tag
        Whether two tags in the field collide so that none is read, shape (n,).
    """

    xy_m: FloatArray
    height_m: FloatArray
    radius_m: FloatArray
    period_steps: IntArray
    phase_steps: IntArray
    one_tag: BoolArray

    def __len__(self) -> int:
        """Return the number of antennas."""
        return len(self.xy_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorKnowledge:
    """What an estimator knows beforehand: the tag map as planned, and its own antennas."""

    tags: TagMap
    antennas: Antennas


class AnyEstimator(Protocol):
    """What estimators of robots, targets and bearings share; a frozen value that holds its settings."""

    card: ClassVar[EstimatorCard]

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        ...

    @property
    def key(self) -> str:
        """Content key of the settings."""
        ...

    def applies(self, layout: Layout) -> str:
        """Return why the estimator cannot work with a layout, or an empty string if it can."""
        ...


class RunningEstimator(Protocol):
    """An estimator at work on one robot."""

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Take one step of odometry and what was read after it; return the estimate."""
        ...


class Estimator(AnyEstimator, Protocol):
    """Turns readings of floor tags into estimates of the robot's pose."""

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> RunningEstimator:
        """Return the estimator at work: the plain twin, the truth for the compiled run."""
        ...

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the estimates of a whole drive, as `start` and step by step would, but fast."""
        ...


class Objective(Protocol):
    """Makes scores of a layout; a frozen value."""

    card: ClassVar[ObjectiveCard]

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return scores by name; a simulated objective only reduces ``outcomes``.

        An objective that does not apply to the layout returns no scores.
        """
        ...


class Group(NamedTuple):
    """What outcomes belong together: those of one layout in one scenario with one estimator.

    Scenario and estimator stand in it by name, for people, and ``settings`` is a key of the content of both:
    the same filter with another likelihood is another group, and so is a scenario of the same name (which has
    the same random streams) with other faults.
    """

    layout_key: str
    scenario: str
    estimator: str
    settings: str


def group_of(layout: Layout, scenario: Scenario, estimator: AnyEstimator) -> Group:
    """Return the group of all trials of a layout in a scenario with an estimator."""
    return Group(layout.key, scenario.name, estimator.name, content_key(scenario.key, estimator.key))


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """Replications ``first`` to ``first + count - 1`` of a layout in a scenario with an estimator."""

    layout: Layout
    scenario: Scenario
    estimator: AnyEstimator
    first: int
    count: int

    @property
    def group(self) -> Group:
        """The group to which the outcomes belong."""
        return group_of(self.layout, self.scenario, self.estimator)


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """A task that ran: its outcomes, and the seconds it took (for progress only, never for results)."""

    group: Group
    first: int
    outcomes: TrialOutcomes
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """A task without outcomes: of what kind and why; the study goes on without that layout."""

    group: Group
    first: int
    message: str
    kind: FailureKind = FailureKind.RAISED

    @property
    def text(self) -> str:
        """Kind and message in words; what was raised says itself what it is."""
        return self.message if self.kind is FailureKind.RAISED else f"{self.kind.value}: {self.message}"


class Stop(Protocol):
    """Says when enough effort was spent."""

    def __call__(self, trials: int, seconds: float) -> bool:
        """Return whether to stop after that many trials and seconds."""
        ...


Evaluate = Callable[[Iterable[Task]], Sequence[Evaluation | Failure]]


class Solver(Protocol):
    """Answers a problem; a frozen value that holds its settings."""

    card: ClassVar[SolverCard]

    def __call__(self, problem: "Problem", evaluate: Evaluate, stop: Stop) -> "Result":
        """Return the result, with a status that says how far it can be trusted."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """What a study wants done next, and why; no tasks means that it is done."""

    name: str
    tasks: tuple[Task, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """What a study would run, told before it runs.

    ``lines`` say it in words; ``pilot`` holds a few of its tasks, each with the number of trials that it stands
    for, from which the run time is predicted.
    """

    lines: tuple[str, ...]
    pilot: tuple[tuple[Task, int], ...] = ()


class Answer(Protocol):
    """What a study found, ready to be told and written."""

    @property
    def exit_code(self) -> int:
        """Exit code of the command line; one that is not zero before any trial was run refuses the question."""
        ...

    def lines(self, folder: "Path | None") -> list[str]:
        """Return what the command line prints; ``folder`` is where the answer was written, if it was."""
        ...

    def write(self, folder: "Path", *, streams: "Streams", quick: bool) -> None:
        """Write tables, figures and report into the study folder: the same bytes for the same evaluations."""
        ...


class Study(Protocol):
    """A question that is answered in rounds of trials; a frozen value."""

    card: ClassVar[StudyCard]

    @classmethod
    def for_spec(cls, spec: "Spec", *, quick: bool, workers: "Workers | None" = None) -> "Study":
        """Return the study that a spec asks for; a quick one spends much less and says so.

        ``workers`` compute what the question itself needs, such as exact scores; without them this process does.
        """
        ...

    @property
    def key(self) -> str:
        """Content key of the question: what a study folder is bound to."""
        ...

    def plan(self) -> Plan:
        """Return what the study would run."""
        ...

    def next_batch(self, evaluations: Sequence[Evaluation | Failure]) -> Round:
        """Return the next round, a pure function of what the journal holds."""
        ...

    def best_so_far(self, evaluations: Sequence[Evaluation | Failure]) -> str:
        """Return the best answer so far in a few words, for progress; empty before there is one."""
        ...

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: "Spec") -> Answer:
        """Return the answer; every number in it comes from the evaluations or is exact."""
        ...


@runtime_checkable
class AnswersSoFar(Protocol):
    """A study that can answer from a part of its trials."""

    def answer_so_far(self, evaluations: Sequence[Evaluation | Failure], spec: "Spec", stopped: str) -> Answer:
        """Return the answer as far as the evaluations go, marked with the words that say why it ended there."""
        ...
