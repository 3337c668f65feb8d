"""Checks that what a study leaves loads nothing and runs nothing but our script: pages, tables and pictures."""

import csv
import json
import re
from base64 import b64encode
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.etree import ElementTree

import studies

OWN_SCRIPT = (Path(studies.__file__).parent / "report.js").read_text(encoding="utf-8")
POLICY = re.compile(
    r"default-src 'none'; script-src 'sha256-[A-Za-z0-9+/]{43}='; style-src 'unsafe-inline'; img-src data:; "
    r"base-uri 'none'; form-action 'none'"
)


class Loads(HTMLParser):
    """Notes of an HTML page what it could run or load."""

    def __init__(self):
        super().__init__()
        self.tags, self.attributes, self.links = set(), set(), set()
        self.scripts, self.metas = [], []
        self._in_script = False

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        self.links |= {value for name, value in attrs if name in ("href", "src", "xlink:href", "action", "data")}
        self._in_script = tag == "script"
        if self._in_script:
            self.scripts.append([dict(attrs), ""])
        if tag == "meta":
            self.metas.append(dict(attrs))

    def handle_endtag(self, tag):
        self._in_script = False

    def handle_data(self, text):
        if self._in_script:
            self.scripts[-1][1] += text


def check_page(text, folder):
    """Check that a page loads nothing and runs nothing but our script, its links go to files below it."""
    page = Loads()
    page.feed(text)
    assert not page.tags & {
        "iframe",
        "object",
        "embed",
        "link",
        "base",
        "form",
        "foreignobject",
    }
    assert not [name for name in page.attributes if name.startswith("on")]
    assert not re.search(r"url\((?!#)|@import", text)
    for link in page.links:
        if link.startswith(("#", "data:image/png;base64,")):
            continue
        parts = urlsplit(link)
        assert not parts.scheme, link
        assert not parts.netloc, link
        assert (folder / unquote(parts.path)).resolve().is_relative_to(folder.resolve()), link
        assert (folder / unquote(parts.path)).exists(), link
    check_scripts(page)


def check_scripts(page):
    """Check that the scripts of a page are ours, once, with its data, under a policy for nothing else."""
    orders = [meta for meta in page.metas if "http-equiv" in meta]
    assert {meta["http-equiv"] for meta in orders} <= {"Content-Security-Policy"}
    policies = [meta["content"] for meta in orders]
    if not page.scripts:
        assert not policies
        return
    (data_attributes, data), (attributes, script) = page.scripts
    assert data_attributes == {"type": "application/json", "id": "report-data"}
    json.loads(data)
    assert attributes == {}
    assert script == OWN_SCRIPT
    (policy,) = policies
    assert POLICY.fullmatch(policy)
    assert b64encode(sha256(script.encode()).digest()).decode() in policy


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
