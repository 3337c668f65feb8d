"""Layouts with UHF antennas, crossed antennas and a transponder, through all that handles layouts."""

import csv
import math
from dataclasses import replace

import numpy as np
import pytest
from small_studies import SPEC

from layoutopt import feasibility
from layoutopt.commissioning.expansion import expanded_space, expansion_of
from layoutopt.drawings.floor_view import mark_boxes, transponder_marks
from layoutopt.drawings.installation import overview_title, write_tables
from layoutopt.drawings.layout_sheet import layout_sheet
from layoutopt.drawings.pattern_template import robot_template
from layoutopt.drawings.robot_sheets import robot_sheets, wiring_rows
from layoutopt.drawings.robot_view import antenna_numbers, robot_shapes
from layoutopt.drawings.sheet import Circle, Marks, Polyline, Text
from layoutopt.drawings.sheet_set import Job, sheet_set, title_block
from layoutopt.drawings.text_boxes import text_box
from layoutopt.errors import InvalidInput
from layoutopt.layout import FloorTags, Transponder
from layoutopt.parts import Scope, bill_of_material, bill_of_needs, default_prices, needs
from layoutopt.reach import OnlyInReach
from layoutopt.snapping.marks import marks_of
from layoutopt.snapping.snapped import snapped
from layoutopt.spec.reading import read_spec
from layoutopt.tables.readers import antenna_rows, read_readers_yaml, write_readers_urdf, write_readers_yaml
from layoutopt.workers import Backend, Workers
from objectives.cost import Cost
from solvers.layout_difference import layout_difference
from studies import answers
from studies.effort import finder_lines
from studies.explain_variants import places_for_one_more, variants_of

TABLES = """
[tracking]
tags = 3
duration = "4 s"
trials = 2
[docking]
transponder = [2.8, 1]
trials = 4
"""


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    """The small study with both tables."""
    path = tmp_path_factory.mktemp("specs") / "spec.toml"
    path.write_text(SPEC.replace("[[0,0],[3,0],[3,2],[0,2]]", "[[0,0],[5,0],[5,4],[0,4]]") + TABLES)
    return read_spec(path)


@pytest.fixture(scope="module")
def hybrid(spec):
    """Its first layout."""
    return next(spec.space.layouts())


@pytest.fixture(scope="module")
def uhf(hybrid):
    """UHF antennas alone, and no tag on the floor."""
    return hybrid.replace(floor_tags=FloorTags(zones=()), readers=hybrid.readers_of("signal"), transponders=())


def plain(layout):
    """Return a layout without what finds things off the floor."""
    return layout.replace(readers=layout.floor_readers, transponders=(), target_tags=0)


def test_labels_say_what_is_there(hybrid, uhf):
    """In a few words, beside those of the floor, which stay as they were."""
    floor = plain(hybrid).label
    assert hybrid.label == floor.replace(", ", " + UHF 2 at ±45° + docking, ", 1)
    assert uhf.label == "UHF 2 at ±45°, no tags on the floor"


@pytest.mark.parametrize(
    ("count", "yaw_deg", "words"),
    [
        (1, 30, "UHF 1 at 30°"),
        (2, 0, "UHF 2 at 0°, 0°"),
        (3, 60, "UHF 3 at 60°, 0°, -60°"),
        (2, 22.5, "UHF 2 at ±22.5°"),
    ],
)
def test_labels_of_uhf_antennas(spec, count, yaw_deg, words):
    """One yaw each, or plus and minus."""
    assert spec.tracking.antennas(count=count, yaw_rad=math.radians(yaw_deg)).label == words


def test_the_bill_of_finders_reckoned_by_hand(hybrid):
    """Two robots: a reader, two antennas and crossed antennas each; one transponder and three tags in all."""
    more = {need.item: need.quantity for need in needs(hybrid, 10, 2)}
    less = {need.item: need.quantity for need in needs(plain(hybrid), 10, 2)}
    assert {item: count for item, count in more.items() if item not in less} == {
        "transponder": 1, "uhf_tag": 3, "uhf_reader": 2, "uhf_antenna": 4, "direction_receiver": 2,
    }  # fmt: skip
    assert {item: more[item] for item in less} == less
    cents = [bill_of_needs(needs(layout, 10, 2), 2, default_prices()) for layout in (hybrid, plain(hybrid))]
    parts_eur = 80.0 + 3 * 0.9 + 2 * (1500.0 + 2 * 120.0 + 900.0)
    spares_eur = 0.9
    hours = 0.5 + 3 / 60 + 2 * (0.75 + 2 / 3 + 1.0)
    assert cents[0].total_eur - cents[1].total_eur == pytest.approx(
        parts_eur + spares_eur + 45.0 * hours, abs=0.03
    )


