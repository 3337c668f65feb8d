"""Dated price lists in TOML: the one that comes with layoutopt, and the user's own."""

import datetime
import math
import re
import reprlib
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Final

from layoutopt.errors import Fault, InvalidInput, UnknownName, did_you_mean
from layoutopt.identity import by_content
from layoutopt.units import Dimension, parse_quantity

TAG_ITEMS: Final = ("label", "disc", "on_metal", "puck")
READER_ITEMS: Final = ("reader_module", "industrial_reader")
DEFAULT_LIST: Final = "default-2026"
FINDER_ITEMS: Final = ("uhf_reader", "uhf_antenna", "uhf_tag", "direction_receiver", "transponder")
"""Items that only layouts with UHF antennas or docking take; a list may do without."""
_DEVICE: Final = ("labour", "spare")
ITEM_KEYS: Final[Mapping[str, tuple[str, ...]]] = {
    **dict.fromkeys(TAG_ITEMS, ("labour", "spare", "size")),
    **dict.fromkeys(READER_ITEMS, _DEVICE),
    "antenna": (*_DEVICE, "base_side"),
    "multiplexer_4": _DEVICE,
    "multiplexer_8": _DEVICE,
    "labour": (),
    "survey": ("labour",),
    "survey_tag": ("labour",),
    **dict.fromkeys(FINDER_ITEMS, _DEVICE),
}
"""The items of a list, with the keys that each has beside price, source, date and description."""

_UNITS: Final = {"labour": "hour", "survey": "visit", "survey_tag": "tag"}
_FILE_KEYS: Final = ("schema", "name", "date", "currency", "base", "items")
_LARGEST_FILE: Final = 200_000
_LONGEST_LINE: Final = 1000
_LONGEST_TEXT: Final = 300
_DATE: Final = re.compile(r"\d{4}(-(0[1-9]|1[0-2])(-(0[1-9]|[12]\d|3[01]))?)?")

_COMPARE: Final = "Write lines such as price = '0.25 EUR' below [items.label]; texts and units stand in quotes."
_READ: Final = "Check its name and the right to read it."
_EXAMPLES: Final[Mapping[Dimension, str]] = {
    "price": "Write for example '0.25 EUR'.",
    "share": "Write for example '2 %'.",
    "time": "Write for example '1.5 min'.",
    "length": "Write for example '20 mm'.",
}
_WHOLE_ITEM: Final = 'A price stands with its source: price = "95 EUR" and source = "offer of ..., 2026-11-20".'
_SI: Final[Mapping[Dimension, str]] = {"price": " EUR", "time": " s", "length": " m"}

