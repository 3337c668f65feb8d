"""What is searched against the published layout: the reference, the space, and a search for each budget."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from layoutopt import registry
from layoutopt.errors import InvalidInput
from layoutopt.identity import content_key
from layoutopt.layout import Layout
from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Estimator
from layoutopt.reach import OnlyInReach
from layoutopt.readers.grid import grid
from layoutopt.readers.mounting import MountBuilder
from layoutopt.readers.ring import ring
from layoutopt.readers.two_rings import two_rings
from layoutopt.space import PATTERNS, READERS, DesignSpace, Family, Interval
from layoutopt.spec.building import Spec
from objectives.cost import Cost
from solvers.candidates import Candidates
from studies import references

OWN_FILTER: Final = "mcl"
"""The filter of the paper."""
BEST_FILTER: Final = "mcl_adaptive"
"""The best of the estimators that a robot can run; see docs/estimators.md."""
FILTERS: Final = (OWN_FILTER, BEST_FILTER)
GOALS: Final = ("cost", "position_error_mean")
REFERENCE: Final = "8 readers, 100 tags/m²"
_SIDE_M: Final = (0.040, 0.080)
"""Up to the largest antenna for which the model is calibrated."""
_HEIGHT_M: Final = (0.005, 0.060)
"""HF antennas hang that high; an antenna of 80 mm reads from up to 77 mm, but from there only a spot."""
_PITCH_M: Final = (0.07, 0.50)
_PITCH: Final = (PATTERNS, "", "pitch_m")
_PORTS: Final = (1, 2, 4, 8)
_WIDEST_AT_M: Final = 0.0369
"""Height at which the disc of an antenna of 80 mm is widest."""
_START_RINGS: Final = ((1, 5), (2, 6), (3, 8), (4, 10), (4, 13), (5, 13), (1, 13), (8, 13))
"""Antennas of the inner and the outer ring; 13 of 80 mm are as many as find room on a circle of 210 mm."""
_SMALL_START_RINGS: Final = ((1, 3), (1, 4))
_FEW_STARTS: Final = 3
_HALVINGS: Final = 9
"""To the five-hundredth of the range of the pitch: a millimetre."""


def reference_layout(spec: Spec) -> Layout:
    """Return the eight readers of the paper over 100 tags/m², as published, with the tag that the spec lays."""
    layout = dict(references.layouts(spec.space))[REFERENCE]
    floor_tags = replace(layout.floor_tags, tag_part=spec.space.tag_part, tag_size_m=spec.space.tag_size_m)
    return replace(layout, floor_tags=floor_tags)


def cost_of(spec: Spec) -> Cost:
    """Return the objective that prices layouts for the spec's fleet."""
    return Cost(prices=spec.prices, robot_count=spec.robot_count, reader_part=spec.reader_part)


def search_space(spec: Spec) -> DesignSpace:
    """Return the space of the spec if it has an interval, else one of rings and grids over lattices.

    Rings, two rings and grids of antennas, as wide as the robot allows; side and height of the antennas; square
    and triangular patterns of any pitch and row gap. Readers that disturb each other may share a module.

    Raises
    ------
    InvalidInput
        If sides are to be varied of antennas that were measured and so have no other side.
    """
    if any(axis.continuous for axis in spec.space.axes):
        return spec.space
    if not math.isfinite(spec.mounts[0][0].antenna.card.valid_side_m[1]):
        raise InvalidInput.at(
            "space.antenna",
            "this study varies the side of the antennas, and a measured one has no other side",
            'Write antenna = "biot_savart" or "sphere", or give a range to a value of [space] such as the pitch.',
        )
    profile = spec.reader_profile
    alone = profile.simultaneous_spacing_sides <= profile.spacing_sides
    room_m = spec.robot.inner_radius_m - _SIDE_M[0] / 2.0
    mount = Family(
        name="mount",
        build=MountBuilder(antenna=spec.mounts[0][0].antenna, profile=profile),
        values={
            "side_m": Interval(low=_SIDE_M[0], high=_SIDE_M[1]),
            "height_m": Interval(low=_HEIGHT_M[0], high=_HEIGHT_M[1]),
            "antennas_per_module": (1,) if alone else _PORTS,
        },
    )
    readers = (
        Family(
            name="two_rings",
            build=two_rings,
            values={
                "inner_count": tuple(range(1, 9)),
                "inner_radius_m": Interval(low=0.15 * room_m, high=0.7 * room_m),
                "outer_count": tuple(range(3, 21)),
                "outer_radius_m": Interval(low=0.5 * room_m, high=room_m),
                "phase": Interval(low=0.0, high=1.0),
                "mount": mount,
            },
        ),
        Family(
            name="ring",
            build=ring,
            values={
                "count": tuple(range(3, 17)),
                "radius_m": Interval(low=0.4 * room_m, high=room_m),
                "mount": mount,
            },
        ),
        Family(
            name="grid",
            build=grid,
            values={
                "rows": tuple(range(2, 7)),
                "columns": tuple(range(2, 8)),
                "spacing_m": Interval(low=_SIDE_M[0], high=0.25),
                "mount": mount,
            },
        ),
    )
    pitch = Interval(low=_PITCH_M[0], high=_PITCH_M[1])
    patterns = (
        Family(name="square", build=registry.load("patterns", "square"), values={"pitch_m": pitch}),
        Family(
            name="triangular",
            build=registry.load("patterns", "triangular"),
            values={"pitch_m": pitch, "row_gap_m": pitch},
        ),
    )
    return replace(spec.space, readers=readers, patterns={"": patterns})


