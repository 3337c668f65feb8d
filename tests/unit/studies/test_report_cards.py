"""Cards, data and prices of the report: what its script knows is what the findings say."""

import json
import math
import random
from dataclasses import replace
from fractions import Fraction

import pytest
from made_findings import figure_svg, findings_of, metres, page_of, read, scores_in

from layoutopt.parts import READER_ITEMS, TAG_ITEMS, bill_of_material
from layoutopt.plots.figures import SvgAxis, SvgFrame
from studies.layout_cards import KINDS, cards_of, page_data
from studies.report import render_report

FRAME = SvgFrame(
    x=SvgAxis(low=1000.0, high=10_000.0, start=30.0, end=470.0, logarithmic=True),
    y=SvgAxis(low=0.0, high=20.0, start=290.0, end=40.0, logarithmic=False),
)
PICTURE = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"></svg>'


def cards_and_findings():
    findings = findings_of()
    return cards_of(findings, frame=FRAME, pictures={}, files={}), findings


def scaled_cents(lines, scales):
    """Return the total that the page's script makes of the lines of a bill."""
    return sum(math.floor(quantity * price * scales[kind] * 100 + 0.5 + 1e-7) for kind, quantity, price in lines)


def test_cards_are_of_the_front_and_of_recommended_layouts_by_rising_cost():
    """A recommended layout beside the front has a card too, which says that it is not on it."""
    findings = findings_of()
    beaten = findings.designs[2].evaluated
    result = replace(findings.result, recommended={"cheapest": beaten})
    cards = cards_of(replace(findings, result=result), frame=None, pictures={}, files={})
    assert [card.cost.value for card in cards] == sorted(card.cost.value for card in cards)
    assert len(cards) == 3
    assert [card.roles for card in cards if not card.on_front] == [("cheapest",)]
    assert all(card.place is None for card in cards)


def test_bounds_are_the_worst_of_search_and_held_out_drives():
    """The bound is the larger of the one-sided 95 % bounds; without known held-out drives it is infinite."""
    cards, findings = cards_and_findings()
    cheap, dear = cards
    held_out = findings.validations[0].scores["position_error_mean"]
    assert cheap.bound == max(cheap.error.upper(), held_out.upper()) == held_out.upper()
    assert dear.bound == math.inf
    assert json.loads(page_data(findings, cards, FRAME))["layouts"][1]["bound"] is None
    before = findings.designs[0].evaluated
    worse = replace(before, scores={**before.scores, "position_error_mean": metres(0.02, 0.001, 400)})
    front = replace(findings.result.front, members=(worse,))
    result = replace(findings.result, front=front, recommended={"cheapest": worse})
    (card,) = cards_of(replace(findings, result=result), frame=None, pictures={}, files={})
    assert card.bound == card.error.upper() > held_out.upper()


def test_bills_of_other_prices_agree_with_the_script_to_the_cent():
    """Lines times scales, rounded as the script does, give the bill of a price list with these prices."""
    draws = random.Random(5)
    cards, findings = cards_and_findings()
    cost = findings.problem.objectives[0]
    scales = [[1.0] * 4] + [[draws.randrange(5, 81) * 5 / 100 for _ in range(3)] + [1.0] for _ in range(60)]
    for tag, reader, labour, rest in scales:
        prices = cost.prices
        for items, scale in ((TAG_ITEMS, tag), (READER_ITEMS, reader), (("labour",), labour)):
            for item in items:
                exact = Fraction(repr(prices.items[item].price_eur)) * Fraction(repr(scale))
                prices = prices.replace_item(item, price_eur=float(exact))
        for card in cards:
            bill = bill_of_material(
                card.layout, card.layout.floor_tags.lay_on(findings.problem.design.site), 3, prices
            )
            cents = round(bill.total_eur * 100)
            assert scaled_cents(card.lines, [tag, reader, labour, rest]) == cents
    assert all(sum(card.by_kind.values()) == pytest.approx(card.cost.value, abs=0.001) for card in cards)
    assert all(sum(card.split.values()) == pytest.approx(card.cost.value, abs=0.001) for card in cards)


def test_no_name_ends_the_data_block():
    """A name with an end of a script in it stays a name, and the data is read back as it was."""
    findings = findings_of()
    hostile = "</script><script>alert(1)</script><!--\u2028&"
    goals = ("cost", f"{hostile}.position_error_mean")
    scores = {goals[1]: metres(0.01, 0.001, 40)}
    items = tuple(replace(item, scores={**item.scores, **scores}) for item in findings.result.front.members)
    front = replace(findings.result.front, goals=goals, members=items)
    changed = replace(
        findings,
        problem=replace(findings.problem, goals=goals),
        result=replace(findings.result, front=front, recommended={}),
    )
    text = page_data(changed, cards_of(changed, frame=FRAME, pictures={}, files={}), FRAME)
    assert not set("<>&\u2028") & set(text)
    assert hostile in json.loads(text)["goal"]


