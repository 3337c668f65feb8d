"""Tags out of reach: which they are by hand, and that no drive ever reads one."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.layout import EditKind, FloorTags, Layout, TagEdit, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.reach import OnlyInReach, in_reach
from layoutopt.readers.listed import listed
from layoutopt.readers.profiles import MI2016
from layoutopt.robot import Robot
from layoutopt.scenario import Judgement, Role, Routes, Scenario
from layoutopt.simulation.trials import record_trial
from layoutopt.site import Site
from layoutopt.streams import Streams

SITE = Site(name="room", floor=box(0, 0, 4, 3), obstacles=(box(1.8, 1.2, 2.2, 1.6),))
ROBOT = Robot(outline_m=np.array([(-0.3, -0.25), (0.3, -0.25), (0.3, 0.25), (-0.3, 0.25)]))
# At 24 mm an antenna of 60 mm reads within 30 mm; the farther of the two sits 0.2 m from the middle.
READERS = listed(
    points_m=[(0.2, 0.0), (-0.05, 0.1)],
    mount=Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.024, profile=MI2016),
)
LAYOUT = Layout(
    floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.05)),)), readers=(READERS,)
)
REACH_M = 0.23


def test_tags_are_in_reach_that_are_no_farther_than_it_from_where_the_robot_may_be():
    """By hand: the robot's centre keeps its radius from walls and the obstacle."""
    xy_m = LAYOUT.floor_tags.lay_on(SITE).xy_m
    radius_m = ROBOT.radius_m
    steps = np.linspace(0.0, 1.0, 801)
    x_m, y_m = np.meshgrid(4.0 * steps, 3.0 * steps)
    beside_m = np.maximum(np.maximum(1.8 - x_m, x_m - 2.2), 0.0), np.maximum(np.maximum(1.2 - y_m, y_m - 1.6), 0.0)
    clear = np.minimum(np.minimum(x_m, 4.0 - x_m), np.minimum(y_m, 3.0 - y_m)) >= radius_m
    clear &= np.hypot(*beside_m) >= radius_m
    places_m = np.stack([x_m[clear], y_m[clear]], axis=1)
    nearest_m, _ = cKDTree(places_m).query(xy_m)
    found = in_reach(LAYOUT, SITE, radius_m)
    assert found[nearest_m <= REACH_M].all()
    # The grid of places is 5 mm fine, and reaches are rounded up by at most two millimetres.
    assert not found[nearest_m > REACH_M + 0.008].any()
    assert 0.5 < found.mean() < 0.9


def test_no_drive_reads_a_tag_that_is_left_out():
    """On twenty drives over the whole pattern every tag that was read is among those kept."""
    scenario = Scenario(
        name="reach",
        role=Role.DESIGN,
        site=SITE,
        robot=ROBOT,
        routes=Routes(kind="point_to_point"),
        judgement=Judgement(settle_s=0.0),
        step_count=600,
    )
    kept = in_reach(LAYOUT, SITE, ROBOT.radius_m)
    read = set()
    for replication in range(20):
        record = record_trial(LAYOUT, scenario, MonteCarloLocalisation(particles=5), Streams(seed=1), replication)
        read |= set(record.observations.read_tag.tolist())
    assert len(read) > 500
    assert kept[sorted(read)].all()


def test_the_layout_keeps_its_other_tags_where_they_lay():
    """The same places without those out of reach, the same readers, and a label as before; twice is as once."""
    only = OnlyInReach(SITE, ROBOT.radius_m)
    layout = only(LAYOUT)
    kept = in_reach(LAYOUT, SITE, ROBOT.radius_m)
    before, after = LAYOUT.floor_tags.lay_on(SITE).xy_m, layout.floor_tags.lay_on(SITE).xy_m
    np.testing.assert_array_equal(
        np.sort(after.view("f8,f8"), axis=0), np.sort(before[kept].view("f8,f8"), axis=0)
    )
    assert layout.readers == LAYOUT.readers
    assert layout.label == LAYOUT.label
    assert only(layout).key == layout.key


def test_where_all_or_none_are_in_reach_the_layout_stays():
    """A robot as small as a point reaches everything; one that fits nowhere reaches nothing."""
    for radius_m in (0.0, 5.0):
        assert OnlyInReach(SITE, radius_m)(LAYOUT) is LAYOUT


def test_edited_tags_are_refused():
    """An edit names its tag by the place where the pattern put it."""
    edits = (TagEdit(kind=EditKind.DROPPED, from_m=(1.0, 1.0)),)
    with pytest.raises(ValueError, match="before they are edited"):
        OnlyInReach(SITE, ROBOT.radius_m)(replace(LAYOUT, floor_tags=replace(LAYOUT.floor_tags, edits=edits)))
