"""Price lists that must end in clear faults: never a traceback, a hang or a silent error."""

import contextlib
import os
import time
from importlib import resources

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from layoutopt.errors import InvalidInput
from layoutopt.parts import read_prices

HEAD = 'schema = 1\nname = "own"\ndate = 2026-12-01\nbase = "default-2026"\n'
LABEL = '[items.label]\nprice = "0.2 EUR"\nsource = "offer"\n'
DEFAULT = (resources.files("layoutopt") / "prices" / "default-2026.toml").read_text(encoding="utf-8")


def complaints(tmp_path, content):
    """Return the faults of a price list as lines of text, and check that they come fast."""
    path = tmp_path / "own.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    begin = time.monotonic()
    with pytest.raises(InvalidInput) as caught:
        read_prices(path)
    assert time.monotonic() - begin < 5.0
    assert all(len(str(fault)) < 1500 and str(fault).isprintable() for fault in caught.value.faults)
    return [str(fault).replace(str(path), "own.toml") for fault in caught.value.faults]


@pytest.mark.parametrize(
    ("lines", "complaint"),
    [
        ("price = nan", "own.toml:6 items.disc.price: nan is not a finite number"),
        ("price = inf", "own.toml:6 items.disc.price: inf is not a finite number"),
        ("price = 1e400", "own.toml:6 items.disc.price: inf is not a finite number"),
        ("price = " + "9" * 400, "is not a finite number"),
        ('price = "1e400 EUR"', "items.disc.price: '1e400 EUR' is not a finite number"),
        ("price = -0.5", "items.disc.price: -0.5 is out of range. It must lie between 0 and 1,000,000 EUR."),
        ("price = 1e7", "items.disc.price: 10000000.0 is out of range"),
        ('price = "0.5 USD"', "items.disc.price: the unit of '0.5 USD' is none of price; use '1 EUR', '1 €'"),
        ('price = "free"', "items.disc.price: 'free' is no number with a unit"),
        ("price = true", "items.disc.price: true is no price. Write for example '0.25 EUR'."),
        ("price = [1]", "items.disc.price: [1] is no price"),
        ("price = 2026-01-01", "items.disc.price: 2026-01-01 is no price"),
        ("labour = 1.5", "items.disc.labour: 1.5 has no unit. Write for example '1.5 min'."),
        ('labour = "1.5 m"', "items.disc.labour: the unit of '1.5 m' is none of time"),
        ('labour = "-1 min"', "items.disc.labour: '-1 min' is out of range"),
        ('spare = "200 %"', "items.disc.spare: '200 %' is out of range. It must lie between 0 and 1."),
        ("size = 0.02", "items.disc.size: 0.02 is no size"),
        ('size = ["20 mm"]', "items.disc.size: ['20 mm'] is no size"),
        ('size = ["20 mm", "0 mm"]', "items.disc.size: '0 mm' is no size. It must lie above 0 and up to 1 m."),
        ('size = ["20 mm", "20 m"]', "items.disc.size: '20 m' is out of range"),
        ('base_side = "60 mm"', "items.disc.base_side: unknown key"),
        ('prise = "1 EUR"', "items.disc.prise: unknown key. Did you mean 'price'?"),
        ("source = 5", "items.disc.source: 5 is no text"),
        ('source = ""', "items.disc.source: '' is no text"),
        ('source = "a\\nb"', "items.disc.source: 'a\\nb' is no text"),
        ('source = "\\u001b[31m"', "items.disc.source: '\\x1b[31m' is no text"),
        ('date = "yesterday"', "items.disc.date: 'yesterday' is no date"),
        ('date = "2026-02-30"', "items.disc.date: '2026-02-30' is no date"),
        ("date = 2026-02-03T10:00:00", "is no date"),
    ],
    ids=lambda value: value[:24],
)
def test_a_bad_value_is_named_with_line_and_key(tmp_path, lines, complaint):
    """One bad value, one complaint that says where, what and what would be right."""
    source = "" if lines.startswith("source") else 'source = "offer"\n'
    found = complaints(tmp_path, HEAD + f"[items.disc]\n{lines}\n{source}")
    assert len(found) == 1
    assert complaint in found[0]
    assert found[0].startswith("own.toml:6 items.disc.")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (HEAD + "[items.lable]\n", "own.toml:5 items.lable: no such item. Did you mean 'label'?"),
        (HEAD + '[items.label]\nprice = "1 EUR"\n', "own.toml:5 items.label.source: is missing"),
        (HEAD + "items = 3\n", "own.toml:5 items: is no table"),
        (HEAD + "[items]\nlabel = 3\n", "own.toml:6 items.label: is no table"),
        (HEAD.replace("schema = 1", "schema = 2"), "own.toml:1 schema: 2 cannot be used. Write schema = 1."),
        (HEAD.replace("schema = 1\n", ""), "own.toml schema: is missing. Write schema = 1."),
        (HEAD.replace("schema = 1", "schema = true"), "own.toml:1 schema: true cannot be used"),
        (HEAD + 'currency = "USD"\n', "own.toml:5 currency: 'USD' cannot be used"),
        (
            HEAD.replace("default-2026", "../../etc/passwd"),
            "own.toml:4 base: no price list named '../../etc/passwd'",
        ),
        (HEAD.replace('"default-2026"', "7"), "own.toml:4 base: no price list named 7. Known: default-2026."),
        (HEAD.replace('name = "own"\n', ""), "own.toml name: is missing"),
        (HEAD.replace("date = 2026-12-01\n", ""), "own.toml date: is missing"),
        (HEAD + "nmae = 1\n", "own.toml:5 nmae: unknown key. Did you mean 'name'?"),
        (HEAD + '"a\\nb" = 1\n', "unknown key"),
        (HEAD + LABEL + LABEL, "this is not TOML"),
        ("price 5\n", "this is not TOML"),
        ("a = " + "[" * 900, "own.toml: brackets are nested too deeply"),
        ("a" + ".a" * 50_000 + " = 1", "own.toml:1: the line has over 1000 characters"),
        ("[" + "a." * 400 + "a]\n" + "b." * 400 + "b = 1\n", "unknown key"),
        (HEAD + "[items.label]\nprice" + ".p" * 450 + " = 1\nsource = 'x'\n", "is no price"),
        ("x = 1\n" * 200_000, "has over 200000 bytes"),
        (b"\xff\xfe" + HEAD.encode("utf-16-le"), "byte 0 is not UTF-8"),
        (b"PK\x03\x04" + bytes(range(256)), "is not UTF-8"),
        (b"\x00\x00", "this is not TOML"),
        ("", "own.toml schema: is missing"),
        ("", "own.toml items: missing: label, disc, on_metal,"),
    ],
    ids=range(26),
)
def test_a_bad_file_is_refused(tmp_path, text, complaint):
    """Unknown names, missing keys, other formats and files made to hurt: a clear complaint, at once."""
    assert any(complaint in line for line in complaints(tmp_path, text))


