"""The report of a finished study in a browser: pointer, keys, sliders, print, light and dark, without script."""

import io
import math
import re
import unicodedata
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import pypdf
import pytest
from devtools import Browser, browser_path

from layoutopt.parts import READER_ITEMS, TAG_ITEMS, bill_of_material
from layoutopt.progress import Silent
from layoutopt.score_text import euros
from layoutopt.spec.reading import read_spec
from studies.cost_vs_accuracy import CostVersusAccuracy
from studies.folder import Run, run_study
from studies.layout_cards import LayoutCard, cards_of

CHROMIUM = browser_path()
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium on the PATH; on Debian: apt-get install chromium"),
]
A4_PT = (595.0, 842.0)
SHOWN = "[...document.querySelectorAll('.card')].filter(c => c.getClientRects().length).map(c => c.id)"


@dataclass(frozen=True)
class Made:
    """A report on disk, and the cards it was made from."""

    page: Path
    cards: list[LayoutCard]
    spec: object


@pytest.fixture(scope="module")
def made(tiny_text, tmp_path_factory):
    """The report of a small study that was run to its end, not quick."""
    folder = tmp_path_factory.mktemp("report")
    text = tiny_text.replace("validation_trials = 40", "validation_trials = 12").replace('"15 s"', '"5 s"')
    (folder / "tiny.toml").write_text(text, encoding="utf-8")
    spec = read_spec(folder / "tiny.toml")
    question = CostVersusAccuracy.for_spec(spec, quick=False)
    answer = run_study("cost_vs_accuracy", question, spec, folder / "out", run=Run(), progress=Silent())
    cards = cards_of(answer.findings, frame=None, pictures={}, files={})
    assert len(cards) >= 3
    return Made(folder / "out" / "report.html", cards, spec)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """One browser for all tests of the file."""
    with Browser(CHROMIUM, tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.fixture
def page(browser, made):
    """The browser with the report freshly opened, 1280 pixels wide."""
    browser.call("Emulation.setDeviceMetricsOverride", width=1280, height=900, deviceScaleFactor=1, mobile=False)
    browser.open(made.page)
    return browser


def mark(card):
    return f'a.mark[href="#{card.anchor}"] .hit'


def shown(page):
    return page.run(SHOWN)


def text_of(page, selector):
    return (
        page.run(f"document.querySelector({selector!r}).textContent").replace("\u202f", " ").replace("\xa0", " ")
    )


def set_slider(page, identifier, value):
    """Move a slider as a script of the page would see it: a new value and its event."""
    page.run(
        f"(() => {{ const s = document.getElementById('{identifier}'); s.value = {value}; "
        "s.dispatchEvent(new Event('input', {bubbles: true})); })()"
    )
    return float(page.run(f"document.getElementById('{identifier}').value"))


def chosen_first(made):
    return next(card for card in made.cards if "cheapest" in card.roles)


def test_page_is_one_file_that_asks_for_nothing_and_complains_of_nothing(page, made):
    """Nothing but the file is asked for, what stands in it as data aside; no complaint is written; below 5 MB."""
    assert [address for address in page.requests() if not address.startswith("data:")] == [made.page.as_uri()]
    assert page.complaints() == []
    assert page.run("document.documentElement.classList.contains('scripted')")
    assert made.page.stat().st_size < 5_000_000


def test_marks_lie_on_the_squares_of_the_figure(page, made):
    """Each mark that is pointed at lies over a square that the figure has drawn for a member of the front."""
    members = [card for card in made.cards if card.on_front]
    apart = page.run(
        "[...document.querySelectorAll('a.mark .hit')].map(mark => { const m = mark.getBoundingClientRect(); "
        "return Math.min(...[...mark.ownerSVGElement.querySelectorAll('use')].map(use => { "
        "const u = use.getBoundingClientRect(); return Math.hypot(m.x + m.width / 2 - u.x - u.width / 2, "
        "m.y + m.height / 2 - u.y - u.height / 2); })); })"
    )
    assert len(apart) == len(made.cards) >= len(members)
    assert max(apart) < 1.0


def test_pointing_shows_a_card_and_leaving_brings_the_kept_one_back(page, made):
    """The recommended layout is shown first; another one as long as the pointer is on its mark."""
    first = chosen_first(made)
    other = next(card for card in made.cards if card is not first)
    assert shown(page) == [first.anchor]
    page.point(mark(other))
    assert shown(page) == [other.anchor]
    page.point("h1")
    assert shown(page) == [first.anchor]


def test_a_click_keeps_a_card_with_picture_split_scores_and_links(page, made):
    """The card stays after the pointer has left; picture and links are there, and links lead to files."""
    other = made.cards[-1]
    page.click(mark(other))
    page.point("h1")
    assert shown(page) == [other.anchor]
    card = f"#{other.anchor}"
    assert page.run(f"document.querySelector('{card} .thumbnail svg').getBoundingClientRect().width") > 80
    assert euros(other.cost.value).replace("\u202f", " ") in text_of(page, card)
    links = page.run(f"[...document.querySelectorAll('{card} .files a')].map(a => a.getAttribute('href'))")
    assert links
    every = page.run(
        "[...document.querySelectorAll('a[href]:not([href^=\"#\"])')].map(a => a.getAttribute('href'))"
    )
    assert set(links) < set(every)
    assert all((made.page.parent / link).exists() for link in every)


def test_marks_are_walked_by_arrows_and_cards_entered_by_enter(page, made):
    """Tab stops once in the figure; arrows, Home and End go from mark to mark; Enter and Escape go in and out."""
    page.run("document.getElementById('target').focus()")
    page.press("Tab")
    focused = "document.activeElement.getAttribute('href')"
    assert page.run(focused) == f"#{chosen_first(made).anchor}"
    page.press("Home")
    order = []
    for _ in made.cards:
        order.append(page.run(focused))
        assert shown(page) == [order[-1][1:]]
        page.press("ArrowRight")
    assert order == [f"#{card.anchor}" for card in made.cards]
    page.press("Enter")
    assert page.run("document.activeElement.closest('.card').id") == made.cards[-1].anchor
    page.press("Escape")
    assert page.run(focused) == order[-1]
    page.press("Tab")
    assert page.run("document.activeElement.closest('.card')?.id") == made.cards[-1].anchor


def test_everything_that_can_be_used_is_reached_by_tab(page):
    """Walking by Tab from the top meets both limits, one mark, three prices, the button and every link."""
    wanted = page.run(
        "[...document.querySelectorAll('a[href], input, button')].filter(e => e.getClientRects().length "
        "&& !(e.matches('a.mark') && e.tabIndex < 0)).length"
    )
    page.run("document.querySelectorAll('a[href], input, button').forEach((e, i) => { e.dataset.place = i; })")
    boxes = page.run("document.querySelectorAll('[tabindex=\"0\"]:not(a)').length")
    met = set()
    for _ in range(wanted + boxes + 1):
        page.press("Tab")
        met.add(page.run("document.activeElement.dataset.place ?? ''"))
    assert len(met - {""}) == wanted
    ids = page.run("[...document.querySelectorAll('input, button')].map(e => e.id)")
    assert ids == ["budget", "target", "price-0", "price-1", "price-2", "list-prices"]


def left_of(page, made):
    out = page.run("[...document.querySelectorAll('a.mark.out')].map(e => e.getAttribute('href'))")
    return [card for card in made.cards if f"#{card.anchor}" not in out]


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7])
def test_budget_dims_what_costs_more_and_names_the_cheapest_left(page, made, share):
    """Those left are the cards whose exact cost is within the budget; the sentence counts them and names one."""
    costs = [card.cost.value for card in made.cards]
    limit = set_slider(page, "budget", min(costs) + share * (max(costs) - min(costs)))
    left = [card for card in made.cards if card.cost.value <= limit]
    assert left_of(page, made) == left
    said = text_of(page, "#cheapest")
    if left:
        assert said.startswith(f"{len(left)} of {len(costs)} layouts ")
        assert left[0].layout.label in said
        assert euros(left[0].cost.value).replace("\u202f", " ") in said
    else:
        assert "No layout on this page is left" in said
    assert page.run("document.getElementById('cheapest').getAttribute('aria-live')") == "polite"
    assert not page.run("document.getElementById('budget-line').hasAttribute('hidden')")
    assert "simulates and validates nothing anew" in text_of(page, ".controls")


