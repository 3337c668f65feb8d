"""The picture of reader groups under a chassis."""

import numpy as np
import pytest

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.plots.figures import as_svg
from layoutopt.plots.undersides import UndersidePicture, draw_undersides
from layoutopt.protocols import Mount
from layoutopt.readers.listed import listed
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.robot import Robot

ROBOT = Robot(outline_m=np.array([(-0.3, -0.2), (0.3, -0.2), (0.3, 0.2), (-0.3, 0.2)]))


def picture(label, points_m, antennas_per_module=1):
    mount = Mount(
        antenna=SphereAntenna(side_m=0.06),
        height_m=0.02,
        profile=COMMERCIAL,
        antennas_per_module=antennas_per_module,
    )
    return UndersidePicture(label=label, group=listed(points_m=points_m, mount=mount))


def test_discs_and_squares_are_drawn_to_scale_at_their_places():
    """Two panels of one scale: a square and a disc for each antenna, slots named where there are turns."""
    shown = [picture("one", [(0.2, 0.1)]), picture("two", [(0.2, 0.1), (-0.2, 0.0)], 2)]
    figure = draw_undersides(ROBOT, shown)
    for ax, item in zip(figure.axes, shown, strict=True):
        assert ax.get_aspect() == 1.0
        assert ax.get_title(loc="left") == item.label
        discs, squares = (collection.get_paths() for collection in ax.collections)
        assert len(discs) == len(squares) == item.group.count
        radius_m = item.group.antenna.read_radius_m(0.02)
        for pose, disc, square in zip(item.group.poses, discs, squares, strict=True):
            extents = disc.get_extents()
            assert (extents.x0, extents.x1) == pytest.approx((pose[0] - radius_m, pose[0] + radius_m))
            assert square.get_extents().y1 == pytest.approx(pose[1] + 0.03)
    assert figure.axes[0].get_xlim() == figure.axes[1].get_xlim()
    assert [text.get_text() for text in figure.axes[0].texts if text.get_text()] == []
    assert [text.get_text() for text in figure.axes[1].texts if text.get_text()] == ["1", "2"]
    assert as_svg(figure).startswith("<svg")


def test_no_group_is_no_figure():
    """An empty list is refused."""
    with pytest.raises(ValueError, match="at least one"):
        draw_undersides(ROBOT, [])
