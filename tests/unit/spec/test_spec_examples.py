import dataclasses
import itertools
import re

import pytest
import shapely

from layoutopt import feasibility
from layoutopt.errors import UnknownName
from layoutopt.simulation.routes import reachable_region
from layoutopt.spec import schema
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in, example_names, template


@pytest.fixture(scope="module")
def ward():
    return read_spec(built_in("hospital_ward"))


def test_the_ward_is_a_ward(ward):
    """15 m by 8 m, a metal plate without tags, a dock with its own demand, and four robots."""
    assert ward.site.floor.area == 120.0
    assert ward.robot_count == 4
    assert [zone.name for zone in ward.site.zones if zone.metal] == ["sluice_plate"]
    assert ward.site.zone("dock").target_error_m == 0.01
    assert [note for note in ward.notes if not note.startswith("left out")] == []


def test_a_robot_can_go_from_any_room_to_any_other(ward):
    """The free floor is one piece that reaches into all six rooms, the robot bay and the nurse station."""
    region = reachable_region(ward.site, ward.robot)
    rooms = [
        (2.5, 6.5),
        (6.0, 6.5),
        (10.0, 6.5),
        (14.0, 6.5),
        (1.5, 1.0),
        (5.0, 1.5),
        (8.5, 1.5),
        (12.5, 1.5),
        (14.0, 4.0),
    ]
    assert all(region.covers(shapely.Point(room)) for room in rooms)
    assert ward.site.robot_region(ward.robot.radius_m).geom_type == "Polygon"


def test_hundreds_of_layouts_can_be_built(ward):
    """At least 500 layouts of the default space pass every rule of the commercial profile."""
    design = ward.design
    sample = list(itertools.islice(ward.space.layouts(), 0, None, 5))
    buildable = sum(not feasibility.check(layout, design) for layout in sample)
    assert 5 * buildable > 500
    assert {group.name for layout in sample for group in layout.readers} == {"cross", "ring", "grid"}


def test_no_wall_stands_in_a_door(ward):
    """Obstacles may touch, but none overlaps another by more than a corner: walls, beds and pillars are apart."""
    obstacles = ward.site.obstacles
    overlap = sum(one.intersection(two).area for one, two in itertools.combinations(obstacles, 2))
    assert overlap < 1e-9
    assert all(ward.site.floor.covers(obstacle) for obstacle in obstacles)


def test_every_example_reads_without_fault():
    """All files that come with layoutopt run as they are."""
    assert "hospital_ward" in example_names()
    for name in example_names():
        assert read_spec(built_in(name)).space.size > 0


@pytest.mark.parametrize(
    "table",
    [
        schema.SiteTable,
        schema.PlanTable,
        schema.LayersTable,
        schema.ScaleTable,
        schema.TilingTable,
        schema.ZoneTable,
        schema.RobotsTable,
        schema.OdometryTable,
        schema.GyroTable,
        schema.PartsTable,
        schema.ProfileTable,
        schema.SpaceTable,
        schema.GoalTable,
        schema.StudyTable,
        schema.StartTable,
        schema.StartOffsetTable,
        schema.HeldOutFaultsTable,
        schema.ToleranceTable,
    ],
)
def test_the_template_shows_every_key(table):
    """Every key of the grammar stands in the template, in use or in a comment, but for those of frozen copies."""
    of_frozen_copies = {"source", "price_list"}
    for key in set(table.model_fields) - of_frozen_copies:
        shown = re.search(rf"(^|[\s{{\[.]){key}(\s*=|\])", template(), flags=re.MULTILINE)
        assert shown, f"{table.__name__}.{key}"


def test_the_defaults_that_the_template_states_are_the_defaults(tmp_path):
    """Keys whose comment names no other default have the value shown when they are left out."""
    bare = tmp_path / "bare.toml"
    bare.write_text("[site]\nfloor = [[0, 0], [15, 0], [15, 8], [0, 8]]\n")
    spec = read_spec(bare)
    full = read_spec(built_in())
    assert spec.robot.key == full.robot.key
    assert spec.routes == full.routes
    assert spec.prices.key == full.prices.key
    assert spec.reader_part == full.reader_part
    assert spec.reader_profile == full.reader_profile
    assert spec.goals == full.goals
    for name in ("validate_with", "validation_trials", "step_s", "duration_s", "particles", "start_sigma_m",
                 "start_sigma_rad", "start_known", "design_faults", "held_out_faults", "tolerance",
                 "alternatives", "least_difference", "alternative_tolerance"):  # fmt: skip
        assert getattr(spec.study, name) == getattr(full.study, name), name
    assert spec.study.search_trials == 4000
    bare_demand = dataclasses.replace(full.placement.demands[0], without=())
    assert spec.placement == dataclasses.replace(full.placement, demands=(bare_demand,))


def test_unknown_examples_are_refused():
    """A misspelt example gets the nearest name."""
    with pytest.raises(UnknownName, match="Did you mean 'hospital_ward'"):
        template("hospital_word")
