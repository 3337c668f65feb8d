"""Small pictures of undersides are to scale, and places in the SVG of a figure are where matplotlib draws them."""

import math
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from made_findings import findings_of, layout_of

from layoutopt.antennas.crossed_loops import CrossedLoops
from layoutopt.antennas.uhf_patch import UhfPatch
from layoutopt.layout import Transponder
from layoutopt.plots.figures import as_svg, new_axes, save, svg_frame
from layoutopt.plots.finder_marks import BEAM, DOCK
from layoutopt.plots.layout_plan import sample_place_m
from layoutopt.plots.thumbnails import underside_svg
from layoutopt.readers.finders import docking_antennas, yawed_antennas

SVG = "{http://www.w3.org/2000/svg}"


def picture_of(layout):
    """Return the element of a layout's picture on the ward of the made findings."""
    world = findings_of().problem.design
    tag_map = layout.floor_tags.lay_on(world.site)
    return ElementTree.fromstring(
        underside_svg(layout=layout, site=world.site, robot=world.robot, tag_map=tag_map)
    )


def test_antennas_and_discs_are_to_scale():
    """Each antenna has a disc with its own read radius in millimetres, as far from the others as its pose says."""
    layout = layout_of(0.06, 0.2)
    (group,) = layout.readers
    discs = list(picture_of(layout).iter(f"{SVG}circle"))
    radii = [float(disc.get("r")) for disc in discs]
    expected = [group.antenna.read_radius_m(float(z_m)) * 1000.0 for z_m in group.poses[:, 2]]
    assert radii == pytest.approx(expected, abs=0.06)
    places = np.array([[float(disc.get("cx")), -float(disc.get("cy"))] for disc in discs])
    np.testing.assert_allclose(places - places[0], (group.poses[:, :2] - group.poses[0, :2]) * 1000.0, atol=0.21)


@pytest.mark.parametrize(("pitch_m", "scale"), [(0.2, 1.0), (0.1, 1.0), (0.01, 0.3)])
def test_pictures_share_a_scale_unless_tags_are_too_many(pitch_m, scale):
    """The side of the picture is that of the robot with room about it; very dense tags are shown closer."""
    layout = layout_of(0.06, pitch_m)
    picture = picture_of(layout)
    side = float(picture.get("viewBox").split()[2])
    tags = sum(path.get("d").count("Z") for path in picture.iter(f"{SVG}path"))
    assert tags < 420
    assert (side == 900.0) == (scale == 1.0)
    assert side <= 900.0
    assert len(ElementTree.tostring(picture)) < 40_000


@pytest.mark.parametrize("logarithmic", [False, True])
def test_places_in_a_saved_figure_are_those_of_its_marks(tmp_path, logarithmic):
    """Values lie where the SVG has their marks, on both kinds of axis, after saving."""
    ax = new_axes(100.0, 70.0)
    x, y = [2.0, 30.0, 700.0], [0.5, 20.0, 3.0]
    if logarithmic:
        ax.set_xscale("log")
        ax.set_yscale("log")
    ax.plot(x, y, linestyle="none", marker="s", gid="marks")
    svg, _ = save(ax, tmp_path / "figure")
    frame = svg_frame(ax)
    group = svg.read_text(encoding="utf-8").partition('id="marks"')[2]
    drawn = [(float(a), float(b)) for a, b in re.findall(r'<use [^>]*x="([\d.]+)" y="([\d.]+)"', group)[: len(x)]]
    placed = [(frame.x.place(a), frame.y.place(b)) for a, b in zip(x, y, strict=True)]
    np.testing.assert_allclose(placed, drawn, atol=0.05)
    assert frame.x.logarithmic == logarithmic


def test_places_hold_where_every_drawing_lays_the_axes_out_anew(tmp_path):
    """A text beyond the axes moves them at each drawing: places are still those in the SVG that was saved."""
    ax = new_axes(100.0, 70.0)
    ax.plot([2.0, 30.0, 700.0], [0.5, 20.0, 3.0], linestyle="none", marker="s", gid="marks")
    note = ax.annotate("far beyond the axes", (700.0, 3.0), xytext=(40.0, 0.0), textcoords="offset points")
    svg, _ = save(ax, tmp_path / "figure")
    frame = svg_frame(ax)
    group = svg.read_text(encoding="utf-8").partition('id="marks"')[2]
    drawn = [float(x) for x in re.findall(r'<use [^>]*x="([\d.]+)" y=', group)[:3]]
    assert [frame.x.place(x) for x in (2.0, 30.0, 700.0)] == pytest.approx(drawn, abs=0.05)
    assert ax.figure.get_layout_engine() is not None
    note.remove()
    again = as_svg(ax)
    assert svg_frame(ax).x.end > frame.x.end + 5.0, "the note took room away"
    assert again.startswith("<svg")


def test_what_finds_things_off_the_floor_is_drawn_too():
    """A beam of the antenna's width, a ring as wide as crossed antennas, and a transponder that lies in sight."""
    layout = whole()
    bare = [element.get("d", "") for element in picture_of(layout_of(0.06, 0.2)).iter(f"{SVG}path")]
    picture = picture_of(layout)
    (ring,) = [e for e in picture.iter(f"{SVG}circle") if e.get("stroke") == DOCK]
    assert float(ring.get("r")) == pytest.approx(500.0 * layout.readers[2].antenna.side_m)
    (beam,) = [e for e in picture.iter(f"{SVG}path") if e.get("fill") == BEAM]
    apex, *rim = np.array(re.findall(r"-?[\d.]+", beam.get("d")), dtype=float).reshape(-1, 2)
    turns = np.unwrap([math.atan2(apex[1] - y, x - apex[0]) for x, y in rim])
    assert turns[-1] - turns[0] == pytest.approx(layout.readers[1].antenna.beam_rad, abs=0.01)
    assert (turns[0] + turns[-1]) / 2.0 == pytest.approx(0.0, abs=0.01)
    drawn = [element.get("d", "") for element in picture.iter(f"{SVG}path")]
    assert len(drawn) == len(bare) + 2
    far = layout.replace(transponders=(replace(layout.transponders[0], position_m=(5.9, 3.9, 0.3)),))
    assert len(list(picture_of(far).iter(f"{SVG}path"))) == len(bare) + 1


def whole():
    """Return floor readers with a UHF antenna, crossed antennas, and a transponder under the robot."""
    layout = layout_of(0.06, 0.2)
    world = findings_of().problem.design
    x_m, y_m = sample_place_m(
        layout=layout, site=world.site, robot=world.robot, tag_map=layout.floor_tags.lay_on(world.site)
    )
    return layout.replace(
        readers=(
            *layout.readers,
            yawed_antennas(antenna=UhfPatch(), count=1, yaw_rad=0.0),
            docking_antennas(antenna=CrossedLoops()),
        ),
        transponders=(Transponder(name="dock", position_m=(x_m, y_m, 0.3)),),
    )
