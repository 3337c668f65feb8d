"""What robots and waves meet on the way to a transponder: walls and scatterers.

A `DockingGround` tells how far robots get and what waves arrive. Two kinds of walls stand behind it: those of a
rectangular room, in closed form, and those of any site, by ray casting. Rectangles are the same in both but for
rounding.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from layoutopt.docking_world import DockingWorld
from layoutopt.estimators.direction_of_arrival import direction_error
from layoutopt.geometry import Bounds, covers
from layoutopt.identity import BoolArray, FloatArray
from layoutopt.robot import Robot
from layoutopt.simulation.ray_casting import cast, visible, walls_of
from layoutopt.simulation.routes import free_space
from layoutopt.site import Site

if TYPE_CHECKING:
    from shapely.geometry import Polygon
    from shapely.geometry.base import BaseGeometry

CLEAR_M: Final = 1e-6
"""What a stopped robot keeps from what stopped it, so that rounding does not put it inside."""
_NO_DISCS: Final = np.zeros((0, 3))


class Walls(Protocol):
    """What walls do to robots and waves."""

    def free_m(self, places_m: FloatArray, headings_rad: FloatArray, most_m: float) -> FloatArray:
        """Return how far robots get before a wall, ``most_m`` at most, shape (n,), m."""
        ...

    def seen(self, from_m: FloatArray, to_m: FloatArray) -> BoolArray:
        """Return between which places, shape (n, 2), no wall stands, shape (n,)."""
        ...

    def images(
        self, source_m: FloatArray, places_m: FloatArray, *, blocked: bool
    ) -> tuple[FloatArray, FloatArray]:
        """Return mirror images of a source in the walls, and at which places each is seen.

        Shapes are (w, 2), m, and (n, w), 1 for seen and 0 for not; ``blocked`` whether walls hide images.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class RectangleWalls:
    """The four walls of a room, by x and y of its lower left and upper right corner, m."""

    bounds_m: Bounds

    def free_m(self, places_m: FloatArray, headings_rad: FloatArray, most_m: float) -> FloatArray:
        """Return how far robots get before a wall, ``most_m`` at most, shape (n,), m."""
        unit = np.stack([np.cos(headings_rad), np.sin(headings_rad)], axis=1)
        wall = np.where(unit > 0.0, np.array(self.bounds_m[2:]), np.array(self.bounds_m[:2]))
        to_wall = np.divide(wall - places_m, unit, out=np.full_like(unit, np.inf), where=np.abs(unit) > CLEAR_M)
        return np.asarray(np.minimum(most_m, to_wall.min(axis=1) - CLEAR_M))

    def seen(self, from_m: FloatArray, to_m: FloatArray) -> BoolArray:
        """Return that all places of a room see each other."""
        return np.ones(len(from_m), dtype=np.bool_)

    def images(
        self, source_m: FloatArray, places_m: FloatArray, *, blocked: bool
    ) -> tuple[FloatArray, FloatArray]:
        """Return the images in the four walls, which are seen everywhere; nothing in a room hides them."""
        x, y = source_m
        left, low, right, high = self.bounds_m
        images_m = np.array([[2 * left - x, y], [2 * right - x, y], [x, 2 * low - y], [x, 2 * high - y]])
        return images_m, np.ones((len(places_m), 4))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SiteWalls:
    """The walls of a site.

    Attributes
    ----------
    room, room_walls_m
        Where a robot's centre can be, and the walls of that: x and y of start and end, shape (r, 4), m.
    walls_m
        What waves meet: x and y of start and end, shape (s, 4), m, as `ray_casting.walls_of` gives them.
    """

    room: "Polygon"
    room_walls_m: FloatArray
    walls_m: FloatArray

    def free_m(self, places_m: FloatArray, headings_rad: FloatArray, most_m: float) -> FloatArray:
        """Return how far robots get before a wall, ``most_m`` at most, shape (n,), m."""
        away_m = cast(places_m, headings_rad, self.room_walls_m, _NO_DISCS, most_m + CLEAR_M)
        free_m = np.minimum(most_m, away_m - CLEAR_M)
        unit = np.stack([np.cos(headings_rad), np.sin(headings_rad)], axis=1)
        # A robot that glides along a wall must not leave the room by rounding.
        stays = covers(self.room, places_m + free_m[:, None] * unit)
        return np.where(stays, np.maximum(free_m, 0.0), 0.0)

    def seen(self, from_m: FloatArray, to_m: FloatArray) -> BoolArray:
        """Return between which places, shape (n, 2), no wall stands, shape (n,)."""
        return visible(from_m, to_m, self.walls_m, _NO_DISCS)

    def images(
        self, source_m: FloatArray, places_m: FloatArray, *, blocked: bool
    ) -> tuple[FloatArray, FloatArray]:
        """Return the images in all walls; one is seen where the straight line to it meets its own wall."""
        start, along = self.walls_m[:, :2], self.walls_m[:, 2:] - self.walls_m[:, :2]
        along = along / np.hypot(along[:, 0], along[:, 1])[:, None]
        aside = np.stack([-along[:, 1], along[:, 0]], axis=1)
        off_m = ((source_m - start) * aside).sum(axis=1)
        # A transponder on a wall has no image in it.
        mirrors = np.abs(off_m) > CLEAR_M
        start, along, aside, off_m = start[mirrors], along[mirrors], aside[mirrors], off_m[mirrors]
        length_m = np.hypot(*(self.walls_m[mirrors, 2:] - start).T)
        images_m = source_m - 2.0 * off_m[:, None] * aside
        place_off_m = ((places_m[:, None] - start) * aside).sum(axis=2)
        same_side = place_off_m * off_m > 0.0
        # Where the line from place to image, which lies as far behind the wall as the source before it, meets it.
        share = np.divide(place_off_m, place_off_m + off_m, out=np.zeros_like(place_off_m), where=same_side)
        met_m = places_m[:, None] + share[..., None] * (images_m - places_m[:, None])
        along_m = ((met_m - start) * along).sum(axis=2)
        seen = same_side & (along_m >= 0.0) & (along_m <= length_m)
        if blocked:
            place, image = np.nonzero(seen)
            touched = met_m[place, image]
            seen[place, image] = self.seen(places_m[place], touched) & self.seen(
                touched, np.broadcast_to(source_m, touched.shape)
            )
        return images_m, seen.astype(np.float64)


