"""Tables of names: the one place where a name becomes an object, loaded only when it is asked for.

Each extension point is a package whose ``__init__`` holds ``ROWS``, a table from names to ``"module:object"``,
and ``EXTENSION_POINT``, its own name. Every module that a row names has a ``CARD``.
"""

import importlib
from collections.abc import Mapping
from types import ModuleType
from typing import Any, Final

from layoutopt.errors import NotInstalled, UnknownName, did_you_mean

PACKAGES: Final[Mapping[str, str]] = {
    "patterns": "layoutopt.patterns",
    "readers": "layoutopt.readers",
    "antennas": "layoutopt.antennas",
    "estimators": "layoutopt.estimators",
    "plans": "layoutopt.plans",
    "objectives": "objectives",
    "solvers": "solvers",
    "studies": "studies",
}
"""Extension points and the packages that hold them."""
_ONE: Final = {"antennas": "antenna model", "readers": "reader family", "studies": "study"}
"""What a single entry is called where that is not the point without its s."""


def rows(point: str) -> Mapping[str, str]:
    """Return the table of an extension point: name to ``"module:object"``.

    Raises
    ------
    NotInstalled
        If a package of the user's own hides ours.
    """
    package = PACKAGES[point]
    module = importlib.import_module(package)
    if getattr(module, "EXTENSION_POINT", None) != point:
        raise NotInstalled(
            f"the package '{package}' of layoutopt is hidden by {getattr(module, '__file__', None) or module}; "
            "rename that file or start from another folder"
        )
    table: Mapping[str, str] = module.ROWS
    return table


def names(point: str) -> tuple[str, ...]:
    """Return the names of an extension point, in the order of its table."""
    return tuple(rows(point))


def load(point: str, name: str, *, place: str = "") -> Any:  # as many types as points
    """Return the object behind a name; ``place`` says where the name was read, for the message.

    Raises
    ------
    UnknownName
        If the table has no such name.
    """
    module, attribute = _row(point, name, place)
    return getattr(module, attribute)


def card(point: str, name: str) -> Any:
    """Return the capability card behind a name."""
    module, _ = _row(point, name, "")
    return module.CARD


def _row(point: str, name: str, place: str) -> tuple[ModuleType, str]:
    table = rows(point)
    if name not in table:
        one = _ONE.get(point, point.removesuffix("s"))
        raise UnknownName.at(place or point, f"no {one} named '{name}'", did_you_mean(name, table))
    module, _, attribute = table[name].partition(":")
    return importlib.import_module(module), attribute
