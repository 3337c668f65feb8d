"""The specs that come with layoutopt: they run as they are, and their comments explain every key."""

from pathlib import Path
from typing import Final

from layoutopt.errors import UnknownName, did_you_mean

DEFAULT_EXAMPLE: Final = "hospital_ward"
_FOLDER: Final = Path(__file__).with_name("examples")


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
    """Return the text of a built-in spec, comments included, as the start of a spec of one's own.

    Raises
    ------
    UnknownName
        If there is none of that name.
    """
    return built_in(example).read_text(encoding="utf-8")
