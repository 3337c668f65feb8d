"""Position and orientation from one reader (han2006): sets of tags, chords, and motion continuity."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.estimators.crossing_time import without_one_antenna
from layoutopt.estimators.instant_centre import initial_orientation, travelling_orientation
from layoutopt.estimators.reader_place import ReaderPlace
from layoutopt.geometry import turned, wrapped
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard, FloorKnowledge
from layoutopt.readings import Estimate, Motion, Observations, Prior, Reading, TagRead, Trajectory

CARD: Final = EstimatorCard(
    summary="Midrange of the tags of one reader, heading from chords, motion continuity with a fixed gain.",
    reference="han2006, Eq. 1-10 and 21-24, Fig. 3",
    estimates="robot",
    needs="tag_read",
)
GATHERINGS: Final = ("at_once", "one_by_one")
COMPENSATIONS: Final = ("none", "gain", "variance")
ORIENTATIONS: Final = ("start", "arc", "wheels")
_SPOT_RAD: Final = 0.03
"""A step that turns by more and goes less than `_SPOT_M` is a turn on the spot: no arc leads over it."""
_SPOT_M: Final = 0.005


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReaderSettings:
    """Settings that the estimators of one reader share; each is a class of its own with a card.

    Attributes
    ----------
    gathering
        ``"at_once"``: each scan brings all tags in the field. ``"one_by_one"``: each brings one tag, and the set
        is complete when a scan brings nothing new (Fig. 3).
    compensation
        How prediction by the wheels and measurement join (Eq. 24 and what follows it): ``"none"`` takes the
        measurement, ``"gain"`` moves by a fixed part towards it, ``"variance"`` by that of the variances, once for
        each set of tags, because a set that is read again brings nothing new.
    gain
        That fixed part.
    orientation
        Where the heading comes from at the end of a chord. ``"start"``: a circle that leaves the begin of the
        drive with its heading (Eq. 4-8), for paths of one curvature. ``"arc"``: the same, from the end of the
        chord before; errors of that heading change sign and stay. ``"wheels"``: the chord's direction and half of
        what the wheels turned since (Eq. 21). A turn on the spot begins a new chord.
    baseline_m
        Least length of a chord. Places err by centimetres: the heading of a short chord is worthless.

    Raises
    ------
    ValueError
        If an option is unknown, or a number lies outside its range.
    """

    gathering: str = "at_once"
    compensation: str = "gain"
    gain: float = 0.3
    orientation: str = "start"
    baseline_m: float = 0.5
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD
    row: ClassVar[str]
    place: ClassVar[str]

    def check(self) -> None:
        """Check the settings."""
        for name, options in (
            ("gathering", GATHERINGS),
            ("compensation", COMPENSATIONS),
            ("orientation", ORIENTATIONS),
        ):
            if getattr(self, name) not in options:
                raise ValueError(f"{name} is one of {', '.join(options)}, not {getattr(self, name)!r}")
        if not 0.0 < self.gain <= 1.0:
            raise ValueError(f"a gain must be above 0 and at most 1, got {self.gain}")
        if not 0.0 < self.baseline_m < math.inf:
            raise ValueError(f"a baseline must be positive and finite, got {self.baseline_m}")

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return self.row

    def applies(self, layout: Layout) -> str:
        """Return why one reader's tags cannot localise a layout's robot, or an empty string."""
        return without_one_antenna(layout)

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> "RunningOneReader":
        """Return the estimator at work, step by step."""
        return RunningOneReader(self, prior, knowledge)

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the estimates of a whole drive, step by step."""
        running = self.start(prior, knowledge, draws)
        poses = [running.step(motion, readings).values for motion, readings in observations.steps()]
        return Trajectory(poses=np.array(poses).reshape(-1, 3))


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OneReader(ReaderSettings):
    """The paper's: midrange, arcs from the begin, fixed gain."""

    row: ClassVar[str] = "one_reader"
    place: ClassVar[str] = "midrange"

    def __post_init__(self) -> None:
        """Check the settings."""
        self.check()


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OneReaderCentroid(ReaderSettings):
    """Centroid in place of the midrange, wheels in place of arcs, variances in place of a fixed gain."""

    compensation: str = "variance"
    orientation: str = "wheels"
    row: ClassVar[str] = "one_reader_centroid"
    place: ClassVar[str] = "centroid"
    card: ClassVar[EstimatorCard] = EstimatorCard(
        summary="Centroid of the tags of one reader, heading from chords and wheels, gain by variances.",
        reference="own, after han2006",
        estimates="robot",
        needs="tag_read",
    )

    def __post_init__(self) -> None:
        """Check the settings."""
        self.check()


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OneReaderMinimax(ReaderSettings):
    """Centre of all places that read the same, wheels in place of arcs, variances in place of a fixed gain."""

    compensation: str = "variance"
    orientation: str = "wheels"
    row: ClassVar[str] = "one_reader_minimax"
    place: ClassVar[str] = "minimax"
    card: ClassVar[EstimatorCard] = EstimatorCard(
        summary="Centre of the places that read the same tags, heading from chords and wheels, gain by variances.",
        reference="own, after han2006; Welzl, New Results and New Trends in Computer Science, 1991",
        estimates="robot",
        needs="tag_read",
    )

    def __post_init__(self) -> None:
        """Check the settings."""
        self.check()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Anchor:
    """Begin of a chord: measured place, heading, their variances, and what the wheels have turned since."""

    place_m: FloatArray
    heading_rad: float
    heading_rad2: float
    place_m2: float
    turned_rad: float = 0.0
    turned_rad2: float = 0.0