def test_all_faults_come_at_once(tmp_path):
    """Five faults, five complaints, in the order of the file's tables."""
    text = HEAD + 'nmae = 1\n[items.lable]\n[items.label]\nprice = -1\nsource = ""\n[items.disc]\nspare = 7\n'
    found = complaints(tmp_path, text)
    named = [line.partition(": ")[0].rpartition(".")[2] for line in found]
    assert named == ["toml:5 nmae", "lable", "price", "source", "spare"]


def test_a_price_without_source_and_with_a_bad_unit_tells_both_and_shows_both_lines(tmp_path):
    """One pass tells all that the item lacks, and how a price with its source is written."""
    source, price = complaints(tmp_path, HEAD + '[items.reader_module]\nprice = "95 USD"\n')
    assert source == (
        "own.toml:5 items.reader_module.source: is missing. A price stands with its source: "
        'price = "95 EUR" and source = "offer of ..., 2026-11-20". '
        "Known keys: price, source, date, description, labour, spare."
    )
    assert price.startswith("own.toml:6 items.reader_module.price: the unit of '95 USD' is none of price; use")


def test_a_missing_file_is_named_where_it_was_asked_for(tmp_path):
    """The message names the spec's line and the path; folders and pipes are no files either."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (tmp_path / "none.toml", tmp_path, pipe, tmp_path / ("x" * 300), "a\0b"):
        with pytest.raises(InvalidInput, match=r"ward.toml:12 parts.prices: '"):
            read_prices(path, "ward.toml:12 parts.prices")


@pytest.mark.parametrize(
    "change", [lambda text: text.replace("\n", "\r\n"), lambda text: "\ufeff" + text], ids=["CRLF", "BOM"]
)
def test_windows_files_are_read(tmp_path, change):
    """Line ends and a byte order mark of a Windows editor do no harm."""
    path = tmp_path / "own.toml"
    path.write_bytes(change(HEAD + LABEL).encode())
    assert read_prices(path).items["label"].price_eur == 0.2


@settings(max_examples=150, deadline=None)
@given(st.integers(0, len(DEFAULT) - 1), st.integers(0, 12), st.text(st.characters(codec="utf-8"), max_size=6))
def test_a_mutated_list_is_read_or_refused(tmp_path_factory, place, length, text):
    """Cut and overwrite the default list anywhere: sound numbers or InvalidInput, and nothing else."""
    path = tmp_path_factory.getbasetemp() / "mutated.toml"
    path.write_bytes((DEFAULT[:place] + text + DEFAULT[place + length :]).encode())
    with contextlib.suppress(InvalidInput):
        prices = read_prices(path)
        assert all(0.0 <= price.price_eur <= 1e6 for price in prices.items.values())
