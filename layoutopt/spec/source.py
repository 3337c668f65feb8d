"""From a path to a TOML document: the one place where a spec's bytes are trusted or refused."""

import math
import os
import re
import stat
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from layoutopt.errors import InvalidInput
from layoutopt.spec.findings import Findings

if TYPE_CHECKING:
    from layoutopt.spec.lines import KeyPath

MAXIMUM_BYTES: Final = 5_000_000
_MAXIMUM_DOTS: Final = 200
_MAXIMUM_CHARACTERS: Final = 4096
_MAXIMUM_WHOLE_NUMBER: Final = 2**63
_INSIDE: Final = "Name a file inside it: of a study, spec.toml or a layout such as layouts/KEY.toml."
_TOML_POSITION = re.compile(r" \(at line (\d+), column (\d+)\)$")
_NO_KEY = re.compile(r"[,\[\]{}=#]")
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f]")
_BINARY_KINDS: Final = {b"PK": "a zip archive", b"%PDF": "a PDF", b"\x89PNG": "an image", b"AC10": "a DWG drawing"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A TOML file that was read: its path, text and content."""

    path: Path
    text: str
    document: dict[str, Any]

    @property
    def folder(self) -> Path:
        """Folder from which the file names in the document count."""
        return self.path.parent


def read_source(path: str | os.PathLike[str]) -> Source:
    """Return the TOML document in a file.

    Raises
    ------
    InvalidInput
        If there is no such file, it is not a plain file of at most 5 MB in UTF-8, it is not TOML, or it holds
        a number or a text that no key could take. Numbers that are not finite are all reported at once.
    """
    text = _text(os.fspath(path))
    file = os.fspath(path)
    _refuse_endless_keys(text, file)
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        position = _TOML_POSITION.search(message)
        place = f"{file}:{position[1]}" if position else file
        problem = _TOML_POSITION.sub("", message)
        raise InvalidInput.at(
            place,
            f"this is not TOML: {problem[:1].lower()}{problem[1:]}",
            "Compare with `layoutopt new`; texts and numbers with units stand in quotes.",
        ) from None
    except RecursionError:
        raise InvalidInput.at(
            file, "brackets are nested too deeply", "A spec needs at most five levels."
        ) from None
    except ValueError:
        # Python refuses to read whole numbers of more than some thousand digits.
        raise InvalidInput.at(
            file, "a number has thousands of digits", "Write numbers of ordinary size."
        ) from None
    source = Source(path=Path(path), text=text, document=document)
    findings = Findings(file, text, document)
    _refuse_impossible_values(document, findings)
    findings.raise_any()
    return source


def _text(path: str) -> str:
    try:
        status = Path(path).stat()
        if stat.S_ISDIR(status.st_mode):
            raise InvalidInput.at(path, "this is a folder, not a file", _INSIDE)
        if not stat.S_ISREG(status.st_mode):
            raise InvalidInput.at(path, "this is not a plain file", "Save the spec as a file and name that.")
        if status.st_size > MAXIMUM_BYTES:
            raise InvalidInput.at(
                path,
                f"the file has {status.st_size / 1e6:.2f} MB, more than the {MAXIMUM_BYTES / 1e6:g} MB of a spec",
                "Keep plans and way points in files of their own.",
            )
        with Path(path).open("rb") as file:
            content = file.read(MAXIMUM_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InvalidInput.at(
            path, f"the file cannot be read: {reason}", "Check its name, the folder and the right to read it."
        ) from None
    if not content.strip():
        raise InvalidInput.at(path, "the file is empty", "Start from `layoutopt new`.")
    for start, kind in _BINARY_KINDS.items():
        if content.startswith(start):
            raise InvalidInput.at(path, f"this is {kind}, not a spec", "A spec is a TOML text file.")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InvalidInput.at(
            f"{path}:{line}",
            f"byte {error.start} is not UTF-8",
            "Save the file with the encoding UTF-8.",
        ) from None


def _refuse_endless_keys(text: str, file: str) -> None:
    """Refuse a key of thousands of dots, for which tomllib takes time that grows with their square."""
    for number, line in enumerate(text.split("\n"), 1):
        if line.count(".") > _MAXIMUM_DOTS and not line.lstrip().startswith("#"):
            pieces = _NO_KEY.split(line)
            if max(piece.count(".") for piece in pieces) > _MAXIMUM_DOTS:
                raise InvalidInput.at(
                    f"{file}:{number}",
                    f"a key has more than {_MAXIMUM_DOTS} dots",
                    "No key of a spec has over five.",
                )


def _refuse_impossible_values(document: dict[str, Any], findings: Findings) -> None:
    """Note numbers that are not finite or absurdly long, and texts with control characters."""
    waiting: list[tuple[KeyPath, object]] = [((), document)]
    while waiting:
        path, value = waiting.pop()
        if isinstance(value, dict):
            for key, item in value.items():
                waiting.append(((*path, key), item))
                if len(key) > _MAXIMUM_CHARACTERS or _CONTROL.search(key):
                    findings.add((*path, key), "no key is written like this", "Use letters and underscores.")
        elif isinstance(value, list):
            waiting += [((*path, number), item) for number, item in enumerate(value)]
        elif isinstance(value, float) and not math.isfinite(value):
            findings.add(path, "this is not a finite number", "Give a number such as 0.1.")
        elif isinstance(value, int) and abs(value) >= _MAXIMUM_WHOLE_NUMBER:
            findings.add(path, "this number has no use in a spec", "Give a number of ordinary size.")
        elif isinstance(value, str) and (len(value) > _MAXIMUM_CHARACTERS or _CONTROL.search(value)):
            findings.add(path, "this text is too long or has control characters", "Give a short plain text.")
