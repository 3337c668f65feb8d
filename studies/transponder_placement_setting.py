"""What the study of a transponder's place asks of a spec: the places, what each of them scores, and the effort."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import shapely
from shapely.geometry import Polygon

from layoutopt import registry
from layoutopt.errors import InvalidInput
from layoutopt.geometry import covers, lattice_points
from layoutopt.identity import BoolArray, FloatArray, content_key
from layoutopt.layout import FloorTags, Layout
from layoutopt.problem import Limit
from layoutopt.protocols import AnyEstimator
from layoutopt.scenario import Scenario
from layoutopt.score_text import limit_text, score_name
from layoutopt.scores import DOCKING_UNITS, Score, Scores
from layoutopt.simulation.docking_ground import DockingGround, SiteWalls, site_walls
from layoutopt.simulation.docking_trials import docking_ground
from layoutopt.spec.building import Spec
from layoutopt.spec.finders import DockingSettings
from layoutopt.units import format_length
from objectives.direction_quality import clearance_m, direction_map, scores_of

CLEARANCE_M: Final = 0.5
"""Least clearance unless the spec limits it: beside a scatterer a place looks better than it is."""
CHEAP: Final = ("direction_error_mean", "direction_bad_share")
"""Exact scores of a place that might tell, without a drive, where robots dock."""
CLEARANCE: Final = "scatterer_clearance"
_JUDGED: Final = frozenset({*CHEAP, *DOCKING_UNITS, CLEARANCE})
GUIDES: Final = ("direction_as_measured", "direction_corrected", "bearing_filter", "bearing_bumper")
"""What is compared at the best place, the yardstick first."""
MOST_PLACES: Final = 2000
"""More places than this would take hours, and lie nearer to each other than their success differs."""
QUICK_PLACES: Final = 24
_FIRST_DRIVES: Final = 24
_LAST_STEP: Final = 0.75
"""A round that would end nearer to the last is left out."""
_FINALISTS: Final = 6
_SAME_M: Final = 1e-9
_OFF_BORDER_M: Final = 1e-6
TOO_NEAR: Final = "too near a wall or scatterer"
OUT_OF_REACH: Final = "no robot gets near enough"


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A place for the transponder.

    Attributes
    ----------
    xy_m
        Where it is, m.
    layout
        Crossed antennas, and the transponder there.
    clearance_m
        Distance from the nearest scatterer or wall.
    scores
        Exact scores of the direction, those that exist.
    in_view
        Share of the cells that the direct wave reaches.
    refusal
        Why no robot is sent there; empty if robots are.
    given
        Whether the spec names the place.
    """

    xy_m: tuple[float, float]
    layout: Layout
    clearance_m: float
    scores: Scores
    in_view: float
    refusal: str
    given: bool

    @property
    def key(self) -> str:
        """Key of its layout."""
        return self.layout.key


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """Drives to each place after each round of the race, ascending, places in the end, and fresh drives."""

    levels: tuple[int, ...]
    finalists: int
    fresh: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """The question: settings, world, limits and effort.

    Attributes
    ----------
    scenario, fresh
        Where the race is run, and the same world under another name for drives that no choice was made on.
    least_clearance_m
        Places with less are refused.
    exact_limits, limits
        Limits of the spec on exact scores of places, but for clearance, and on simulated docking.
    elsewhere
        Limits of the spec at which the study does not look, in words.
    pitch_m, borders
        Pitch of the lattice of places, and whether there are more along the borders of obstacles.
    """

    settings: DockingSettings
    scenario: Scenario
    fresh: Scenario
    estimator: AnyEstimator
    guides: tuple[AnyEstimator, ...]
    least_clearance_m: float
    exact_limits: tuple[Limit, ...]
    limits: tuple[Limit, ...]
    elsewhere: tuple[str, ...]
    pitch_m: float
    borders: bool
    effort: Effort

    @property
    def key(self) -> str:
        """Content key of the question."""
        settings, effort = self.settings, self.effort
        limits = [(limit.score, limit.upper, limit.lower) for limit in (*self.exact_limits, *self.limits)]
        estimators = [estimator.key for estimator in (self.estimator, *self.guides)]
        numbers = (
            self.least_clearance_m,
            self.pitch_m,
            self.borders,
            effort.levels,
            effort.finalists,
            effort.fresh,
        )
        return content_key(
            "transponder_placement", self.scenario.key, estimators, settings.transponder_m, limits, numbers
        )


