"""A square loop antenna by the exact field of its four sides: a tag is read where the field is strong enough."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar, Final

import numpy as np

from layoutopt.antennas.loop_field import field_on_axis, square_loop_field
from layoutopt.antennas.mi2016_antennas import CALIBRATED_SIDE_M, LARGE, SMALL, calibrated, exponent
from layoutopt.identity import BoolArray, FloatArray, by_content, check_not_negative
from layoutopt.protocols import AntennaCard, Surroundings

LEAST_FIELD_A_M: Final = 0.15
"""Field in which every tag works by ISO/IEC 15693-2, A/m; good large labels need 0.085 (FEIG ID ISC.ANT300)."""
DISCS: Final = ("inscribed", "equal_area")

CARD: Final = AntennaCard(
    summary="Reads every tag where the field of a square loop is strong enough; drive fitted to two antennas.",
    reference="Biot-Savart; drive through the two antennas of mi2016 (Sections 5.3 and 5.4); ISO/IEC 15693-2",
    valid_side_m=CALIBRATED_SIDE_M,
)
_DRIVE_EXPONENT: Final = exponent(
    1.0 / field_on_axis(SMALL.side_m, SMALL.reach_m), 1.0 / field_on_axis(LARGE.side_m, LARGE.reach_m)
)
_FARTHEST_SIDES: Final = 3.0
"""An antenna that reads from farther is driven harder than any product of its size."""
_NEAREST_M: Final = 1e-6
"""A wire without thickness has an infinite field; no tag comes nearer to its plane."""
_EDGE_M: Final = 0.002
"""Scale of the soft edge, the ``read_edge`` of the held-out faults: 2 to 3 mm from spread of tags and heights."""
_EDGE_SCALES: Final = 14.0
"""Scales beyond which no tag is read, as in simulated drives."""
_STEPS: Final = 48
_HALVINGS: Final = 34
_RAYS_RAD: Final = np.linspace(0.0, np.pi / 4.0, 17)
"""The outline of a square loop repeats itself in every eighth of a turn."""
_SCANNED: Final = 400
"""Places on a ray at which the ring beside the loop is looked for; it is as wide as the antenna is high."""


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BiotSavartAntenna:
    """A square loop of ``side_m`` that reads a tag where the field along the tag's normal reaches a least value.

    Without ``ampere_turns_a`` the loop is driven by a law K side^q that passes through both antennas of mi2016
    (q = 1.474). Two points are a fit and no law of physics: the 60 mm antenna has 2.8 times the ampere-turns of
    the 30 mm one. Beyond 80 mm the law is capped at constant power, by which ampere-turns fall as 1 / sqrt(side).
    Outside 25 to 80 mm such an antenna is marked as extrapolated; one with ampere-turns of its own is physics at
    any side.

    Heights count from the tags: the clearance, and whatever covers the tags. A covering that neither conducts nor
    is magnetic (carpet, PVC, wood, tiles, dry screed) acts by its thickness only.

    Attributes
    ----------
    ampere_turns_a
        Turns times current (r.m.s.); ``None`` for the law above.
    least_field_a_m
        Field that the tags need, A/m r.m.s.; ``None`` for 0.15 A/m. Only beside ``ampere_turns_a``: the law is
        fitted to reaches, which say nothing of field and tags apart.
    tag_tilt_rad
        By how much tags are tilted. To which side is not known, so the least favourable one counts.
    metal_depth_m
        Depth of a metal plane below the tags, everywhere; ``None`` for no metal. It acts by the image of the loop;
        that it detunes the antenna as well is left out.
    covering_loss_share
        Share of the field that a conductive covering takes.
    disc
        What the rest of layoutopt takes for the outline on the floor, which bulges towards the corners: the
        ``"inscribed"`` circle, within which tags are read whatever the heading, or the ``"equal_area"`` one, with
        which as many tags are read as with the outline.

    Raises
    ------
    ValueError
        If a number lies outside its range, or a drive is stated by halves or carries farther than three sides.
    """

    side_m: float
    ampere_turns_a: float | None = None
    least_field_a_m: float | None = None
    tag_tilt_rad: float = 0.0
    metal_depth_m: float | None = None
    covering_loss_share: float = 0.0
    disc: str = "inscribed"
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[AntennaCard] = CARD

    def __post_init__(self) -> None:
        """Check every number."""
        stated = {
            "side": self.side_m,
            "number of ampere-turns": self.ampere_turns_a,
            "least field": self.least_field_a_m,
        }
        for name, value in stated.items():
            if value is not None and not (value > 0.0 and math.isfinite(value)):
                raise ValueError(f"an antenna needs a positive, finite {name}, got {value}")
        if self.least_field_a_m is not None and self.ampere_turns_a is None:
            raise ValueError(
                "a least field says nothing without ampere-turns: the drive law was fitted to reaches of antenna "
                "and tag together; state both or neither"
            )
        if not 0.0 <= self.tag_tilt_rad <= math.pi / 2.0:
            raise ValueError(f"tags are tilted by 0 to 90 degrees, not by {math.degrees(self.tag_tilt_rad):g}")
        if self.metal_depth_m is not None:
            check_not_negative("the antenna", metal_depth_m=self.metal_depth_m)
        if not 0.0 <= self.covering_loss_share < 1.0:
            raise ValueError(f"a covering takes a share from 0 to below 1, got {self.covering_loss_share}")
        if self.disc not in DISCS:
            raise ValueError(f"disc is one of {', '.join(DISCS)}, not {self.disc!r}")
        if self.drive_m * field_on_axis(self.side_m, _FARTHEST_SIDES * self.side_m) >= 1.0:
            raise ValueError(
                f"{self.ampere_turns_a} ampere-turns through a loop of {self.side_m} m would read farther than "
                f"{_FARTHEST_SIDES:g} sides, which no antenna of that size does; check the ampere-turns"
            )

    @property
    def drive_m(self) -> float:
        """Ampere-turns over the least field that the tags need, m: all that reading depends on."""
        if self.ampere_turns_a is not None:
            least_a_m = LEAST_FIELD_A_M if self.least_field_a_m is None else self.least_field_a_m
            return self.ampere_turns_a / least_a_m
        capped_m = min(self.side_m, CALIBRATED_SIDE_M[1])
        at_constant_power = math.sqrt(capped_m / self.side_m)
        return at_constant_power * drive_law_m(capped_m)

    @property
    def extrapolated(self) -> bool:
        """Whether the drive is that of the law, and the side lies outside its range."""
        return self.ampere_turns_a is None and not calibrated(self.side_m)

    @property
    def reach_m(self) -> float:
        """Greatest depth below the antenna at which a tag on the axis is read; zero if none is."""
        depths_m = np.linspace(0.0, _FARTHEST_SIDES * self.side_m, 601)
        read = np.flatnonzero(self._on_axis(depths_m) >= 1.0)
        if len(read) == 0:
            return 0.0
        last = int(read[-1])
        return float(_end_within(lambda depth_m: self._on_axis(depth_m) >= 1.0, *depths_m[last : last + 2]))

    def field_ratio(self, offset_m: FloatArray, surroundings: Surroundings | None = None) -> FloatArray:
        """Return the field along the normal of a tag over the least that it needs, shape (...), at offsets.

        Below the loop it is positive, beyond the ring on which the field turns over negative; a tag is read where
        its size is 1 or more. Of a tilted tag it is the size for the least favourable direction of the tilt; it
        does not fall below zero there.

        Parameters
        ----------
        offset_m
            Places of tags in the antenna frame, shape (..., 3), m.
        surroundings
            What it says of metal and tilt takes the place of the antenna's own.
        """
        metal_depth_m, tilt_rad = self._around(surroundings)
        at_m = np.array(offset_m, dtype=np.float64)
        at_m[..., 2] = -np.maximum(np.abs(at_m[..., 2]), _NEAREST_M)
        strength = square_loop_field(at_m, self.side_m)
        if metal_depth_m is not None:
            # The image lies as deep below the plane as the loop lies above it, and its current runs the other way.
            mirrored_m = at_m * (1.0, 1.0, -1.0) + (0.0, 0.0, 2.0 * metal_depth_m)
            strength = strength - square_loop_field(mirrored_m, self.side_m)
        along = strength[..., 2]
        if tilt_rad > 0.0:
            beside = np.hypot(strength[..., 0], strength[..., 1])
            least = np.abs(along) * math.cos(tilt_rad) - beside * math.sin(tilt_rad)
            along = np.sign(along) * np.maximum(least, 0.0)
        return np.asarray(self.drive_m * (1.0 - self.covering_loss_share) * along)

    def outline_m(self, height_m: float) -> FloatArray:
        """Return how far from the axis tags are read on a plane, on 17 rays from 0 to 45 degrees, shape (17,), m.

        It is the first place on each ray where the field is too weak; at 0 degrees a ray leaves through the middle
        of a side, at 45 degrees through a corner. All zero where a tag on the axis is not read, even if one beside
        it is, as may be near metal.
        """
        return _outline(self, float(height_m))

    def read_radius_m(self, height_m: float) -> float:
        """Return the radius of the disc that stands for the outline on a plane ``height_m`` below the antenna.

        Examples
        --------
        >>> round(BiotSavartAntenna(side_m=0.030).read_radius_m(0.020), 4)
        0.0104
        """
        outline_m = self.outline_m(height_m)
        if self.disc == "inscribed":
            return float(outline_m.min())
        # The trapezoidal rule over a period, of which the rays are an eighth.
        squared_m2 = outline_m**2
        return math.sqrt(float(squared_m2[1:-1].sum() + squared_m2[[0, -1]].mean()) / (len(squared_m2) - 1))

    def disc_error_m(self, height_m: float) -> float:
        """Return by how much the outline on that plane leaves the disc at most."""
        return float(np.abs(self.outline_m(height_m) - self.read_radius_m(height_m)).max())

    def reads_beside_disc(self, height_m: float) -> bool:
        """Return whether tags are also read in a ring outside the loop, where the field has turned over."""
        away_m = np.linspace(0.0, _FARTHEST_SIDES * self.side_m, _SCANNED)[:, None]
        return bool((self.field_ratio(_on_rays(away_m, height_m)) <= -1.0).any())

    def read_probability(self, offset_m: FloatArray, surroundings: Surroundings) -> FloatArray:
        """Return the chance that one scan reads a tag at offsets, shape (..., 3), m, in the antenna frame.

        It is one half on the outline and falls off along the floor as a logistic curve of 2 mm. The ring beside
        the loop (`reads_beside_disc`) is left out: makers of antennas say that it exists near the loop and is not
        to be planned with (Siemens SIMATIC RF300 manual, "secondary fields"). ``surroundings`` as in
        `field_ratio`.
        """
        offset_m = np.asarray(offset_m, dtype=np.float64)
        below = offset_m[..., 2] <= 0.0
        away_m = np.hypot(offset_m[..., 0], offset_m[..., 1])
        angle_rad = np.arctan2(offset_m[..., 1], offset_m[..., 0])
        cos, sin, up_m = np.cos(angle_rad), np.sin(angle_rad), offset_m[..., 2]

        def read(radius_m: FloatArray) -> BoolArray:
            at_m = np.stack([radius_m * cos, radius_m * sin, up_m], axis=-1)
            return self.field_ratio(at_m, surroundings) >= 1.0

        edge_m = _first_end(read, np.full_like(away_m, _FARTHEST_SIDES * self.side_m))
        beyond_m = away_m - edge_m
        chance = 0.5 - 0.5 * np.tanh(beyond_m / (2.0 * _EDGE_M))
        in_range = below & (edge_m > 0.0) & (beyond_m < _EDGE_SCALES * _EDGE_M)
        return np.asarray(np.where(in_range, chance, 0.0), dtype=np.float64)

    def _around(self, surroundings: Surroundings | None) -> tuple[float | None, float]:
        if surroundings is None:
            surroundings = Surroundings()
        depth_m, tilt_rad = surroundings.metal_depth_m, surroundings.tag_tilt_rad
        return self.metal_depth_m if depth_m is None else depth_m, tilt_rad or self.tag_tilt_rad

    def _on_axis(self, depth_m: FloatArray) -> FloatArray:
        depth_m = np.asarray(depth_m, dtype=np.float64)
        return self.field_ratio(np.stack([0.0 * depth_m, 0.0 * depth_m, -depth_m], axis=-1))


def drive_law_m(side_m: float) -> float:
    """Return ampere-turns over least field, m, by K side^q through the two antennas of mi2016, without a cap.

    With 0.15 A/m these are 25 mA of ampere-turns at 30 mm and 69 mA at 60 mm.

    Examples
    --------
    >>> [round(1000.0 * LEAST_FIELD_A_M * drive_law_m(side_m)) for side_m in (0.03, 0.06)]
    [25, 69]
    """
    return float((side_m / SMALL.side_m) ** _DRIVE_EXPONENT / field_on_axis(SMALL.side_m, SMALL.reach_m))


@lru_cache(maxsize=4096)
def _outline(antenna: BiotSavartAntenna, height_m: float) -> FloatArray:
    """Return the outline, read only; every trial asks for that of each antenna."""
    farthest_m = np.full_like(_RAYS_RAD, _FARTHEST_SIDES * antenna.side_m if height_m >= 0.0 else 0.0)
    radius_m = _first_end(lambda away_m: antenna.field_ratio(_on_rays(away_m, height_m)) >= 1.0, farthest_m)
    radius_m.setflags(write=False)
    return radius_m


def _on_rays(away_m: FloatArray, height_m: float) -> FloatArray:
    """Return places that far from the axis on each ray, on a plane below the antenna; the last axis is x, y, z."""
    x_m, y_m = np.cos(_RAYS_RAD) * away_m, np.sin(_RAYS_RAD) * away_m
    return np.stack([x_m, y_m, np.full_like(x_m, -height_m)], axis=-1)


def _first_end(inside: Callable[[FloatArray], BoolArray], farthest_m: FloatArray) -> FloatArray:
    """Return where ``inside``, followed outwards from zero, first ends; zero where it does not even hold there."""
    low_m, step_m = np.zeros_like(farthest_m), farthest_m / _STEPS
    held = inside(low_m)
    if not held.any():
        return low_m
    high_m = np.where(held, step_m, 0.0)
    for number in range(1, _STEPS):
        if not held.any():
            break
        held = held & inside(number * step_m)
        low_m, high_m = np.where(held, number * step_m, low_m), np.where(held, (number + 1) * step_m, high_m)
    return _end_within(inside, low_m, high_m)


def _end_within(inside: Callable[[FloatArray], BoolArray], low_m: FloatArray, high_m: FloatArray) -> FloatArray:
    """Return where ``inside`` ends between two places, by halving."""
    for _ in range(_HALVINGS):
        middle_m = (low_m + high_m) / 2.0
        within = inside(middle_m)
        low_m, high_m = np.where(within, middle_m, low_m), np.where(within, high_m, middle_m)
    return low_m
