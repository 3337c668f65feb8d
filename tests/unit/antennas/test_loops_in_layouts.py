"""Layouts with loop antennas from a spec to drives: screened, built by the rules, and read by a filter."""

import math

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.antennas.biot_savart import BiotSavartAntenna
from layoutopt.detection import antennas_of
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.feasibility import check
from layoutopt.layout import FloorTags, Layout, ReaderProfile, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.ring import ring
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.simulation.trials import run_trials
from layoutopt.site import Site
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from solvers.exhaustive import screen

SPEC = """
[site]
floor = [[0, 0], [3, 0], [3, 2], [0, 2]]
[robots]
outline = [[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]]
[space]
antenna = "biot_savart"
antenna_side = ["40 mm", "60 mm"]
antennas_per_module = 4
readers = [{ family = "ring", count = 4, radius = "0.14 m" }]
patterns = [{ family = "square", pitch = "100 mm" }]
[goal]
limits = ["speed_limit >= 0.2 m/s"]
[study]
duration = "20 s"
validate_with = ["mcl"]
design_faults = { missed_read_share = "0 %" }
"""


@pytest.fixture
def problem(tmp_path):
    """Return the question of the spec above."""
    path = tmp_path / "loops.toml"
    path.write_text(SPEC, encoding="utf-8")
    return read_spec(path).problem()


def test_a_spec_with_loops_is_screened_and_driven(problem):
    """The slower antennas break the limit on speed; the others read what their discs promise, and localise."""
    by_side = {item.evaluated.layout.readers[0].antenna.side_m: item for item in screen(problem)}
    assert "speed_limit" in by_side[0.04].refusal
    assert by_side[0.06].refusal == ""
    layout, scores = by_side[0.06].evaluated.layout, by_side[0.06].evaluated.scores
    radius_m = BiotSavartAntenna(side_m=0.06).read_radius_m(0.02)
    assert antennas_of(layout, 0.05).radius_m == pytest.approx([radius_m] * 4)
    assert scores["speed_limit"].value == pytest.approx(math.pi * radius_m / 2.0 / 0.2)
    drives = {
        name: run_trials(layout, problem.design, estimator, Streams(seed=5), 0, 12)
        for name, estimator in (("mcl", MonteCarloLocalisation()), ("odometry", OdometryAlone()))
    }
    reads = drives["mcl"].score("reads_per_step")
    # Eleven degrees of freedom: Student's t exceeds 9.5 in either direction once in a million.
    assert abs(reads.value - scores["expected_reads_per_step"].value) < 9.5 * reads.standard_error
    assert reads.standard_error < 0.1 * reads.value
    error = {name: outcomes.score("position_error_mean").value for name, outcomes in drives.items()}
    assert error["mcl"] < 0.5 * error["odometry"]


def test_readers_of_one_tag_keep_clear_of_the_corners_of_the_outline():
    """Two tags within the outline collide, although one of them lies beyond the inscribed disc."""
    antenna = BiotSavartAntenna(side_m=0.06)
    corner_m = float(antenna.outline_m(0.02).max())
    assert corner_m > antenna.read_radius_m(0.02) + 0.005
    profile = ReaderProfile(name="one", scan_period_s=0.05, tags_per_scan="one")
    mount = Mount(antenna=antenna, height_m=0.02, profile=profile, antennas_per_module=1)
    scenario = Scenario(
        name="room",
        role=Role.DESIGN,
        site=Site(name="room", floor=box(0, 0, 3, 3)),
        robot=Robot(outline_m=np.array([(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)])),
    )
    need_m = 2.0 * corner_m + 0.02
    for pitch_m, rules in ((need_m + 1e-6, []), (need_m - 1e-4, ["one tag a scan"])):
        tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=pitch_m)),))
        layout = Layout(floor_tags=tags, readers=(ring(count=4, radius_m=0.2, mount=mount),))
        assert [violation.rule for violation in check(layout, scenario)] == rules
