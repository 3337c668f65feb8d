"""The map of places for a transponder: a square a place, what was refused, and a scale that holds all shares."""

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.plots.docking_map import DockingMap, draw_docking_map
from layoutopt.site import Site

SITE = Site(name="room", floor=box(0, 0, 4, 3), obstacles=(box(1, 1, 1.5, 1.5),))


def shown(success, **changes):
    """Return a map with a place for each share."""
    given = {
        "places_m": np.array([(0.5 + 0.5 * number, 2.0) for number in range(len(success))]).reshape(-1, 2),
        "success": np.array(success),
        "refused_m": np.array([(0.0, 0.0), (0.5, 0.0)]),
        "side_m": 0.5,
        "scatterers_m": np.array([(3.0, 1.0)]),
        "clearance_m": 0.5,
    }
    return DockingMap(**{**given, **changes})


@pytest.mark.parametrize(
    ("success", "low"), [([1.0, 1.0], 90.0), ([0.95, 0.62, 0.8], 60.0), ([0.0], 0.0), ([0.7], 70.0)]
)
def test_the_scale_holds_every_share_and_ends_at_all(success, low):
    """Where all dock the scale still has a width."""
    ax = draw_docking_map(SITE, shown(success))
    (squares,) = ax.collections
    assert np.allclose(squares.get_clim(), (low, 100.0))
    assert np.allclose(squares.get_array(), 100.0 * np.array(success))


def test_the_legend_names_what_is_there_and_nothing_else():
    """Marks of a best and a given place only where there is one."""
    words = [text.get_text() for text in draw_docking_map(SITE, shown([0.5])).get_legend().get_texts()]
    assert words == ["refused", "clearance of 500 mm", "scatterer"]
    bare = shown(
        [0.5], refused_m=np.zeros((0, 2)), scatterers_m=np.zeros((0, 2)), clearance_m=2.0, best_m=(1.0, 2.0)
    )
    words = [text.get_text() for text in draw_docking_map(SITE, bare).get_legend().get_texts()]
    assert words == ["best place"]


def test_a_map_without_any_drive_shows_the_floor():
    """All places are refused: no scale, but the crosses."""
    ax = draw_docking_map(SITE, shown([]))
    assert not ax.collections
    assert any(len(line.get_xdata()) == 2 and line.get_marker() == "x" for line in ax.lines)


def test_a_share_is_missing_or_too_many():
    """Said with both numbers."""
    with pytest.raises(ValueError, match="1 places and 2 shares"):
        draw_docking_map(SITE, shown([0.5, 0.6], places_m=np.array([(1.0, 1.0)])))
