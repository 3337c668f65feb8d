"""The first page of the report: what it says follows the findings, and what is not shown is said."""

from dataclasses import replace

import pytest
from made_findings import findings_of, metres, page_of, read
from shapely import box

from layoutopt.parts import Scope
from layoutopt.problem import Limit
from layoutopt.result import Status
from layoutopt.score_text import NOT_KNOWN
from studies.first_page import first_page


def told(findings, quick=False):
    return first_page(findings, quick=quick)


def test_what_to_buy_is_the_first_recommended_layout():
    """Tags, antennas, modules, robots and the split of the cost are those of the layout and its bill."""
    findings = findings_of()
    item = findings.result.recommended["cheapest"]
    lead, money, order, named = told(findings).buy
    tags = len(item.layout.floor_tags.lay_on(findings.problem.design.site))
    assert lead.startswith(
        f"Lay {tags} tags on the floor and mount 4 antennas with 1 reader module under each robot"
    )
    assert item.layout.label in named
    assert item.layout.short_key in named
    bill = findings.problem.objectives[0].bill(item.layout, findings.problem.design)
    assert f"{bill.total_eur:,.2f}".replace(",", "\u202f") in money
    assert "for 3 robots" in money
    goods = [line for line in bill.lines if line.scope is not Scope.LABOUR]
    spare_tags = next(line.quantity for line in goods if line.scope is Scope.SPARES and line.item == "label")
    assert order.startswith(f"To order, spares included: {tags + spare_tags:g} × HF label ISO 15693")
    assert len(order.split("; ")) == len({line.description for line in goods})


def test_a_zone_that_bars_the_tags_is_named_with_what_to_buy():
    """No tag of this part goes there, so nobody looks for one that is missing; other zones are not named."""
    findings = findings_of()
    site = findings.problem.design.site
    assert "No such tag" not in " ".join(told(findings).buy)
    plate = replace(site.zones[0], name="plate", metal=True)
    design = replace(findings.problem.design, site=replace(site, zones=(*site.zones, plate)))
    page = told(replace(findings, problem=replace(findings.problem, design=design)))
    assert page.buy[3] == "No such tag goes into the zone “plate”."


def test_a_floor_that_robots_hardly_reach_is_told_with_what_was_asked():
    """Where the demand was looked at is a part of it; robots that get about need no such sentence."""
    findings = findings_of()
    assert "get to" not in " ".join(told(findings).asked)
    walls = box(1.5, 0, 6, 4)  # leaves 1.5 m by 4 m, less 0.41 m for the robot at each wall
    site = replace(findings.problem.design.site, obstacles=(walls,))
    narrow = replace(findings.problem.design, site=site)
    page = told(replace(findings, problem=replace(findings.problem, design=narrow)))
    assert page.asked[1].startswith("The middle of a robot can get to 2.2 m² of it: all drives are there")


def test_how_exact_gives_each_held_out_world_with_intervals_and_the_search_where_there_is_none():
    """The error in plain words with three digits and its 95 % interval; a few drives give none."""
    findings = findings_of()
    (held_out,) = told(findings).exact
    assert "1 % of the tags dead" in held_out
    assert "11 mm" in held_out
    findings = replace(findings, validations=())
    (search,) = told(findings).exact
    assert search.startswith(
        "On the 400 drives by which it was chosen (tours of the whole floor; nothing goes wrong) a robot is on "
        "average 10.3 mm from where it believes to be (95 % sure: "
    )
    item = findings.result.recommended["cheapest"]
    few = replace(item, scores={**item.scores, "position_error_mean": metres(0.0103, 0.004, 3)})
    result = replace(findings.result, recommended={"cheapest": few})
    last = told(replace(findings, result=result)).exact[-1]
    assert last.startswith("On the 3 drives")
    assert "too few to say how exactly" in last


def test_a_zone_with_a_target_of_its_own_is_told_from_the_drives_that_are_harder_there():
    """Of two held-out scenarios the one that is farther from the demand counts."""
    findings = findings_of()
    problem, row = findings.problem, findings.validations[0]
    hard = replace(problem.held_out[0], name="held-out/hard")
    scenarios = (problem.held_out[0], hard)
    limit = Limit(score="dock.position_error_mean", upper=0.012)
    rows = [
        replace(row, scenario=scenario.name, scores={**row.scores, limit.score: metres(mean_m, 0.0001, 200)})
        for scenario, mean_m in zip(scenarios, (0.0061, 0.0072), strict=True)
    ]
    changed = replace(problem, held_out=scenarios, limits=(*problem.limits, limit))
    page = told(replace(findings, problem=changed, validations=tuple(rows)))
    assert any(
        text.startswith("In the zone “dock” a robot is on average 7.2 mm from where") and "harder there" in text
        for text in page.exact
    )


