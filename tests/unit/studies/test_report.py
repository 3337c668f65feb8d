"""The HTML report: every number is that of the findings, and nothing in it is loaded, or run but our script."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from harmless import check_page
from made_findings import NOTHING_SAVED, figure_svg, findings_of, metres, page_of, read, scores_in

from layoutopt.parts import Scope, bill_of_material, default_prices
from layoutopt.problem import Limit
from layoutopt.protocols import Group
from layoutopt.result import Front, Result, Status

HOSTILE = '<script>alert(1)</script>=cmd|\'$x$ & "q"'


def test_recommended_numbers_are_those_of_the_findings():
    """Cost, tags, antennas, modules, search, held-out score and optimism of a layout equal its scores."""
    findings = findings_of()
    row = next(row for row in read(page_of(findings)).rows if row[0] == "cheapest" and len(row) == 9)
    item = findings.result.recommended["cheapest"]
    cost = item.scores["cost"].value
    assert float(re.sub(r"[^\d.]", "", row[2])) == pytest.approx(cost, abs=0.005)
    assert int(row[3]) == len(item.layout.floor_tags.lay_on(findings.problem.design.site))
    assert (row[4], row[5]) == ("4", "1")
    assert scores_in(row[6]) == [(10.34, 0.21, 400)]
    assert scores_in(row[7]) == [(11.01, 0.30, 200)]
    assert scores_in(row[8]) == [(0.67, 0.37, 200)]
    assert row[8].startswith("+")


def test_roles_of_one_layout_share_a_row():
    """A layout that is both knee and most accurate is one row with both roles."""
    rows = read(page_of(findings_of())).rows
    assert sum(row[0] == "knee, most accurate" for row in rows) == 1


def test_the_price_of_the_next_millimetre_stands_in_the_report():
    """Extra cost over gain with its interval, in words and in a row, with membership and hypervolume."""
    findings = findings_of()
    reader = read(page_of(findings))
    (rate,) = findings.trade_off.rates
    (row,) = [row for row in reader.rows if len(row) == 7 and scores_in(row[5]) == [(4.00, 0.20, 380)]]
    assert row[3] == "83 %"
    assert float(re.sub(r"\D", "", row[6].partition("EUR")[0])) == pytest.approx(rate.rate / 1000, rel=0.005)
    assert "Beyond the layout “cheapest” the next millimetre costs" in reader.text
    assert "beyond the layout “knee” no dearer one of the front is shown" in reader.text.replace(
        "Beyond", "beyond"
    )
    assert "1.234 ± 0.032" in reader.text or "1.235 ± 0.032" in reader.text
    assert "20 mm" in reader.text


def test_alternatives_stand_in_the_report_with_what_they_rest_on():
    """Extra cost, paired change, difference in words and number, and that no held-out drives were run."""
    reader = read(page_of(findings_of()))
    (row,) = [row for row in reader.rows if "sides 30 mm instead of 60 mm" in row]
    assert "+12.50 EUR" in row[1]
    assert scores_in(row[3]) == [(0.70, 0.10, 60)]
    assert "1 of 3: only 1 other layout is as good" in reader.text
    assert "were not tried on held-out drives" in reader.text
    nothing = replace(findings_of(), alternatives=replace(findings_of().alternatives, instead_of=None, found=()))
    heading = "Which other layouts are about as good?"
    assert heading in reader.text
    assert heading not in page_of(nothing)


def test_front_table_holds_every_member_with_its_interval():
    """Each member of the front is a row by rising cost, and its 95 % interval is that of its score."""
    findings = findings_of()
    rows = [row for row in read(page_of(findings)).rows if len(row) == 8 and row[0].endswith("EUR")]
    members = findings.result.front.members
    assert len(rows) == len(members)
    for row, member in zip(rows, members, strict=True):
        assert member.layout.short_key in row[1]
        low, high = (end * 1000.0 for end in member.scores["position_error_mean"].interval())
        shown = [float(number) for number in re.findall(r"[\d.]+", row[6])]
        assert shown == pytest.approx([low, high], abs=0.006)


def test_every_simulated_number_carries_error_and_count():
    """Every simulated score of the validation table has its ±, and its row the number of drives it rests on."""
    rows = [row for row in read(page_of(findings_of())).rows if "midrange" in row[:3] and len(row) > 6]
    assert [row[-6] for row in rows] == ["200", "1"]
    for row in rows:
        for cell in row[-5:-1]:
            assert cell == "not known" or re.fullmatch(r"[\d.]+ ± [\d.]+\S? ?(mm|%)?", cell), cell


def test_drives_stand_in_the_cells_where_scores_of_a_row_rest_on_different_numbers():
    """A score that fewer drives gave keeps its own number, and the column of drives is empty."""
    findings = findings_of()
    first = findings.validations[0]
    mixed = replace(first, scores={**first.scores, "lost_share": replace(first.scores["lost_share"], count=150)})
    row = next(
        row
        for row in read(page_of(replace(findings, validations=(mixed,)))).rows
        if "midrange" in row[:3] and len(row) > 6
    )
    assert row[-6] == ""
    assert [scores_in(cell)[0][2] for cell in row[-5:-1]] == [200, 200, 200, 150]


def test_what_is_not_known_says_so():
    """A NaN score is 'not known', and no 'nan' or 'inf' reaches the page."""
    reader = read(page_of(findings_of(), figures={}))
    assert any("not known" in cell for row in reader.rows for cell in row)
    assert not re.search(r"\b(nan|inf|None)\b", reader.text)


def test_estimator_that_does_not_apply_gives_its_reason():
    """The reason stands in the table, escaped."""
    page = page_of(findings_of())
    assert "does not apply, because it reads no tags &amp; needs none" in page


def test_held_out_verdicts_follow_the_limits():
    """Met, undecided and broken demands are told apart by their confidence bounds."""
    for upper, verdict in ((0.012, "met"), (0.0110, "undecided"), (0.009, "broken")):
        findings = findings_of(limits=(Limit(score="position_error_mean", upper=upper),))
        row = next(row for row in read(page_of(findings)).rows if row[0] == "cheapest" and "at most" in row[1])
        assert row[4].endswith(f": {verdict}")
        assert f"at most {upper * 1000:g} mm" in row[1]


def test_limit_on_a_score_without_held_out_value_is_not_met():
    """A simulated score that the held-out drives do not give is never taken from the search."""
    limit = Limit(score="lost_share", upper=0.5)
    findings = findings_of(limits=(limit,))
    assert limit.met(findings.result.recommended["knee"].scores["lost_share"])
    verdicts = {row[0]: row[4] for row in read(page_of(findings)).rows if len(row) == 5 and "at most" in row[1]}
    assert verdicts["cheapest"].endswith(": met")
    assert verdicts["knee"].endswith(": not known")


def test_exact_limits_hold_on_held_out_drives_too():
    """The budget is met wherever the cost meets it, because the cost is the same in every world."""
    for upper, verdict in ((1e6, "met"), (1.0, "broken")):
        findings = findings_of(limits=(Limit(score="cost", upper=upper),))
        rows = [row for row in read(page_of(findings)).rows if len(row) == 5 and "at most" in row[1]]
        assert len(rows) == 3
        assert all(row[4].endswith(f": {verdict}") for row in rows)


def test_optimism_stands_in_the_table_of_estimators():
    """The last cell of a validated layout is its optimism, and a dash where there is none."""
    rows = [row for row in read(page_of(findings_of())).rows if "midrange" in row[:3] and len(row) > 6]
    assert scores_in(rows[0][-1]) == [(0.67, 0.37, 200)]
    assert rows[1][-1] == "–"


def test_bill_adds_up_to_the_cost():
    """The split by scope is that of the bill of material, and its total is the cost score."""
    findings = findings_of()
    item = findings.result.recommended["cheapest"]
    tag_map = item.layout.floor_tags.lay_on(findings.problem.design.site)
    bill = bill_of_material(item.layout, tag_map, 3, default_prices())
    row = next(row for row in read(page_of(findings)).rows if row[0] == "cheapest" and len(row) == 6)
    shown = [float(re.sub(r"[^\d.]", "", cell)) for cell in row[1:]]
    assert shown == pytest.approx([*(bill.total_of(scope) for scope in Scope), bill.total_eur], abs=0.005)
    assert shown[-1] == pytest.approx(item.scores["cost"].value, abs=0.005)


def test_reference_marks_carry_their_caveat():
    """Published layouts say that they are reconstructed and never members of the front."""
    reader = read(page_of(findings_of()))
    row = next(row for row in reader.rows if row[0] == "8 readers, 100 tags/m²")
    assert scores_in(row[3]) == [(5.60, 0.20, 40)]
    assert "reconstructed" in row[1]
    assert "never members of the front" in reader.text
    assert "1.2 m × 1.1 m" in reader.text


def test_extrapolated_antennas_say_so():
    """A side of 90 mm lies outside the calibrated range and is marked; 60 mm is not."""
    rows = read(page_of(findings_of())).rows
    assert any("extrapolated" in row[1] for row in rows if row[0] == "knee, most accurate")
    assert not any("extrapolated" in row[1] for row in rows if row[0] == "cheapest")


def test_hostile_names_are_escaped():
    """Names and facts cannot open a tag or end the data, and no script but ours gets into the page."""
    findings = findings_of(site_name=HOSTILE, zone_name=HOSTILE)
    svg = figure_svg(HOSTILE)
    page = page_of(findings, figures={"front": svg, HOSTILE: svg}, facts={HOSTILE: HOSTILE})
    reader = read(page)
    check_page(page, Path())
    assert page.count("<script") == page.count("</script") == 2
    assert HOSTILE in "".join(reader.words)
    assert not [name for _, name, _ in reader.attributes if name.startswith("on")]


def test_page_loads_nothing():
    """There are no links to other hosts and nothing to fetch; name spaces of SVG are not fetched."""
    page = page_of(findings_of(), drawings={"cheapest": {"sheet.pdf": "recommended/a b/sheet.pdf"}})
    assert re.findall(r"https?://", re.sub(r'xmlns(:\w+)?="[^"]*"', "", page)) == []
    reader = read(page)
    assert not {"link", "iframe", "object", "embed"} & set(reader.tags)
    assert not [value for _, name, value in reader.attributes if name == "src"]
    links = [value for tag, name, value in reader.attributes if tag == "a" and name == "href"]
    assert {link for link in links if not link.startswith("#")} == {"recommended/a%20b/sheet.pdf"}
    assert "@import" not in page
    assert len(page) < 5_000_000


def test_ids_are_unique_on_the_page():
    """Two figures on one page do not share an id, so that none draws with the other's shapes."""
    page = page_of(findings_of(), figures={"front": figure_svg("a"), "layout": figure_svg("b")})
    ids = [value for _, name, value in read(page).attributes if name == "id"]
    assert len(ids) > 10
    assert len(set(ids)) == len(ids)


