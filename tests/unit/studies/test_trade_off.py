"""What more accuracy costs, how sure a front is, and which other layouts are as good: on made-up trials."""

import csv
import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.estimators.midrange import Midrange
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.patterns.triangular import triangular
from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Mount, group_of
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.result import Evaluated
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.scores import Score, TrialOutcomes, paired_difference
from layoutopt.site import Site
from layoutopt.space import DesignSpace, Family
from solvers.front import front_of
from solvers.front_measures import hypervolume
from studies.alternatives import (
    LEAST_TRIALS,
    Wish,
    alternatives_lines,
    alternatives_of,
    difference_words,
    rule_text,
)
from studies.front_tables import write_exchange_rates
from studies.trade_off import front_text, next_step_text, rate_text, trade_off_lines, trade_off_of

GOAL = "position_error_mean"
ROBOT = Robot(outline_m=[(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)])
DESIGN = Scenario(name="design", role=Role.DESIGN, site=Site(name="room", floor=box(0, 0, 4, 4)), robot=ROBOT)
PROBLEM = Problem(
    space=DesignSpace(
        readers=(Family(name="cross", build=cross, values={"count": (4,)}),),
        patterns={"": (Family(name="square", build=square, values={"pitch_m": (0.1, 0.2)}),)},
    ),
    design=DESIGN,
    held_out=(),
    objectives=(),
    goals=("cost", GOAL),
    limits=(),
    estimators=(Midrange(),),
)


def layout_of(pattern, count=4, side_m=0.06, per_module=1):
    mount = Mount(
        antenna=SphereAntenna(side_m=side_m), height_m=0.02, profile=COMMERCIAL, antennas_per_module=per_module
    )
    tags = FloorTags(zones=(ZonePattern(zone="", pattern=pattern),))
    return Layout(floor_tags=tags, readers=(cross(count=count, mount=mount),))


def study(*rows, trials=64, seed=4):
    """Return evaluated layouts and outcomes of rows (cost, mean error, layout): drives are common to all."""
    generator = np.random.Generator(np.random.Philox(seed))
    drives = generator.standard_normal(trials)
    items, known = [], {}
    for cost, mean_m, layout, *count in rows:
        own = generator.standard_normal(trials)
        values = mean_m * (1.0 + 0.2 * (drives - drives.mean()) + 0.02 * (own - own.mean()))
        number = count[0] if count else trials
        table = TrialOutcomes(
            replications=np.arange(number), columns=(GOAL,), values=values[:number].reshape(-1, 1)
        )
        known[group_of(layout, DESIGN, PROBLEM.estimators[0])] = table
        scores = {"cost": Score(value=cost, unit="EUR"), GOAL: table.score(GOAL)}
        items.append(Evaluated(layout=layout, scores=scores))
    return items, known


def four():
    """Return a front of four, of which the second step buys nothing that can be shown."""
    return study(
        (1000.0, 0.020, layout_of(square(pitch_m=0.4))),
        (1100.0, 0.010, layout_of(square(pitch_m=0.3))),
        (1200.0, 0.00999, layout_of(square(pitch_m=0.25))),
        (2000.0, 0.005, layout_of(square(pitch_m=0.2))),
    )


def trade_off(items, known, **recommended):
    front = front_of(items, PROBLEM.goals)
    return trade_off_of(PROBLEM, items, front, recommended, known, seed=1), front


def test_rates_use_the_paired_differences_of_neighbours():
    """The gain is that of the common drives, far surer than two independent scores, and in euros a millimetre."""
    items, known = four()
    found, front = trade_off(items, known)
    assert len(front) == 4
    first = found.rates[0]
    tables = [known[group_of(item.layout, DESIGN, PROBLEM.estimators[0])] for item in items]
    assert first.gain == paired_difference(tables[0], tables[1], GOAL)
    assert first.rate / 1000 == pytest.approx(10.0, rel=0.01)
    assert [rate.significant for rate in found.rates] == [True, False, True]
    assert rate_text(first, GOAL).startswith("10 EUR (")
    assert rate_text(found.rates[1], GOAL).startswith("not significant, at least ")