@pytest.mark.parametrize(
    ("upper", "verdict", "words"),
    [
        (0.012, "met", "by luck, in at most 5 of 100"),
        (0.0110, "undecided", "too few to say"),
        (0.009, "broken", "Do not build this"),
    ],
)
def test_how_sure_follows_the_verdict_on_held_out_drives(upper, verdict, words):
    """Met, undecided and broken demands are told apart, with the number of drives that say so."""
    page = told(findings_of(limits=(Limit(score="position_error_mean", upper=upper),)))
    assert page.verdict == verdict
    assert words in page.sure[0]
    assert "200 simulated drives" in page.sure[0]


def test_how_sure_tells_untried_unknown_and_undemanded_apart():
    """Without held-out drives, without the score of a demand, and without a demand nothing is promised."""
    untried = told(replace(findings_of(), validations=()))
    assert (untried.verdict, untried.sure[0].partition(":")[0]) == ("untried", "Not tested")
    unknown = told(findings_of(limits=(Limit(score="dock.position_error_mean", upper=0.02),)))
    assert unknown.verdict == NOT_KNOWN
    free = told(findings_of(limits=()))
    assert (free.verdict, free.asked[-1]) == ("", "No target was set.")
    assert "No demand was set" in free.sure[0]


def test_a_scenario_without_drives_leaves_the_verdict_open():
    """Two held-out scenarios of which one was not driven are not enough for a demand to be met."""
    findings = findings_of()
    second = replace(findings.problem.held_out[0], name="held-out/2")
    problem = replace(findings.problem, held_out=(*findings.problem.held_out, second))
    assert told(replace(findings, problem=problem)).verdict == NOT_KNOWN


def test_what_was_not_shown_is_always_said():
    """Simulation, length of drives, estimator, prices, optimality; a quick look and extrapolation if so."""
    findings = findings_of()
    words = " ".join(told(findings).not_shown)
    for part in (
        "every figure is simulated",
        "“midrange”",
        "“default-2026”",
        "3 of 4 layouts",
        "Longer drives than",
        "places where no drive came",
        "none with laser scanners or cameras was compared",
        "why others were left out stands further down",
        "Robots and their computers are not in the sum",
    ):
        assert part in words
    assert "quick look" not in words
    assert "quick look" in told(findings, quick=True).not_shown[0]
    dear = findings.result.recommended["knee"]
    result = replace(findings.result, recommended={"knee": dear})
    assert "extrapolated" in " ".join(told(replace(findings, result=result)).not_shown)
    asked_elsewhere = replace(findings.problem, elsewhere=("docking success at least 90 %",))
    assert "docking success" in told(replace(findings, problem=asked_elsewhere)).not_shown[-1]


def test_the_cheapest_layout_of_all_says_that_a_cheaper_one_may_lie_outside():
    """The end of the design space is no answer of the search; a cheaper layout that was compared is one."""
    findings = findings_of()
    words = "Not one costs less than this one"
    assert words in " ".join(told(findings).not_shown)
    assert words not in " ".join(told(replace(findings, problem=replace(findings.problem, limits=()))).not_shown)
    dear = replace(findings.result, recommended={"cheapest": findings.result.recommended["knee"]})
    assert words not in " ".join(told(replace(findings, result=dear)).not_shown)


def test_a_refusal_recommends_nothing_to_buy():
    """A layout that was not shown to do what was asked is a lead, and no order."""
    findings = findings_of()
    result = replace(findings.result, status=Status.TARGET_NOT_MET, shortfall="2 mm are missing")
    page = told(replace(findings, result=result))
    assert page.buy[0].startswith("Nothing yet")
    assert "To order" not in " ".join(page.buy)
    text = read(page_of(replace(findings, result=result))).text
    assert text.index("2 mm are missing") < text.index("What this does not show") < text.index("The front")


def test_the_first_page_uses_no_term_of_the_trade():
    """A customer reads it without a glossary: none of the words that the rest of the report explains."""
    limits = (
        Limit(score="position_error_mean", upper=0.012),
        Limit(score="heading_error_p95", upper=0.09),
        Limit(score="dock.position_error_mean", upper=0.02),
        Limit(score="lost_share", upper=0.02),
        Limit(score="cost", upper=9000.0),
    )
    for status in Status:
        findings = findings_of(limits=limits)
        page = told(replace(findings, result=replace(findings.result, status=status)))
        sentences = [page.headline, *page.asked, *page.buy, *page.exact, *page.sure, *page.not_shown]
        for term in ("held-out", "front", "optimism", "p95", "95 % heading", "estimator", "raced", "design space"):
            assert term not in " ".join(sentences), term
    many = told(findings_of(limits=limits * 2)).asked[-1]
    assert many.endswith("; and 5 more, which stand in the table of demands.")
    asked = told(findings_of(limits=limits)).asked[-1]
    assert "in 95 of 100 moments a robot looks at most 5.157° past where it believes to look" in asked
    assert "in the zone “dock” a robot is on average at most 20 mm from where it believes to be" in asked
    assert "a robot is lost at most 2 % of the time (lost: more than 250 mm off)" in asked