def base_problem(spec: Spec) -> Problem:
    """Return the question of the spec with the paper's filter and the best one, its limits left out.

    Tags that no antenna can come near enough to read are left out of every layout of the space; the published one
    stays as it was published.
    """
    filters = replace(spec.study, validate_with=FILTERS)
    problem = replace(spec, study=filters).problem()
    finish = OnlyInReach(spec.site, spec.robot.radius_m)
    return replace(problem, space=replace(search_space(spec), finish=finish), goals=GOALS, limits=())


def start_points(candidates: Candidates, most: int) -> tuple[tuple[float, ...], ...]:
    """Return points with which a search begins: two rings of the widest discs, at the pitch that the budget buys.

    A wide disc crosses the most tags on its way, and two rings fill the room under the robot; what is left of the
    budget goes into tags. Where readers are so dear that few of these are to be had, smaller ones are added. Of
    many such points ``most`` are taken, evenly. A space without such rings and pitches has none.
    """
    if candidates.problem.space.readers[0].name != "two_rings" or _PITCH not in _places(candidates):
        return ()
    found = _begun(candidates, _START_RINGS)
    if len(found) < _FEW_STARTS:
        found += _begun(candidates, _SMALL_START_RINGS)
    return tuple(found[:: max(1, -(-len(found) // most))])


def _places(candidates: Candidates) -> dict[tuple[str, str, str], int]:
    return {(axis.part, axis.zone, axis.name): number for number, axis in enumerate(candidates.axes)}


def _begun(candidates: Candidates, pairs: Iterable[tuple[int, int]]) -> list[tuple[float, ...]]:
    """Return the points of pairs of rings, with every number of antennas a module, that the budget buys."""
    places = _places(candidates)
    space = candidates.problem.space
    rings = space.readers[0]
    ports = rings.free.get("mount.antennas_per_module")
    choices = len(ports) if isinstance(ports, tuple) else 1
    found = []
    for inner, outer in pairs:
        for number in range(choices):
            point = np.zeros(len(places))
            wanted = {
                "inner_count": _share(rings, "inner_count", inner),
                "inner_radius_m": 0.5,
                "outer_count": _share(rings, "outer_count", outer),
                "outer_radius_m": _share(rings, "outer_radius_m", _outer_radius_m(space)),
                "phase": 0.5,
                "mount.side_m": 1.0,
                "mount.height_m": _share(rings, "mount.height_m", _WIDEST_AT_M),
                "mount.antennas_per_module": (number + 0.5) / choices,
            }
            for name, share in wanted.items():
                if (READERS, "", name) in places:
                    point[places[READERS, "", name]] = share
            low, high = 0.0, 1.0
            for _ in range(_HALVINGS):
                middle = (low + high) / 2.0
                point[places[_PITCH]] = middle
                low, high = (low, middle) if candidates.at(point).penalty is None else (middle, high)
            point[places[_PITCH]] = high
            if candidates.at(point).penalty is None:
                found.append(tuple(float(value) for value in point))
    return found


def _share(family: Family[Any], name: str, value: float) -> float:
    """Return where a value lies in the range or list of a parameter, as a share."""
    values = family.free.get(name)
    if isinstance(values, Interval):
        return min(max((value - values.low) / (values.high - values.low), 0.0), 1.0)
    return 0.0 if values is None else (values.index(value) + 0.5) / len(values)


def _outer_radius_m(space: DesignSpace) -> float:
    """Return the radius of a ring that has room under the robot with the largest antennas."""
    radius = space.readers[0].values["outer_radius_m"]
    return float(radius.high) - (_SIDE_M[1] - _SIDE_M[0]) / 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """One search: the smallest error of a filter for at most a share of what the reference costs."""

    share: float
    estimator: Estimator
    problem: Problem

    @property
    def place(self) -> tuple[str, float]:
        """Filter and share."""
        return self.estimator.name, self.share


def searches(problem: Problem, reference_cost_eur: float, shares: Sequence[float]) -> tuple[Search, ...]:
    """Return a search for each filter and each share of the reference's cost."""
    return tuple(
        Search(
            share=share,
            estimator=estimator,
            problem=replace(
                problem,
                limits=(Limit(score="cost", upper=share * reference_cost_eur),),
                estimators=(estimator,),
            ),
        )
        for estimator in problem.estimators
        for share in shares
    )


def space_key(space: DesignSpace) -> str:
    """Return a key of the coordinates of a space and of its first layout: which functions, ranges and antennas."""
    choices: list[tuple[str, tuple[Family[Any], ...]]] = [("readers", space.readers), *space.patterns.items()]
    families = [
        (zone, family.name, family.free, family.option(0).key) for zone, found in choices for family in found
    ]
    return content_key(
        families, space.finish, space.tag_part, space.tag_size_m, space.origin_m, space.placement_sigma_m
    )
