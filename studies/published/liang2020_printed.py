"""The numbers that liang2020 prints: Tables 1 to 5, and what its text says of Fig. 6."""

from typing import Final

APPROACHES: Final = ("RSS", "velocity", "fused")
"""Signal strength alone, radial velocity matching alone, both: the columns of Table 1."""
SQUIGGLE: Final = "Squiggle"
"""The tag with which the sensor model was learned, and that of Tables 2 to 5."""
TABLE_1: Final = {
    "MiniWeb": (0.95, 0.41, 0.28),
    "Frog 3D": (0.92, 0.44, 0.31),
    "AD-680r6-P": (1.16, 0.40, 0.33),
    SQUIGGLE: (0.77, 0.41, 0.25),
    "DogBone": (0.89, 0.43, 0.32),
}
"""Mean error by tag and approach, m."""
TABLE_2: Final = {"right": 0.58, "left": 0.66, "both": 0.25}
"""Mean error by antenna, m."""
TABLE_3: Final = {1: 0.357, 4: 0.325, 9: 0.255, 13: 0.251, 100: 0.252}
"""Mean error by number K of matches, m."""
TABLE_4: Final = {10: 0.483, 50: 0.341, 100: 0.255, 200: 0.253}
"""Mean error by number N of particles, m."""
UPDATE_MS: Final = {10: 0.030, 50: 0.079, 100: 0.137, 200: 0.245}
"""Running time of one update by number of particles, ms (Table 4)."""
TABLE_5: Final = {0.02: 0.75, 0.2: 0.29, 0.4: 0.25, 0.6: 0.44}
"""Mean error by walking speed in m/s, m."""
FIGURE_6_RHO: Final = {0.001: 0.43, 0.05: 0.25, 0.5: None, 1.0: 0.37}
"""Mean error by ρ, m, where the text gives it."""
FIGURE_6_SIGMA: Final = (0.2, 0.7, 1.0, 2.0)
"""Values of σ that were tried; by the text 0.2 is worst and 1.0 best, and no error is given but that at 1.0."""
