"""Texts of specs that several tests read."""

HALL = "[site]\nfloor = [[0, 0], [8, 0], [8, 5], [0, 5]]\n"
ZONES = (
    '[[site.zone]]\nname = "dock"\nregion = [[0, 0], [2, 0], [2, 2]]\ntarget_error = "5 mm"\n'
    '[[site.zone]]\nname = "plain"\nregion = [[4, 0], [6, 0], [6, 2]]\n'
)
FULL = """
schema = 1
seed = 11
[site]
name = "hall"
floor = [["0 m", 0], ["800 cm", 0], [8, 5], [0, 5]]
obstacles = [[[3, 2], [3.2, 2], [3.2, 2.2], [3, 2.2]]]
tiling = { size = "0.5 m", origin = [0.1, 0], angle = "30 deg" }
[[site.zone]]
name = "dock"
region = [[0, 0], [2, 0], [2, 2], [0, 2]]
target_error = "10 mm"
[[site.zone]]
name = "plate"
region = [[5, 0], [6, 0], [6, 1], [5, 1]]
metal = true
[robots]
count = 4
drive = "omnidirectional"
outline = [["-0.3 m", "-0.3 m"], ["0.3 m", "-0.3 m"], ["0.3 m", "0.3 m"], ["-0.3 m", "0.3 m"]]
speed = "0.5 m/s"
gyro = { random_walk_after_1s = "0.02 deg", bias = "0.001 rad/s", fitted = true }
pause = "20 s"
heading = "90 deg"
routes = [[1, 1], [4, 4]]
[robots.odometry]
translation = "3 %"
rotation = "2 deg/m"
lateral = "1 %"
half_track = "150 mm"
translation_after_1s = "7 mm"
rotation_after_1s = "0.05 rad"
[parts]
prices = "default-2026"
tag = "disc"
reader = "industrial_reader"
reader_profile = { name = "cheap", scan_period = "40 ms", tags_per_scan = "one", spacing_sides = 1.2 }
[space]
antenna = { model = "sphere" }
antenna_side = ["30 mm", "60 mm"]
antenna_height = ["15 mm", "20 mm"]
antennas_per_module = [1, 2, 8]
origin = [0.05, 0]
placement_sigma = "2 mm"
readers = [{ family = "cross", count = [4, 8], spacing = "50 mm" }, { family = "mi2016_8" }]
patterns = [
    { family = "square", pitch = { from = "60 mm", to = "300 mm", steps = 9 } },
    { family = "triangular", pitch = 0.1, row_gap = ["80 mm", "100 mm"] },
    { family = "square", pitch = "50 mm", zone = "dock" },
]
[goal]
minimise = ["cost", "position_error_p95"]
limits = ["heading_error_p95 <= 5 deg", "dock.position_error_max <= 30 mm", "lost_share <= 2 %", "nees <= 2.5"]
target_error = "15 mm"
budget = "5000 EUR"
[study]
search_trials = 100
validate_with = ["mcl", "odometry", "midrange"]
validation_trials = 20
step = "25 ms"
duration = "30 s"
start_uncertainty = { position = "20 mm", heading = "2 deg" }
particles = 64
held_out_faults = { tag_offset = ["5 mm", 0], slips_per_m = 0.5, slip_sigma = "10 mm", asynchronous = true }
[study.design_faults]
dead_tag_share = "5 %"
kidnapped_at = "12 s"
start_offset = { x = "165 mm", heading = "1.5 rad" }
"""
