"""Layouts one step from another: which they are, what they change on common drives, how the report tells it."""

from dataclasses import replace

import numpy as np
import pytest
from made_findings import findings_of, layout_of, page_of, read, scores_in

from layoutopt.layout import Layout
from layoutopt.protocols import Mount, group_of
from layoutopt.readers.cross import cross
from layoutopt.result import Evaluated
from layoutopt.scores import Score, TrialOutcomes
from studies.one_steps import OneStep, one_steps_of

DRIVES = 40


def table(errors_m):
    return TrialOutcomes(
        columns=("position_error_mean",),
        replications=np.arange(len(errors_m)),
        values=np.asarray(errors_m, dtype=np.float64)[:, None],
    )


def steps_of(start, others, errors):
    """Return the steps from a layout; ``errors`` by layout are those of its drives, m."""
    problem = findings_of().problem
    items = [
        Evaluated(layout=layout, scores={"cost": Score(value=1000.0 + 10.0 * number, unit="EUR")})
        for number, layout in enumerate([start, *others])
    ]
    known = {
        group_of(layout, problem.design, problem.estimators[0]): table(drives)
        for layout, drives in zip([start, *others], errors, strict=True)
        if drives is not None
    }
    return one_steps_of(problem, items, items[0], known)


def drives(mean_m, seed):
    return mean_m + 0.001 * np.random.Generator(np.random.Philox(seed)).standard_normal(DRIVES)


def test_steps_are_the_next_values_of_a_single_choice():
    """Of sides 30, 60, 80 and 90 mm and pitches 0.1, 0.2, 0.3 and 0.4 m only the next ones are a step away."""
    start = layout_of(0.06, 0.2)
    near = [layout_of(0.03, 0.2), layout_of(0.08, 0.2), layout_of(0.06, 0.1), layout_of(0.06, 0.3)]
    far = [layout_of(0.09, 0.2), layout_of(0.06, 0.4), layout_of(0.08, 0.1), layout_of(0.03, 0.3)]
    others = [*far, *near]
    found = steps_of(start, others, [drives(0.01, number) for number in range(9)])
    assert {step.item.layout.key for step in found} == {layout.key for layout in near}
    assert [step.extra_cost for step in found] == sorted(step.extra_cost for step in found)
    assert {step.words for step in found if step.item.layout.key == near[1].key} == {
        "antenna sides 80 mm instead of 60 mm"
    }


def test_one_antenna_more_or_fewer_and_another_distance_are_steps():
    """Number and distance of a cross are choices of their own; both changed at once are no step."""
    start = layout_of(0.06, 0.2)
    (group,) = start.readers
    mount = Mount(antenna=group.antenna, height_m=0.02, profile=group.profile, antennas_per_module=4)

    def other(count, spacing_m):
        readers = (cross(count=count, spacing_m=spacing_m, mount=mount),)
        return Layout(floor_tags=start.floor_tags, readers=readers)

    found = steps_of(
        start,
        [other(8, 0.12), other(4, 0.15), other(8, 0.15)],
        [drives(0.01, number) for number in range(4)],
    )
    words = [step.words for step in found]
    assert len(words) == 2
    assert any("8 antennas instead of 4" in text for text in words)
    assert any("elsewhere on average" in text for text in words)


def test_a_change_is_paired_over_common_drives():
    """The drives' own scatter of 1 mm cancels: a shift of 0.1 mm is shown, with the error of the difference."""
    start, other = layout_of(0.06, 0.2), layout_of(0.08, 0.2)
    own = drives(0.01, 1)
    noise = 0.00002 * np.random.Generator(np.random.Philox(2)).standard_normal(DRIVES)
    (step,) = steps_of(start, [other], [own, own - 0.0001 + noise])
    assert step.change.value == pytest.approx(-0.0001 + noise.mean(), abs=1e-12)
    assert step.change.standard_error == pytest.approx(noise.std(ddof=1) / np.sqrt(DRIVES), rel=1e-6)
    assert step.verdict == "better"


def test_layouts_without_drives_and_few_drives_decide_nothing():
    """Without a drive there is no step; from three drives no verdict, however far the means are apart."""
    start = layout_of(0.06, 0.2)
    assert steps_of(start, [layout_of(0.08, 0.2)], [drives(0.01, 1), None]) == ()
    (few,) = steps_of(start, [layout_of(0.03, 0.2)], [drives(0.01, 1), drives(0.05, 2)[:3]])
    assert few.verdict == ""
    assert one_steps_of(findings_of().problem, [], None, {}) == ()


def test_the_report_tells_steps_with_interval_and_rate():
    """Change, its interval, the verdict in words, and euros for a millimetre where a dearer layout is better."""
    reader = read(page_of(findings_of()))
    (dear,) = [row for row in reader.rows if row and row[0].startswith("8 antennas instead of 4")]
    assert scores_in(dear[2]) == [(-4.00, 0.20, 380)]
    assert dear[4] == "more accurate"
    assert "EUR (" in dear[5]
    (cheap,) = [
        row for row in reader.rows if row and row[0].startswith("sides 30 mm instead of") and len(row) == 6
    ]
    assert cheap[1].startswith("-12.50")
    assert "interval not known (n = 3)" in cheap[3]
    assert cheap[4:] == ["neither", ""]
    assert "layoutopt explain layouts/" in reader.text
    nothing = replace(findings_of(), one_steps=())
    assert "What would one step more or less change?" not in read(page_of(nothing)).text


def test_a_step_knows_its_verdict():
    """Beyond zero on either side is a verdict; an interval about zero is none."""
    item = findings_of().result.recommended["cheapest"]

    def verdict(value_m):
        change = Score(value=value_m, unit="m", standard_error=0.001, count=50)
        return OneStep(item=item, words="", extra_cost=0.0, change=change).verdict

    assert [verdict(value_m) for value_m in (-0.01, 0.0, 0.01)] == ["better", "", "worse"]
