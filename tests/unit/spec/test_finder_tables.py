"""The tables [tracking] and [docking]: read, defaulted, frozen and refused key by key."""

import math

import numpy as np
import pytest
import shapely
from spec_texts import HALL

from layoutopt.errors import InvalidInput
from layoutopt.prices import FINDER_ITEMS, ITEM_KEYS, default_prices
from layoutopt.spec import finder_schema
from layoutopt.spec.finders import DockingSettings, TrackingSettings
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in, template
from layoutopt.spec.writing import write_spec

TABLES = """
[tracking]
antennas = [3, 1]
yaw = { from = "0 deg", to = "60 deg", steps = 3 }
interval = ["200 ms", 0.4]
beam = "90 deg"
height = "70 cm"
tags = 12
robot_at = [2, "2500 mm", "-0.1 rad"]
walk = [[4, 1], [6.333, 1], ["6 m", 4]]
walking_speed = "1 km/h"
person_radius = "0.3 m"
bystanders = 2
clutter = 0
clutter_radius = "11 cm"
strength_at_1m_dbm = -50.5
path_exponent = 2.2
fading_db = 0.0
fading_correlation = 0.3
noise_db = 1.7
half_range = "5 m"
detection_width_db = 0.7
tag_offset_db = -4.0
phase_noise = "7 deg"
phase_bits = 10
channels = ["865.7 MHz", "0.9 GHz"]
dwell = "0.3 s"
laser_noise = "0.5 in"
laser_range = "12 m"
laser_step = "1 deg"
laser_field = "3 rad"
trials = 5
duration = "1.5 min"
[docking]
transponder = [7.9, "3.3 m"]
scatterers = [[1, 1], [2.2, 3.3]]
random_scatterers = 3
reflection = "65 %"
wall_reflection = 0.1
scatterer_radius = "12 cm"
blocks_wave = true
frequency = "0.3 GHz"
clearance = "0.4 m"
least_start = "1.5 m"
noise = "4 deg"
step = "0.3 m"
stop = "0.6 m"
steps = 25
detour = false
candidate_pitch = "0.7 m"
trials = 11
"""
WALL = "obstacles = [[[4, 0], [4.2, 0], [4.2, 5], [4, 5]]]\n"


def faults_of(read, text):
    """Return the faults of a spec as texts."""
    with pytest.raises(InvalidInput) as caught:
        read(text)
    return [str(fault) for fault in caught.value.faults]


def test_every_key_is_read_in_si(read):
    """Whatever the unit, and every key lands in the field that it is about."""
    spec = read(HALL + TABLES)
    tracking, docking = spec.tracking, spec.docking
    world, signal, laser = tracking.world, tracking.world.signal, tracking.world.laser
    assert (tracking.fitted, tracking.counts, tracking.intervals_s) == (True, (3, 1), (0.2, 0.4))
    assert tracking.yaws_rad == pytest.approx(np.radians([0, 30, 60]))
    assert (tracking.beam_rad, tracking.height_m) == (pytest.approx(math.pi / 2), pytest.approx(0.7))
    assert (tracking.target_tags, tracking.trials, tracking.duration_s) == (12, 5, 90.0)
    assert world.robot_pose == (2.0, 2.5, -0.1)
    assert world.walk_m.tolist() == [[4.0, 1.0], [6.333, 1.0], [6.0, 4.0]]
    assert world.walking_speed_m_s == pytest.approx(1 / 3.6)
    assert (world.person_radius_m, world.bystanders, world.clutter_count) == (0.3, 2, 0)
    assert world.clutter_radius_m == pytest.approx(0.11)
    assert (signal.strength_at_1m_dbm, signal.path_exponent) == (-50.5, 2.2)
    assert (signal.fading_sigma_db, signal.fading_correlation, signal.noise_sigma_db) == (0.0, 0.3, 1.7)
    assert (signal.half_range_m, signal.detection_width_db, signal.tag_offset_db) == (5.0, 0.7, -4.0)
    assert (signal.phase_sigma_rad, signal.phase_bits) == (pytest.approx(math.radians(7)), 10)
    assert (signal.channels_hz, signal.dwell_s) == ((865.7e6, 0.9e9), 0.3)
    assert (laser.range_sigma_m, laser.range_m, laser.field_rad) == (pytest.approx(0.0127), 12.0, 3.0)
    assert laser.step_rad == pytest.approx(math.radians(1))
    drives = docking.world
    assert docking.transponder_m == (7.9, 3.3)
    assert docking.scatterers_m.tolist() == [[1.0, 1.0], [2.2, 3.3]]
    assert (drives.random_scatterers, drives.reflection, drives.wall_reflection) == (3, 0.65, 0.1)
    assert (drives.scatterer_radius_m, drives.blocks_wave, drives.frequency_hz) == (0.12, True, 0.3e9)
    assert (drives.clearance_m, drives.least_start_m, drives.step_m, drives.stop_m) == (0.4, 1.5, 0.3, 0.6)
    assert (drives.steps, drives.detour, docking.candidate_pitch_m, docking.trials) == (25, False, 0.7, 11)
    assert docking.noise_rad == pytest.approx(math.radians(4))


