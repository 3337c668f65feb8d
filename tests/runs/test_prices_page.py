"""What docs/prices.md shows is what happens."""

import re
from pathlib import Path

import layoutopt
from layoutopt.prices import ITEM_KEYS, read_prices
from tests.command_line import called

PAGE = (Path(layoutopt.__file__).parent.parent / "docs" / "prices.md").read_text(encoding="utf-8")


def test_the_list_of_ten_lines_reads_as_the_page_says(tmp_path):
    """Ten lines, five items changed, each with its own source and date."""
    (text,) = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)
    assert len(text.splitlines()) == 10
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    items = read_prices(tmp_path / "mine.toml").items
    assert (items["label"].price_eur, items["label"].labour_s) == (0.18, 60.0)
    assert items["reader_module"].date == "2026-10-14"
    assert items["label"].date == "2026-11"
    assert items["puck"].source == "estimate"


def test_the_output_shown_is_that_of_the_command(tmp_path):
    """Every line of the block is one that `layoutopt prices` prints."""
    (block,) = re.findall(r"```\n\$ layoutopt prices\n(.*?)```", PAGE, flags=re.DOTALL)
    printed = called("prices", cwd=tmp_path).stdout.replace("\u202f", " ").splitlines()
    assert set(block.splitlines()) - {"..."} <= set(printed)


def test_every_item_and_key_stands_in_the_table():
    """An item or key that is added is told on the page."""
    for item, keys in ITEM_KEYS.items():
        assert f"`{item}`" in PAGE
        assert all(f"`{key}`" in PAGE for key in keys)