def test_what_a_list_lacks_is_no_price_of_zero(hybrid):
    """Without a price there is no bill, and the message says what to add."""
    prices = default_prices()
    old = replace(prices, items={name: item for name, item in prices.items.items() if "uhf" not in name})
    assert bill_of_needs(needs(plain(hybrid), 10, 1), 1, old).total_eur > 0.0
    with pytest.raises(ValueError, match=r"has no uhf_tag, uhf_reader, uhf_antenna: .*default-2026"):
        bill_of_needs(needs(hybrid, 10, 1), 1, old)


def test_only_floor_readers_hang_below_the_robot(spec, hybrid, uhf):
    """A UHF antenna wider than the robot breaks no rule; a fifth one on a reader does."""
    own = {violation.rule for violation in feasibility.check(plain(hybrid), spec.design)}
    assert {violation.rule for violation in feasibility.check(hybrid, spec.design)} == own
    assert feasibility.check(uhf, spec.design) == ()
    group = uhf.readers[0]
    five = replace(group, poses=np.zeros((5, 4)), slots=tuple(range(5)), antennas_per_module=5)
    (violation,) = feasibility.check(uhf.replace(readers=(five,)), spec.design)
    assert (violation.rule, "5 antennas" in violation.message) == ("UHF ports", True)


def test_finders_read_no_tag_wherever_they_are(spec, hybrid, uhf):
    """Reach is that of floor antennas, and so is what tells layouts apart."""
    only = OnlyInReach(site=spec.site, robot_radius_m=spec.robot.radius_m)
    assert only(hybrid).floor_tags.key == only(plain(hybrid)).floor_tags.key
    assert only(uhf) is uhf
    assert layout_difference(hybrid, plain(hybrid)).total == 0.0
    assert layout_difference(uhf, uhf).total == 0.0


def test_work_and_bill_tell_the_same_hours(spec, hybrid, tmp_path):
    """Each step once: tags are laid by area, a transponder is mounted, UHF tags are given out."""
    write_tables(spec, hybrid, tmp_path)
    bill = bill_of_material(hybrid, hybrid.floor_tags.lay_on(spec.site), 1, spec.prices)
    hours = sum(line.quantity for line in bill.lines if line.scope is Scope.LABOUR)
    rows = list(csv.reader((tmp_path / "work_plan.csv").read_text(encoding="utf-8").splitlines()))
    assert float(rows[-1][-1]) == pytest.approx(hours, abs=1e-3)
    steps = {row[2].partition(":")[0]: row[3] for row in rows[1:-1]}
    assert (steps["mount, see transponders.csv"], steps["encode and give out"]) == ("1", "3")
    found = list(csv.DictReader((tmp_path / "transponders.csv").read_text(encoding="utf-8").splitlines()))
    assert found == [{"name": "dock", "frame_id": "map", "x_m": "2.8000", "y_m": "1.0000", "z_m": "0.5000"}]


def test_tables_of_readers_hold_the_yaw(hybrid, tmp_path):
    """In YAML and URDF, numbered through all groups; none is written for a layout without transponders."""
    write_readers_yaml(tmp_path / "readers.yaml", hybrid)
    write_readers_urdf(tmp_path / "readers.urdf", hybrid)
    rows = read_readers_yaml(tmp_path / "readers.yaml")
    assert [row.kind for row in rows] == ["tag_read"] * 4 + ["signal"] * 2 + ["direction"]
    assert [round(math.degrees(row.yaw_rad), 3) for row in rows[4:6]] == [45.0, -45.0]
    urdf = (tmp_path / "readers.urdf").read_text(encoding="utf-8")
    assert 'xyz="0.000000 0.000000 0.800000" rpy="0 0 -0.785398"' in urdf
    assert len(antenna_rows(hybrid)) == 7


def test_drawings_show_where_antennas_look_and_where_the_transponder_is(spec, hybrid):
    """An arrow along each yaw, a ring, a named mark, and notes with heights and places."""
    shapes = robot_shapes(hybrid, spec.robot)
    heads = [shape.points_mm for shape in shapes if isinstance(shape, Polyline) and shape.fill]
    yaws_deg = [math.degrees(math.atan2(*reversed(head[1]))) for head in heads]
    assert yaws_deg == pytest.approx([45.0, -45.0])
    assert sum(isinstance(shape, Circle) and shape.radius_mm == 150.0 for shape in shapes) == 1
    assert {shape.layer for shape in shapes[1:] if isinstance(shape, Polyline) and shape.fill} == {"A-READERS-TOP"}
    mark, name = transponder_marks(hybrid, 50)
    assert (mark.points_mm.tolist(), name.text) == ([[2800.0, 1000.0]], "dock")
    sheet = layout_sheet(
        layout=hybrid, site=spec.site, robot=spec.robot, tag_map=hybrid.floor_tags.lay_on(spec.site), title="x"
    )
    words = " ".join(entity.text for entity in sheet.entities if isinstance(entity, Text))
    for part in (
        "Antennas 4 to 5: UHF",
        "45°, -45°",
        "Antenna 6: crossed antennas",
        "x 2800, y 1000",
        "given out: 3",
    ):
        assert part in words, part


