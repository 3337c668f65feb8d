"""Checks that what a study leaves runs and loads nothing: pages, tables and pictures."""

import csv
import re
from html.parser import HTMLParser
from urllib.parse import unquote, urlsplit
from xml.etree import ElementTree


class Loads(HTMLParser):
    """Notes of an HTML page what it could run or load."""

    def __init__(self):
        super().__init__()
        self.tags, self.attributes, self.links = set(), set(), set()

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        self.links |= {value for name, value in attrs if name in ("href", "src", "xlink:href", "action", "data")}


def check_page(text, folder):
    """Check that a page runs and loads nothing, and that its links are to files below it."""
    page = Loads()
    page.feed(text)
    assert not page.tags & {
        "script",
        "iframe",
        "object",
        "embed",
        "link",
        "base",
        "form",
        "foreignobject",
        "meta refresh",
    }
    assert not [name for name in page.attributes if name.startswith("on")]
    for link in page.links:
        if link.startswith(("#", "data:image/png;base64,")):
            continue
        parts = urlsplit(link)
        assert not parts.scheme, link
        assert not parts.netloc, link
        assert (folder / unquote(parts.path)).resolve().is_relative_to(folder.resolve()), link
        assert (folder / unquote(parts.path)).exists(), link
    assert "http-equiv" not in page.attributes


def check_table(path):
    """Check that no cell of a table is taken for a formula: it is a number, or begins with no sign of one."""
    with path.open(encoding="utf-8", newline="") as stream:
        for row in csv.reader(stream, strict=True):
            for cell in row:
                number = re.fullmatch(r"-?(\d+(\.\d+)?(e[-+]?\d+)?|inf|nan)", cell)
                assert number or not cell.lstrip().startswith(("=", "+", "-", "@", "\t", "\r")), (path.name, cell)


def check_picture(path):
    """Check that an SVG is XML without anything that runs or loads."""
    for element in ElementTree.parse(path).iter():
        assert element.tag.rpartition("}")[2] not in ("script", "foreignObject", "a", "iframe")
        for name, value in element.attrib.items():
            assert not name.lower().startswith("on")
            if name.rpartition("}")[2] == "href":
                assert value.startswith(("#", "data:image/png;base64,"))
