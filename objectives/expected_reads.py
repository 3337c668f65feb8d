"""How many reads and tags a layout can expect, from the density of its tags and the discs of its antennas.

A set of area A that is laid on a lattice at a random place holds A times the lattice's density on average,
whatever its shape and the angle of the lattice. A disc of radius r that has moved on by a way w covers
pi r^2 - lens(r, w) of new floor, where lens(r, w) is what the disc and the one before it share. So the mean
numbers below are exact for every periodic pattern. They are means: they do not say whether reads come evenly or in
bursts, and so they bound no error.

Faults are left out: with a share p of missed scans the expected reads are 1 - p times as many.
"""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np
import shapely

from layoutopt.detection import antennas_of
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ZonePattern
from layoutopt.protocols import Antennas, ObjectiveCard
from layoutopt.scenario import Scenario
from layoutopt.scores import SCORE_UNITS, Score, Scores, TrialOutcomes
from layoutopt.site import Site

CARD: Final = ObjectiveCard(
    summary="Expected reads per step and per metre, and tags newly met per metre, at cruising speed, no faults.",
    reference="Santaló, Integral Geometry and Geometric Probability, 2nd ed. 2004, Chapter 8 (lattices)",
    scores={
        name: SCORE_UNITS[name]
        for name in ("expected_reads_per_step", "expected_reads_per_m", "expected_new_tags_per_m")
    },
    fidelity="exact",
    per_zone=True,
)


def swept_area_m2(radius_m: FloatArray, way_m: FloatArray) -> FloatArray:
    """Return the area that discs cover after a straight way and did not cover before, shape as given, m².

    For a short way it is 2 r w, a strip as wide as the disc; beyond the way 2 r it is the whole disc.

    Examples
    --------
    >>> swept_area_m2(np.array([1.0, 1.0]), np.array([0.001, 3.0])).round(6).tolist()
    [0.002, 3.141593]
    """
    radius_m, way_m = np.asarray(radius_m, dtype=np.float64), np.asarray(way_m, dtype=np.float64)
    half_angle = np.arcsin(np.minimum(way_m / 2.0, radius_m) / np.where(radius_m > 0.0, radius_m, 1.0))
    # pi r^2 less the lens 2 r^2 arccos(w / 2r) - w / 2 sqrt(4 r^2 - w^2), written so that no digits cancel.
    return np.asarray(radius_m**2 * (2.0 * half_angle + np.sin(2.0 * half_angle)))


def reads_per_step(antennas: Antennas, density_per_m2: float) -> float:
    """Return the expected number of reads of all antennas in one time step.

    An antenna reads the tags in its disc in each step in which its turn comes; the steps between count too.
    """
    return float(density_per_m2 * (math.pi * antennas.radius_m**2 / antennas.period_steps).sum())


def new_tags_per_m(antennas: Antennas, density_per_m2: float, way_per_step_m: float) -> float:
    """Return how many tags come newly into a scan per metre of straight travel, summed over the antennas.

    New to an antenna is a tag that its scan before did not read; two antennas that meet the same tag count twice.
    An antenna that scans all the time meets 2 r times the density; one whose turn comes only after a way of more
    than 2 r passes over some tags between its scans.
    """
    way_m = antennas.period_steps.astype(np.float64) * way_per_step_m
    return float(density_per_m2 * (swept_area_m2(antennas.radius_m, way_m) / way_m).sum())


def tag_density_per_m2(floor_tags: FloorTags, entry: ZonePattern, site: Site) -> float:
    """Return the tags per square metre of a pattern: of its cell, or, laid once, of the floor where it rules.

    A pattern that is laid once has no density of its own. Its tags on the site are divided by the open floor on
    which no other pattern rules; that is what an antenna meets on average over that floor, but for those tags near
    its edge of which a part of the disc lies outside. Zero where the site leaves it no floor.
    """
    if entry.pattern.cell_m is not None:
        return entry.pattern.density_per_m2
    own = {zone.zone for zone in floor_tags.zones}
    names = site.zone_names
    index = -1 if entry.zone == WHOLE_FLOOR else names.index(entry.zone)
    region = site.open_floor if index < 0 else site.open_floor.intersection(site.zone(entry.zone).region)
    ruling = [zone.region for number, zone in enumerate(site.zones) if zone.name in own and number > index]
    area_m2 = float(region.difference(shapely.union_all(ruling)).area)
    tags = int((site.zone_of(floor_tags.lay_on(site).xy_m, own) == index).sum())
    return tags / area_m2 if area_m2 > 0.0 else 0.0


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExpectedReads:
    """Expected reads and new tags over the base pattern, and over each zone with a pattern of its own.

    The robot drives straight ahead at the scenario's cruising speed. A reader that takes one tag a scan is counted
    like one that takes several, because a layout in which two tags lie in its field cannot be built.
    """

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the objective has no settings."""

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return the scores of every pattern, those of a zone as ``zone.name``; none without an HF antenna."""
        antennas = antennas_of(layout, scenario.step_s)
        if len(antennas) == 0:
            return {}
        way_per_step_m = scenario.robot.speed_m_s * scenario.step_s
        floor_tags = layout.floor_tags
        named = [(f"{entry.zone}.", entry) for entry in floor_tags.zones if entry.zone != WHOLE_FLOOR]
        scores: dict[str, Score] = {}
        for prefix, entry in [("", floor_tags.base), *named]:
            density_per_m2 = tag_density_per_m2(floor_tags, entry, scenario.site)
            reads = reads_per_step(antennas, density_per_m2)
            values = {
                "expected_reads_per_step": reads,
                "expected_reads_per_m": reads / way_per_step_m,
                "expected_new_tags_per_m": new_tags_per_m(antennas, density_per_m2, way_per_step_m),
            }
            scores |= {prefix + name: Score(value=value, unit=CARD.scores[name]) for name, value in values.items()}
        return scores
