"""
Patterns and their blind directions
===================================

With few tags a robot may drive far without seeing one. How far depends on the direction, and that on the
pattern. Nothing is simulated here: the chances are exact.
"""

import math

import numpy as np

import layoutopt as lo
from layoutopt.plots.blind_rose import RoseCurve, draw_blind_rose
from layoutopt.plots.pattern_cells import PatternPicture, draw_patterns
from objectives.invisibility import blind_probability, corridors

TILE_M, RADIUS_M, RUN_M = 0.7, 0.1, 1.0  # read disc of one antenna; a run of a metre

patterns = {
    "square": lo.load("patterns", "square")(pitch_m=TILE_M / 2.0),
    "tilted by 13°": lo.load("patterns", "tilted")(tile_m=TILE_M, angle_rad=math.radians(13.0), radius_m=RADIUS_M),
    "Sudoku": lo.load("patterns", "sudoku")(tile_m=TILE_M, seed=1, radius_m=RADIUS_M, rule="diagonals"),
}

# %%
# All have four tags on a tile of 0.7 m. The discs are where one antenna reads the tag.

cells = draw_patterns(
    [PatternPicture(label=name, pattern=pattern, radius_m=RADIUS_M) for name, pattern in patterns.items()]
)

# %%
# A corridor is a strip that no disc enters: there a robot stays blind for ever.

direction_rad = np.linspace(0.0, 2.0 * math.pi, 360, endpoint=False)
curves = []
for name, pattern in patterns.items():
    chance = blind_probability(pattern, RADIUS_M, RUN_M, direction_rad)
    widest_m = max((found.width_m for found in corridors(pattern, RADIUS_M)), default=0.0)
    print(f"{name}: {chance.mean():.1%} of the runs of {RUN_M:g} m are blind, {chance.max():.1%} at worst;")
    print(f"    the widest corridor has {1000 * widest_m:.0f} mm")
    curves.append(RoseCurve(label=name, direction_rad=direction_rad, probability=chance))
rose = draw_blind_rose(curves)
