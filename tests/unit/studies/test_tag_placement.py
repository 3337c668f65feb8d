"""The study of single tags: from a spec to its answer, and from the command line to the drawing."""

import dataclasses
import re

import numpy as np
import pytest
from small_studies import called

from layoutopt.errors import InvalidInput
from layoutopt.parts import bill_of_material
from layoutopt.result import Status
from layoutopt.spec.layout_file import read_layout
from layoutopt.spec.reading import read_spec
from layoutopt.spec.writing import write_spec
from layoutopt.streams import Streams
from studies.tag_placement import TagPlacementStudy
from studies.tag_placement_setting import most_tags, tag_price_cents, tags_cost_eur

EVERYWHERE = 'pitch = "150 mm"\nunserved = "90 %"\n'
"""Few slots, and runs that need no routes, so that an answer takes a moment."""


@pytest.fixture
def spec_with(tmp_path, tiny_text):
    """Return a reader of the tiny spec with a table of placement."""

    def made(table=""):
        path = tmp_path / "own.toml"
        path.write_text(tiny_text + "[placement]\n" + table, encoding="utf-8")
        return read_spec(path)

    return made


def _written(study, spec, folder):
    folder.mkdir(exist_ok=True)
    answer = study.answer((), spec)
    answer.write(folder, streams=Streams(seed=0), quick=True)
    return answer, (folder / "report.html").read_text(encoding="utf-8")


def _page(study, spec):
    """Return the answer, the headings of its page, and the rows of its tables by name, with nothing written."""
    answer = study.answer((), spec)
    page = answer.page.page(Streams(seed=0))
    return answer, [section.heading for section in page.sections], {data.name: data.rows for data in page.data}


def test_the_price_of_a_tag_is_what_the_bill_grows_by(spec_with):
    """Ten thousand tags more cost ten thousand times the price to within a cent each; the survey comes once."""
    spec = spec_with()
    cents, first = tag_price_cents("label", spec.prices, spec.robot_count, 0)
    grown = tags_cost_eur(spec, 20_000, 0) - tags_cost_eur(spec, 10_000, 0)
    assert abs(100.0 * grown / 10_000 - cents) <= 0.5 + 1e-9
    assert first > 0
    assert tag_price_cents("label", spec.prices, spec.robot_count, 5)[1] == 0
    layout = next(iter(spec.problem().space.layouts()))
    tag_map = layout.floor_tags.lay_on(spec.site)
    bill = bill_of_material(layout, tag_map, spec.robot_count, spec.prices)
    robots = sum(line.total_cents for line in bill.lines if line.item in ("reader_module", "antenna"))
    assert tags_cost_eur(spec, len(tag_map), 0) < bill.total_eur - robots / 100.0 + 1e-9


def test_the_default_question_has_an_answer_and_layouts_that_can_be_read(spec_with, tmp_path):
    """Placed tags stand first, keep to slots, and lie in the file as they were placed."""
    spec = spec_with()
    study = TagPlacementStudy.for_spec(spec, quick=True)
    assert study.found.placed.status in (Status.OPTIMAL, Status.BOUNDED)
    assert study.rivals[0].label == "placed"
    assert study.rivals[0].missed == study.found.placed.missed
    (missed,) = study.found.placed.missed
    assert 0 < missed.draws <= 100
    assert missed.draws < missed.runs
    assert any("misses no more" in rival.label for rival in study.rivals)
    answer, text = _written(study, spec, tmp_path / "out")
    assert answer.exit_code == 0
    assert "Beside regular patterns" in text
    told = " ".join(answer.lines(tmp_path / "out"))
    assert "tags to lay" in told
    assert told.endswith(str(tmp_path / "out" / "report.html"))
    assert f"{missed.runs} fresh random runs of {missed.draws} routes" in told
    assert f"at most {missed.upper:.2%} of all at 95 %, counted by routes" in told
    own = study.rivals[0].layout
    again = read_layout(tmp_path / "out" / "layouts" / f"{own.short_key}.toml")[1]
    assert again.key == own.key


