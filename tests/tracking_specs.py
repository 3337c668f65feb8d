"""Specs of tracking in the room, with the robot and the walk of `tracking_cases`."""

from layoutopt.spec.reading import read_spec

TEXT = """
schema = 1
seed = 3
[site]
floor = [[-1,-3],[5,-3],[5,3],[-1,3]]
[robots]
outline = [["-0.2 m","-0.2 m"],["0.2 m","-0.2 m"],["0.2 m","0.2 m"],["-0.2 m","0.2 m"]]
[space]
antenna_side = "40 mm"
antenna_height = "20 mm"
antennas_per_module = 1
readers = [{ family = "ring", count = 4, radius = "0.15 m" }]
patterns = [{ family = "square", pitch = "200 mm" }]
[tracking]
fitted = false
robot_at = [0, 0, "0 deg"]
walk = [[1,-2],[3,-2],[3,2],[1,2]]
"""


def spec_of(folder, more="", text=TEXT):
    """Return the spec with more lines under tracking."""
    path = folder / "tracking.toml"
    path.write_text(text + more, encoding="utf-8")
    return read_spec(path)
