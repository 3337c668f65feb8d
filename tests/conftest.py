"""What many tests share: a tiny world whose answers are quick to have."""

from pathlib import Path

import pytest
from hypothesis import settings

# Examples are the same in every run, so that a failure can be had again; shared machines break any deadline.
settings.register_profile("layoutopt", derandomize=True, deadline=None)
settings.load_profile("layoutopt")

TINY = """
schema = 1
seed = 3
[site]
floor = [[0,0],[4,0],[4,3],[0,3]]
tiling = { size = "0.5 m" }
[[site.zone]]
name = "dock"
region = [[0,0],[1.5,0],[1.5,1.5],[0,1.5]]
target_error = "40 mm"
[[site.zone]]
name = "plate"
region = [[3,2],[4,2],[4,3],[3,3]]
metal = true
[robots]
count = 2
outline = [["-0.2 m","-0.2 m"],["0.2 m","-0.2 m"],["0.2 m","0.2 m"],["-0.2 m","0.2 m"]]
[space]
antenna_side = ["40 mm", "60 mm"]
antenna_height = "20 mm"
antennas_per_module = [1, 4]
readers = [{ family = "ring", count = 4, radius = "0.15 m" }]
patterns = [{ family = "square", pitch = { from = "100 mm", to = "300 mm", steps = 3 } }]
[goal]
target_error = "30 mm"
[study]
search_trials = 60
validation_trials = 40
duration = "15 s"
particles = 200
"""


LONG_TEST_S = 1800
"""A limit ends what hangs; on a machine that is busy with other work a long test may take many times as long."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give long tests their limit, unless they have one of their own."""
    for item in items:
        if item.get_closest_marker("long") and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(LONG_TEST_S))


@pytest.fixture(scope="session")
def tiny_text() -> str:
    """Return the text of the tiny spec."""
    return TINY


@pytest.fixture
def tiny_spec(tmp_path: Path) -> Path:
    """A spec of twelve layouts on twelve square metres that a study answers in seconds."""
    path = tmp_path / "tiny.toml"
    path.write_text(TINY, encoding="utf-8")
    return path
