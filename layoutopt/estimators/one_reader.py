"""Position and orientation from one reader (han2006): sets of tags, chords, and motion continuity."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.estimators.crossing_time import without_one_antenna
from layoutopt.estimators.instant_centre import initial_orientation, travelling_orientation
from layoutopt.estimators.reader_chord import Chord
from layoutopt.estimators.reader_place import ReaderPlace
from layoutopt.estimators.step_by_step import step_by_step
from layoutopt.geometry import turned, wrapped
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard, FloorKnowledge
from layoutopt.readings import Estimate, Motion, Observations, Prior, Reading, TagRead, Trajectory

CARD: Final = EstimatorCard(
    summary="Midrange of the tags of one reader, heading from chords, motion continuity with a fixed gain.",
    reference="han2006, Eq. 1-10 and 24, Fig. 3; Eq. 21-22 as increments of the odometry",
    estimates="robot",
    needs="tag_read",
)
GATHERINGS: Final = ("at_once", "one_by_one")
COMPENSATIONS: Final = ("none", "gain", "variance")
ORIENTATIONS: Final = ("start", "arc", "wheels")
_SPOT_RAD: Final = 0.03
"""A turn by more than this, and three deviations, on a way of less than `_SPOT_M` is one on the spot: no arc."""
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
        each set of tags, because a set that is read again brings nothing new, unless nothing was read in between.
    gain
        That fixed part.
    orientation
        Where the heading comes from at the end of a chord. ``"start"``: a circle that leaves the begin of the
        drive with its heading (Eq. 4-8), for paths of one curvature. ``"arc"``: the same, from the end of the
        chord before; errors of that heading change sign and stay. ``"wheels"``: the chord's direction, and what
        the wheels say of the way along it: on an arc, half of what they turned since (Eq. 21). A turn on the spot
        begins a new chord. A heading that is unknown comes from the first chord alone (Eq. 1-3). Where the way was
        no arc by the wheels, for example sideways or round a corner, and for Eq. 1-3 where it was not straight
        ahead, ``"wheels"`` stands in.
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
        """Check the settings.

        Raises
        ------
        ValueError
            If one lies outside its range, or is none of its options.
        """
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
        return step_by_step(self.start(prior, knowledge, draws), observations)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OneReader(ReaderSettings):
    """The paper's: midrange, arcs from the begin, fixed gain."""

    row: ClassVar[str] = "one_reader"
    place: ClassVar[str] = "midrange"

    def __post_init__(self) -> None:
        """Check the settings."""
        self.check()


