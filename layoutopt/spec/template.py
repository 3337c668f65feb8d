"""The specs that come with layoutopt: they run as they are, and their comments explain every key.

Beside them a price list to fill in.
"""

from pathlib import Path
from typing import Final

from layoutopt.errors import UnknownName, did_you_mean

DEFAULT_EXAMPLE: Final = "hospital_ward"
PRICES: Final = "prices"
"""What `template` knows beside the built-in specs: a price list of one's own."""
_FOLDER: Final = Path(__file__).with_name("examples")
_PRICE_LIST: Final = Path(__file__).parent.with_name("own_prices.toml")


def example_names() -> tuple[str, ...]:
    """Return the names of the built-in specs."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.toml")))


def built_in(name: str = DEFAULT_EXAMPLE) -> Path:
    """Return the file of a built-in spec.

    Raises
    ------
    UnknownName
        If there is none of that name.
    """
    names = example_names()
    if name not in names:
        raise UnknownName.at("example", f"no built-in spec named '{name}'", did_you_mean(name, names))
    return _FOLDER / f"{name}.toml"


def template(example: str = DEFAULT_EXAMPLE) -> str:
    """Return the text of a built-in spec or of a price list, comments included, as the start of one's own.

    Raises
    ------
    UnknownName
        If there is none of that name.
    """
    known = (*example_names(), PRICES)
    if example not in known:
        raise UnknownName.at("--from", f"there is nothing called '{example}'", did_you_mean(example, known))
    return (_PRICE_LIST if example == PRICES else built_in(example)).read_text(encoding="utf-8")


def example_lines() -> list[str]:
    """Return what there is to start from, each with the first sentence of its file."""
    names = (*example_names(), PRICES)
    width = max(map(len, names))
    lines = [f"{name:{width}}  {template(name).partition(chr(10))[0].removeprefix('# ')}" for name in names]
    return [*lines, f"layoutopt new FILE --from NAME writes one; without --from it is {DEFAULT_EXAMPLE}."]