@pytest.mark.parametrize("share", [0.0, 0.4, 0.8])
def test_target_goes_by_the_worst_bound_of_search_and_held_out_drives(page, made, share):
    """Those left have all their bounds within the target, in millimetres; a bound that is not known is out."""
    bounds = [card.bound * 1000.0 for card in made.cards if math.isfinite(card.bound)]
    limit = set_slider(page, "target", min(bounds) + share * (max(bounds) - min(bounds)))
    left = [card for card in made.cards if card.bound * 1000.0 <= limit]
    assert left_of(page, made) == left
    said = text_of(page, "#cheapest")
    assert (left[0].layout.label in said) if left else ("No layout" in said)
    if left:
        assert f"at most {left[0].bound * 1000.0:#.3g}".rstrip(".") in said


def test_sliders_are_moved_by_keys_and_say_their_value(page, made):
    """Home goes to the tightest budget, which leaves nothing; End takes the limit away."""
    page.run("document.getElementById('budget').focus()")
    page.press("Home")
    assert left_of(page, made) == []
    assert "EUR" in page.run("document.getElementById('budget').getAttribute('aria-valuetext')")
    page.press("End")
    assert left_of(page, made) == made.cards
    assert text_of(page, "#budget-value") == "no limit"


@pytest.mark.parametrize("scales", [(100, 100, 100), (50, 200, 135), (395, 25, 80), (115, 105, 45)])
def test_prices_give_the_bill_to_the_cent(page, made, scales):
    """Costs at scaled prices of tag, reader module and labour are those of a bill by such a price list."""
    for number, scale in enumerate(scales):
        set_slider(page, f"price-{number}", scale)
    prices = made.spec.prices
    for items, scale in zip((TAG_ITEMS, READER_ITEMS, ("labour",)), scales, strict=True):
        for item in items:
            exact = Fraction(repr(prices.items[item].price_eur)) * scale / 100
            prices = prices.replace_item(item, price_eur=float(exact))
    totals = {}
    for card in made.cards:
        tag_map = card.layout.floor_tags.lay_on(made.spec.site)
        totals[card.layout.label] = bill_of_material(card.layout, tag_map, 2, prices).total_eur
        told = text_of(page, f'#prices tr[data-layout="{card.anchor}"] .new-cost')
        assert told == euros(totals[card.layout.label]).replace("\u202f", " ")
    assert min(totals, key=totals.get) in text_of(page, "#repriced")
    page.click("#list-prices")
    first = made.cards[0]
    told = text_of(page, f'#prices tr[data-layout="{first.anchor}"] .new-cost')
    assert told == euros(first.cost.value).replace("\u202f", " ")


