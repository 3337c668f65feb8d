"""Layouts and their parts in a few words, for tables and pictures."""

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from layoutopt.layout import Layout, ReaderGroup, TagPattern


def layout_label(layout: "Layout") -> str:
    """Return a line such as ``cross 8 × 60 mm, square 100 mm``; installed tags are counted in it."""
    readers = " + ".join(group_label(group) for group in layout.readers)
    tags = ", ".join(
        (f"{entry.zone}: " if entry.zone else "") + pattern_label(entry.pattern)
        for entry in layout.floor_tags.zones
    )
    lying = layout.floor_tags.installed
    installed = "" if lying is None else f", {len(lying.ids)} installed"
    return f"{readers}, {tags or 'no tags on the floor'}{installed}"


def group_label(group: "ReaderGroup") -> str:
    """Return words such as ``cross 8 × 60 mm``, ``UHF 2 at ±45°`` or ``docking``."""
    if group.kind == "direction":
        return "docking"
    if group.kind == "signal":
        yaws_deg = [round(math.degrees(yaw_rad), 1) for yaw_rad in group.poses[:, 3].tolist()]
        if len(yaws_deg) == 2 and yaws_deg[0] == -yaws_deg[1] != 0.0:
            return f"UHF 2 at ±{abs(yaws_deg[0]):g}°"
        return f"UHF {group.count} at {', '.join(f'{yaw_deg + 0.0:g}°' for yaw_deg in yaws_deg)}"
    of_module = f" ({group.antennas_per_module} a module)" if group.antennas_per_module > 1 else ""
    return f"{group.name} {group.count} × {group.antenna.side_m * 1000:g} mm{of_module}"


def pattern_label(pattern: "TagPattern") -> str:
    """Return a pattern's name, its size, and whatever else tells it from others of its family."""
    sizes, others = [], []
    for name, value in pattern.parameters.items():
        if name.endswith("_m"):
            sizes.append(f"{float(value) * 1000:g} mm")
        elif name.endswith("_rad"):
            others.append(f"{math.degrees(float(value)):.4g}°")
        elif name == "count":
            others.append(f"{value} tags")
        else:
            others.append(str(value) if isinstance(value, str) else f"{name} {value}")
    return " ".join([pattern.name, *sizes[: 0 if pattern.name == "listed" else 1], *others])
