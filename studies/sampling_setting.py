"""What intervals, walking speeds, ways to read phases and tags are compared, and the hard limits of phases."""

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

from layoutopt.estimators.phase_velocity import wavelength_m
from layoutopt.estimators.targets import TargetEstimator
from layoutopt.scenario import Scenario
from layoutopt.score_text import limit_text
from layoutopt.spec.building import Spec
from layoutopt.spec.finders import TrackingSettings
from layoutopt.tracking_world import TrackingWorld
from studies.antenna_yaw_setting import scenario_of, settings_of, thinned, tracker_of, tracking_layout
from studies.cells import Cell

INTERVALS_S: Final = (0.1, 0.2, 0.3, 0.4, 0.6, 0.8)
"""About the 0.4 s of liang2020."""
SPEEDS_M_S: Final = (0.2, 0.4, 1.2)
"""Two speeds of liang2020, and the pace at which people walk."""
OFFSETS_DB: Final = (-6.0, -4.0, -2.0, 0.0, 4.0)
"""Tags of another type answer some decibels weaker or stronger than the one that was calibrated."""
READINGS: Final = {"signed": 1, "two hypotheses": 2, "three aliases": 3}
"""Ways to read a phase difference, and how many quarter wavelengths of radial way an interval they allow."""
MODES: Final = {"strength, phase and laser": "fused", "strength alone": "strength"}
"""What a tracker goes by, and its setting."""
OWN: Final = "as the tracker has it"
_QUICK_TRIALS: Final = 2


class Place(NamedTuple):
    """A cell: speed, interval, way to read phases, what the tracker goes by, and strength of the tag."""

    speed_m_s: float
    interval_s: float
    reading: str
    mode: str
    offset_db: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """The comparison.

    Attributes
    ----------
    own
        The cell that is as the spec says; its interval is the first of the spec's.
    intervals_s, speeds_m_s, readings, offsets_db
        Values that are compared: every interval with every speed and reading, offsets with all else as in ``own``.
    elsewhere
        Limits of the spec in words: none is judged here.
    """

    tracking: TrackingSettings
    scenario: Scenario
    tracker: TargetEstimator
    own: Place
    intervals_s: tuple[float, ...]
    speeds_m_s: tuple[float, ...]
    readings: tuple[str, ...]
    modes: tuple[str, ...]
    offsets_db: tuple[float, ...]
    trials: int
    elsewhere: tuple[str, ...]

    def places(self) -> Iterator[Place]:
        """Yield every cell's place once."""
        compared = [
            place for speed in self.speeds_m_s for reading in self.readings for place in self.row(speed, reading)
        ]
        tags = [
            self.own._replace(mode=mode, offset_db=offset) for mode in self.modes for offset in self.offsets_db
        ]
        yield from dict.fromkeys((*compared, *tags))

    def row(self, speed_m_s: float, reading: str) -> list[Place]:
        """Return the places of a speed and a reading, by rising interval."""
        return [
            self.own._replace(speed_m_s=speed_m_s, reading=reading, interval_s=interval)
            for interval in self.intervals_s
        ]

    def cells(self) -> Iterator[tuple[Place, Cell]]:
        """Yield every cell under its place."""
        for place in self.places():
            yield (
                place,
                Cell(
                    layout=tracking_layout(self.tracking, interval_s=place.interval_s),
                    scenario=replace(self.scenario, tracking=self.world(place)),
                    estimator=self.estimator(place),
                    trials=self.trials,
                ),
            )

    def world(self, place: Place) -> TrackingWorld:
        """Return the world of a cell."""
        world = self.tracking.world
        signal = replace(world.signal, tag_offset_db=place.offset_db)
        return replace(world, walking_speed_m_s=place.speed_m_s, signal=signal)

    def estimator(self, place: Place) -> TargetEstimator:
        """Return the tracker of a cell."""
        changes: dict[str, object] = {} if place.reading == OWN else {"aliases": place.reading}
        if place.mode != OWN:
            changes["mode"] = MODES[place.mode]
        return tracker_of(self.tracking, **changes)

    def longest_s(self, reading: str, speed_m_s: float) -> float:
        """Return the longest interval at which phases tell a target's speed on a radial way, s.

        On the shortest wavelength that is in use: a quarter of it an interval for a signed speed, half of it where
        two hypotheses leave the sign open, three quarters with an alias on either side. Not known (NaN) for a
        tracker that does not say how it reads phases.
        """
        highest_hz = max(self.tracking.world.signal.channels_hz)
        return READINGS.get(reading, math.nan) * wavelength_m(highest_hz) / 4.0 / speed_m_s


def setting_of(spec: Spec, *, quick: bool) -> Setting:
    """Return the comparison that a spec asks for; a quick one takes few values, and few and short trials.

    A spec that lists one interval only asks nothing of it: then those about that of liang2020 are compared.

    Raises
    ------
    InvalidInput
        If the site has no room for the robot and the walk that are taken where a spec names none.
    """
    tracking = settings_of(spec)
    world, tracker = tracking.world, tracker_of(tracking)
    fields = {item.name for item in dataclasses.fields(tracker)}  # type: ignore[arg-type]
    readings = tuple(READINGS) if "aliases" in fields else (OWN,)
    modes = tuple(MODES) if "mode" in fields else (OWN,)
    own = Place(
        speed_m_s=world.walking_speed_m_s,
        interval_s=tracking.intervals_s[0],
        reading=next((name for name in readings if name == getattr(tracker, "aliases", OWN)), OWN),
        mode=next((name for name in modes if MODES.get(name) == getattr(tracker, "mode", OWN)), OWN),
        offset_db=world.signal.tag_offset_db,
    )
    intervals_s = tracking.intervals_s if len(tracking.intervals_s) > 1 else INTERVALS_S
    speeds_m_s = sorted({own.speed_m_s, *SPEEDS_M_S})
    offsets_db = sorted({own.offset_db, *OFFSETS_DB})
    if quick:
        intervals_s = tuple(thinned(intervals_s))
        speeds_m_s = sorted({own.speed_m_s, speeds_m_s[-1]})
        offsets_db = sorted({own.offset_db, offsets_db[0], offsets_db[-1]})
    return Setting(
        tracking=tracking,
        scenario=scenario_of(spec, quick=quick),
        tracker=tracker,
        own=own,
        intervals_s=tuple(sorted({own.interval_s, *intervals_s})),
        speeds_m_s=tuple(speeds_m_s),
        readings=readings,
        modes=modes,
        offsets_db=tuple(offsets_db),
        trials=_QUICK_TRIALS if quick else tracking.trials,
        elsewhere=tuple(limit_text(limit) for limit in spec.limits),
    )