def asked_of(spec: Spec, *, quick: bool) -> Asked:
    """Return the question of a spec; a quick one has fewer places and drives.

    Raises
    ------
    InvalidInput
        If the spec says nothing of docking, its estimator guides no docking robot, there are too many places,
        or no robot can dock at the given one.
    """
    settings = spec.docking
    if settings is None:
        raise InvalidInput.at("docking", "the spec says nothing of docking", "Write a [docking] table.")
    scenario = spec.docking_scenario
    known = {name: registry.load("estimators", name)() for name in dict.fromkeys((settings.estimator, *GUIDES))}
    estimator = known[settings.estimator]
    if estimator.card.estimates != "bearing":
        raise InvalidInput.at(
            "docking.estimator",
            f"'{settings.estimator}' guides no docking robot",
            f"Take one of {', '.join(GUIDES)}.",
        )
    if settings.transponder_m is not None:
        # A place where nobody can dock is the user's to mend, unlike those of the lattice.
        docking_ground(layout_at(settings, settings.transponder_m), scenario)
    clearances_m = [limit.end for limit in spec.own_limits if limit.score == CLEARANCE]
    asked = Asked(
        settings=settings,
        scenario=scenario,
        fresh=replace(scenario, name=f"{scenario.name}/fresh"),
        estimator=estimator,
        guides=tuple(known[name] for name in dict.fromkeys((*GUIDES, settings.estimator))),
        least_clearance_m=max(clearances_m, default=CLEARANCE_M),
        exact_limits=tuple(limit for limit in spec.own_limits if limit.score in CHEAP),
        limits=tuple(limit for limit in spec.own_limits if limit.score in DOCKING_UNITS),
        elsewhere=tuple(limit_text(limit) for limit in spec.limits if limit.score not in _JUDGED),
        pitch_m=settings.candidate_pitch_m,
        borders=not quick,
        effort=_effort(settings.trials, quick=quick),
    )
    # So many would find no room in memory to be counted; borders add to them, but less.
    floor_count = scenario.site.open_floor.area / settings.candidate_pitch_m**2
    if floor_count > 2.0 * MOST_PLACES:
        raise _too_many(asked, floor_count)
    if quick:
        # Whole multiples of the pitch, so that places keep coordinates that a rule shows.
        coarser = (replace(asked, pitch_m=times * asked.pitch_m) for times in itertools.count(1))
        asked = next(question for question in coarser if np.count_nonzero(_clear(question)) <= QUICK_PLACES)
    count = len(lattice_m(asked))
    if count > MOST_PLACES:
        raise _too_many(asked, count)
    return asked


def _too_many(asked: Asked, count: float) -> InvalidInput:
    """Return the refusal of a pitch that makes so many places."""
    wanted_m = asked.pitch_m * math.sqrt(count / MOST_PLACES)
    return InvalidInput.at(
        "docking.candidate_pitch",
        f"{format_length(asked.pitch_m)} makes about {count:.3g} places, more than {MOST_PLACES}",
        f"Write {format_length(math.ceil(20.0 * wanted_m) / 20.0)}.",
    )


def lattice_m(asked: Asked) -> FloatArray:
    """Return the places that are tried, shape (n, 2), m.

    They lie on the open floor at multiples of the pitch from the site's datum. Where the question has ``borders``
    there are more along the border of each obstacle and of each hole of the floor, at the pitch or a little less.
    """
    site, pitch_m = asked.scenario.site, asked.pitch_m
    on_floor = lattice_points(np.array([site.datum_m]), pitch_m * np.eye(2), site.bounds_m)
    on_floor = on_floor[covers(site.open_floor, on_floor)]
    along: list[FloatArray] = []
    holes = [Polygon(ring) for part in shapely.get_parts(site.floor) for ring in part.interiors]
    for thing in (*site.obstacles, *holes) if asked.borders else ():
        # Just off the border: a point on it lies on either side by rounding.
        ring = thing.buffer(_OFF_BORDER_M, join_style="mitre").exterior
        shares = np.arange(count := math.ceil(ring.length / pitch_m)) / count
        along.append(shapely.get_coordinates(shapely.line_interpolate_point(ring, shares, normalized=True)))
    if not along:
        return on_floor
    borders = np.concatenate(along)
    borders = borders[covers(site.open_floor, borders)]
    near_m = np.hypot(*np.moveaxis(borders[:, None] - on_floor, -1, 0)).min(axis=1, initial=np.inf)
    return np.concatenate([on_floor, borders[near_m > 2.0 * _OFF_BORDER_M]])


