"""How values show themselves in a notebook: well-formed, self-contained, with every text escaped."""

import dataclasses
import itertools
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from made_findings import findings_of
from shapely.geometry import Polygon, box

import layoutopt as lo
from layoutopt.notebook import html_of
from layoutopt.result import Evaluated
from layoutopt.score_text import limit_text, score_text
from layoutopt.site import Zone
from studies.summary import verdict

HOSTILE = '<script>alert("&")</script>'
SVG = "{http://www.w3.org/2000/svg}svg"


@pytest.fixture(scope="module")
def layout():
    """A ring over a square pattern."""
    mount = lo.Mount(
        antenna=lo.load("antennas", "sphere")(side_m=0.06),
        height_m=0.02,
        profile=lo.read_spec(lo.built_in("small_hall")).reader_profile,
    )
    square = lo.ZonePattern(zone="", pattern=lo.load("patterns", "square")(pitch_m=0.1))
    ring = lo.load("readers", "ring")(count=4, radius_m=0.2, mount=mount)
    return lo.Layout(floor_tags=lo.FloorTags(zones=(square,)), readers=(ring,))


def _parsed(value):
    html = value._repr_html_()
    tree = ElementTree.fromstring(html)
    assert tree.tag == "div"
    assert not any(element.tag.rpartition("}")[2] == "script" for element in tree.iter())
    assert "http://www.w3.org" in html or "<svg" not in html
    loaded = [
        value
        for element in tree.iter()
        for name, value in element.attrib.items()
        if name.rpartition("}")[2] in ("href", "src") and not value.startswith("#")
    ]
    assert loaded == []
    return tree


def _texts(tree):
    return [text.strip() for text in tree.itertext() if text.strip()]


def _front(layout, count):
    members = tuple(
        Evaluated(
            layout=layout,
            scores={
                "cost": lo.Score(value=1000.0 + index, unit="EUR", standard_error=0.0, count=0),
                "position_error_mean": lo.Score(value=0.02 / (1 + index), unit="m", standard_error=0.001, count=9),
            },
        )
        for index in range(count)
    )
    return lo.Front(goals=("cost", "position_error_mean"), members=members)


def test_a_site_shows_its_plan_and_zones_with_hostile_names():
    """Names of site, plan and zones come out as they are, and nothing of them becomes an element."""
    zone = Zone(name=HOSTILE, region=box(0.0, 0.0, 1.0, 1.0), target_error_m=0.01)
    site = lo.Site(name=HOSTILE, floor=box(0.0, 0.0, 4.0, 3.0), zones=(zone,), source=HOSTILE)
    tree = _parsed(site)
    texts = _texts(tree)
    assert f"Site {HOSTILE}" in texts
    assert f"zone {HOSTILE}" in texts
    assert "1.00 m², target 10 mm" in texts
    assert tree.find(SVG) is not None


@pytest.mark.parametrize("corners", [[(0, 0), (200, 0), (200, 1), (0, 1)], [(0, 0), (1, 0), (1, 200), (0, 200)]])
def test_long_and_narrow_sites_have_a_picture_too(corners):
    """A corridor of 200 m by 1 m in either direction is drawn."""
    assert _parsed(lo.Site(name="corridor", floor=Polygon(corners))).find(SVG) is not None


def test_a_layout_shows_each_antenna_and_tag_to_scale(layout):
    """Four discs of the read radius at the antennas' places, y up, and the tags between them."""
    tree = _parsed(layout)
    discs = [
        {k: float(v) for k, v in item.attrib.items()} for item in tree.iter("{http://www.w3.org/2000/svg}circle")
    ]
    (group,) = layout.readers
    assert [(disc["cx"], -disc["cy"]) for disc in discs] == [
        pytest.approx((1000 * x, 1000 * y), abs=0.06) for x, y in group.poses[:, :2]
    ]
    assert {disc["r"] for disc in discs} == {round(1000 * group.antenna.read_radius_m(0.02), 1)}
    paths = [item.attrib["d"] for item in tree.iter("{http://www.w3.org/2000/svg}path")]
    # Frame of 0.36 m on either side: seven rows and columns of tags at 100 mm.
    assert [path.count("M") for path in paths] == [49, 4]


def test_layouts_without_a_period_or_with_very_dense_tags_show_their_antennas_alone(layout):
    """What would be a grey field, or is nowhere near the robot, is left out of the picture."""
    for pattern in (
        lo.load("patterns", "square")(pitch_m=0.021),
        lo.TagPattern(name="listed", cell_m=None, points_m=np.array([[5.0, 5.0]])),
    ):
        tags = lo.FloorTags(zones=(lo.ZonePattern(zone="", pattern=pattern),))
        tree = _parsed(layout.replace(floor_tags=tags))
        assert len(list(tree.iter("{http://www.w3.org/2000/svg}path"))) == 1


def test_a_front_lists_its_members_with_their_errors(layout):
    """Costs in euro and errors with what is known of them; a long front is thinned and says so."""
    texts = _texts(_parsed(_front(layout, 3)))
    assert "10.0 ± 1.0 mm (n = 9)" in texts
    assert layout.label in texts
    many = _texts(_parsed(_front(layout, 60)))
    assert "25 of 60 members, evenly spaced along the front" in many
    assert many.count(layout.label) == 25


def test_a_result_says_how_it_ended_even_without_any_layout(layout):
    """Status and shortfall are the first things said; what is missing has no picture."""
    empty = lo.Result(
        status=lo.Status.TARGET_NOT_MET,
        front=lo.Front(goals=("cost", "position_error_mean"), members=()),
        recommended={},
        trials=0,
        shortfall=f"3 mm short {HOSTILE}",
    )
    tree = _parsed(empty)
    assert lo.Status.TARGET_NOT_MET.value in _texts(tree)
    assert f"3 mm short {HOSTILE}" in _texts(tree)
    assert tree.find(SVG) is None
    front = _front(layout, 3)
    full = dataclasses.replace(
        empty, front=front, recommended={"cheapest": front.members[0]}, bound=900.0, gap=0.1
    )
    texts = _texts(_parsed(full))
    assert "cheapest" in texts
    assert "10 %" in texts


def test_what_has_no_form_says_so():
    """Only values that show themselves have one."""
    with pytest.raises(TypeError, match="a int has no form"):
        html_of(3)


def test_values_show_themselves_without_having_loaded_any_picture():
    """Making a site brings no plots along; showing it does."""
    program = (
        "import sys, layoutopt as lo\nfrom shapely.geometry import box\n"
        "site = lo.Site(name='a', floor=box(0, 0, 1, 1))\n"
        "print('matplotlib' in sys.modules, 'layoutopt.notebook' in sys.modules)\n"
        "site._repr_html_()\nprint('matplotlib' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False", "True"]


def test_findings_show_the_demand_and_what_held_out_drives_say():
    """A search score alone would look better than the layout is; few drives are called few, as everywhere."""
    findings = findings_of()
    texts = _texts(_parsed(findings))
    assert verdict(findings) in texts
    assert [limit_text(limit) for limit in findings.problem.limits] == [
        text for name, text in itertools.pairwise(texts) if name == "demand"
    ]
    goal, first = findings.problem.goals[1], findings.problem.estimators[0].name
    cheapest = findings.result.recommended["cheapest"].layout.key
    rows = [row for row in findings.validations if row.layout_key == cheapest and row.estimator == first]
    assert rows
    for row in rows:
        if row.scores is not None:
            assert (f"cheapest, {row.scenario}", score_text(row.scores[goal], goal)) in itertools.pairwise(texts)