def test_the_next_step_skips_what_buys_nothing():
    """From the second layout on the next millimetre is bought with the fourth, not with its neighbour."""
    items, known = four()
    found, _ = trade_off(items, known, cheapest=items[1], **{"most accurate": items[3]})
    assert found.next_steps["cheapest"].dearer.layout.key == items[3].layout.key
    assert "most accurate" not in found.next_steps
    assert "the next millimetre costs 180 EUR (" in next_step_text(found, "cheapest")
    assert "no dearer one" in next_step_text(found, "most accurate")
    lines = trade_off_lines(found, {"cheapest": items[1], "most accurate": items[3]})
    assert len(lines) == 2
    assert lines[1] == front_text(found)


def test_the_hypervolume_is_that_of_the_front_within_its_reference():
    """In logarithms, a tenth beyond the worst; its error comes of the draws."""
    items, known = four()
    found, front = trade_off(items, known)
    goals = np.array([[item.scores[goal].value for goal in PROBLEM.goals] for item in front.members])
    assert found.reference == pytest.approx((2200.0, 0.022))
    assert found.hypervolume.value == pytest.approx(
        hypervolume(goals, np.array(found.reference), logarithmic=True)
    )
    # All errors go with the drives, 0.2 / 8 = 2.5 % together: times the width in logarithms of cost, 0.79.
    assert found.hypervolume.standard_error == pytest.approx(0.025 * math.log(2.2), rel=0.3)


def test_sure_members_are_told_from_doubtful_ones():
    """Clear steps are sure; of two that are equal within their errors the dearer one is a toss-up."""
    items, known = four()
    found, _ = trade_off(items, known)
    shares = [found.membership[item.layout.key] for item in items]
    assert shares[0] == 1.0
    assert shares[1] > 0.99
    assert 0.3 < shares[2] < 0.9
    assert shares[3] > 0.99


def test_without_trials_nothing_is_known():
    """A front of exact scores only has neither membership nor errors, and says nothing."""
    items, _ = four()
    found, _ = trade_off(items, {}, cheapest=items[0])
    assert found.membership == {}
    assert [rate_text(rate, GOAL) for rate in found.rates] == ["not known"] * 3
    assert found.next_steps == {}
    assert found.hypervolume.standard_error == math.inf
    empty, _ = trade_off([], {})
    assert (empty.rates, empty.reference, empty.hypervolume, front_text(empty)) == ((), None, None, "")