def site_walls(site: Site, robot: Robot) -> SiteWalls:
    """Return the walls of a site as they are for a robot, whose centre keeps the room that routes keep.

    Raises
    ------
    InvalidInput
        If the robot fits nowhere.
    """
    room = free_space(site, robot.radius_m).region
    return SiteWalls(
        room=room, room_walls_m=walls_of(Site(name="room of a robot", floor=room)), walls_m=walls_of(site)
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrivals:
    """What waves arrive at places.

    Attributes
    ----------
    heard
        Whether any wave arrives, shape (n,).
    error_rad, amplitude_ratio
        As `direction_of_arrival.DirectionError` has them, shape (n,); zero and one where nothing is heard.
    """

    heard: BoolArray
    error_rad: FloatArray
    amplitude_ratio: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DockingGround:
    """Walls, a transponder among them, and how things are met.

    Attributes
    ----------
    floor
        Where a transponder may be, as estimators are told.
    """

    walls: Walls
    floor: "BaseGeometry"
    transponder_m: tuple[float, float]
    world: DockingWorld

    def free_way_m(self, scatterers_m: FloatArray, places_m: FloatArray, headings_rad: FloatArray) -> FloatArray:
        """Return how far each robot gets on its heading in one step, shape (n,), m.

        Parameters
        ----------
        scatterers_m
            Middles of each robot's scatterers, shape (n, k, 2), m.
        places_m, headings_rad
            Where the robots stand, shape (n, 2), m, and face, shape (n,), rad.
        """
        free_m = self.walls.free_m(places_m, headings_rad, self.world.step_m)
        radius_m = self.world.scatterer_radius_m
        if radius_m > 0.0 and scatterers_m.shape[-2]:
            unit = np.stack([np.cos(headings_rad), np.sin(headings_rad)], axis=1)
            to_middle = scatterers_m - places_m[:, None, :]
            ahead_m = (to_middle * unit[:, None, :]).sum(axis=2)
            aside_m2 = (to_middle**2).sum(axis=2) - ahead_m**2
            within_m2 = radius_m**2 - aside_m2
            meets = (ahead_m > 0.0) & (within_m2 > 0.0)
            contact_m = np.where(meets, ahead_m - np.sqrt(np.maximum(within_m2, 0.0)) - CLEAR_M, np.inf)
            free_m = np.minimum(free_m, contact_m.min(axis=1))
        # A robot that touches something stands; what rounding leaves of its way is no move.
        return np.asarray(np.where(free_m < CLEAR_M, 0.0, free_m))

    def direct_share(self, scatterers_m: FloatArray, places_m: FloatArray) -> FloatArray:
        """Return the share of the direct wave that arrives, shape (n,): none through what blocks it, else all.

        Scatterers are those of each place, shape (n, k, 2), or of all of them, (k, 2).
        """
        share = np.ones(len(places_m))
        if not self.world.blocks_wave:
            return share
        transponder = np.array(self.transponder_m)
        share[~self.walls.seen(places_m, np.broadcast_to(transponder, places_m.shape))] = 0.0
        if scatterers_m.shape[-2]:
            line = transponder - places_m
            to_middle = scatterers_m - places_m[:, None, :]
            along = np.clip((to_middle * line[:, None, :]).sum(axis=2) / (line**2).sum(axis=1)[:, None], 0.0, 1.0)
            aside = to_middle - along[:, :, None] * line[:, None, :]
            hidden = (np.hypot(aside[..., 0], aside[..., 1]) < self.world.scatterer_radius_m).any(axis=1)
            share[hidden] = 0.0
        return share

    def arrivals(self, scatterers_m: FloatArray, places_m: FloatArray) -> Arrivals:
        """Return what waves arrive at places, shape (n, 2), m; scatterers as in `direct_share`.

        Scattered waves and images in walls are lost behind walls as the direct one is, if walls block.

        Raises
        ------
        ValueError
            If a place is that of the transponder or of a scatterer.
        """
        world, transponder = self.world, np.array(self.transponder_m)
        direct = self.direct_share(scatterers_m, places_m)
        sent_on = world.reflection * self._scattered(scatterers_m, places_m)
        images_m, mirrored = np.zeros((0, 2)), np.zeros((len(places_m), 0))
        if world.wall_reflection > 0.0:
            images_m, seen = self.walls.images(transponder, places_m, blocked=world.blocks_wave)
            mirrored = world.wall_reflection * seen
        heard = (direct > 0.0) | (sent_on > 0.0).any(axis=1) | (mirrored > 0.0).any(axis=1)
        error_rad, amplitude_ratio = np.zeros(len(places_m)), np.ones(len(places_m))
        if heard.any():
            found = direction_error(
                places_m[heard],
                transponder,
                scatterers_m[heard] if scatterers_m.ndim == 3 else scatterers_m,
                sent_on[heard],
                world.wavelength_m,
                images_m=images_m,
                image_reflection=mirrored[heard],
                direct=direct[heard],
            )
            error_rad[heard], amplitude_ratio[heard] = found.error_rad, found.amplitude_ratio
        return Arrivals(heard=heard, error_rad=error_rad, amplitude_ratio=amplitude_ratio)

    def _scattered(self, scatterers_m: FloatArray, places_m: FloatArray) -> FloatArray:
        """Return which scatterers both transponder and place see, shape (n, k), as ones and zeros."""
        shape = (len(places_m), scatterers_m.shape[-2])
        if not self.world.blocks_wave or not shape[1]:
            return np.ones(shape)
        each = scatterers_m.reshape(-1, 2)
        lit = self.walls.seen(each, np.broadcast_to(np.array(self.transponder_m), each.shape))
        seen = np.broadcast_to(lit.reshape(scatterers_m.shape[:-1]), shape).copy()
        place, number = np.nonzero(seen)
        seen[place, number] = self.walls.seen(
            places_m[place], np.broadcast_to(scatterers_m, (*shape, 2))[place, number]
        )
        return seen.astype(np.float64)
