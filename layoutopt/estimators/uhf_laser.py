"""Tracking of a UHF tag by the strength and phase of its answers and by what a laser scanner sees move."""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np

from layoutopt.estimators.laser_clusters import Clustering
from layoutopt.estimators.phase_velocity import (
    ALIASES,
    phase_displacement,
    similarity,
    speed_limit,
    wavelength_m,
)
from layoutopt.estimators.sensor_model import sensor_tables
from layoutopt.estimators.targets import TargetKnowledge, TargetObservations, TargetTrack
from layoutopt.estimators.uhf_laser_filter import (
    NORMALS,
    UNIFORMS,
    Motion,
    RunningUhfLaser,
    antenna_frames,
    check_told,
    cloud_at_start,
    draw,
)
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from layoutopt.estimators.uhf_laser_kernels import Place, Told

__all__ = [
    "CARD",
    "MODES",
    "MOTIONS",
    "SIGMA_UNITS",
    "UhfLaser",
    "phase_displacement",
    "similarity",
    "speed_limit",
]

CARD: Final = EstimatorCard(
    summary="Particle filter on strength and phase of a UHF tag and on the clusters of a laser scan.",
    reference="liang2020, Eq. 1-15; aliases, floor and steps without a reading are ours",
    estimates="target",
    needs="signal",
)
MODES: Final = ("fused", "strength", "velocity")
MOTIONS: Final = ("random walk", "heading")
SIGMA_UNITS: Final = ("step", "second", "root second")
_NUMBERS_AT_ONCE: Final = 1 << 20
"""Random numbers that are drawn before the kernel goes on: 8 MB."""


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UhfLaser:
    """The particle filter of liang2020: strengths by a learned sensor model, clusters by their radial velocity.

    The answer is the weighted mean of the particles before they are resampled, which has the paper's expectation
    (after it) without the noise of the resampling.

    Attributes
    ----------
    mode
        ``"fused"``, or what of it is used alone: ``"strength"`` or ``"velocity"``.
    particles
        N, their number.
    matches
        K, the number of best matching clusters that count.
    sigma_m, sigma_per
        Standard deviation of a step in x and in y: per ``"step"`` (Eq. 12), or per ``"second"`` and times the
        interval, or per ``"root second"`` and times its root (a Brownian motion).
    rho_m2
        Eq. 14: variance of a particle about the cluster of its target.
    aliases
        How many velocities a pair of phases may stand for: `phase_velocity.phase_velocities`.
    motion
        ``"random walk"`` (Eq. 12), or ``"heading"``: each particle has a direction and a speed, which change
        slowly or are new, and the random step comes on top.
    turn_sigma_rad, speed_sigma_m_s
        Standard deviations of their changes in 1 s, for ``"heading"``.
    fresh_per_s
        Rate of new directions and speeds.
    fastest_m_s
        Largest speed of a target.
    seeded_share
        Share of the particles that are put to the matched clusters at each instant, so that a filter that follows
        the wrong one recovers; the paper has none.
    on_floor
        Whether particles stay on the floor.
    steps_unread
        Whether particles move, and are weighed by the silence, at instants that tell nothing of the target.
    largest_radius_m
        R_max of clusters; not printed in the paper.

    Raises
    ------
    ValueError
        If a setting lies outside its range.

    References
    ----------
    liang2020, Section 3; a motion model with direction and speed is its future work.
    """

    mode: str = "fused"
    particles: int = 100
    matches: int = 9
    sigma_m: float = 1.0
    sigma_per: str = "step"
    rho_m2: float = 0.05
    aliases: str = "two hypotheses"
    motion: str = "random walk"
    turn_sigma_rad: float = 1.0
    speed_sigma_m_s: float = 0.2
    fresh_per_s: float = 0.2
    fastest_m_s: float = 1.5
    seeded_share: float = 0.0
    on_floor: bool = True
    steps_unread: bool = False
    largest_radius_m: float = 0.4
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD
    row: ClassVar[str] = "uhf_laser"

    def __post_init__(self) -> None:
        """Check the settings."""
        choices = {"mode": MODES, "sigma_per": SIGMA_UNITS, "aliases": ALIASES, "motion": MOTIONS}
        for name, known in choices.items():
            if getattr(self, name) not in known:
                raise ValueError(f"{name} must be one of {', '.join(known)}, got {getattr(self, name)!r}")
        for name in ("particles", "matches"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} are counted from 1, got {getattr(self, name)}")
        if not 0.0 <= self.seeded_share < 1.0:
            raise ValueError(f"seeded_share lies between 0 and 1, 1 excluded, got {self.seeded_share!r}")
        for name in ("rho_m2", "fastest_m_s", "largest_radius_m"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be positive and finite, got {getattr(self, name)!r}")
        for name in ("sigma_m", "turn_sigma_rad", "speed_sigma_m_s", "fresh_per_s"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be zero or positive and finite, got {getattr(self, name)!r}")

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return self.row

    @property
    def uses_strength(self) -> bool:
        """Whether strengths weigh particles."""
        return self.mode != "velocity"

    @property
    def uses_velocity(self) -> bool:
        """Whether clusters with matching radial velocities do."""
        return self.mode != "strength"

    def applies(self, layout: Layout) -> str:
        """Return why the tracker cannot work with a layout, or an empty string."""
        groups = len(layout.readers_of("signal"))
        if groups == 1:
            return ""
        return f"it needs one reader with UHF antennas, and the layout has {groups or 'none'}"

    def motion_in(self, interval_s: float) -> Motion:
        """Return what one interval does to the particles."""
        growth = {"step": 1.0, "second": interval_s, "root second": math.sqrt(interval_s)}
        return Motion(
            interval_s=interval_s,
            sigma_m=self.sigma_m * growth[self.sigma_per],
            heading=self.motion == "heading",
            turn_sigma_rad=self.turn_sigma_rad * math.sqrt(interval_s),
            speed_sigma_m_s=self.speed_sigma_m_s * math.sqrt(interval_s),
            fresh_share=-math.expm1(-self.fresh_per_s * interval_s),
            fastest_m_s=self.fastest_m_s,
            on_floor=self.on_floor,
        )

    def start(self, knowledge: TargetKnowledge, draws: np.random.Generator) -> RunningUhfLaser:
        """Return the plain filter that works instant by instant."""
        return RunningUhfLaser(self, knowledge, draws)

    def run(
        self, knowledge: TargetKnowledge, observations: TargetObservations, draws: np.random.Generator
    ) -> TargetTrack:
        """Return the track of a whole drive from the compiled twin of `RunningUhfLaser`, on the same draws.

        Raises
        ------
        ValueError
            If a range is NaN or negative, or the readings do not fit the antennas or come out of order.
        """
        from layoutopt.estimators.uhf_laser_kernels import State, Weighing, track

        told = _columns(knowledge, observations)
        cloud = cloud_at_start(knowledge, self.particles, self.fastest_m_s, draws)
        beams = len(knowledge.laser.beam_rad)
        state = State(
            cloud=cloud,
            place_m=cloud[:2].mean(axis=1),
            clusters_m=np.empty((beams, 3)),
            counts=np.zeros(1, dtype=np.int64),
        )
        weighing = Weighing(
            uses_strength=self.uses_strength,
            uses_velocity=self.uses_velocity,
            steps_unread=self.steps_unread,
            matches=self.matches,
            rho_m2=self.rho_m2,
            seeded_share=self.seeded_share,
            aliases=ALIASES.index(self.aliases),
            phase_steps=1 << knowledge.phase_bits,
        )
        count = len(observations)
        places_m, blind, matched = np.empty((count, 2)), np.empty(count, np.bool_), np.empty(count, np.bool_)
        motion = self.motion_in(observations.interval_s)
        clustering = Clustering(largest_radius_m=self.largest_radius_m)
        tables, place = sensor_tables(knowledge.sensor_model), _place(knowledge)
        block = max(1, _NUMBERS_AT_ONCE // (self.particles * (NORMALS + UNIFORMS)))
        for first in range(0, count, block):
            numbers = [draw(draws, self.particles) for _ in range(first, min(first + block, count))]
            track(
                weighing,
                motion,
                clustering,
                tables,
                place,
                told,
                state,
                first,
                np.array([normal for normal, _, _ in numbers]),
                np.array([uniform for _, uniform, _ in numbers]),
                np.array([mark for _, _, mark in numbers]),
                places_m,
                blind,
                matched,
            )
        return TargetTrack(places_m=places_m, blind=blind, matched=matched)


def _columns(knowledge: TargetKnowledge, observations: TargetObservations) -> "Told":
    """Return the columns of a drive as the kernel takes them, checked."""
    from layoutopt.estimators.uhf_laser_kernels import Told

    check_told(knowledge, observations)
    has_phase = observations.phase_word >= 0
    waves_m = np.full(has_phase.shape, np.nan)
    for frequency_hz in np.unique(observations.frequency_hz[has_phase]):
        waves_m[has_phase & (observations.frequency_hz == frequency_hz)] = wavelength_m(float(frequency_hz))
    late = np.argwhere((has_phase[1:] & has_phase[:-1]) & ~(np.diff(observations.read_time_s, axis=0) > 0.0))
    if len(late):
        row, antenna = late[0].tolist()
        raise ValueError(f"antenna {antenna} reads at instant {row + 1} no later than at the one before")
    return Told(
        read_time_s=np.array(observations.read_time_s, dtype=np.float64, order="C"),
        strength_dbm=np.array(observations.strength_dbm, dtype=np.float64, order="C"),
        phase_word=np.array(observations.phase_word, dtype=np.int64, order="C"),
        wavelength_m=waves_m,
        ranges_m=np.array(observations.ranges_m, dtype=np.float64, order="C"),
    )


def _place(knowledge: TargetKnowledge) -> "Place":
    """Return what stays as it is, as the kernel takes it."""
    from layoutopt.estimators.uhf_laser_kernels import Place

    x_m, y_m, heading_rad = knowledge.robot_pose
    beam_rad = knowledge.laser.beam_rad
    return Place(
        robot=np.array([x_m, y_m, math.cos(heading_rad), math.sin(heading_rad)]),
        antennas=antenna_frames(knowledge),
        beam=np.stack([np.cos(beam_rad), np.sin(beam_rad)]),
        step_rad=knowledge.laser.step_rad,
        edges_m=_edges(knowledge.floor),
    )


def _edges(floor: "BaseGeometry") -> FloatArray:
    """Return the edges of a floor, outer and inner, as rows of x, y, x, y."""
    import shapely

    rings = [shapely.get_coordinates(ring) for ring in shapely.get_rings(shapely.get_parts(floor))]
    return np.concatenate([np.column_stack([ring[:-1], ring[1:]]) for ring in rings])
