"""From antenna positions to a reader group: which module and scan slot each antenna gets."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.layout import Parameters, ReaderGroup, ReaderProfile
from layoutopt.protocols import AntennaModel, Mount


@dataclass(frozen=True, slots=True, kw_only=True)
class MountBuilder:
    """Makes mounts of antennas like a given one, of any side; a value, so that equal spaces are equal."""

    antenna: AntennaModel
    profile: ReaderProfile

    def __call__(self, *, side_m: float, height_m: float, antennas_per_module: int = 1) -> Mount:
        """Return the mount of antennas of that side at that height."""
        # A model is a frozen value with a side, but its protocol cannot say that it is a dataclass.
        antenna: Any = self.antenna
        return Mount(
            antenna=replace(antenna, side_m=side_m),
            height_m=height_m,
            profile=self.profile,
            antennas_per_module=antennas_per_module,
        )


def mounted(name: str, xy_m: FloatArray, mount: Mount, parameters: Parameters) -> ReaderGroup:
    """Return the group of antennas at ``xy_m``, shape (n, 2), in ``base_link``, yaw zero.

    Raises
    ------
    ValueError
        If there is no antenna, or a multiplexer has more ports than there are antennas.
    """
    xy_m = np.asarray(xy_m, dtype=np.float64).reshape(-1, 2)
    if len(xy_m) == 0:
        raise ValueError("a reader group needs at least one antenna")
    poses = np.zeros((len(xy_m), 4))
    poses[:, :2] = xy_m
    poses[:, 2] = mount.height_m
    return ReaderGroup(
        name=name,
        poses=poses,
        antenna=mount.antenna,
        profile=mount.profile,
        slots=scan_slots(xy_m, mount.antennas_per_module),
        antennas_per_module=mount.antennas_per_module,
        parameters=parameters,
    )


def scan_slots(xy_m: FloatArray, antennas_per_module: int) -> tuple[int, ...]:
    """Return the scan slot of each antenna so that antennas of one slot lie far apart.

    Antennas of a slot are on at the same time and disturb each other. One after the other takes the slot,
    among those with a free module, whose nearest member is farthest away; ties go to the emptier, then the
    earlier slot.
    """
    modules = -(-len(xy_m) // antennas_per_module)
    members: list[list[int]] = [[] for _ in range(min(antennas_per_module, len(xy_m)))]
    slots = []
    for antenna, place in enumerate(xy_m):
        free = [slot for slot, inside in enumerate(members) if len(inside) < modules]
        nearest = {
            slot: min((float(np.linalg.norm(xy_m[other] - place)) for other in members[slot]), default=np.inf)
            for slot in free
        }
        slot = max(free, key=lambda slot: (round(nearest[slot], 9), -len(members[slot]), -slot))
        members[slot].append(antenna)
        slots.append(slot)
    return tuple(slots)
