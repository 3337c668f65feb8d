"""The search against the published layout: its comparisons, what binds, where it begins, and empty answers."""

from dataclasses import replace

import numpy as np
import pytest

from layoutopt.errors import InvalidInput
from layoutopt.progress import Silent
from layoutopt.scores import Score, TrialOutcomes
from layoutopt.spec.layout_file import read_layout
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in
from layoutopt.streams import Streams
from studies.against_reference import AgainstReference
from studies.against_reference_results import (
    ERROR,
    REFERENCE,
    Found,
    Results,
    binding,
    cheapest_as_accurate,
    compared,
    summary,
)
from studies.against_reference_setting import base_problem, cost_of, reference_layout, search_space, start_points
from studies.page_frame import closing_lines
from studies.runner import run_rounds


@pytest.fixture(scope="module")
def ward():
    """The built-in spec."""
    return read_spec(built_in())


@pytest.fixture(scope="module")
def study(ward):
    """The quick study of the ward."""
    return AgainstReference.for_spec(ward, quick=True)


def table(errors_m):
    """Return outcomes with these mean errors."""
    values = np.asarray(errors_m, dtype=np.float64)[:, None]
    return TrialOutcomes(replications=np.arange(len(values)), columns=(ERROR,), values=values)


def found(study, name, share, cost_eur):
    """Return a layout that a search may have found."""
    scores = {"cost": Score(value=cost_eur, unit="EUR")}
    return Found(
        filter=name, share=share, layout=study.reference, scores=scores, stage="done", layouts=1, trials=1
    )


def results_of(study, driven, items):
    """Return results of made-up drives in one scenario."""
    return Results(
        found=tuple(items),
        rows=compared(items, driven, ("mcl", "mcl_adaptive"), ("dry",)),
        refused={},
        reference=study.reference,
        reference_cost_eur=study.reference_cost_eur,
        reference_in_reach_eur=study.reference_cost_eur,
        driven=driven,
        cost=study.cost,
        design=study.problem.design,
        seed=7,
    )


def test_the_reference_is_what_the_paper_printed(ward, study):
    """Eight readers, 100 tags/m², the paper's profile whatever that of the spec, and the cost on this floor."""
    group, pattern = study.reference.readers[0], study.reference.floor_tags.zones[0].pattern
    assert group.name == "mi2016_8"
    assert group.profile.name == "mi2016"
    assert pattern.density_per_m2 == pytest.approx(100.0)
    assert study.reference.floor_tags.tag_part == ward.space.tag_part
    assert study.reference_cost_eur == 20944.63


def test_layouts_are_compared_drive_by_drive(study):
    """A layout that is half as bad on every drive has a ratio of one half without any spread."""
    hard = np.linspace(0.005, 0.05, 20)
    driven = {
        ("mcl", REFERENCE, "dry"): table(hard),
        ("mcl_adaptive", REFERENCE, "dry"): table(hard / 2.0),
        ("mcl", "0.3", "dry"): table(hard * 1.1),
        ("mcl", "1.0", "dry"): table(hard / 2.0),
        ("mcl_adaptive", "1.0", "dry"): table(hard / 4.0),
    }
    items = [found(study, "mcl", 0.3, 6000.0), found(study, "mcl", 1.0, 20000.0)]
    items.append(found(study, "mcl_adaptive", 1.0, 20000.0))
    results = results_of(study, driven, items)
    ratios = {(row.found.filter, row.found.share, row.reference_filter): row.ratio for row in results.rows}
    assert {place: round(score.value, 12) for place, score in ratios.items()} == {
        ("mcl", 0.3, "mcl"): 1.1,
        ("mcl", 1.0, "mcl"): 0.5,
        ("mcl_adaptive", 1.0, "mcl"): 0.25,
        ("mcl_adaptive", 1.0, "mcl_adaptive"): 0.5,
    }
    assert all(score.standard_error < 1e-12 for score in ratios.values())
    assert [row.as_accurate for row in results.rows] == [False, True, True, True]
    lines = summary(results)
    assert len(lines) == 5
    assert "for 95.5 % of the published one's cost was shown to be as accurate in every held-out" in lines[0]
    assert "With mcl, beside the published layout with mcl on dry: as accurate at 95.5 % of its cost" in lines[1]
    assert "20 held-out drives in each scenario, seed 7" in lines[4]
    nothing = results_of(study, {**driven, ("mcl", "1.0", "dry"): table(hard * 2.0)}, items[:2])
    assert summary(nothing)[0].startswith("No layout was shown to be as accurate as the published one")


def test_the_cheapest_that_is_shown_to_be_as_accurate_counts(study):
    """A cheaper one whose mean is better but not beyond chance does not."""
    draws = np.random.Generator(np.random.Philox(4))
    reference = np.full(12, 0.010)
    driven = {
        ("mcl", REFERENCE, "dry"): table(reference),
        ("mcl", "0.2", "dry"): table(reference * (0.98 + draws.normal(0.0, 0.4, 12))),
        ("mcl", "0.3", "dry"): table(reference * 0.9),
        ("mcl", "0.5", "dry"): table(reference * 0.8),
    }
    items = [found(study, "mcl", share, 20000.0 * share) for share in (0.5, 0.3, 0.2)]
    best = cheapest_as_accurate(results_of(study, driven, items).rows)
    assert best.found.share == 0.3
    assert cheapest_as_accurate(()) is None


