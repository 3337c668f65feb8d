"""The figure of a drive shows path, truth, reads and lost steps, and nothing that is not known."""

import numpy as np
import pytest
from figure_cases import LAYOUT, PATH, SITE, TAGS

from layoutopt.plots.drive_plan import draw_drive
from layoutopt.plots.figures import as_svg, legend_above, new_axes
from layoutopt.plots.floor_plan import frame_site, plan_axes


def draw(true=None, lost=None, ax=None):
    """Draw the drive on the whole site with its legend, and return the axes."""
    ax = plan_axes(SITE, ax)
    frame_site(ax, SITE)
    entries = draw_drive(
        ax,
        layout=LAYOUT,
        site=SITE,
        tag_map=TAGS,
        path_m=PATH,
        true_m=np.full_like(PATH, np.nan) if true is None else true,
        read_tags=np.array([3, 3, 5]),
        lost=np.zeros(30, dtype=bool) if lost is None else lost,
        covariance_m2=None,
    )
    legend_above(ax, entries, columns=3)
    return ax


def legend(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_everything_known_is_drawn_in_metres():
    """Path, truth, tags that were read and lost steps each have an entry, at their places."""
    lost = np.arange(30) < 4
    ax = draw(true=PATH + 0.01, lost=lost)
    assert legend(ax) == [
        f"tag that was read (2 of {len(TAGS)})",
        "true path",
        "estimated path",
        "first step",
        "lost (4 steps)",
    ]
    lines = {line.get_label(): line for line in ax.lines}
    assert lines["estimated path"].get_xydata() == pytest.approx(PATH)
    assert lines["lost (4 steps)"].get_xydata() == pytest.approx(PATH[:4])
    assert lines[f"tag that was read (2 of {len(TAGS)})"].get_xydata() == pytest.approx(TAGS.xy_m[[3, 5]])
    assert ax.get_xlabel() == "x (m)"
    assert ax.get_aspect() == 1.0


def test_what_is_not_known_is_left_out():
    """Without truth and without lost steps the legend does not name them."""
    assert legend(draw()) == [f"tag that was read (2 of {len(TAGS)})", "estimated path", "first step"]


def test_axes_of_the_caller_are_used_and_bytes_repeat():
    """The figure goes into given axes, and the same drive gives the same bytes."""
    ax = new_axes(100.0, 80.0)
    assert draw(ax=ax) is ax
    assert as_svg(draw()) == as_svg(draw())


def test_columns_of_different_lengths_are_refused():
    """A truth for fewer steps is a mistake of the caller."""
    with pytest.raises(ValueError, match="30, 29 and 30"):
        draw(true=PATH[1:])