@pytest.mark.parametrize("tables", [TABLES, "", TABLES.replace("[docking]", "[docking]\nfitted = false")])
def test_the_frozen_copy_reads_back_bit_for_bit(read, tmp_path, tables):
    """Also what nobody wrote: the copy says where robot and person were."""
    spec = read(HALL + tables)
    write_spec(spec, tmp_path / "frozen.toml")
    again = read_spec(tmp_path / "frozen.toml")
    assert again.tracking == spec.tracking
    assert again.docking == spec.docking
    assert again.space == spec.space
    assert again.tracking_scenario.key == spec.tracking_scenario.key
    assert again.docking_scenario.key == spec.docking_scenario.key
    assert "robot_at" in (tmp_path / "frozen.toml").read_text(encoding="utf-8")


def test_defaults_are_those_of_the_settings(read):
    """An empty table means what the settings mean, and that layouts carry it."""
    spec = read(HALL + "[tracking]\n[docking]\n")
    own = TrackingSettings(world=spec.tracking.world, fitted=True)
    assert spec.tracking == own
    assert spec.tracking.world.signal.key == type(own.world.signal)().key
    assert spec.docking == DockingSettings(fitted=True)
    for settings in (read(HALL).tracking, read(HALL).docking):
        assert not settings.fitted


@pytest.mark.parametrize(
    "floor",
    [
        HALL,
        HALL + WALL,
        "[site]\nfloor = [[0, 0], [12, 0], [12, 1.5], [0, 1.5]]\n",
        "[site]\nfloor = [[0, 0], [9, 0], [9, 2], [2, 2], [2, 9], [0, 9]]\n",
        built_in("hospital_ward").read_text(encoding="utf-8"),
    ],
    ids=["hall", "wall", "corridor", "angle", "ward"],
)
def test_the_default_walk_lies_ahead_of_the_robot_and_in_its_sight(read, floor):
    """On floors of any form: no wall between robot and walk, or within a person's radius, and room to stand."""
    spec = read(floor)
    world = spec.tracking.world
    robot = shapely.Point(world.robot_pose[:2])
    assert spec.tracking.lack == ""
    assert spec.site.robot_region(spec.robot.radius_m).covers(robot)
    sight = shapely.convex_hull(shapely.union(robot, shapely.MultiPoint(world.walk_m)))
    # Corners are rounded to a millimetre.
    assert spec.site.open_floor.covers(sight.buffer(world.person_radius_m - 0.002))
    ahead = (world.walk_m - world.robot_pose[:2]) @ [math.cos(world.robot_pose[2]), math.sin(world.robot_pose[2])]
    assert (ahead > spec.robot.radius_m + world.person_radius_m).all()


def test_the_robot_stands_in_the_middle_of_a_hall(read):
    """The largest circle of a square room is in its middle, and the paper's rectangle fits ahead."""
    world = read("[site]\nfloor = [[0, 0], [8, 0], [8, 8], [0, 8]]\n").tracking.world
    assert world.robot_pose == pytest.approx((4.0, 4.0, 0.0), abs=0.01)
    assert np.ptp(world.walk_m, axis=0) == pytest.approx((2.0, 4.0))
    assert world.walk_m[:, 0].min() == pytest.approx(5.0, abs=0.01)