def places_of(asked: Asked) -> tuple[Place, ...]:
    """Return every place with its exact scores, the given one first."""
    scenario, given_m = asked.scenario, asked.settings.transponder_m
    places_m = lattice_m(asked)
    if given_m is not None:
        others_m = places_m[np.hypot(*(places_m - given_m).T) > _SAME_M]
        places_m = np.concatenate([[given_m], others_m])
    walls = site_walls(scenario.site, scenario.robot)
    clear_m = clearance_m(places_m, scenario.site, scenario.scatterers_m)
    return tuple(
        _place(asked, walls, (float(x_m), float(y_m)), float(clear), given=given_m is not None and number == 0)
        for number, ((x_m, y_m), clear) in enumerate(zip(places_m, clear_m, strict=True))
    )


def layout_at(settings: DockingSettings, xy_m: tuple[float, float]) -> Layout:
    """Return crossed antennas and a transponder at a place, without anything on the floor."""
    transponder = replace(settings, transponder_m=xy_m).transponder()
    assert transponder is not None
    return Layout(floor_tags=FloorTags(zones=()), readers=(settings.antennas(),), transponders=(transponder,))


def _clear(asked: Asked) -> BoolArray:
    """Return which places of the lattice keep the least clearance, shape (n,)."""
    scenario = asked.scenario
    clear_m = clearance_m(lattice_m(asked), scenario.site, scenario.scatterers_m)
    return np.asarray(clear_m >= asked.least_clearance_m - _SAME_M)


def _place(asked: Asked, walls: SiteWalls, xy_m: tuple[float, float], clear_m: float, *, given: bool) -> Place:
    scenario, layout = asked.scenario, layout_at(asked.settings, xy_m)
    scores: Scores = {}
    in_view = 0.0
    # A wave that comes from a scatterer's own place has no direction.
    if np.hypot(*(scenario.scatterers_m - xy_m).T).min(initial=np.inf) > _SAME_M:
        world, floor = asked.settings.world, scenario.site.open_floor
        found = direction_map(DockingGround(walls=walls, floor=floor, transponder_m=xy_m, world=world), scenario)
        scores, in_view = scores_of(found.error_rad), found.in_view
    refusal = ""
    if clear_m < asked.least_clearance_m - _SAME_M:
        refusal = TOO_NEAR
    elif walls.room.distance(shapely.Point(xy_m)) > asked.settings.world.stop_m:
        refusal = OUT_OF_REACH
    else:
        # A score that does not exist, because no wave is heard anywhere, keeps no limit.
        broken = [
            limit.score
            for limit in asked.exact_limits
            if limit.score not in scores or not limit.met(scores[limit.score])
        ]
        refusal = f"limit on the {score_name(broken[0])}" if broken else _not_docked_at(layout, scenario)
    return Place(
        xy_m=xy_m,
        layout=layout,
        clearance_m=clear_m,
        scores=scores,
        in_view=in_view,
        refusal=refusal,
        given=given,
    )


def _not_docked_at(layout: Layout, scenario: Scenario) -> str:
    """Return why no robot can dock at the transponder of a layout, or an empty string."""
    try:
        docking_ground(layout, scenario)
    except InvalidInput as error:
        return error.faults[0].problem
    return ""


def limited(limits: Sequence[Limit], scores: Scores) -> list[tuple[Limit, Score]]:
    """Return the limits with the scores that they speak of, as far as there are any."""
    return [(limit, scores[limit.score]) for limit in limits if limit.score in scores]


def _effort(trials: int, *, quick: bool) -> Effort:
    """Return rounds that double the drives of each place up to those of the spec."""
    if quick:
        trials = min(trials, _FIRST_DRIVES)
    levels = [min(_FIRST_DRIVES // (2 if quick else 1), trials)]
    while 2 * levels[-1] <= _LAST_STEP * trials:
        levels.append(2 * levels[-1])
    if levels[-1] < trials:
        levels.append(trials)
    return Effort(levels=tuple(levels), finalists=3 if quick else _FINALISTS, fresh=trials)
