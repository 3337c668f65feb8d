"""The figure of cost against error draws what it is given, in euros and millimetres."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import FloorTags, Layout, ReaderProfile, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.plots.figures import as_svg, new_axes
from layoutopt.plots.front import REFERENCE_NOTE, draw_front
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.result import Evaluated, Front
from layoutopt.scores import Score

PROFILE = ReaderProfile(name="commercial", scan_period_s=0.05, tags_per_scan="several")
GOALS = ("cost", "position_error_mean")


@dataclass
class Point:
    """A design as the figure sees it."""

    evaluated: Evaluated


@dataclass
class Mark:
    """A published layout as the figure sees it."""

    label: str
    layout: Layout
    cost: Score
    error: Score


def layout_of(pitch_m):
    mount = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.02, profile=PROFILE)
    tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=pitch_m)),))
    return Layout(floor_tags=tags, readers=(cross(count=4, mount=mount),))


def error(value_m, standard_error_m=0.0002, count=100):
    return Score(value=value_m, unit="m", standard_error=standard_error_m, count=count)


def evaluated(number, cost_eur, score):
    scores = {"cost": Score(value=cost_eur, unit="EUR"), "position_error_mean": score}
    return Evaluated(layout=layout_of(0.05 + 0.001 * number), scores=scores)


MEMBERS = (
    evaluated(1, 1000.0, error(0.02)),
    evaluated(2, 2000.0, error(0.01)),
    evaluated(3, 4000.0, error(0.006)),
)


def draw(**changes):
    given = {
        "designs": [Point(evaluated(10 + n, 1200.0 + 50.0 * n, error(0.03 - 0.0001 * n))) for n in range(20)],
        "front": Front(goals=GOALS, members=MEMBERS),
        "recommended": {"cheapest": MEMBERS[1], "knee": MEMBERS[1], "most accurate": MEMBERS[2]},
        "references": [
            Mark("96 readers, 100 tags/m²", layout_of(0.1), Score(value=9000.0, unit="EUR"), error(0.003))
        ],
        "target_m": 0.012,
    }
    return draw_front(**{**given, **changes})


def lines(ax, label):
    return [line for line in ax.lines if line.get_label() == label]


def test_axes_carry_units():
    """Cost is in euros and error in millimetres, and both axes say so."""
    ax = draw()
    assert ax.get_xlabel() == "cost (EUR)"
    assert ax.get_ylabel() == "mean position error (mm)"


def test_target_and_budget_lie_at_their_values():
    """The dashed line lies at the target in millimetres, the other at the budget in euros."""
    ax = draw(budget_eur=3000.0)
    assert lines(ax, "target, 12 mm")[0].get_ydata() == pytest.approx([12.0, 12.0])
    (upright,) = [line for line in ax.lines if str(line.get_label()).startswith("budget")]
    assert upright.get_xdata() == pytest.approx([3000.0, 3000.0])
    low, high = ax.get_ylim()
    assert low < 12.0 < high


def test_every_member_stands_at_its_scores_with_its_interval():
    """Marks of the front are the scores in EUR and mm, and bars end at the 95 % interval."""
    ax = draw()
    (front,) = lines(ax, "front, with 95 % interval")
    assert np.column_stack([front.get_xdata(), front.get_ydata()]) == pytest.approx(
        np.array([(item.scores["cost"].value, item.scores["position_error_mean"].value * 1e3) for item in MEMBERS])
    )
    ends = [segment[:, 1] for bars in ax.collections for segment in bars.get_segments()]
    for member in MEMBERS:
        low, high = (end * 1000.0 for end in member.scores["position_error_mean"].interval())
        assert any(end == pytest.approx([low, high]) for end in ends)


def test_recommended_layouts_are_labelled_once_with_all_roles():
    """A layout with two roles has one label; the cheapest says that it meets the target only if it does."""
    texts = [note.get_text() for note in draw().texts]
    assert sum("knee" in text for text in texts) == 1
    assert any(text.startswith("cheapest that meets the target, knee") for text in texts)
    missed = [note.get_text() for note in draw(target_m=0.002).texts]
    assert any(text.startswith("cheapest, knee") for text in missed)


def test_references_are_open_marks_with_name_and_caveat():
    """Published layouts are open diamonds with their label, and the legend says what they are not."""
    ax = draw()
    (mark,) = lines(ax, REFERENCE_NOTE)
    assert mark.get_marker() == "D"
    assert mark.get_markerfacecolor() != mark.get_markeredgecolor()
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == pytest.approx((9000.0, 3.0))
    assert "96 readers, 100 tags/m²" in [note.get_text() for note in ax.texts]
    assert REFERENCE_NOTE in [text.get_text() for text in ax.get_legend().get_texts()]
    assert "not members of the front" in REFERENCE_NOTE


def test_scale_is_logarithmic_beyond_a_decade_only():
    """Costs from 1000 to 9000 EUR are linear, to 40 000 EUR logarithmic."""
    far = [Mark("far", layout_of(0.1), Score(value=40000.0, unit="EUR"), error(0.003))]
    assert draw().get_xscale() == "linear"
    assert draw(references=far).get_xscale() == "log"


def test_many_points_become_a_picture():
    """Up to 5000 points are shapes in the SVG, more are one picture."""
    few = [Point(MEMBERS[0])] * 5000
    assert "<image" not in as_svg(draw(designs=few))
    assert "<image" in as_svg(draw(designs=[*few, Point(MEMBERS[0])]))


def test_unknown_errors_are_left_out():
    """NaN and missing scores draw nothing and do not break the limits."""
    unknown = evaluated(50, 1500.0, error(math.nan, math.inf, 1))
    bare = Evaluated(layout=layout_of(0.07), scores={"cost": Score(value=10.0, unit="EUR")})
    ax = draw(designs=[Point(unknown), Point(bare)])
    assert lines(ax, "simulated layout") == []
    assert np.isfinite([*ax.get_xlim(), *ax.get_ylim()]).all()


@pytest.mark.parametrize(("count", "bars"), [(1, 0), (2, 0), (4, 0), (5, 1)])
def test_few_replications_have_no_bar(count, bars):
    """A member or a published layout with fewer than five trials gets no interval, and the legend says so."""
    single = evaluated(60, 1500.0, error(0.015, math.inf if count == 1 else 0.01, count))
    marks = [Mark("far", layout_of(0.1), Score(value=4000.0, unit="EUR"), error(0.005, 0.01, count))]
    ax = draw(front=Front(goals=GOALS, members=(single,)), recommended={}, references=marks)
    assert len(ax.collections) == 2 * bars
    assert len(lines(ax, "front, with 95 % interval" if bars else "front, intervals not known")) == 1
    assert ax.get_ylim()[0] >= 0.0


@pytest.mark.parametrize(
    ("goal", "unit", "value", "label", "shown"),
    [
        ("position_error_p95", "m", 0.02, "95 % position error (mm)", 20.0),
        ("heading_error_mean", "rad", 0.02, "mean heading error (°)", math.degrees(0.02)),
        ("lost_share", "", 0.02, "share of time lost (%)", 2.0),
        ("dock.position_error_mean", "m", 0.02, "mean position error in zone 'dock' (mm)", 20.0),
    ],
)
def test_the_axis_is_that_of_the_second_goal(goal, unit, value, label, shown):
    """Name, unit and values of the axis follow the goal; a target for the mean position error is not drawn."""
    score = Score(value=value, unit=unit, standard_error=value / 50.0, count=100)
    scores = {"cost": Score(value=2000.0, unit="EUR"), goal: score}
    member = Evaluated(layout=layout_of(0.05), scores=scores)
    mark = Mark("far", layout_of(0.1), Score(value=4000.0, unit="EUR"), score)
    ax = draw(
        designs=[Point(member)],
        front=Front(goals=("cost", goal), members=(member,)),
        recommended={"cheapest": member},
        references=[mark],
        target_m=0.012,
    )
    assert ax.get_ylabel() == label
    (front,) = lines(ax, "front, with 95 % interval")
    assert front.get_ydata() == pytest.approx([shown])
    assert lines(ax, REFERENCE_NOTE)[0].get_ydata() == pytest.approx([shown])
    assert lines(ax, "target, 12 mm") == []


def test_empty_front_still_draws():
    """A refused study gives axes with units and no marks."""
    ax = draw(designs=[], front=Front(goals=GOALS, members=()), recommended={}, references=[], target_m=None)
    assert ax.get_xlabel() == "cost (EUR)"
    assert as_svg(ax).startswith("<svg")


def test_draws_into_given_axes():
    """With ``ax`` the same axes come back."""
    ax = new_axes(120.0, 90.0)
    assert draw(ax=ax) is ax


def test_names_are_plain_text():
    """A label with dollar signs, and one that starts with an underscore, reach the figure as they are."""
    marks = [
        Mark(name, layout_of(0.1), Score(value=3000.0, unit="EUR"), error(0.003)) for name in ("$a_1$", "_hidden")
    ]
    ax = draw(references=marks)
    texts = [note.get_text() for note in ax.texts]
    assert "$a_1$" in texts
    assert "_hidden" in texts
    assert not any(note.get_parse_math() for note in ax.texts)


def test_a_mark_of_the_front_is_the_fuller_the_surer_it_is():
    """Its tone has the probability as its opacity, a layout without one is empty, and the legend says so."""
    shares = {MEMBERS[0].layout.key: 0.25, MEMBERS[1].layout.key: 1.0}
    ax = draw(membership=shares)
    (tones,) = [item for item in ax.collections if len(item.get_offsets()) == len(MEMBERS)]
    assert tones.get_facecolors()[:, 3] == pytest.approx([0.25, 1.0, 0.0])
    (marks,) = lines(ax, "front, with 95 % interval\nthe fuller, the surer to be on it")
    assert marks.get_ydata() == pytest.approx(np.asarray(tones.get_offsets())[:, 1])
    assert lines(draw(), "front, with 95 % interval")[0].get_markerfacecolor() != marks.get_markerfacecolor()