def test_a_site_too_small_to_walk_on_is_read_without_a_table_only(read, tmp_path):
    """Who asks for tracking is told what is missing; who does not is left alone, and so is a frozen copy."""
    closet = "[site]\nfloor = [[0, 0], [1.2, 0], [1.2, 1.2], [0, 1.2]]\n"
    spec = read(closet)
    assert "no 0.5 m by 0.3 m of open floor" in spec.tracking.lack
    write_spec(spec, tmp_path / "frozen.toml")
    assert read_spec(tmp_path / "frozen.toml").tracking == spec.tracking
    (fault,) = faults_of(read, closet + "[tracking]\n")
    assert "spec.toml:3 tracking" in fault
    assert "Give robot_at and walk." in fault


def test_a_walk_alone_turns_the_robot_to_it(read):
    """The robot stands where it stands by default and looks at the middle of the walk."""
    x_m, y_m, heading_rad = read(HALL + "[tracking]\nwalk = [[6, 1], [6, 4]]\n").tracking.world.robot_pose
    assert heading_rad == pytest.approx(math.atan2(2.5 - y_m, 6.0 - x_m))


FAULTS = {
    "robot off the floor": ('[tracking]\nrobot_at = [9, 1, "0 deg"]', "tracking.robot_at", "off the floor"),
    "robot in a wall": ('[tracking]\nrobot_at = [4.1, 1, "0 deg"]', "tracking.robot_at", "in obstacle 1"),
    "robot at a wall": ('[tracking]\nrobot_at = [0.1, 1, "0 deg"]', "tracking.robot_at", "touches a wall"),
    "no pose": ("[tracking]\nrobot_at = [1, 1]", "tracking.robot_at", "x, y and heading"),
    "walk off the floor": ("[tracking]\nwalk = [[1, 1], [1, 6]]", "tracking.walk[1]", "off the floor"),
    "walk in a wall": ("[tracking]\nwalk = [[1, 1], [4.1, 1]]", "tracking.walk[1]", "in obstacle 1"),
    "walk through a wall": ("[tracking]\nwalk = [[1, 1], [6, 1]]", "tracking.walk[0]", "crosses an obstacle"),
    "walk of one place": ("[tracking]\nwalk = [[1, 1], [1, 1]]", "tracking.walk", "one place"),
    "walk of one corner": ("[tracking]\nwalk = [[1, 1]]", "tracking.walk", "at least 2 points"),
    "walk through the robot": (
        '[tracking]\nrobot_at = [2, 2, "0 deg"]\nwalk = [[1, 2], [3, 2]]',
        "tracking.walk",
        "of the middle of the robot",
    ),
    "no interval": ('[tracking]\ninterval = "0 s"', "tracking.interval", "more than 0 s"),
    "five antennas": ("[tracking]\nantennas = [2, 5]", "tracking.antennas", "1 to 4"),
    "yaw of three turns": ('[tracking]\nyaw = "1080 deg"', "tracking.yaw", "half a turn"),
    "short trial": ('[tracking]\nduration = "0.5 s"', "tracking.duration", "no two samples"),
    "channel of a phone": ('[tracking]\nchannels = ["2.4 GHz"]', "tracking.channels[0]", "860 to 960 MHz"),
    "channels without dwell": (
        '[tracking]\nchannels = ["920 MHz", "921 MHz"]',
        "tracking.channels",
        "stays on the first channel",
    ),
    "dwell on one channel": ('[tracking]\ndwell = "1 s"', "tracking.dwell", "only one channel"),
    "beams apart": ('[tracking]\nlaser_step = "2 deg"\nlaser_field = "1 deg"', "tracking.laser_step", "no two"),
    "beams without number": ('[tracking]\nlaser_step = "1e-6 deg"', "tracking.laser_step", "million ranges"),
    "samples without number": ('[tracking]\ninterval = "0.01 ms"', "tracking.laser_step", "shorten duration"),
    "misspelt": ('[tracking]\nwalkingspeed = "1 m/s"', "tracking.walkingspeed", "Did you mean 'walking_speed'"),
    "unknown tracker": ('[tracking]\nestimator = "uhf_lazer"', "tracking.estimator", "Did you mean 'uhf_laser'"),
    "tracker of robots": ('[tracking]\nestimator = "mcl"', "tracking.estimator", "under study.validate_with"),
    "tracker of bearings": (
        '[tracking]\nestimator = "bearing_filter"',
        "tracking.estimator",
        "under docking.estimator",
    ),
    "bearing of targets": ('[docking]\nestimator = "uhf_laser"', "docking.estimator", "under tracking.estimator"),
    "filter of targets": (
        '[study]\nvalidate_with = ["mcl", "uhf_laser"]',
        "study.validate_with[1]",
        "under tracking.estimator",
    ),
    "transponder off the floor": ("[docking]\ntransponder = [9, 1]", "docking.transponder", "off the floor"),
    "transponder in a wall": ("[docking]\ntransponder = [4.1, 1]", "docking.transponder", "in obstacle 1"),
    "transponder in a scatterer": (
        "[docking]\ntransponder = [1, 1]\nscatterers = [[1, 1.05]]",
        "docking.transponder",
        "within scatterers[0]",
    ),
    "scatterer off the floor": ("[docking]\nscatterers = [[1, 1], [-1, 1]]", "docking.scatterers[1]", "off the"),
    "no frequency": ('[docking]\nfrequency = "0 MHz"', "docking.frequency", "at least"),
    "hertz for megahertz": ("[docking]\nfrequency = 303.2", "docking.frequency", "at least"),
    "blocked by nothing": (
        '[docking]\nblocks_wave = true\nscatterer_radius = "0 m"',
        "docking.blocks_wave",
        "without a radius",
    ),
    "no room between": (
        '[docking]\nrandom_scatterers = 2\nclearance = "10 cm"',
        "docking.clearance",
        "beyond their own radius",
    ),
    "UHF below the robot": ('[space]\nantenna = "uhf_patch"', "space.antenna", "reads this way"),
    "goal of tracking": (
        '[goal]\nminimise = ["cost", "tracking_error_mean"]',
        "goal.minimise[1]",
        "antenna_yaw",
    ),
    "limit on a zone of tracking": ('[goal]\nlimits = ["a.alias_share <= 1 %"]', "goal.limits[0]", "no zone 'a'"),
}