class RunningOneReader:
    """The estimator at work on one robot."""

    def __init__(self, settings: ReaderSettings, prior: Prior, knowledge: FloorKnowledge) -> None:
        self._settings = settings
        self._places = ReaderPlace(knowledge, settings.place)
        self._lever_m = np.array(knowledge.antennas.xy_m[0])
        self._period = int(knowledge.antennas.period_steps[0])
        self._phase = int(knowledge.antennas.phase_steps[0])
        self._step = -1
        self._place_m = np.array(prior.pose[:2])
        self._place_m2 = prior.sigma_m**2
        self._heading_rad = prior.pose[2]
        self._heading_rad2 = prior.sigma_rad**2
        self._astray_m = np.zeros(2)
        self._spot_rad = 0.0
        self._spot_rad2 = 0.0
        self._spot_m = 0.0
        self._chord = self._begun()
        self._gathered: frozenset[int] = frozenset()
        self._latest: frozenset[int] = frozenset()

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Predict by the wheels, and where a set of tags is complete, compensate."""
        self._step += 1
        self._predict(motion)
        tags = self._complete({read.tag for read in readings if isinstance(read, TagRead) and read.tag >= 0})
        if tags:
            antenna_m, variance_m2 = self._places.of(tags)
            self._compensate(self._robot_m(antenna_m), variance_m2, fresh=tags != self._latest)
            self._orient(antenna_m, variance_m2)
        if tags is not None:
            self._latest = tags
        x_m, y_m = (float(value) for value in self._place_m)
        return Estimate(of="robot", values=(x_m, y_m, float(wrapped(self._heading_rad))))

    def _robot_m(self, antenna_m: FloatArray) -> FloatArray:
        """Return where the robot is, given its antenna and the heading that is believed."""
        return np.asarray(antenna_m - turned(self._lever_m, self._heading_rad))

    def _begun(self) -> Chord | None:
        """Return a chord from the pose that is believed, if it is one; else a chord begins where tags are read."""
        known = math.isfinite(self._place_m2) and math.isfinite(self._heading_rad2)
        if self._settings.orientation != "start" or not known:
            return None
        return self._chord_from(self._place_m, self._place_m2)

    def _chord_from(self, place_m: FloatArray, place_m2: float) -> Chord:
        return Chord(
            place_m=place_m, place_m2=place_m2, heading_rad=self._heading_rad, heading_rad2=self._heading_rad2
        )

    def _predict(self, motion: Motion) -> None:
        """Take one step of motion continuity (Eq. 24)."""
        way_m = turned(np.array([motion.forward_m, motion.left_m]), self._heading_rad)
        self._place_m = self._place_m + way_m
        self._place_m2 += (motion.sigma[0] ** 2 + motion.sigma[1] ** 2) / 2.0
        if math.isfinite(self._heading_rad2):
            self._place_m2 += float(way_m @ way_m) * self._heading_rad2 / 2.0
        else:
            # In an unknown direction the whole way since the latest measurement is uncertain, until it leads back.
            before_m2 = float(self._astray_m @ self._astray_m)
            self._astray_m = self._astray_m + way_m
            astray_m2 = float(self._astray_m @ self._astray_m)
            self._place_m2 = max(self._place_m2 + astray_m2 - before_m2, 0.0)
        self._heading_rad += motion.turn_rad
        self._heading_rad2 += motion.sigma[2] ** 2
        if self._chord is not None:
            self._chord.add(motion)
        if self._turns_on_the_spot(motion):
            self._chord = self._begun()

    def _turns_on_the_spot(self, motion: Motion) -> bool:
        """Return whether a turn on the spot goes on or ends with this step, however many steps it takes."""
        turned_already = self._on_the_spot()
        self._spot_rad += motion.turn_rad
        self._spot_rad2 += motion.sigma[2] ** 2
        self._spot_m += math.hypot(motion.forward_m, motion.left_m)
        if self._spot_m >= _SPOT_M:
            self._spot_rad, self._spot_rad2, self._spot_m = 0.0, 0.0, 0.0
        return turned_already or self._on_the_spot()

    def _on_the_spot(self) -> bool:
        """Return whether the turn on the latest few millimetres is more than one of an arc, and than noise."""
        return abs(self._spot_rad) > _SPOT_RAD + 3.0 * math.sqrt(self._spot_rad2)

    def _complete(self, tags: set[int]) -> frozenset[int] | None:
        """Return the set of tags if this step completes one; it is empty where the field is."""
        if not tags and self._step % self._period != self._phase:
            # The antenna did not scan: its silence says nothing.
            return None
        if self._settings.gathering == "at_once":
            return frozenset(tags)
        if tags - self._gathered:
            self._gathered |= tags
            return None
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
            gain = _share(self._place_m2, variance_m2) if fresh else 0.0
        self._place_m = self._place_m + gain * (measured_m - self._place_m)
        if not math.isfinite(self._place_m2):
            self._place_m2 = variance_m2
        elif gain > 0.0:
            self._place_m2 = (1.0 - gain) ** 2 * self._place_m2 + gain**2 * variance_m2
        if gain > 0.0:
            self._astray_m = np.zeros(2)

    def _orient(self, antenna_m: FloatArray, variance_m2: float) -> None:
        """Where a chord is long enough, take the heading from it; then the next one begins here."""
        chord, measured_m = self._chord, self._robot_m(antenna_m)
        if chord is not None:
            length_m = math.dist(measured_m, chord.place_m)
            if length_m < self._settings.baseline_m:
                return
            if chord.agrees(length_m) and self._turned_by(chord, measured_m, variance_m2):
                return
        self._chord = self._chord_from(self._robot_m(antenna_m), variance_m2)

    def _turned_by(self, chord: Chord, measured_m: FloatArray, variance_m2: float) -> bool:
        """Take the heading from a chord; return whether the chord goes on."""
        chord_rad = initial_orientation(chord.place_m, measured_m)
        chord_rad2 = (chord.place_m2 + variance_m2) / math.dist(measured_m, chord.place_m) ** 2
        known = math.isfinite(chord.heading_rad2)
        if self._settings.orientation != "wheels" and known and chord.is_arc():
            start = (float(chord.place_m[0]), float(chord.place_m[1]), chord.heading_rad)
            self._turn_towards(travelling_orientation(start, measured_m), 4.0 * chord_rad2 + chord.heading_rad2)
            return self._settings.orientation == "start"
        heading_rad, heading_rad2 = chord_rad + chord.onward_rad, chord_rad2 + chord.onward_rad2
        self._turn_towards(heading_rad, heading_rad2)
        if known or self._settings.orientation != "start":
            return False
        # The first chord tells the heading at its begin, and so where the robot was then; from there arcs lead.
        antenna_m = chord.place_m + turned(self._lever_m, chord.heading_rad)
        chord.heading_rad, chord.heading_rad2 = heading_rad - chord.turn_rad, heading_rad2
        chord.place_m = antenna_m - turned(self._lever_m, chord.heading_rad)
        return True

    def _turn_towards(self, heading_rad: float, heading_rad2: float) -> None:
        kind = self._settings.compensation
        if not math.isfinite(self._heading_rad2) or kind == "none":
            gain = 1.0
        elif kind == "gain":
            gain = self._settings.gain
        else:
            gain = _share(self._heading_rad2, heading_rad2)
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


def _share(own: float, other: float) -> float:
    """Return the gain by variances; what is known exactly does not move."""
    return own / (own + other) if own > 0.0 else 0.0
