"""
Where the error is
==================

A mean over a whole floor hides the places where a robot is lost. A map of local errors shows them, and says where
it does not know enough.
"""

import numpy as np

import layoutopt as lo
from layoutopt.plots.local_error import draw_local_error
from layoutopt.simulation.local_error import simulated_error_map

spec = lo.read_spec(lo.built_in("small_hall"))
scenario, estimator = spec.problem().held_out[0], lo.load("estimators", "mcl_adaptive")()

# %%
# Two layouts with the same antennas, a tag every 140 mm and every 280 mm:

mount = lo.Mount(antenna=lo.load("antennas", "sphere")(side_m=0.06), height_m=0.02, profile=spec.reader_profile)
ring = lo.load("readers", "ring")(count=3, radius_m=0.15, mount=mount)


def laid(pitch_m: float) -> lo.Layout:
    """Return the layout with tags in a square pattern of one pitch."""
    pattern = lo.load("patterns", "square")(pitch_m=pitch_m)
    return lo.Layout(floor_tags=lo.FloorTags(zones=(lo.ZonePattern(zone="", pattern=pattern),)), readers=(ring,))


# %%
# The same sixty drives for both, so that the maps differ by the tags alone:

streams = lo.Streams(seed=7)
maps = {
    pitch_m: simulated_error_map(laid(pitch_m), scenario, estimator, streams, 60, cell_m=0.5)
    for pitch_m in (0.14, 0.28)
}
for pitch_m, errors in maps.items():
    known = errors.certain
    print(
        f"every {1000.0 * pitch_m:g} mm: {known.sum()} of {(errors.drives > 0).sum()} cells are certain, "
        f"from {1000.0 * errors.mean_m[known].min():.1f} to {1000.0 * errors.mean_m[known].max():.1f} mm, "
        f"with a standard error of at most {1000.0 * np.max(errors.standard_error_m[known]):.1f} mm"
    )

# %%
# With a dense pattern:

dense = draw_local_error(site=spec.site, errors=maps[0.14], title="every 140 mm")

# %%
# With a sparse one the robot drives farther without a read. What it errs then differs from drive to drive, so
# fewer cells are certain.

sparse = draw_local_error(site=spec.site, errors=maps[0.28], title="every 280 mm")