def test_numbers_are_those_of_readers_yaml_and_touch_nothing(spec, hybrid):
    """Whatever the order of the groups; on the template only those below have one."""
    turned = hybrid.replace(readers=hybrid.readers[::-1])
    for layout, below in ((hybrid, ["0", "1", "2", "3"]), (turned, ["3", "4", "5", "6"])):
        assert [text.text for text in antenna_numbers(layout, 5)] == [str(number) for number in range(7)]
        assert [text.text for text in antenna_numbers(layout, 1, "below")] == below
        numbers = [entity.text for entity in robot_template(layout, spec.robot) if isinstance(entity, Text)]
        assert numbers == below


def test_underside_and_top_of_the_robot_are_sheets_of_their_own(spec, hybrid, uhf):
    """Each shows and lists its own antennas only, and the wiring says what every module is."""
    tag_map = hybrid.floor_tags.lay_on(spec.site)
    sheets = {
        sheet.number: sheet
        for sheet in sheet_set(Job(layout=hybrid, site=spec.site, robot=spec.robot, tag_map=tag_map, title="x"))
    }
    numbers = {
        number: {
            item.text
            for item in sheets[number].views[0].entities
            if isinstance(item, Text) and item.layer == "A-READERS"
        }
        for number in ("R-101", "R-102")
    }
    assert numbers == {"R-101": {"0", "1", "2", "3"}, "R-102": {"4", "5", "6"}}
    assert {item.layer for item in sheets["R-102"].views[0].entities} == {
        "A-ROBOT",
        "A-READERS",
        "A-DIMS",
        "A-DATUM",
    }
    modules = [row[1] for row in wiring_rows(hybrid)]
    assert modules == [*4 * ["HF reader"], *2 * ["UHF reader"], "docking receiver"]
    alone = robot_sheets(
        uhf,
        spec.robot,
        paper="A3",
        block=title_block(Job(layout=uhf, site=spec.site, robot=spec.robot, tag_map=tag_map, title="x")),
    )
    assert [(sheet.number, sheet.title) for sheet in alone] == [("R-101", "Robot top: x")]


def test_the_name_of_a_transponder_keeps_clear_of_tags(spec, hybrid):
    """Where it would lie on a tag it moves, and numbers of tags keep off its mark."""
    places_mm = [(2800.0, 1000.0 + 50.0 * up) for up in (0.0, 4.0, 8.0)]
    tags = Marks(layer="A-TAGS", points_mm=places_mm, symbol="disc", size_mm=20.0, printed_mm=0.8)
    _, name = transponder_marks(hybrid, 50, tags)
    box_mm = text_box(name, 50)
    assert not any(box_mm.overlaps(other) for other in mark_boxes(tags, 50))
    assert any(text_box(transponder_marks(hybrid, 50)[1], 50).overlaps(other) for other in mark_boxes(tags, 50))


def test_the_overview_says_what_is_to_be_installed(hybrid, uhf):
    """A hybrid is more than floor tags and readers."""
    assert overview_title(hybrid) == (
        "Installation of floor tags, readers, UHF antennas, docking antennas and transponders"
    )
    assert overview_title(hybrid.replace(readers=hybrid.floor_readers, transponders=())) == (
        "Installation of floor tags and readers"
    )
    assert "floor tags" not in overview_title(uhf)


def test_a_robot_with_nothing_below_has_no_template(spec, uhf):
    """The set says so, and has all its other sheets."""
    job = Job(layout=uhf, site=spec.site, robot=spec.robot, tag_map=uhf.floor_tags.lay_on(spec.site), title="x")
    sheets = sheet_set(job)
    assert {sheet.number[0] for sheet in sheets} == {"G", "A", "R", "W"}
    words = " ".join(entity.text for entity in sheets[0].entities if isinstance(entity, Text))
    assert "all antennas are on top of it" in words
    assert "No tags lie on the floor." in words


def test_nothing_is_snapped_where_nothing_lies(spec, uhf):
    """A clear word instead of advice about marks."""
    with pytest.raises(InvalidInput, match="no tags lie on the floor"):
        snapped(
            uhf.floor_tags,
            spec.site,
            marks_of(spec.site, "chalk", margin_m=0.01, tag_part="label", chalk_spacing_m=0.05),
        )