@pytest.mark.parametrize("link", ["javascript:alert(1)", "https://a.example/x", "/etc/passwd", "../x", "", "a\\b"])
def test_links_stay_in_the_folder(link):
    """A link that is not below the report is refused."""
    with pytest.raises(ValueError, match="relative"):
        page_of(findings_of(), drawings={"cheapest": {"sheet": link}})


def test_figure_that_is_no_drawing_is_refused():
    """Only SVG elements are put into the page unescaped."""
    with pytest.raises(ValueError, match="svg"):
        page_of(findings_of(), figures={"front": "<script>alert(1)</script>"})


@pytest.mark.parametrize("status", [Status.TARGET_NOT_MET, Status.BUDGET_TOO_SMALL, Status.INFEASIBLE])
def test_refusals_are_reported_without_a_front(status):
    """A study that recommends nothing still says why, and shows no table of recommended layouts."""
    findings = findings_of()
    empty = Result(
        status=status,
        front=Front(goals=findings.problem.goals, members=()),
        recommended={},
        trials=0,
        shortfall="the cheapest layout costs 12 EUR more",
    )
    findings = replace(findings, result=empty, validations=(), references=(), reasons={})
    reader = read(page_of(findings, figures={}))
    assert status.value in reader.text
    assert "the cheapest layout costs 12 EUR more" in reader.text
    assert "No layout is recommended" in reader.text
    heading = "Which layouts are recommended"
    assert heading not in reader.text
    assert heading in read(page_of(findings_of())).text
    assert any(row == ["1", "tags of 20 mm overlap at a spacing of 5 mm"] for row in reader.rows)


