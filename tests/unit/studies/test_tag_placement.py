"""The study of single tags: from a spec to its answer, and from the command line to the drawing."""

import dataclasses

import pytest
from small_studies import called

from layoutopt.errors import InvalidInput
from layoutopt.parts import bill_of_material
from layoutopt.result import Status
from layoutopt.spec.layout_file import read_layout
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from studies.tag_placement import TagPlacementStudy
from studies.tag_placement_setting import tag_price_cents, tags_cost_eur


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
    assert any("misses no more" in rival.label for rival in study.rivals)
    answer, text = _written(study, spec, tmp_path / "out")
    assert answer.exit_code == 0
    assert "Beside regular patterns" in text
    own = study.rivals[0].layout
    again = read_layout(tmp_path / "out" / "layouts" / f"{own.short_key}.toml")[1]
    assert again.key == own.key


@pytest.mark.parametrize(
    ("table", "status", "words"),
    [
        ('budget = "140 EUR"', Status.BUDGET_TOO_SMALL, "cost less than"),
        ('pitch = "400 mm"\ndemand = { tags = 9, length = "2 m" }', Status.INFEASIBLE, "see too few slots"),
        ('aim = "coverage"\nbudget = "200 EUR"', Status.BOUNDED, "no choice within the budget"),
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
    assert ("Where no slot serves" in text) == bool(len(study.found.placed.lost))
    if status is Status.INFEASIBLE:
        assert "Ways out" in text
        assert (tmp_path / "out" / "figures" / "unserved.svg").exists()
    if status.exit_code:
        assert "placed" not in {rival.label for rival in study.rivals}


@pytest.mark.long
def test_stages_have_a_table_with_all_at_once_beside_it(spec_with, tmp_path):
    """The dock first, then the rest; the summary names what all at once would take."""
    spec = spec_with(
        'stages = [["dock"], [""]]\ndemand = [{ zone = "dock", length = "0.8 m" }, { length = "1 m" }]\n'
    )
    study = TagPlacementStudy.for_spec(spec, quick=True)
    answer, text = _written(study, spec, tmp_path / "out")
    first, second = study.found.stages
    assert len(second.xy_m) == first.new + second.new
    assert "All stages at once would take" in " ".join(answer.lines(None))
    assert ">Stages<" in text


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


def test_the_command_answers_and_its_layout_can_be_drawn(tmp_path, tiny_text):
    """One run from the spec to the drawings."""
    (tmp_path / "tiny.toml").write_text(tiny_text, encoding="utf-8")
    ran = called("study", "tag_placement", "tiny.toml", "--quick", "--jobs", "1", "--out", "out", cwd=tmp_path)
    assert ran.returncode in (None, 0), ran.stderr
    assert "tags to lay" in ran.stdout
    layouts = sorted((tmp_path / "out" / "layouts").glob("*.toml"))
    drawn = called("draw", layouts[0], "--out", "sheets", cwd=tmp_path)
    assert drawn.returncode in (None, 0), drawn.stderr
    assert list((tmp_path / "sheets").iterdir())