Place = tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Price:
    """What one unit of an item costs, and who says so.

    Attributes
    ----------
    price_eur
        Price of one ``unit``: piece, hour, visit or tag.
    source, date
        Where the price comes from, and when it held (year, month or day).
    labour_s
        Time to place, mount or survey one.
    spare_share
        Share that is bought on top for the whole fleet.
    size_m
        Width and height of a tag.
    base_side_m
        Side up to which an antenna costs ``price_eur``; above it the price grows with the area.

    Raises
    ------
    ValueError
        If a number is negative or not finite.
    """

    name: str
    description: str
    price_eur: float
    unit: str
    source: str
    date: str
    labour_s: float = 0.0
    spare_share: float = 0.0
    size_m: tuple[float, float] | None = None
    base_side_m: float | None = None

    def __post_init__(self) -> None:
        """Check the numbers."""
        numbers = [self.price_eur, self.labour_s, self.spare_share, *(self.size_m or ())]
        numbers += [] if self.base_side_m is None else [self.base_side_m]
        if not all(math.isfinite(number) and number >= 0.0 for number in numbers):
            raise ValueError(f"numbers of '{self.name}' must be finite and not negative, got {numbers}")


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PriceList:
    """A dated list of prices by item name, in euro; it may lack `FINDER_ITEMS`, but no other item.

    Raises
    ------
    ValueError
        If an item is missing, or is none that a bill can hold.
    """

    name: str
    date: str
    items: Mapping[str, Price]
    currency: str = "EUR"
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the table and check that it is complete."""
        object.__setattr__(self, "items", MappingProxyType(dict(self.items)))
        needed = set(ITEM_KEYS) - set(FINDER_ITEMS)
        if not needed <= set(self.items) <= set(ITEM_KEYS):
            raise ValueError(
                f"a price list needs the items {', '.join(name for name in ITEM_KEYS if name in needed)} "
                f"and may have {', '.join(FINDER_ITEMS)}; got {', '.join(self.items)}"
            )

    def missing(self, names: Iterable[str]) -> tuple[str, ...]:
        """Return which of the named items have no price here."""
        return tuple(name for name in names if name not in self.items)

    def replace_item(self, name: str, **changes: object) -> "PriceList":
        """Return a copy in which one item differs: ``prices.replace_item("label", price_eur=0.1)``."""
        changed = replace(self.items[name], **changes)  # type: ignore[arg-type]
        return replace(self, items={**self.items, name: changed})


def default_names() -> tuple[str, ...]:
    """Return the names of the price lists that come with layoutopt."""
    entries = (resources.files("layoutopt") / "prices").iterdir()
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in entries if entry.name.endswith(".toml")))


@lru_cache(maxsize=8)
def default_prices(name: str = DEFAULT_LIST, place: str = "prices") -> PriceList:
    """Return a price list that comes with layoutopt.

    Raises
    ------
    UnknownName
        If there is no list of that name.
    """
    if name not in default_names():
        raise UnknownName.at(
            place, f"no price list named {reprlib.repr(name)}", did_you_mean(name, default_names())
        )
    text = (resources.files("layoutopt") / "prices" / f"{name}.toml").read_text(encoding="utf-8")
    return _PriceFile(text, f"{name}.toml").price_list()


def read_prices(path: Path | str, place: str = "prices") -> PriceList:
    """Return the price list of a TOML file.

    A list names every item (`FINDER_ITEMS` only if it wants to), or says ``base = "default-2026"`` and names only
    what differs from that list.

    Parameters
    ----------
    path
        The file.
    place
        Where the path was read, for the message if there is no such file.

    Raises
    ------
    InvalidInput
        With every fault of the file at once.
    """
    path = Path(path)
    try:
        # A pipe would block and a device would never end.
        if not path.is_file():
            repair = "Give the path of a price list in TOML; layoutopt new FILE --from prices writes one."
            raise InvalidInput.at(place, f"'{path}' is no file", repair)
        if path.stat().st_size > _LARGEST_FILE:
            raise InvalidInput.at(
                place, f"'{path}' has over {_LARGEST_FILE} bytes", "Give a price list, which has a few thousand."
            )
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput.at(str(path), f"byte {error.start} is not UTF-8", "Save it as UTF-8 text.") from error
    except (OSError, ValueError) as error:
        raise InvalidInput.at(place, f"'{path}' cannot be read ({error})", _READ) from error
    return _PriceFile(text, str(path)).price_list()


class _PriceFile:
    """The text of one price list while it is read; collects the faults."""

    def __init__(self, text: str, name: str) -> None:
        self._text = text
        self._name = name
        self._lines = _line_numbers(text)
        self._faults: list[Fault] = []
        self._readers: dict[str, tuple[str, Callable[[Place, object], object]]] = {
            "description": ("description", self._words),
            "price": ("price_eur", lambda place, value: self._number(place, value, "price", 1e6)),
            "source": ("source", self._words),
            "date": ("date", self._date),
            "labour": ("labour_s", self._labour),
            "spare": ("spare_share", lambda place, value: self._number(place, value, "share", 1.0)),
            "size": ("size_m", self._size),
            "base_side": ("base_side_m", self._length),
        }

    def price_list(self) -> PriceList:
        """Return the list, or raise all faults."""
        table = self._parsed()
        for key in table:
            if key not in _FILE_KEYS:
                self._fault((key,), "unknown key", did_you_mean(key, _FILE_KEYS))
        for key, want in (("schema", 1), ("currency", "EUR")):
            given = table.get(key, want if key == "currency" else None)
            if given != want or isinstance(given, bool):
                problem = "is missing" if given is None else f"{_shown(given)} cannot be used"
                self._fault((key,), problem, f"Write {key} = {_toml(want)}.")
        base = self._base(table)
        for key in ("name", "date"):
            if key not in table:
                self._fault((key,), "is missing", f"Every price list has a {key}.")
        name = self._words(("name",), table.get("name", "-"))
        date = self._date(("date",), table.get("date", "2000"))
        given_items = table.get("items", {})
        if not isinstance(given_items, dict):
            self._fault(("items",), "is no table", "Write [items.label] and its keys below.")
            given_items = {}
        for key in given_items:
            if key not in ITEM_KEYS:
                self._fault(("items", key), "no such item", did_you_mean(key, ITEM_KEYS))
        missing = [key for key in ITEM_KEYS if key not in given_items and key not in FINDER_ITEMS]
        if missing and base is None:
            repair = f'Take them from the list that comes along, base = "{DEFAULT_LIST}", or write them all.'
            self._fault(("items",), f"missing: {', '.join(missing)}", repair)
        items = {key: self._item(key, given_items.get(key), base, date) for key in ITEM_KEYS}
        if self._faults:
            raise InvalidInput(self._faults)
        found = {key: item for key, item in items.items() if item is not None}
        return PriceList(name=name, date=date, items=found)

    def _parsed(self) -> dict[str, object]:
        # A key of thousands of dots takes tomllib time that grows with their square.
        long = next((n for n, line in enumerate(self._text.splitlines(), 1) if len(line) > _LONGEST_LINE), 0)
        if long:
            raise InvalidInput.at(
                f"{self._name}:{long}", f"the line has over {_LONGEST_LINE} characters", _COMPARE
            )
        try:
            return tomllib.loads(self._text)
        except RecursionError as error:
            raise InvalidInput.at(self._name, "brackets are nested too deeply", _COMPARE) from error
        except ValueError as error:
            raise InvalidInput.at(self._name, f"this is not TOML: {error}", _COMPARE) from error

    def _base(self, table: Mapping[str, object]) -> Mapping[str, Price] | None:
        if "base" not in table:
            return None
        wanted = table["base"]
        if not isinstance(wanted, str) or wanted not in default_names():
            names = ", ".join(default_names())
            self._fault(("base",), f"no price list named {reprlib.repr(wanted)}", f"Known: {names}.")
            return default_prices().items  # so that what it would fill is not called missing as well
        return default_prices(wanted).items

    def _item(self, name: str, table: object, base: Mapping[str, Price] | None, date: str) -> Price | None:
        """Return one item, ``None`` after a fault."""
        place: Place = ("items", name)
        if table is None:
            return base[name] if base is not None else None
        if not isinstance(table, dict):
            self._fault(place, "is no table", f"Write [items.{name}] and its keys below.")
            return None
        needed = ("price", "source", *ITEM_KEYS[name]) if base is None else ()
        if base is not None and "price" in table:
            # The old source never named the new price.
            needed = ("source",)
        known = ("price", "source", "date", "description", *ITEM_KEYS[name])
        faults_before = len(self._faults)
        for key in needed:
            if key not in table:
                example = f"{_WHOLE_ITEM} " if key in ("price", "source") else ""
                self._fault((*place, key), "is missing", f"{example}Known keys: {', '.join(known)}.")
        fields: dict[str, object] = {}
        for key, value in table.items():
            if key not in known:
                self._fault((*place, key), "unknown key", did_you_mean(key, known))
                continue
            field_name, read = self._readers[key]
            fields[field_name] = read((*place, key), value)
        if len(self._faults) > faults_before:
            return None
        if base is not None:
            dated = {"date": date} if "source" in table else {}
            return replace(base[name], **{**dated, **fields})  # type: ignore[arg-type]
        plain = {"name": name, "description": name.replace("_", " "), "unit": _UNITS.get(name, "piece")}
        return Price(**{**plain, "date": date, **fields})  # type: ignore[arg-type]

    def _number(self, place: Place, value: object, dimension: Dimension, largest: float) -> float | None:
        if not isinstance(value, (str, int, float)):
            self._fault(place, f"{_shown(value)} is no {dimension}", _EXAMPLES[dimension])
            return None
        try:
            number = parse_quantity(value, dimension)
        except ValueError as error:
            self._fault(place, str(error), _EXAMPLES[dimension])
            return None
        if not 0.0 <= number <= largest:
            self._fault(
                place,
                f"{value!r} is out of range",
                f"It must lie between 0 and {largest:,.0f}{_SI.get(dimension, '')}.",
            )
            return None
        return number + 0.0  # -0.0 becomes 0.0, which has another content key

    def _labour(self, place: Place, value: object) -> float | None:
        if isinstance(value, (int, float)) and value:
            # A bare 1.5 would be seconds, where everybody means minutes.
            self._fault(place, f"{value!r} has no unit", "Write for example '1.5 min'.")
            return None
        return self._number(place, value, "time", 1e6)

    def _length(self, place: Place, value: object) -> float | None:
        length_m = self._number(place, value, "length", 1.0)
        if length_m == 0.0:
            self._fault(place, f"{value!r} is no size", "It must lie above 0 and up to 1 m.")
        return length_m

    def _size(self, place: Place, value: object) -> tuple[float | None, ...]:
        if not isinstance(value, list) or len(value) != 2:
            self._fault(place, f"{_shown(value)} is no size", "Write width and height: ['20 mm', '10 mm'].")
            return ()
        return tuple(self._length(place, side) for side in value)

    def _words(self, place: Place, value: object) -> str:
        text = value.strip() if isinstance(value, str) else ""
        if not text or len(text) > _LONGEST_TEXT or not text.isprintable():
            repair = f"One printable line, 1 to {_LONGEST_TEXT} characters long."
            self._fault(place, f"{_shown(value)} is no text", repair)
        return text

    def _date(self, place: Place, value: object) -> str:
        text = value.isoformat() if type(value) is datetime.date else value
        if isinstance(text, str) and _DATE.fullmatch(text):
            try:
                datetime.date.fromisoformat((text + "-01-01")[:10])
            except ValueError:
                pass
            else:
                return text
        self._fault(place, f"{_shown(value)} is no date", "Write 2026-11-01, '2026-11' or '2026'.")
        return "2000"

    def _fault(self, place: Place, problem: str, repair: str) -> None:
        known = (place[:size] for size in range(len(place), 0, -1))
        line = next((self._lines[part] for part in known if part in self._lines), 0)
        where = f"{self._name}:{line}" if line else self._name
        shown = ".".join(part if part.isidentifier() else reprlib.repr(part) for part in place)
        self._faults.append(Fault(place=f"{where} {shown}", problem=problem, repair=repair))


def _line_numbers(text: str) -> dict[Place, int]:
    """Return the line of each table and key that stands on a line of its own."""
    found: dict[Place, int] = {}
    table: Place = ()
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.partition("#")[0].strip()
        head, equals, _ = bare.partition("=")
        if bare.startswith("[") and bare.endswith("]") and not equals:
            table = _dotted(bare[1:-1])
            found.setdefault(table, number)
        elif equals:
            found.setdefault((*table, *_dotted(head)), number)
    return found


def _dotted(name: str) -> Place:
    return tuple(part.strip().strip("\"'") for part in name.split("."))


def _shown(value: object) -> str:
    """Return a value as its file has it, as far as messages quote it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    return reprlib.repr(value)


def _toml(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value)