def test_data_holds_cost_error_and_place():
    """Costs are exact, errors in the unit shown, and marks lie where the axes of the figure have them."""
    cards, findings = cards_and_findings()
    data = json.loads(page_data(findings, cards, FRAME))
    assert data["unit"] == "mm"
    for card, entry in zip(cards, data["layouts"], strict=True):
        assert entry["id"] == card.anchor == f"layout-{card.layout.short_key}"
        assert entry["cost"] == card.cost.value
        assert entry["error"] == pytest.approx(card.error.value * 1000.0)
        share = math.log10(card.cost.value / 1000.0)
        assert card.place == pytest.approx(
            (30.0 + 440.0 * share, 290.0 - 12.5 * card.error.value * 1000.0), abs=0.01
        )


def test_page_holds_a_mark_and_a_card_for_each_layout_without_script():
    """Each mark of the figure leads to a card of the page, with cost split, scores, held-out rows and files."""
    findings = findings_of()
    cheap = findings.result.recommended["cheapest"].layout
    page = page_of(
        findings,
        frame=FRAME,
        pictures={cheap.key: PICTURE},
        layout_files={cheap.key: f"layouts/{cheap.short_key}.toml"},
        drawings={"cheapest": {"sheet.pdf": "recommended/cheapest/sheet.pdf"}},
    )
    reader = read(page)
    ids = {value for _, name, value in reader.attributes if name == "id"}
    inner = {value[1:] for _, name, value in reader.attributes if name == "href" and value.startswith("#")}
    assert {"answer", "front", "recommended", "held-out", "more-accuracy", "what-if", "cost", "sources"} <= inner
    assert {f"layout-{item.layout.short_key}" for item in findings.result.front.members} <= inner <= ids
    card = page[page.index(f'id="layout-{cheap.short_key}"') :].partition("</article>")[0]
    assert PICTURE in card
    assert f'href="layouts/{cheap.short_key}.toml"' in card
    assert 'href="recommended/cheapest/sheet.pdf"' in card
    assert "layoutopt draw" not in card, "there are drawings"
    rows = read(card).rows
    assert next(scores_in(row[1]) for row in rows if row[0] == "held-out/1") == [(11.01, 0.30, 200)]
    assert page.count("hidden") >= 4, "controls stay hidden until the script shows them"


def test_a_card_without_drawings_says_how_to_make_them():
    """Where there is a layout file and nothing drawn from it, the command stands in the card."""
    findings = findings_of()
    files = {item.layout.key: f"layouts/{item.layout.short_key}.toml" for item in findings.result.front.members}
    drawings = {"cheapest": {"sheet.pdf": "recommended/cheapest/sheet.pdf"}}
    text = read(page_of(findings, layout_files=files, drawings=drawings)).text
    cheap, dear = findings.result.front.members
    key = dear.layout.short_key
    assert f"layoutopt draw layouts/{key}.toml --out drawings/{key}" in text
    assert f"layoutopt draw layouts/{cheap.layout.short_key}.toml" not in text


def test_prices_table_holds_what_the_sliders_scale():
    """Without the script the share of each kind of price stands in the table, and adds up to the cost."""
    reader = read(page_of(findings_of()))
    heads = next(row for row in reader.rows if row[1 : 1 + len(KINDS)] == list(KINDS))
    rows = [row for row in reader.rows if len(row) == len(heads) and row[-1] == "" and row[0] != ""]
    assert len(rows) == 2
    for row in rows:
        amounts = [float("".join(c for c in cell if c.isdigit() or c == ".")) for cell in row[1:6]]
        assert sum(amounts[:-1]) == pytest.approx(amounts[-1], abs=0.001)


def test_worlds_and_open_questions_are_told_without_invented_numbers():
    """Each world has its faults and errors with a change; what was not simulated is a command."""
    text = read(page_of(findings_of())).text
    (row,) = [row for row in read(page_of(findings_of())).rows if row[0] == "held-out/1" and len(row) == 6]
    assert row[1:4] == ["3 mm", "1.0 %", "none"]
    assert scores_in(row[4]) == [(11.01, 0.30, 200), (0.67, 0.37, 200)]
    assert "not known" in row[5]
    assert "layoutopt study robustness spec.toml" in text
    assert "layoutopt reprice . my_prices.toml" in text
    assert "layoutopt explain layouts/" in text


def test_sources_name_papers_of_what_was_used():
    """The estimators' and patterns' cards stand in the report, and the works they name are cited."""
    text = read(page_of(findings_of())).text
    assert "Design of an HF-Band RFID System with Multiple Readers" in text
    assert "han2006, Fig. 5" in text
    assert "liang2020" not in text


def test_a_picture_that_is_no_drawing_is_refused():
    """Only SVG elements are put into cards unescaped."""
    with pytest.raises(ValueError, match="svg"):
        render_report(findings_of(), figures={"front": figure_svg()}, facts={}, drawings={}, pictures={"k": "<b>"})