def test_explain_takes_the_floor_readers_apart(spec, hybrid, uhf):
    """Every variant keeps antennas, transponder and tags of the rest; without floor readers there is none."""
    for variant in (*variants_of(spec, hybrid), *places_for_one_more(hybrid, spec.design)):
        assert variant.layout.readers[1:] == hybrid.readers[1:]
        assert variant.layout.transponders == hybrid.transponders
        assert " of group" not in variant.change
    assert variants_of(spec, uhf) == ()
    assert places_for_one_more(uhf, spec.design) == ()


def test_what_stands_is_not_paid_again(spec, hybrid, tmp_path):
    """Robots keep UHF and docking, the transponder stays, and a second one is the extension's own."""
    path = tmp_path / "larger.toml"
    text = SPEC.replace("[[0,0],[3,0],[3,2],[0,2]]", "[[0,0],[7,0],[7,4],[0,4]]") + TABLES
    path.write_text(text)
    larger = read_spec(path)
    kept = expansion_of(spec, hybrid, larger)
    first = next(expanded_space(kept, larger, new_readers=False).layouts())
    assert first.readers == hybrid.readers
    assert (first.transponders, first.target_tags) == (hybrid.transponders, 3)
    cost = Cost(
        prices=larger.prices, robot_count=1, equipped_count=1, equipped_with=kept.readers,
        standing=kept.transponders, given_out=kept.target_tags,
    )  # fmt: skip
    items = {need.item for need in cost.needs(first, larger.design)}
    assert items == {"label", "survey", "survey_tag"}
    path.write_text(text.replace("[2.8, 1]", "[6.5, 1]").replace("tags = 3", "tags = 5"))
    moved = next(expanded_space(kept, read_spec(path), new_readers=False).layouts())
    assert [round(item.position_m[0], 3) for item in moved.transponders] == [2.8, 6.5]
    extra = {need.item: need.quantity for need in cost.needs(moved, larger.design)}
    assert (extra["transponder"], extra["uhf_tag"]) == (1, 2)


def test_an_old_key_of_cost_stays(spec):
    """What came later leaves the key as it was as long as nothing stands."""
    cost = Cost(prices=spec.prices, robot_count=2)
    assert cost.key == replace(cost, standing=(), given_out=0).key
    assert cost.key != replace(cost, standing=(Transponder(name="t", position_m=(0.0, 0.0, 0.0)),)).key


def test_a_robot_without_floor_readers_has_no_floor_to_expand(spec, hybrid):
    """Tags that nobody reads are not carried on."""
    with pytest.raises(InvalidInput, match="no antenna reads the floor"):
        expansion_of(spec, hybrid.replace(readers=hybrid.readers[1:]), spec)


def test_scores_of_all_three_systems_come_at_once(spec, hybrid, uhf):
    """Pose, tracking and docking, each on trials of its own and with exact scores; UHF alone is tracking alone."""
    found = {}
    for name, layout in (("hybrid", hybrid), ("uhf", uhf), ("plain", plain(hybrid))):
        scored = answers.score(spec, layout, trials=3, workers=Workers(Backend.SERIAL, jobs=1))
        assert not scored.failures
        found[name] = scored
    simulated = {name: {key[0] for key in scored.simulated} for name, scored in found.items()}
    floor = {scenario.name for scenario in (spec.design, *spec.held_out)}
    assert simulated["hybrid"] == {*floor, "tracking", "docking"}
    assert simulated["plain"] == floor
    assert "tracking" in simulated["uhf"]
    assert "docking" not in simulated["uhf"]
    tracking = found["hybrid"].simulated["tracking", "uhf_laser"]
    assert (tracking["tracking_error_mean"].count, tracking["detection_share"].count) == (2, 2)
    assert found["hybrid"].simulated["docking", "bearing_filter"]["docking_success"].count == 3
    exact = set(found["hybrid"].exact)
    assert {"area_coverage", "direction_error_mean", "static_error_mean"} <= exact
    assert {"area_coverage", "cost"} <= set(found["uhf"].exact)
    assert not {"area_coverage", "direction_error_mean"} & set(found["plain"].exact)
    assert set(found["uhf"].does_not_apply) == {"mcl_adaptive", "midrange"}
    bare = hybrid.replace(transponders=())
    lacking = answers.score(spec, bare, trials=2, workers=Workers(Backend.SERIAL, jobs=1))
    assert "transponder" in lacking.does_not_apply["bearing_filter"]


def test_check_tells_the_tables(spec):
    """What robots carry, how it is judged, and that nobody pays the scanner."""
    lines = finder_lines(spec)
    assert "UHF 2 at ±45°" in lines[0]
    assert any("laser scanner" in line and "not priced" in line for line in lines)
    assert any("at (2.80, 1.00) m" in line for line in lines)
