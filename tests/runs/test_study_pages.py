"""The catalogue of studies: every study has its row, its page and its picture, and asks what its card asks."""

import re
from pathlib import Path

import pytest

from layoutopt import registry

DOCS = Path(__file__).parents[2] / "docs"
CATALOGUE = (DOCS / "studies.md").read_text(encoding="utf-8")
QUESTIONS = re.findall(r"(?m)^\| `([\w/]+)` \| (.+?) \| \[.+?\]\((\w+)\.md[#\w-]*\) \| (.*?) \|$", CATALOGUE)
EFFORTS = dict(re.findall(r"(?m)^\| `([\w/]+)` \| [^|]+ \| [^|]+ \| ([^|]+) \| [^|]+ \|$", CATALOGUE))
"""By study: trials and seconds of a look."""
PICTURED = (
    "cost_vs_accuracy",
    "pattern_comparison",
    "reader_count",
    "antenna_sizing",
    "speed",
    "fleet_size",
    "placement_tolerance",
    "dead_tags",
    "recovery",
    "aliasing",
    "antenna_yaw",
    "sampling",
    "transponder_placement",
    "published/han2006",
    "published/kim2009",
    "published/kim2010",
    "published/liang2020",
    "published/mi2016",
)
"""Studies whose figure stands in the catalogue."""
OWN_PAGES = {name: page for name, _, page, _ in QUESTIONS if page.startswith("study_")}
A_LOOK_S = 75
"""CPU seconds: a minute on two processors, of which one is waited for now and then."""


def test_every_study_has_one_row_of_each_table():
    names = sorted(registry.names("studies"))
    assert sorted(name for name, *_ in QUESTIONS) == names
    assert sorted(EFFORTS) == names


@pytest.mark.parametrize(("name", "question", "page", "picture"), QUESTIONS, ids=[row[0] for row in QUESTIONS])
def test_a_row_asks_what_the_card_asks_and_leads_to_its_page(name, question, page, picture):
    """That links and headings exist is looked at with those of all pages."""
    card = registry.card("studies", name)
    assert question == card.question
    assert page == card.guide
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    assert f"study {name}" in " ".join(text.split())
    if name in PICTURED:
        (file,) = re.findall(r"\]\((pictures/\w+\.png)\)", picture)
        assert (DOCS / file).exists()
        assert f"]({file})" in text, f"{page}.md does not show {file}"


@pytest.mark.parametrize(("name", "page"), OWN_PAGES.items())
def test_a_page_of_one_study_answers_in_the_common_order(name, page):
    """Question, figure, command with a look, how to read the figure, numbers with their seed, where it ends."""
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    parts = [
        f"**{registry.card('studies', name).question}**",
        f"](pictures/{name}.png)",
        "\n## Ask it of ",
        f"layoutopt study {name} ward.toml --quick",
        "\n## Read the figure\n",
        "\n## The numbers\n",
        "seed 7",
        "\n## Where it ends\n",
    ]
    places = [text.find(part) for part in parts]
    assert -1 not in places, [part for part, place in zip(parts, places, strict=True) if place == -1]
    assert places == sorted(places)


@pytest.mark.parametrize("name", PICTURED)
def test_a_look_was_measured_and_takes_less_than_a_minute(name):
    """The page tells what was measured; a look that grew has to be measured anew."""
    ((trials, seconds),) = re.findall(r"^([\d,]+) trials, (\d+) s$", EFFORTS[name])
    assert int(trials.replace(",", "")) > 0
    assert int(seconds) <= A_LOOK_S