@pytest.mark.parametrize(
    ("table", "status", "words"),
    [
        ('budget = "140 EUR"', Status.BUDGET_TOO_SMALL, "pays for 2 new tags, and no choice"),
        ('pitch = "400 mm"\ndemand = { tags = 9, length = "2 m" }', Status.INFEASIBLE, "see too few slots"),
        (
            EVERYWHERE + 'aim = "coverage"\nbudget = "200 EUR"\ndemand = { along = "everywhere" }',
            Status.BOUNDED,
            "no choice within the budget",
        ),
    ],
)
def test_every_ending_has_its_status_sentence_and_exit_code(spec_with, tmp_path, table, status, words):
    """Refusals too have a page, with the cells and ways out where there are some."""
    spec = spec_with(table)
    study = TagPlacementStudy.for_spec(spec, quick=True)
    assert study.found.placed.status is status
    answer, text = _written(study, spec, tmp_path / "out")
    assert answer.exit_code == status.exit_code
    assert words in " ".join(answer.lines(None))
    assert ("drawn evenly" in text) == ("coverage" in table)
    assert ("Fresh runs a round" in text) == ("coverage" not in table)
    assert ("Where no slot serves" in text) == bool(len(study.found.placed.lost))
    if status is Status.INFEASIBLE:
        assert "Ways out" in text
        assert (tmp_path / "out" / "figures" / "unserved.svg").exists()
    if status.exit_code:
        assert "placed" not in {rival.label for rival in study.rivals}


def test_stages_have_a_table_with_all_at_once_beside_it(spec_with):
    """The dock first, then the rest; the summary counts the tags of both, and what all at once would take."""
    spec = spec_with(
        EVERYWHERE
        + 'stages = [["dock"], [""]]\ndemand = [{ zone = "dock", length = "0.4 m", along = "everywhere" },'
        ' { length = "1 m", along = "everywhere" }]\n'
    )
    study = TagPlacementStudy.for_spec(spec, quick=True)
    answer, headings, tables = _page(study, spec)
    first, second = (stage.placed for stage in study.found.stages)
    assert second.new > 0
    assert study.found.new == len(second.xy_m) == first.new + second.new
    told = " ".join(answer.lines(None))
    assert f"{study.found.new} tags to lay" in told
    assert f"All stages at once would take {study.found.at_once.new} tags" in told
    assert "Stages" in headings
    assert [row[0] for row in tables["stages"]] == ["1", "2"]


@pytest.mark.long
def test_a_stage_without_an_answer_ends_the_study_with_its_reason(spec_with, tmp_path):
    """The dock is served; the rest demands more tags than any run sees."""
    spec = spec_with(
        'pitch = "150 mm"\nstages = [["dock"], [""]]\n'
        'demand = [{ zone = "dock", length = "0.4 m", along = "everywhere", tags = 50 },'
        ' { length = "1 m", along = "everywhere" }]\n'
    )
    study = TagPlacementStudy.for_spec(spec, quick=True)
    answer, text = _written(study, spec, tmp_path / "out")
    assert answer.exit_code == Status.INFEASIBLE.exit_code
    assert "see too few slots" in " ".join(answer.lines(None))
    assert ">Stages<" in text
    assert [stage.placed.xy_m for stage in study.found.stages] == [None]


def test_the_smallest_gap_is_told_from_both_sides(spec_with):
    """A shorter length than the one asked for is served; without money none is, and that is the answer."""
    demand = EVERYWHERE + 'aim = "gap"\ndemand = { length = "0.4 m", along = "everywhere" }\n'
    spec = spec_with(demand + 'budget = "1000 EUR"\n')
    study = TagPlacementStudy.for_spec(spec, quick=True)
    gap = study.found.gap
    assert 0.0 <= gap.impossible_m < gap.length_m < 0.4
    assert tags_cost_eur(spec, gap.placed.new, 0) <= 1000.0
    answer, _, tables = _page(study, spec)
    assert "are served within the budget; " in " ".join(answer.lines(None))
    assert tables["gap"] == ((f"{gap.length_m:.9g}", f"{gap.impossible_m:.9g}", f"{gap.step_m:.9g}"),)
    spec = spec_with(demand + 'budget = "1 EUR"\n')
    poor = TagPlacementStudy.for_spec(spec, quick=True)
    assert poor.found.gap.length_m is None
    answer = poor.answer((), spec)
    assert answer.exit_code == 1
    assert "pays for 0 new tags" in " ".join(answer.lines(None))


