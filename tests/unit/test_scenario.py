"""Scenarios: which worlds are refused, and with which words."""

import math

import pytest
from shapely.geometry import box

from layoutopt.robot import Drive, Robot
from layoutopt.scenario import Faults, Judgement, Role, Routes, Scenario
from layoutopt.site import Site

OUTLINE_M = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)]


def scenario(drive=Drive.DIFFERENTIAL, **fields):
    return Scenario(
        name="test",
        role=Role.DESIGN,
        site=Site(name="hall", floor=box(0, 0, 8, 5)),
        robot=Robot(outline_m=OUTLINE_M, drive=drive),
        **fields,
    )


@pytest.mark.parametrize("value", [-1e-9, math.nan, math.inf])
@pytest.mark.parametrize(
    ("kind", "name"),
    [
        *((Faults, name) for name in ("tag_placement_sigma_m", "read_edge_m", "direction_noise_rad")),
        *((Faults, name) for name in ("clock_error_s", "slips_per_m", "slip_sigma_m", "kidnapped_at_s")),
        *((Routes, name) for name in ("circle_radius_m", "centre_spread_m", "pause_s")),
        *((Judgement, name) for name in ("settle_s", "localised_within_m", "hold_s", "lost_beyond_m")),
        *((scenario, name) for name in ("start_sigma_m", "start_sigma_rad")),
    ],
)
def test_sizes_must_be_finite_and_not_negative(kind, name, value):
    """The message names the field and shows the value."""
    with pytest.raises(ValueError, match=rf"{name} of the .* must be zero or positive and finite, got"):
        kind(**{name: value})


@pytest.mark.parametrize("value", [-0.01, 1.01, math.nan, math.inf])
@pytest.mark.parametrize("name", ["dead_tag_share", "missed_read_share", "wrong_identity_share"])
def test_shares_lie_between_nought_and_one(name, value):
    """A share that is none is refused by name."""
    with pytest.raises(ValueError, match=rf"{name} must lie between 0 and 1"):
        Faults(**{name: value})


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("tag_offset_m", (0.0, math.nan), "tag_offset_m must be 2 finite numbers"),
        ("start_offset", (0.0, 0.0, math.inf), "start_offset must be 3 finite numbers"),
        ("start_offset", (0.0, 0.0), "start_offset must be 3 finite numbers"),
        ("antenna_height_error_m", math.nan, "antenna_height_error_m must be finite"),
    ],
)
def test_offsets_must_be_finite(field, value, said):
    """Offsets may have any sign, but have to be numbers."""
    with pytest.raises(ValueError, match=said):
        Faults(**{field: value})


@pytest.mark.parametrize("step_s", [0.0, -0.05, math.nan, math.inf])
def test_a_step_takes_time(step_s):
    """Time stands or runs away in no trial."""
    with pytest.raises(ValueError, match="positive, finite time step"):
        scenario(step_s=step_s)


def test_a_pause_needs_a_way_point():
    """Pauses on other routes, which have no way points, are refused."""
    for kind in ("patrol", "point_to_point", "circle"):
        with pytest.raises(ValueError, match="pauses are made at way points"):
            Routes(kind=kind, pause_s=1.0)


def test_random_routes_take_no_spread():
    """A patrol lies anywhere as it is."""
    for kind in ("patrol", "point_to_point"):
        with pytest.raises(ValueError, match="take no centre_spread_m"):
            Routes(kind=kind, centre_spread_m=0.1)


@pytest.mark.parametrize("kind", ["circle", "way_points", "patrol"])
def test_only_an_omnidirectional_robot_keeps_its_heading(kind):
    """A differential drive that is to keep a heading is refused with what would be right."""
    routes = Routes(kind=kind, heading_rad=0.5)
    with pytest.raises(ValueError, match=r"a differential drive looks where it goes.*give an omnidirectional"):
        scenario(routes=routes)
    assert scenario(Drive.OMNIDIRECTIONAL, routes=routes).routes.heading_rad == 0.5
    with pytest.raises(ValueError, match="heading_rad of the routes must be finite"):
        Routes(kind=kind, heading_rad=math.nan)


def test_an_unknown_start_is_not_told_wrongly():
    """An offset of a start that is never told is a mistake."""
    with pytest.raises(ValueError, match="leave out start_offset"):
        scenario(start_known=False, faults=Faults(start_offset=(0.1, 0.0, 0.0)))


@pytest.mark.parametrize(
    ("at_s", "steps"),
    [(None, None), (0.0, 0), (0.99, 10), (1.0, 10), (1.01, 11), (1.9, 19), (2.0, None), (9.0, None)],
)
def test_steps_before_a_kidnapping(at_s, steps):
    """The robot is lifted at the end of the step that holds the instant, unless the drive is over by then."""
    assert scenario(step_s=0.1, step_count=20, faults=Faults(kidnapped_at_s=at_s)).lifted_after == steps