def test_quick_runs_carry_a_banner():
    """The first words of a quick run's page say that nothing is to be built from it; a full run has none."""
    words = "Quick look on few layouts and drives: nothing to build from. Run without --quick."
    quick, full = (read(page_of(findings_of(), quick=value)).text for value in (True, False))
    assert quick.index(words) < quick.rindex("Cost against accuracy: ward")
    assert words not in full


def test_raced_layouts_are_those_without_refusal():
    """Three of the four layouts have no refusal, and nothing is said of how many can be built."""
    text = read(page_of(findings_of())).text
    assert "3 of 4 layouts raced." in text
    assert "can be built" not in text


def test_failed_tasks_are_said_aloud():
    """The number of failed tasks and one message stand in the first section; without failures nothing does."""
    failures = {
        Group("a", "design", "mcl", "k"): "ValueError: <b> & c",
        Group("b", "design", "mcl", "k"): "ValueError: z",
    }
    text = read(page_of(replace(findings_of(), failures=failures))).text
    assert "2 tasks failed: ValueError: <b> & c" in text[: text.index("The front")]
    assert "failed:" not in read(page_of(findings_of())).text


@pytest.mark.parametrize(("count", "known"), [(2, False), (4, False), (5, True)])
def test_intervals_of_a_handful_of_trials_are_not_known(count, known):
    """Below five trials the page prints no interval, which would reach below zero, but how many there were."""
    findings = findings_of()
    item = findings.result.recommended["cheapest"]
    few = replace(item, scores={**item.scores, "position_error_mean": metres(0.010, 0.004, count)})
    front = replace(findings.result.front, members=(few,))
    result = replace(findings.result, front=front, recommended={"cheapest": few})
    reader = read(page_of(replace(findings, result=result)))
    words = f"interval not known (n = {count})"
    assert (words in " ".join(reader.text.split())) != known
    assert "95 % interval interval" not in reader.text
    (row,) = [row for row in reader.rows if len(row) == 8 and row[0].endswith("EUR")]
    assert ("to" in row[6].split()) == known


