"""How to cite layoutopt and the works that its cards name, as text and as BibTeX, from ``works.toml``."""

import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from types import MappingProxyType
from typing import Any, Final

import layoutopt

_WORDS: Final = ("named", "type")
_PLACES: Final = ("journal", "booktitle", "publisher", "institution")


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """Something that can be cited.

    Attributes
    ----------
    key
        Short name, such as ``"mi2016"``; cards name the work by it or by one of ``named``.
    type
        Kind of the BibTeX entry.
    fields
        Fields of the entry: title, author, year and what else is known, as BibTeX writes them.
    """

    key: str
    type: str
    fields: Mapping[str, str]
    named: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The work in one line, as a list of references has it."""
        known = self.fields
        authors = [_in_reading_order(name) for name in known["author"].split(" and ")]
        place = next((known[name] for name in _PLACES if name in known), "")
        volume = known.get("volume", "")
        issue = f"{volume}({known['number']})" if volume and "number" in known else volume
        edition = f"{known['edition']}. edition" if "edition" in known else ""
        pages = known.get("pages", "").replace("--", "–")
        parts = [f"{place} {issue}".strip(), edition, pages, known.get("year", "")]
        text = f"{', '.join(authors)}: {known['title']}. {', '.join(part for part in parts if part)}".rstrip(" .")
        tail = [f"Version {known['version']}"] if "version" in known else []
        tail += [f"doi:{known['doi']}"] if "doi" in known else []
        tail += [known["note"]] if "note" in known else []
        return ". ".join([text, *tail]) + "."

    @property
    def bibtex(self) -> str:
        """The work as an entry of BibTeX."""
        # A second pair of braces keeps the capitals of a title.
        shown = {**self.fields, "title": f"{{{self.fields['title']}}}"}
        lines = [f"  {name} = {{{value}}}," for name, value in shown.items()]
        return "\n".join([f"@{self.type}{{{self.key},", *lines, "}"])


def software() -> Work:
    """Return how layoutopt itself is cited, in the version that runs."""
    table = dict(_file()["software"])
    kind = str(table.pop("type"))
    return Work(key="layoutopt", type=kind, fields={**table, "version": layoutopt.__version__})


@lru_cache(maxsize=1)
def works() -> Mapping[str, Work]:
    """Return all works that cards may name, by key."""
    return MappingProxyType(
        {
            key: Work(
                key=key,
                type=table["type"],
                fields={name: value for name, value in table.items() if name not in _WORDS},
                named=tuple(table.get("named", ())),
            )
            for key, table in _file()["works"].items()
        }
    )


def works_named(references: Iterable[str]) -> tuple[Work, ...]:
    """Return the works that the references of cards name, each once, in the order of ``works.toml``.

    >>> [work.key for work in works_named(["mi2016, Algorithm 1, Eq. 1-6", "own, after kim2010, Eq. 1-6"])]
    ['mi2016', 'kim2010']
    """
    told = tuple(references)
    return tuple(
        work
        for work in works().values()
        if any(re.search(rf"\b{re.escape(name)}", text) for name in (work.key, *work.named) for text in told)
    )


def _in_reading_order(name: str) -> str:
    """Return a name of BibTeX as it is read.

    >>> _in_reading_order("Mi, Jian"), _in_reading_order("others"), _in_reading_order("{3GPP}")
    ('Jian Mi', 'and others', '3GPP')
    """
    if name == "others":
        return "and others"
    family, _, given = name.strip("{}").partition(", ")
    return f"{given} {family}".strip()


@lru_cache(maxsize=1)
def _file() -> dict[str, Any]:
    text = (resources.files("layoutopt") / "works.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)