def test_print_is_a4_with_the_answer_on_the_first_page_and_no_controls(page, made):
    """A4 pages; the first holds summary and picture of the layout; every card is printed; no slider is."""
    set_slider(page, "budget", 0)
    document = pypdf.PdfReader(io.BytesIO(page.printed()))
    # Print has ligatures, such as one glyph for "fi".
    texts = [" ".join(unicodedata.normalize("NFKC", leaf.extract_text()).split()) for leaf in document.pages]
    for leaf in document.pages:
        assert [float(side) for side in leaf.mediabox[2:]] == pytest.approx(A4_PT, abs=1.5)
    assert 5 <= len(texts) <= 30
    for words in (
        "What was asked",
        "What to buy and lay",
        "How exact it is",
        "How sure that is",
        "What this does not show",
    ):
        assert words in texts[0]
    assert "The recommended layout on its site" in texts[0]
    assert "That costs" in texts[0]
    assert "The answer in figures" not in texts[0]
    whole = " ".join(texts)
    assert "Back to the list" not in whole
    assert "Point at a square" not in whole
    assert all(card.layout.label in whole for card in made.cards)
    assert whole.count("--out drawings/") == sum(not card.roles for card in made.cards)
    assert all(text for text in texts)


PRINTED_WIDTH_PX = 703
"""A4 less the margins of the page style, at 96 pixels an inch."""


