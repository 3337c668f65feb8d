"""Values that hold arrays and shapes: read-only, equal and hashed by their content.

A dataclass that holds an array cannot use the generated equality. The classes decorated here carry a ``key``,
the SHA-256 of a canonical form of their fields, which is also what journals and file names use.
"""

import dataclasses
import enum
import hashlib
import json
import math
from collections.abc import Callable, Mapping
from typing import Any, Final, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.base import BaseGeometry

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
Float32Array = NDArray[np.float32]
WordArray = NDArray[np.uint32]
LATER: Final = {"later": True}
"""Metadata of a field that came after keys were written to files: at its default it leaves the key as it was."""

_Class = TypeVar("_Class", bound=type)
_Value = TypeVar("_Value")


def read_only(values: ArrayLike, shape: tuple[int, ...] | None = None) -> FloatArray:
    """Return a read-only float64 copy; ``shape`` (-1 for any length) is checked.

    Raises
    ------
    ValueError
        If the shape differs or a number is not finite.
    """
    array = np.array(values, dtype=np.float64, order="C")
    if shape is not None:
        if array.size == 0 and -1 in shape:
            array = array.reshape([0 if size == -1 else size for size in shape])
        if array.ndim != len(shape) or any(
            want not in (-1, have) for want, have in zip(shape, array.shape, strict=True)
        ):
            raise ValueError(f"array of shape {array.shape} where {shape} is needed")
    if not np.isfinite(array).all():
        raise ValueError("array holds numbers that are not finite")
    array.setflags(write=False)
    return array


def check_not_negative(owner: str, **values: float) -> None:
    """Check numbers that are sizes of errors, ways or times: finite, and zero or more.

    Raises
    ------
    ValueError
        With the first that is not, by name.
    """
    for name, value in values.items():
        if not 0.0 <= value < math.inf:
            raise ValueError(f"{name} of {owner} must be zero or positive and finite, got {value!r}")


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Same(Generic[_Value]):
    """A value as the key of a cache by identity, because its arrays cannot be hashed; the cache keeps it alive."""

    value: _Value

    def __hash__(self) -> int:
        return id(self.value)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Same) and other.value is self.value


def content_key(*parts: object) -> str:
    """Return the SHA-256, in hexadecimal, of the canonical form of ``parts``.

    Numbers enter by their exact bits and mappings sorted by name, so two values have one key if and only if
    they were built from the same content.
    """
    canonical = json.dumps([_canonical(part) for part in parts], separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(canonical.encode()).hexdigest()


def by_content(cls: _Class) -> _Class:
    """Give a frozen dataclass equality, hash and pickling by the content key in its field ``key``.

    The class declares ``key: str = field(init=False, repr=False, default="")``; it is set after the class's
    own ``__post_init__``, which it must have, has checked the fields and made the arrays read-only. Unpickling
    runs the constructor again, because numpy forgets the read-only flag.
    """
    check: Callable[[Any], None] = cls.__dict__["__post_init__"]

    def __post_init__(self: Any) -> None:
        check(self)
        object.__setattr__(self, "key", content_key(type(self).__name__, _fields(self)))

    def __eq__(self: Any, other: object) -> bool:
        return type(other) is type(self) and other.key == self.key  # type: ignore[attr-defined]

    def __hash__(self: Any) -> int:
        return hash(self.key)

    def __reduce__(self: Any) -> tuple[Any, ...]:
        # A mapping proxy cannot be pickled; the constructor makes a new one.
        plain = {
            name: dict(value) if isinstance(value, Mapping) else value for name, value in _fields(self).items()
        }
        return (_rebuild, (type(self), plain))

    for method in (__post_init__, __eq__, __hash__, __reduce__):
        setattr(cls, method.__name__, method)
    return cls


def _rebuild(cls: type, fields: dict[str, object]) -> object:
    return cls(**fields)


def _fields(value: Any) -> dict[str, object]:
    found = {field: getattr(value, field.name) for field in dataclasses.fields(value) if field.init}
    return {field.name: item for field, item in found.items() if field.metadata != LATER or item != field.default}


def _canonical(part: object) -> object:
    if part is None or isinstance(part, (bool, str)):
        return part
    if isinstance(part, enum.Enum):
        return ["enum", type(part).__name__, part.name]
    if isinstance(part, (int, np.integer)):
        return int(part)
    if isinstance(part, (float, np.floating)):
        return ["float", float(part).hex()]
    if isinstance(part, np.ndarray):
        return ["array", list(part.shape), str(part.dtype), hashlib.sha256(part.tobytes()).hexdigest()]
    if isinstance(part, Mapping):
        return {str(name): _canonical(part[name]) for name in sorted(part)}
    if isinstance(part, (tuple, list)):
        return [_canonical(item) for item in part]
    if hasattr(part, "key") and isinstance(part.key, str):
        return ["key", part.key]
    if dataclasses.is_dataclass(part) and not isinstance(part, type):
        return [type(part).__name__, _canonical(_fields(part))]
    if isinstance(part, BaseGeometry):
        return ["shape", part.normalize().wkb_hex]
    raise TypeError(f"no canonical form for {type(part).__name__}")