@pytest.mark.parametrize(("text", "key", "said"), FAULTS.values(), ids=FAULTS)
def test_faults_are_told_at_their_key(read, text, key, said):
    """Where, what and what would be right."""
    faults = faults_of(read, HALL + WALL + text)
    assert any(f" {key} " in f"{fault} ".replace(":", " ") and said in fault for fault in faults), faults


@pytest.mark.parametrize(("dwell", "told"), [("0.4 s", True), ("0.5 s", False)])
def test_a_reader_that_hops_between_readings_is_told(read, dwell, told):
    """Its phases are of different channels; the default interval is 0.4 s."""
    spec = read(f'{HALL}[tracking]\nchannels = ["920 MHz", "921 MHz"]\ndwell = "{dwell}"\n')
    assert any("trackers go by strength" in note for note in spec.notes) is told


@pytest.mark.parametrize(("frequency", "told"), [("13.56 MHz", True), ("303.2 MHz", False)])
def test_a_robot_that_docks_in_the_near_field_is_told(read, frequency, told):
    """At 13.56 MHz it ends 3.52 m from the transponder, at 303.2 MHz at 157 mm, nearer than robots drive."""
    spec = read(f'{HALL}[docking]\nfrequency = "{frequency}"\n')
    notes = [note for note in spec.notes if "taken as far" in note]
    assert len(notes) == told
    assert all("3.519 m" in note for note in notes)


