"""What every figure promises: axes of the caller's, units on every axis, and parts that are told apart in grey."""

import ast
import importlib
import inspect
import itertools
import pkgutil
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from figure_cases import CASES
from matplotlib.colors import to_rgba
from matplotlib.container import Container
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import layoutopt.plots
import studies
from layoutopt.plots.figures import DASHES, HATCHES, MARKERS, PAPER, SERIES, add_axes, figure_of, new_figure
from layoutopt.plots.shades import SHADES, shades

PARTS = {
    "draw_drive": "floor, paths and tags within the limits of axes",
    "draw_floor": "outline, obstacles and zones",
    "draw_on_top": "beams and rings of a robot",
    "draw_scale_bar": "bar of length",
    "draw_tags": "dots",
    "draw_transponders": "marks with names",
}
"""Functions that draw a part into axes which they must be given, and which are no figures."""

_UNITS = r"mm|m|mm/s|s|ms|%|EUR|°|degrees|dB|\{\}"
UNIT = re.compile(rf"\((?:{_UNITS})\)|, (?:{_UNITS})$")
UNITLESS = frozenset(
    {
        "",
        "new tags",
        "robots",
        "runs",
        "drives that came there",
        "obstacles",
        "tour",
        "ours / printed",
        "ours / printed, mean error; grey: within 1.5 and within 2",
        "error over that of {} particles",
        "error over that on the square pattern",
        "cost over that of the published layout",
        "case of Fig. 5",
        "share read",
        "log10 of ρ in m²",
    }
)
"""Labels of what is counted, numbered, or a ratio; an axis without a label has words instead of numbers."""


LEAST_STEP = 15.0
"""Lightness by which areas and lines of the same form differ at least, on a scale of 100."""


@cache
def drawing_functions():
    """Return the public drawing functions of all modules of figures, by name."""
    found = {}
    for module in pkgutil.iter_modules(layoutopt.plots.__path__, "layoutopt.plots."):
        for name, value in vars(importlib.import_module(module.name)).items():
            if name.startswith("draw_") and inspect.isfunction(value) and value.__module__ == module.name:
                found[name] = value
    return found


@cache
def drawn(name):
    """Return what a figure function answers, and the axes that it was given; drawn once for all tests."""
    case = CASES[name]
    figure = new_figure(170.0, 120.0)
    projection = "polar" if case.polar else None
    axes = [add_axes(figure, 1, case.axes, number + 1, projection=projection) for number in range(case.axes)]
    several = "axes" in inspect.signature(drawing_functions()[name]).parameters
    return case.draw(**({"axes": axes} if several else {"ax": axes[0]})), axes


def lightness(colour):
    """Return the lightness L* of CIE 1976 of a colour on paper, 0 to 100."""
    *parts, alpha = to_rgba(colour)
    mixed = alpha * np.array(parts) + (1.0 - alpha) * np.array(to_rgba(PAPER)[:3])
    linear = np.where(mixed <= 0.04045, mixed / 12.92, ((mixed + 0.055) / 1.055) ** 2.4)
    luminance = float(linear @ (0.2126, 0.7152, 0.0722))
    return 903.3 * luminance if luminance <= 0.008856 else 116.0 * luminance ** (1.0 / 3.0) - 16.0


def looks(handle):
    """Return how an entry of a legend looks without colour: its form, and the lightness of most of it."""
    if isinstance(handle, Container):
        handle = handle[0]
    if isinstance(handle, Line2D):
        marker = handle.get_marker()
        marked = marker not in ("", "None", None)
        face = handle.get_markerfacecolor()
        filled = marked and not (isinstance(face, str) and face in ("none", PAPER))
        line = handle.get_linestyle() not in ("None", "", "none")
        dashes = str(handle._unscaled_dash_pattern) if line else ""
        width = round(handle.get_linewidth(), 1) if line else 0.0
        form = ("line", dashes, width > 2.0, str(marker) if marked else "", filled)
        colour = handle.get_color() if line or filled else handle.get_markeredgecolor()
        return form, lightness(to_rgba(colour, handle.get_alpha()))
    faces = np.atleast_2d(handle.get_facecolor())
    hatch = getattr(handle, "get_hatch", lambda: None)() or ""
    form = (type(handle).__name__ != "PathCollection", hatch, len(faces) > 0 and faces[0][3] > 0.0)
    return form, lightness(tuple(faces[0])) if form[2] else 100.0


def told_apart(one, other):
    """Return whether two entries of a legend differ in more than colour."""
    (form, light), (other_form, other_light) = looks(one), looks(other)
    return form != other_form or abs(light - other_light) >= LEAST_STEP


def legends(axes):
    """Return for each legend of axes and of their figure the entries, name and what stands for it."""
    named = {}
    for ax in axes:
        handles, names = ax.get_legend_handles_labels()
        named.update(zip(names, handles, strict=True))
    found = [ax.get_legend() for ax in axes if ax.get_legend() is not None] + figure_of(axes[0]).legends
    return [
        [
            (text.get_text(), named.get(text.get_text(), handle))
            for text, handle in zip(legend.get_texts(), legend.legend_handles, strict=True)
        ]
        for legend in found
    ]


def has_unit(label):
    return label in UNITLESS or UNIT.search(label) is not None


def test_every_figure_has_an_example_and_no_example_is_stale():
    assert drawing_functions().keys() == CASES.keys() | PARTS.keys()
    assert not CASES.keys() & PARTS.keys()