def test_nothing_is_wider_than_the_paper(page):
    """Every table and figure keeps within A4: what is wider makes the browser print all pages smaller."""
    page.call("Emulation.setEmulatedMedia", media="print")
    try:
        page.call(
            "Emulation.setDeviceMetricsOverride",
            width=PRINTED_WIDTH_PX,
            height=1005,
            deviceScaleFactor=1,
            mobile=False,
        )
        wide = page.run(
            "[...document.querySelectorAll('table, figure, section, pre')].filter(e => e.getClientRects().length "
            f"&& e.getBoundingClientRect().right > {PRINTED_WIDTH_PX + 1})"
            ".map(e => e.closest('section')?.querySelector('h2')?.textContent)"
        )
        assert wide == []
        shape = page.run(
            "(() => { const r = document.querySelector('.page-one svg').getBoundingClientRect(); "
            "return [r.width, r.height]; })()"
        )
        assert min(shape) > 180
    finally:
        page.call("Emulation.setEmulatedMedia", media="")


@pytest.mark.parametrize("demands", [1, 5])
@pytest.mark.parametrize(("width", "height"), [(100, 40), (40, 100)])
def test_page_one_keeps_its_picture_whatever_the_shape(page, demands, width, height):
    """A long or a tall picture stays on the first page, also with as many demands as that page tells."""
    sentence = "in the zone “dock” a robot is on average at most 10 mm from where it believes to be; "
    page.run(
        f"(() => {{ const svg = document.querySelector('.page-one svg'); "
        f"svg.setAttribute('viewBox', '0 0 {width} {height}'); "
        f"document.querySelector('.first-page dd p:last-child').append({sentence * (demands - 1)!r}); }})()"
    )
    document = pypdf.PdfReader(io.BytesIO(page.printed()))
    texts = [" ".join(unicodedata.normalize("NFKC", leaf.extract_text()).split()) for leaf in document.pages]
    assert "The recommended layout on its site" in texts[0]
    assert "For a decision" in texts[1]