class RunningOneReader:
    """The estimator at work on one robot."""

    def __init__(self, settings: ReaderSettings, prior: Prior, knowledge: FloorKnowledge) -> None:
        self._settings = settings
        self._places = ReaderPlace(knowledge, settings.place)
        self._lever_m = np.array(knowledge.antennas.xy_m[0])
        self._place_m = np.array(prior.pose[:2])
        self._place_m2 = prior.sigma_m**2
        self._heading_rad = prior.pose[2]
        self._heading_rad2 = prior.sigma_rad**2
        self._anchor = self._begun() if settings.orientation == "start" else None
        self._gathered: frozenset[int] = frozenset()
        self._latest: frozenset[int] = frozenset()

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Predict by the wheels, and where a set of tags is complete, compensate."""
        self._predict(motion)
        tags = self._complete({read.tag for read in readings if isinstance(read, TagRead) and read.tag >= 0})
        if tags:
            antenna_m, variance_m2 = self._places.of(tags)
            measured_m = antenna_m - turned(self._lever_m, self._heading_rad)
            self._compensate(measured_m, variance_m2, fresh=tags != self._latest)
            self._orient(measured_m, variance_m2)
            self._latest = tags
        x_m, y_m = (float(value) for value in self._place_m)
        return Estimate(of="robot", values=(x_m, y_m, float(wrapped(self._heading_rad))))

    def _begun(self) -> _Anchor | None:
        """Return the begin of a chord where the robot is, if that is known."""
        if not math.isfinite(self._place_m2):
            return None
        return _Anchor(
            place_m=self._place_m,
            heading_rad=self._heading_rad,
            heading_rad2=self._heading_rad2,
            place_m2=self._place_m2,
        )

    def _predict(self, motion: Motion) -> None:
        """Take one step of motion continuity (Eq. 24)."""
        way_m = turned(np.array([motion.forward_m, motion.left_m]), self._heading_rad)
        self._place_m = self._place_m + way_m
        along_m2 = motion.sigma[0] ** 2 + motion.sigma[1] ** 2
        if math.isfinite(self._heading_rad2):
            self._place_m2 += (along_m2 + float(way_m @ way_m) * self._heading_rad2) / 2.0
        self._heading_rad += motion.turn_rad
        self._heading_rad2 += motion.sigma[2] ** 2
        on_the_spot = abs(motion.turn_rad) > _SPOT_RAD and math.hypot(*way_m) < _SPOT_M
        anchor = self._anchor
        if anchor is not None:
            self._anchor = (
                (self._begun() if self._settings.orientation == "start" else None)
                if on_the_spot
                else _Anchor(
                    place_m=anchor.place_m,
                    heading_rad=anchor.heading_rad,
                    heading_rad2=anchor.heading_rad2,
                    place_m2=anchor.place_m2,
                    turned_rad=anchor.turned_rad + motion.turn_rad,
                    turned_rad2=anchor.turned_rad2 + motion.sigma[2] ** 2,
                )
            )

    def _complete(self, tags: set[int]) -> frozenset[int]:
        """Return the set of tags if this scan completes one, else none."""
        if self._settings.gathering == "at_once":
            return frozenset(tags)
        if tags - self._gathered:
            self._gathered |= tags
            return frozenset()
        # Nothing new: the field is read empty, and the next scan begins anew.
        done, self._gathered = self._gathered, frozenset()
        return done

    def _compensate(self, measured_m: FloatArray, variance_m2: float, *, fresh: bool) -> None:
        """Move from the predicted place towards the measured one."""
        kind = self._settings.compensation
        if not math.isfinite(self._place_m2) or kind == "none":
            gain = 1.0
        elif kind == "gain":
            gain = self._settings.gain
        else:
            gain = self._place_m2 / (self._place_m2 + variance_m2) if fresh else 0.0
        self._place_m = self._place_m + gain * (measured_m - self._place_m)
        if not math.isfinite(self._place_m2):
            self._place_m2 = variance_m2
        elif gain > 0.0:
            self._place_m2 = (1.0 - gain) ** 2 * self._place_m2 + gain**2 * variance_m2

    def _orient(self, measured_m: FloatArray, variance_m2: float) -> None:
        """Where a chord is long enough, take the heading from it; then the next one begins here."""
        anchor = self._anchor
        if anchor is not None and math.dist(measured_m, anchor.place_m) < self._settings.baseline_m:
            return
        if anchor is not None:
            chord_rad2 = (anchor.place_m2 + variance_m2) / math.dist(measured_m, anchor.place_m) ** 2
            unknown = not math.isfinite(anchor.heading_rad2)
            if self._settings.orientation != "wheels" and not unknown:
                start = (float(anchor.place_m[0]), float(anchor.place_m[1]), anchor.heading_rad)
                heading_rad = travelling_orientation(start, measured_m)
                heading_rad2 = 4.0 * chord_rad2 + anchor.heading_rad2
            else:
                heading_rad = initial_orientation(anchor.place_m, measured_m) + anchor.turned_rad / 2.0
                heading_rad2 = chord_rad2 + anchor.turned_rad2 / 4.0
            self._turn_towards(heading_rad, heading_rad2)
            if self._settings.orientation == "start":
                return
        self._anchor = _Anchor(
            place_m=measured_m,
            heading_rad=self._heading_rad,
            heading_rad2=self._heading_rad2,
            place_m2=variance_m2,
        )

    def _turn_towards(self, heading_rad: float, heading_rad2: float) -> None:
        kind = self._settings.compensation
        if not math.isfinite(self._heading_rad2) or kind == "none":
            gain = 1.0
        elif kind == "gain":
            gain = self._settings.gain
        else:
            gain = self._heading_rad2 / (self._heading_rad2 + heading_rad2)
        before_rad = self._heading_rad
        off_rad = float(wrapped(heading_rad - before_rad))
        self._heading_rad = before_rad + gain * off_rad
        # The lever turns with the robot; the antenna stays where it was.
        self._place_m = (
            self._place_m + turned(self._lever_m, before_rad) - turned(self._lever_m, self._heading_rad)
        )
        known = math.isfinite(self._heading_rad2)
        self._heading_rad2 = (
            (1.0 - gain) ** 2 * self._heading_rad2 + gain**2 * heading_rad2 if known else heading_rad2
        )