def test_reference_note_says_why_they_lie_below_and_how_many_trials():
    """Under the figure stands what the published arrays assume, and that their marks rest on 40 trials."""
    text = read(page_of(findings_of())).text
    assert "they stand on a chassis of 1.2 m × 1.1 m, wider than this robot, run on a clear floor" in text
    assert "they cannot be mounted here. Each rests on 40 trials." in text
    assert "below the front" not in read(page_of(replace(findings_of(), references=()))).text


def test_cheapest_beside_the_front_is_explained():
    """The demand that the front does not show is named; a cheapest layout of the front needs no word."""
    zone = "dock.position_error_mean"
    limits = (Limit(score="position_error_mean", upper=0.03), Limit(score=zone, upper=0.02))
    findings = findings_of(limits=limits)
    assert "not on the front" not in read(page_of(findings)).text
    beaten = findings.designs[2].evaluated
    result = replace(findings.result, recommended={"cheapest": beaten})
    text = read(page_of(replace(findings, result=result))).text
    assert "demands that the front's two goals do not show: mean position error in zone 'dock'." in text


def test_the_goal_gives_headings_and_numbers():
    """With the heading as goal, caption, headings and search scores are those of the heading."""
    findings = findings_of(limits=())
    goals = ("cost", "heading_error_mean")
    result = replace(findings.result, front=replace(findings.result.front, goals=goals))
    reader = read(page_of(replace(findings, problem=replace(findings.problem, goals=goals), result=result)))
    assert "Cost against mean heading error." in reader.text
    row = next(row for row in reader.rows if row[0] == "cheapest" and len(row) == 9)
    assert scores_in(row[6]) == [(1.146, 0.057, 400)]
    assert any("mean heading error, search" in row for row in reader.rows)


def test_names_of_scenarios_do_not_break():
    """Every place in a table or sentence that shows a held-out scenario keeps its name on one line."""
    page = page_of(findings_of())
    shown = re.findall(r"<(\w+)([^>]*)>held-out/1<", page)
    assert len(shown) >= 6
    assert all('class="name"' in attributes for _, attributes in shown)
    assert ".name { white-space: nowrap; }" in page


def test_what_common_drives_save_is_told():
    """The mean ratio with its interval, comparisons and trials; without any comparison there is no section."""
    findings = findings_of()
    text = read(page_of(findings)).text
    assert "Comparisons of the mean position error on common drives need this share" in text
    assert "0.31 (0.22 to 0.40) between neighbours on the front (1 comparison of 380 trials)." in text
    nothing = replace(findings, pairing=replace(findings.pairing, front=NOTHING_SAVED))
    heading = "How much did common drives save?"
    assert heading in text
    assert heading not in read(page_of(nothing)).text


def test_same_findings_give_the_same_bytes():
    """Figures and page are the same on a second run."""
    assert page_of(findings_of()) == page_of(findings_of())


def test_contents_name_every_section_by_its_heading():
    """The links of the contents are all headings of the page, in their order and with their words."""
    figures = {"front": figure_svg(), "local_error": figure_svg("a"), "own": figure_svg("b")}
    page = page_of(findings_of(), figures=figures)
    contents = page[page.index("<nav") : page.index("</nav>")]
    links = re.findall(r'<a href="#([^"]+)">([^<]+)</a>', contents)
    assert re.findall(r'<h2 id="([^"]+)">([^<]+)</h2>', page) == links
    assert len(links) == 17
    assert page.index('id="held-out"') < page.index("local_error.csv") < page.index('id="more-accuracy"')
    assert page.index('id="further"') < page.index('aria-label="own"')


def test_demands_that_other_studies_judge_are_named():
    """A limit at which this study does not look stands below its demands, with the study that does."""
    findings = findings_of()
    words = "share of drives that dock at least 90 % (layoutopt study transponder_placement)"
    problem = replace(findings.problem, elsewhere=(words,))
    text = read(page_of(replace(findings, problem=problem))).text
    assert f"Demands that this study does not judge: {words}" in text
    assert "does not judge" not in read(page_of(findings)).text