def test_the_table_of_rates_leaves_open_ends_empty(tmp_path):
    """Neighbours first, then steps from recommended layouts; a rate that is not significant has no upper end."""
    items, known = four()
    found, _ = trade_off(items, known, cheapest=items[1])
    write_exchange_rates(found, tmp_path / "rates.csv")
    with (tmp_path / "rates.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["step"] for row in rows] == ["neighbours"] * 3 + ["next after cheapest"]
    assert [row["significant"] for row in rows] == ["yes", "no", "yes", "yes"]
    assert rows[1]["eur_per_m_high"] == ""
    assert float(rows[0]["eur_per_m"]) == pytest.approx(found.rates[0].rate)


def choices():
    """Return a recommended layout and eight others: equal, different, too dear, worse, cheaper, on few trials."""
    return study(
        (1000.0, 0.0100, layout_of(square(pitch_m=0.2))),
        (1050.0, 0.0101, layout_of(square(pitch_m=0.199))),
        (1100.0, 0.0102, layout_of(triangular(pitch_m=0.2))),
        (1150.0, 0.0103, layout_of(square(pitch_m=0.2), count=8, side_m=0.03)),
        (1500.0, 0.0090, layout_of(triangular(pitch_m=0.1))),
        (1100.0, 0.0300, layout_of(triangular(pitch_m=0.4))),
        (900.0, 0.0101, layout_of(square(pitch_m=0.4), count=8)),
        (1100.0, 0.0090, layout_of(triangular(pitch_m=0.15), count=12), LEAST_TRIALS - 1),
    )


def alternatives(wish, limits=(), failed=(), role="cheapest"):
    items, known = choices()
    problem = replace(PROBLEM, limits=limits)
    return items, alternatives_of(problem, items, {role: items[0]}, known, wish, failed)


def keys(found):
    return [entry.item.layout.key for entry in found.found]


def test_alternatives_to_the_cheapest_meet_the_demand_and_cost_little_more():
    """Not the nearly equal one, the dear one, the one that misses the demand, the cheaper or the unproven one."""
    limits = (Limit(score=GOAL, upper=0.015),)
    items, found = alternatives(Wish(count=3), limits)
    assert keys(found) == [items[2].layout.key, items[3].layout.key]
    assert found.by_demand
    assert found.near == 4
    assert found.shortfall == "2 of 3: 3 other layouts are as good, but no 3 of them differ by 0.2"
    entry = found.found[0]
    assert entry.extra_cost == pytest.approx(100.0)
    assert entry.change.value == pytest.approx(0.0002, rel=1e-6)
    assert entry.words == "triangular tags instead of square"
    assert "meet every demand in the search and cost at most 20 % more" in rule_text(found, GOAL)
    lines = alternatives_lines(found, GOAL)
    assert len(lines) == 3
    assert "+100.00 EUR, +0.20" in lines[0]


def test_a_layout_that_failed_on_held_out_drives_is_no_alternative():
    """It is known to miss the demand."""
    limits = (Limit(score=GOAL, upper=0.015),)
    items, found = alternatives(Wish(count=1), limits)
    assert keys(found) == [items[2].layout.key]
    items, found = alternatives(Wish(count=1), limits, failed={items[2].layout.key})
    assert keys(found) == [items[3].layout.key]


def test_without_a_demand_alternatives_are_shown_to_be_as_accurate():
    """A cheaper one may then be chosen too; the least sum of errors decides."""
    items, found = alternatives(Wish(count=2), role="knee")
    assert not found.by_demand
    assert keys(found) == [items[6].layout.key, items[2].layout.key]
    assert "are shown to have a mean position error at most 20 % larger" in rule_text(found, GOAL)
    _, strict = alternatives(Wish(count=2, tolerance=0.001), role="knee")
    assert strict.found == ()
    assert strict.shortfall.startswith("none of 2")


def test_who_wants_no_alternatives_gets_none():
    """And without a recommended layout there is nothing to differ from."""
    _, found = alternatives(Wish(count=0))
    assert (found.found, found.shortfall, alternatives_lines(found, GOAL)) == ((), "", [])
    assert alternatives_of(PROBLEM, [], {}, {}, Wish()).instead_of is None


def test_differences_are_told_as_an_installer_would():
    """Number, place and size of antennas, modules, family and density of tags, zone by zone."""
    first = layout_of(square(pitch_m=0.2), per_module=4)
    second = layout_of(triangular(pitch_m=0.1), count=8, side_m=0.03, per_module=1)
    assert difference_words(first, second) == (
        "8 antennas instead of 4, antenna sides 30 mm instead of 60 mm, 8 reader modules a robot instead of 1, "
        "triangular tags instead of square, 4 times as many tags a square metre"
    )
    assert difference_words(first, first) == "nothing that is counted"
    zone = ZonePattern(zone="dock", pattern=triangular(pitch_m=0.2), angle_rad=0.1)
    docked = first.replace(floor_tags=FloorTags(zones=(*first.floor_tags.zones, zone)))
    assert difference_words(first, docked) == (
        "in zone 'dock' triangular tags instead of square and tags turned by +5.73°"
    )


def test_what_the_race_may_have_misjudged_is_told_where_it_is_known():
    """A race that did not end says nothing of it."""
    items, known = four()
    found, front = trade_off(items, known)
    assert "wrong side" not in front_text(found)
    judged = trade_off_of(PROBLEM, items, front, {}, known, seed=1, misjudged=1.26)
    assert "at most 1.3 layouts are expected on the wrong side of the front" in front_text(judged)
