"""
A map for docking
=================

A robot finds a transponder by the direction of its waves. What stands about scatters them. The maps show how
far the direction is off wherever the robot may be, for two places of the transponder. Nothing is simulated
here; the study ``transponder_placement`` lets robots drive.
"""

import numpy as np

from layoutopt.estimators.direction_of_arrival import direction_error
from layoutopt.plots.direction_maps import DirectionMap, draw_direction_maps

SIDE_M, CELL_M = 4.0, 0.05
REFLECTION, WAVELENGTH_M = 0.5, 299_792_458 / 303.2e6  # share of the amplitude sent on; wavelength at 303.2 MHz
scatterers_m = np.array([(1.1, 2.7), (2.9, 1.2), (2.6, 3.1)])

# %%
# Cells of 50 mm, counted from their middle.

middles_m = np.arange(CELL_M / 2.0, SIDE_M, CELL_M)
cells_m = np.stack(np.meshgrid(middles_m, middles_m), axis=-1)

maps = []
for transponder_m in ((0.51, 0.51), (2.01, 2.31)):
    found = direction_error(cells_m, transponder_m, scatterers_m, REFLECTION, WAVELENGTH_M)
    error_deg = np.degrees(np.abs(found.error_rad))
    print(
        f"transponder at {transponder_m} m: {error_deg.mean():.1f}° off on average, {error_deg.max():.0f}° at most"
    )
    maps.append(
        DirectionMap(
            title=f"transponder at {transponder_m} m",
            error_deg=error_deg,
            bounds_m=(0.0, 0.0, SIDE_M, SIDE_M),
            transponder_m=transponder_m,
            scatterers_m=scatterers_m,
        )
    )
figure = draw_direction_maps(maps, columns=2, limit_deg=45.0)