@pytest.mark.parametrize("name", CASES)
def test_a_figure_takes_axes_or_makes_its_own(name):
    """``ax`` for one, ``axes`` for several, by keyword and none by default; parts must be given theirs."""
    parameters = inspect.signature(drawing_functions()[name]).parameters
    taken = [parameters[word] for word in ("ax", "axes") if word in parameters]
    assert len(taken) == 1
    assert (taken[0].kind, taken[0].default) == (inspect.Parameter.KEYWORD_ONLY, None)


@pytest.mark.parametrize("name", PARTS)
def test_a_part_is_drawn_into_the_axes_that_it_must_be_given(name):
    first = next(iter(inspect.signature(drawing_functions()[name]).parameters.values()))
    assert (first.name, first.default) == ("ax", inspect.Parameter.empty)


@pytest.mark.parametrize("name", CASES)
def test_a_figure_is_drawn_into_the_axes_given_and_answers_with_them(name):
    """With ``ax`` the axes come back, with ``axes`` their figure; something was drawn into each."""
    answer, axes = drawn(name)
    assert answer is (axes[0].figure if isinstance(answer, Figure) else axes[0])
    for ax in axes:
        assert ax.lines or ax.patches or ax.collections or ax.images or ax.containers


@pytest.mark.parametrize("name", CASES)
def test_every_axis_has_a_label_with_a_unit(name):
    """An axis without a label has no numbers either, only words, or none at all; scales of maps have units too."""
    _, axes = drawn(name)
    for ax in axes:
        for label, axis in ((ax.get_xlabel(), ax.xaxis), (ax.get_ylabel(), ax.yaxis)):
            assert has_unit(label), f"{name}: {label!r}"
            if not label and ax.name != "polar":
                words = [text for text in axis.get_majorticklabels() if text.get_text()]
                fixed = [text.get_text() for text in words]
                assert not any(re.fullmatch(r"[-−]?[\d.]+", text) for text in fixed), (
                    f"{name}: numbers without a label"
                )
                assert fixed or not len(axis.get_majorticklocs()), f"{name}: numbers without a label"
        for scale in ax.child_axes:
            if scale.get_label() == "<colorbar>":
                assert scale.get_ylabel(), f"{name}: a scale without a label"
                assert has_unit(scale.get_ylabel()), f"{name}: {scale.get_ylabel()!r}"


@pytest.mark.parametrize("name", CASES)
def test_what_a_legend_names_is_told_apart_in_grey(name):
    _, axes = drawn(name)
    for entries in legends(axes):
        for (one, handle), (other, other_handle) in itertools.combinations(entries, 2):
            assert told_apart(handle, other_handle), f"{name}: {one!r} and {other!r} look the same in grey"


def test_lines_that_differ_in_hue_alone_are_not_told_apart():
    """Blue and vermilion are 8 apart in lightness; dashes, marks and open marks tell lines apart, black too."""
    one = Line2D([], [], color=SERIES[0])
    assert not told_apart(one, Line2D([], [], color=SERIES[1]))
    for style in ({"linestyle": DASHES[1]}, {"marker": "o"}, {"color": "#000000"}):
        assert told_apart(one, Line2D([], [], **{"color": SERIES[1], **style}))
    marks = {"linestyle": "none", "marker": "o", "color": SERIES[0]}
    assert told_apart(Line2D([], [], **marks), Line2D([], [], **marks, markerfacecolor="none"))


def test_series_have_a_style_each():
    """There are as many dashes, marks and hatches as colours, so that no two series share all of them."""
    assert len(SERIES) == len(DASHES) == len(MARKERS) == len(HATCHES)
    for styles in (SERIES, DASHES, MARKERS, HATCHES):
        assert len(set(styles)) == len(styles)


def test_the_scale_of_maps_darkens_evenly_from_a_shade_that_is_no_paper():
    """Each tenth of the scale is darker by 5 to 11 of 100; paper differs from its begin, black from its end."""
    for scale in (shades(), shades(beyond=True)):
        lights = [lightness(scale(float(share))) for share in np.linspace(0.0, 1.0, 11)]
        assert all(5.0 <= before - after <= 11.0 for before, after in itertools.pairwise(lights))
        assert lightness(PAPER) - lights[0] >= 8.0
    assert lightness(SHADES[-2]) - lightness(tuple(shades(beyond=True).get_over())) >= LEAST_STEP


@pytest.mark.parametrize("name", CASES)
def test_maps_use_that_scale(name):
    """What is coloured by a value has the even scale, so that no map is near white where there is something."""
    _, axes = drawn(name)
    for ax in axes:
        for item in (*ax.images, *ax.collections):
            # Lines of equal values have one colour and their values beside them.
            if item.get_array() is not None and not isinstance(item, ContourSet):
                assert item.get_cmap().name == shades().name, name


def test_labels_that_studies_give_have_units():
    """Written labels of axes in the code of studies; those that are put together there are told by their parts."""
    found = set()
    for path in sorted(Path(studies.__path__[0]).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.keyword) and node.arg in ("x_label", "y_label"):
                found |= {(path.name, text) for text in _texts(node.value)}
    assert len(found) > 30
    assert not [(name, text) for name, text in found if not has_unit(text)]


def _texts(node):
    """Return the text of a node, with braces for what is only known when it runs; none if all of it is."""
    if isinstance(node, ast.Constant):
        return [node.value]
    if isinstance(node, ast.JoinedStr):
        return ["".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)]
    return []