def luminance(colour):
    channels = [int(part) / 255.0 for part in re.findall(r"\d+", colour)[:3]]
    linear = [value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4 for value in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(first, second):
    low, high = sorted((luminance(first), luminance(second)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_light_and_dark_have_contrast_for_text_and_marks(page, made, scheme):
    """Text has a contrast of 4.5 to what it stands on, marks of the figure 3 (WCAG 2.2, AA); dark is dark."""
    page.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    try:
        style = "getComputedStyle(document.querySelector('{}')).{}"
        paper = page.run(style.format("body", "backgroundColor"))
        assert (luminance(paper) < 0.05) == (scheme == "dark")
        wash = page.run(style.format(".status", "backgroundColor"))
        for selector, behind in (
            ("body", paper),
            (".quiet", paper),
            ("a", paper),
            (".status p", wash),
            (".met", wash),
        ):
            assert contrast(page.run(style.format(selector, "color")), behind) >= 4.5, selector
        set_slider(page, "budget", 0)
        for selector in (".mark.out .cross", ".limit", ".mark.chosen .ring"):
            assert contrast(page.run(style.format(selector, "stroke")), paper) >= 3.0, selector
        for colour in ("rgb(0, 114, 178)", "rgb(213, 94, 0)"):
            assert contrast(colour, paper) >= 3.0
    finally:
        page.call("Emulation.setEmulatedMedia", features=[])


def test_what_is_out_is_told_by_shape_too(page, made):
    """A layout out of the limits has a cross over its mark, not only another tone."""
    set_slider(page, "budget", 0)
    crossed = page.run(
        "[...document.querySelectorAll('.mark .cross')].filter(e => getComputedStyle(e).stroke !== 'none').length"
    )
    assert crossed == len(made.cards)


def test_without_script_everything_is_shown_and_marks_lead_to_cards(browser, made):
    """All cards and sections are there, no dead control is seen, and a click on a mark goes to its card."""
    browser.call("Emulation.setScriptExecutionDisabled", value=True)
    try:
        browser.open(made.page)
        assert shown(browser) == [card.anchor for card in made.cards]
        linked = browser.run("[...document.querySelectorAll('nav a')].map(a => a.getAttribute('href').slice(1))")
        headed = browser.run(
            "[...document.querySelectorAll('h2')].filter(h => h.getClientRects().length).map(h => h.id)"
        )
        assert linked == headed
        assert browser.run(
            "[...document.querySelectorAll('input, button')].every(e => !e.getClientRects().length)"
        )
        browser.click(mark(made.cards[-1]))
        assert browser.run("location.hash") == f"#{made.cards[-1].anchor}"
    finally:
        browser.call("Emulation.setScriptExecutionDisabled", value=False)


def test_the_policy_lets_no_other_script_run(browser, made):
    """A script, a handler and a picture from elsewhere put into a copy of the page do nothing, and are refused."""
    text = made.page.read_text(encoding="utf-8")
    foreign = (
        "<script>document.title = 'MARK'</script>"
        "<svg onload=\"document.title = 'MARK'\"></svg>"
        '<img src="http://192.0.2.1/x.png">'
    )
    copy = made.page.with_name("copy.html")
    copy.write_text(text.replace("</h1>", f"</h1>{foreign}"), encoding="utf-8")
    browser.open(copy)
    copy.unlink()
    assert "MARK" not in browser.run("document.title")
    refused = [event for event in browser.complaints() if "Content Security Policy" in str(event)]
    assert len(refused) >= 3
    assert browser.run("document.documentElement.classList.contains('scripted')")


def test_a_narrow_screen_scrolls_down_only(browser, made):
    """At 360 pixels nothing but wide tables reaches beyond the page."""
    browser.call("Emulation.setDeviceMetricsOverride", width=360, height=740, deviceScaleFactor=1, mobile=False)
    browser.open(made.page)
    assert browser.run("document.documentElement.scrollWidth") <= 360


def test_wide_tables_scroll_in_their_box_by_keys_too(browser, made):
    """At 360 pixels every table that is cut has a box that scrolls, has a name and is moved by the arrow keys."""
    browser.call("Emulation.setDeviceMetricsOverride", width=360, height=740, deviceScaleFactor=1, mobile=False)
    browser.open(made.page)
    cut = browser.run(
        "[...document.querySelectorAll('table')].filter(t => t.getClientRects().length && "
        "t.getBoundingClientRect().right > 361).map(t => { const box = t.closest('.wide'); return box && "
        "getComputedStyle(box).overflowX === 'auto' && box.tabIndex === 0 && "
        "box.getAttribute('role') === 'region' && box.getAttribute('aria-label').startsWith('Table: '); })"
    )
    assert len(cut) >= 5
    assert all(cut)
    browser.run("(() => { const box = document.querySelector('.wide[tabindex]'); box.focus(); })()")
    browser.press("ArrowRight")
    browser.run("new Promise(done => setTimeout(done, 400))")
    assert browser.run("document.querySelector('.wide[tabindex]').scrollLeft") > 0
    outline = browser.run("getComputedStyle(document.querySelector('.wide[tabindex]')).outlineStyle")
    assert outline == "solid"