def test_all_faults_are_told_at_once(read):
    """Of both tables, whatever else is wrong."""
    texts = [FAULTS[name][0] for name in ("robot in a wall", "five antennas")]
    text = "\n".join([texts[0], texts[1].removeprefix("[tracking]\n"), FAULTS["transponder off the floor"][0]])
    assert len(faults_of(read, HALL + WALL + text + "\n[study]\nvalidate_with = ['mcll']")) == 4


def test_layouts_carry_what_the_tables_fit(read):
    """Behind the floor readers: the first choice of UHF antennas, crossed antennas, the transponder, the tags."""
    spec = read(HALL + TABLES)
    plain = read(HALL)
    off = read(
        HALL
        + TABLES.replace("[tracking]", "[tracking]\nfitted = false").replace(
            "[docking]", "[docking]\nfitted = false"
        )
    )
    keys = [layout.key for layout in plain.space.layouts()]
    assert [layout.key for layout in off.space.layouts()] == keys
    for layout, bare in zip(spec.space.layouts(), plain.space.layouts(), strict=True):
        assert [group.kind for group in layout.readers] == ["tag_read", "signal", "direction"]
        assert layout.readers_of("signal")[0].parameters["count"] == 3
        assert (layout.target_tags, layout.transponders[0].position_m[:2]) == (12, (7.9, 3.3))
        assert layout.floor_readers == bare.readers
    unit = [0.5] * len(spec.space.axes)
    assert spec.space.decode(unit).readers[1:] == spec.space.finders
    assert spec.space.decode(unit).label.startswith(plain.space.decode(unit).readers[0].label + " + UHF 3 at 0°")


def test_limits_on_tracking_and_docking_are_told_and_not_searched(read):
    """A floor search has no score for them; the problem says which study has."""
    limits = '[goal]\nlimits = ["tracking_error_mean <= 0.4 m", "lost_share <= 2 %", "docking_success >= 90 %"]\n'
    spec = read(HALL + limits)
    problem = spec.problem()
    assert [limit.score for limit in problem.limits] == ["lost_share"]
    assert [text.rpartition("(")[2] for text in problem.elsewhere] == [
        "layoutopt study antenna_yaw)",
        "layoutopt study transponder_placement)",
    ]
    assert len(spec.limits) == 3


def test_a_price_list_without_finders_serves_specs_without_them(tmp_path):
    """A list of before reads as it did, and is refused with the items it lacks where layouts need them."""
    items = [
        f'[items.{name}]\nprice = 1\nsource = "x"\n'
        + "".join(f'{key} = "1 min"\n' if key == "labour" else "" for key in keys)
        + ('spare = "0 %"\n' if "spare" in keys else "")
        + ('size = ["20 mm", "10 mm"]\n' if "size" in keys else "")
        + ('base_side = "60 mm"\n' if "base_side" in keys else "")
        for name, keys in ITEM_KEYS.items()
        if name not in FINDER_ITEMS
    ]
    (tmp_path / "own.toml").write_text('schema = 1\nname = "own"\ndate = "2025"\n' + "".join(items))
    path = tmp_path / "spec.toml"
    path.write_text(HALL + '[parts]\nprices = "own.toml"\n')
    spec = read_spec(path)
    assert set(spec.prices.items) == set(ITEM_KEYS) - set(FINDER_ITEMS)
    write_spec(spec, tmp_path / "frozen.toml")
    assert read_spec(tmp_path / "frozen.toml").prices.key == spec.prices.key
    path.write_text(HALL + '[parts]\nprices = "own.toml"\n[docking]\n')
    with pytest.raises(InvalidInput, match="has no direction_receiver, transponder") as caught:
        read_spec(path)
    assert "spec.toml:4 parts.prices" in str(caught.value)
    assert set(default_prices().items) == set(ITEM_KEYS)


@pytest.mark.parametrize("table", [finder_schema.TrackingTable, finder_schema.DockingTable])
def test_the_hybrid_example_shows_every_key(table):
    """In use or in a comment."""
    import re

    for key in table.model_fields:
        assert re.search(rf"^(# )?{key} = ", template("hybrid"), flags=re.MULTILINE), key