def test_what_binds_the_reference(study):
    """Antennas 100 mm apart where 66 are needed, 20 mm to the outline, tags 80 mm apart beyond their length."""
    bound = binding(study.reference, results_of(study, {}, ()))
    assert bound.antennas == 8
    assert bound.antenna_room_m == pytest.approx(0.034)
    assert bound.outline_room_m == pytest.approx(0.02)
    assert bound.tag_room_m == pytest.approx(0.08)
    assert bound.radius_m == pytest.approx(0.03)
    assert bound.widest_radius_m == pytest.approx(0.03)
    # 8 readers of 31 EUR for each of 4 robots, half an hour of labour on each, 10 % of the modules spare.
    readers_eur = 32 * (25.0 + 6.0 + 0.5 * 45.0) + 4 * 25.0
    assert study.reference_cost_eur - bound.floor_eur == pytest.approx(readers_eur, abs=0.02)


def test_searches_begin_with_rings_that_use_their_budget(study):
    """Every start can be built for the money and leaves less than three per cent of it."""
    candidates = study.search.candidates(study._searches()[0].problem)
    budget_eur = 0.3 * study.reference_cost_eur
    starts = start_points(candidates, 20)
    assert len(starts) >= 3
    for point in starts:
        item = candidates.at(np.array(point))
        assert item.penalty is None
        assert item.layout.readers[0].name == "two_rings"
        assert 0.97 * budget_eur < item.scores["cost"].value <= budget_eur
    few = start_points(candidates, 2)
    assert len(few) == 2
    assert set(few) < set(starts)


def test_a_spec_with_a_range_brings_its_own_space(tiny_text, tmp_path):
    """Without any, rings and grids over lattices are searched; then starts of rings do not apply."""
    path = tmp_path / "free.toml"
    path.write_text(tiny_text, encoding="utf-8")
    assert [family.name for family in search_space(read_spec(path)).readers] == ["two_rings", "ring", "grid"]
    path.write_text(
        tiny_text.replace('to = "300 mm", steps = 3', 'to = "300 mm"').replace('"150 mm"', '"100 mm"'),
        encoding="utf-8",
    )
    spec = read_spec(path)
    assert search_space(spec) == spec.space
    study = AgainstReference.for_spec(spec, quick=True)
    assert start_points(study.search.candidates(base_problem(spec)), 4) == ()


@pytest.mark.parametrize(
    "antenna",
    [
        '{ model = "disc", radius = "20 mm" }',
        '{ model = "measured", table = [[0.04, 0, 0.02], [0.04, 0.03, 0], [0.06, 0, 0.03], [0.06, 0.03, 0]] }',
    ],
)
def test_antennas_that_were_measured_have_no_other_sides(tiny_text, tmp_path, antenna):
    """The space of the study's own varies sides, so it is refused with what would be right."""
    path = tmp_path / "measured.toml"
    path.write_text(tiny_text.replace("[space]", f"[space]\nantenna = {antenna}"), encoding="utf-8")
    with pytest.raises(InvalidInput, match="measured one has no other side"):
        search_space(read_spec(path))


def test_a_budget_that_buys_nothing_is_told(tiny_text, tmp_path):
    """The answer says so for each filter, and the page still tells of the reference."""
    path = tmp_path / "tiny.toml"
    path.write_text(tiny_text, encoding="utf-8")
    spec = read_spec(path)
    study = replace(AgainstReference.for_spec(spec, quick=True), shares=(0.01,), trials=2)
    ran = run_rounds(study, streams=Streams(seed=spec.seed), journal=None, progress=Silent())
    answer = study.answer(ran.evaluations, spec)
    *lines, sure, after = answer.lines(None)
    assert [sure, after] == closing_lines("against_reference", found=False)
    assert len(lines) == 2
    assert all("at most 1 % of the cost: no layout found" in line and "cost is" in line for line in lines)
    answer.write(tmp_path, streams=Streams(seed=spec.seed), quick=True)
    assert "8 readers" in (tmp_path / "report.html").read_text(encoding="utf-8").replace("Eight", "8")
    assert answer.exit_code == 1


def test_found_layouts_are_written_as_files_that_read_back(tiny_text, tmp_path):
    """One for each layout; the same key after reading."""
    path = tmp_path / "tiny.toml"
    path.write_text(tiny_text, encoding="utf-8")
    spec = read_spec(path)
    study = AgainstReference.for_spec(spec, quick=True)
    study = replace(
        study, shares=(1.0,), trials=2, search=replace(study.search, generations=1, polish_evaluations=0)
    )
    ran = run_rounds(study, streams=Streams(seed=spec.seed), journal=None, progress=Silent())
    results = study.results(ran.evaluations)
    assert {item.filter for item in results.found} == {"mcl", "mcl_adaptive"}
    assert {row.scenario for row in results.rows} == {scenario.name for scenario in spec.held_out}
    study.answer(ran.evaluations, spec).write(tmp_path, streams=Streams(seed=spec.seed), quick=True)
    for item in results.found:
        assert item.cost_eur <= cost_of(spec)(reference_layout(spec), spec.design, None)["cost"].value
        _, layout = read_layout(tmp_path / "layouts" / f"{item.layout.short_key}.toml")
        assert layout.key == item.layout.key