def test_a_front_has_a_figure_a_table_and_says_what_it_leaves_open(spec_with, tmp_path):
    """More tags serve more runs; every choice keeps its bound; the budgets between are named."""
    spec = spec_with(EVERYWHERE + 'aim = "front"\ndemand = { length = "0.5 m", along = "everywhere" }\n')
    study = TagPlacementStudy.for_spec(spec, quick=True)
    points = study.found.front.points
    assert len(points) >= 4
    new, share = (np.array([getattr(point.placed, name) for point in points]) for name in ("new", "met_share"))
    assert (np.diff(new) > 0).all()
    assert (np.diff(share) > 0.0).all()
    assert all(point.placed.bound >= point.placed.met_share - 1e-9 for point in points)
    answer, text = _written(study, spec, tmp_path / "out")
    assert answer.exit_code == 0
    assert "Better choices than those shown may exist for" in " ".join(answer.lines(None))
    assert ">Tags against runs served<" in text
    assert (tmp_path / "out" / "figures" / "front.svg").exists()
    assert (
        len((tmp_path / "out" / "tables" / "front.csv").read_text(encoding="utf-8").splitlines())
        == len(points) + 1
    )
    assert study.rivals[0].tags == points[-1].placed.new


def test_required_slots_are_laid_and_those_that_are_forbidden_too_are_refused(spec_with):
    """The place names the nearest slot of the grid."""
    table = EVERYWHERE + 'demand = { length = "1 m", along = "everywhere" }\nrequired = [[1, 1]]\n'
    study = TagPlacementStudy.for_spec(spec_with(table), quick=True)
    question = study.asked.question
    assert question.required_count == 1
    assert (study.found.placed.xy_m == question.slots.xy_m[question.required]).all(axis=1).any()
    both = TagPlacementStudy.for_spec(spec_with(table + "forbidden = [[1, 1]]\n"), quick=True)
    assert both.found.placed.status is Status.INFEASIBLE
    assert "required and forbidden at once" in both.found.placed.message


def test_a_budget_is_kept_by_the_bill(spec_with):
    """One tag more than it pays for would cost more, survey and spares included."""
    spec = spec_with('budget = "200 EUR"\n')
    most = most_tags(spec, 0, 10_000)
    assert tags_cost_eur(spec, most, 0) <= 200.0 < tags_cost_eur(spec, most + 1, 0)
    assert most_tags(spec, 0, 5) == 5
    assert most_tags(spec_with(), 0, 5) is None


def test_a_floor_too_large_for_the_default_grid_is_refused_by_this_study_alone(tmp_path, tiny_text):
    """A spec that asks nothing of single tags can be read; its frozen copy too."""
    wide = re.sub(r"(?m)^floor = .*$", "floor = [[0, 0], [40, 0], [40, 30], [0, 30]]", tiny_text)
    assert wide != tiny_text
    (tmp_path / "own.toml").write_text(wide, encoding="utf-8")
    spec = read_spec(tmp_path / "own.toml")
    write_spec(spec, tmp_path / "frozen.toml")
    assert read_spec(tmp_path / "frozen.toml").placement == spec.placement
    with pytest.raises(InvalidInput, match=r"placement\.pitch.* slots, and at most"):
        TagPlacementStudy.for_spec(spec, quick=True)


def test_a_forbidden_place_that_is_no_slot_is_refused_by_its_number(spec_with):
    """The one that is a slot is not named."""
    spec = spec_with("forbidden = [[1, 1], [3.9, 2.9]]\n")
    with pytest.raises(InvalidInput, match=r"placement\.forbidden\[1\]") as refused:
        TagPlacementStudy.for_spec(spec, quick=True)
    assert "forbidden[0]" not in str(refused.value)


def test_a_reader_group_that_cannot_be_built_is_refused(spec_with):
    """With the rule that it breaks; without a number the first that can be built is taken."""
    spec = spec_with("reader = 2\n")
    wide = dataclasses.replace(spec.robot, outline_m=spec.robot.outline_m / 2.0)
    with pytest.raises(InvalidInput, match="beyond the robot's outline"):
        TagPlacementStudy.for_spec(dataclasses.replace(spec, robot=wide), quick=True)


@pytest.mark.long
def test_the_command_answers_and_its_layout_can_be_drawn(tmp_path, tiny_text):
    """One run from the spec to the drawings."""
    (tmp_path / "tiny.toml").write_text(tiny_text + "[placement]\n" + EVERYWHERE, encoding="utf-8")
    ran = called("study", "tag_placement", "tiny.toml", "--quick", "--jobs", "1", "--out", "out", cwd=tmp_path)
    assert ran.returncode in (None, 0), ran.stderr
    assert "tags to lay" in ran.stdout
    layouts = sorted((tmp_path / "out" / "layouts").glob("*.toml"))
    drawn = called("draw", layouts[0], "--out", "sheets", cwd=tmp_path)
    assert drawn.returncode in (None, 0), drawn.stderr
    assert list((tmp_path / "sheets").iterdir())
