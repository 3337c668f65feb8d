"""From what ``[space]`` lists to families of patterns and readers.

The parameters of a family are those of its function: ``pitch_m`` is written ``pitch`` and takes a length. So a
new family needs no change here.
"""

import inspect
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from layoutopt import registry
from layoutopt.errors import InvalidInput, did_you_mean
from layoutopt.space import Family, Interval, Values
from layoutopt.spec.findings import Findings
from layoutopt.spec.lines import KeyPath, written
from layoutopt.spec.quantities import Unfit, in_si, out_of_reason
from layoutopt.units import Dimension, dimension_of, format_length, without_unit

MAXIMUM_OPTIONS: Final = 100_000
"""Most reader groups, and most patterns for one zone, that a spec may list."""
MAXIMUM_STEPS: Final = 10_000
_MAXIMUM_POINTS: Final = 20_000
_MAXIMUM_SHOWN: Final = 5
_MAXIMUM_COUNT: Final = 10_000
_LARGEST_M: Final = 10.0
"""Longest pitch, tile or radius: no robot that fits the widest outline would meet the tags."""
_RANGE_KEYS: Final = ({"from", "to", "steps"}, {"from", "to"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One parameter of a family's function, as the spec sees it.

    ``word`` is its name in the spec, ``dimension`` ``None`` for a bare number; ``kind`` is ``"number"``,
    ``"whole"``, ``"text"`` or ``"list"``, the last for one that takes lists as they are.
    """

    name: str
    word: str
    dimension: Dimension | None
    kind: str
    required: bool
    default: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One table of ``readers`` or ``patterns``: the function it names and the values of its parameters.

    Where a value is an interval, the combinations are those of its levels.
    """

    path: KeyPath
    name: str
    build: Callable[..., Any]
    values: Mapping[str, Values]
    zone: str

    @property
    def size(self) -> int:
        """Number of combinations."""
        return Family(name=self.name, build=dict, values=self.values).size

    def combinations(self) -> Iterator[dict[str, Any]]:
        """Yield the arguments of every combination; the last parameter varies fastest."""
        yield from Family(name=self.name, build=dict[str, Any], values=self.values).options()


def parameters_of(build: Callable[..., Any]) -> dict[str, Parameter]:
    """Return the parameters of a family's function, or of an antenna model, by the word used in a spec.

    >>> from layoutopt.patterns.square import square
    >>> parameters_of(square)["pitch"].dimension
    'length'
    """
    found = {}
    for name, parameter in inspect.signature(build).parameters.items():
        if name == "mount":
            continue
        known = {part for part in _types_in(parameter.annotation) if part is not type(None)}
        kind = "number"
        if any(isinstance(part, type) and issubclass(part, Sequence) and part is not str for part in known):
            kind = "list"
        elif known == {int}:
            kind = "whole"
        elif known == {str}:
            kind = "text"
        required = parameter.default is inspect.Parameter.empty
        found[without_unit(name)] = Parameter(
            name=name,
            word=without_unit(name),
            dimension=dimension_of(name),
            kind=kind,
            required=required,
            default=None if required else parameter.default,
        )
    return found


def entries(
    tables: Sequence[Mapping[str, Any]], point: str, path: KeyPath, findings: Findings
) -> tuple[Entry, ...]:
    """Return the entries of ``readers`` or ``patterns``; every fault is noted and its entry left out."""
    if not tables:
        findings.add(path, "the list is empty, so there is no layout to choose", "Name at least one family.")
    own = ("zone",) if point == "patterns" else ()
    found = (entry_of(table, point, (*path, number), findings, own) for number, table in enumerate(tables))
    return tuple(entry for entry in found if entry is not None)


def axis(value: Any, parameter: Parameter, path: KeyPath, findings: Findings) -> Values | None:
    """Return the values of a parameter: one, a list, ``{ from, to, steps }`` or ``{ from, to }``.

    The last means every number in between, of a whole number every one. A parameter that takes a list may have
    such ranges for numbers within. ``None`` after a fault.
    """
    if parameter.kind == "list":
        whole = _one(value, parameter, path, findings)
        free = _intervals(whole)
        if free:
            return Family(name=parameter.name, build=_Filled(whole), values=free)
        return None if whole is None else (whole,)
    if isinstance(value, Mapping):
        return _range(value, parameter, path, findings)
    if not isinstance(value, list):
        value, paths = [value], [path]
    else:
        paths = [(*path, number) for number in range(len(value))]
    if not value:
        findings.add(path, "the list is empty", "Give at least one value.")
        return None
    if len(value) > MAXIMUM_STEPS:
        findings.add(path, f"the list has {len(value)} values", f"Give at most {MAXIMUM_STEPS}.")
        return None
    chosen = [_one(item, parameter, where, findings) for item, where in zip(value, paths, strict=True)]
    if any(item is None for item in chosen):
        return None
    for number, item in enumerate(chosen):
        if item in chosen[:number]:
            findings.add(paths[number], "this value stands twice in the list", "Remove one of them.")
            return None
    return tuple(chosen)


def entry_of(
    table: Mapping[str, Any], point: str, path: KeyPath, findings: Findings, own: Sequence[str] = ()
) -> Entry | None:
    """Return one table of ``readers`` or ``patterns``, ``None`` after a fault.

    ``own`` names keys beside ``family`` and its parameters, which are left to others.
    """
    family, zone = table.get("family"), table.get("zone", "")
    if not isinstance(family, str):
        known = ", ".join(registry.names(point))
        findings.add((*path, "family"), "a family is named by a text", f"Known: {known}.")
        return None
    try:
        build = registry.load(point, family, place=written((*path, "family")))
    except InvalidInput as error:
        findings.take(error, (*path, "family"))
        return None
    parameters = parameters_of(build)
    values: dict[str, Values] = {}
    sound = True
    for word in table:
        if word not in own and word not in parameters and word != "family":
            known_words = [*parameters, *own, "family"]
            findings.add((*path, word), f"'{family}' has no such parameter", did_you_mean(word, known_words))
            sound = False
    for word, parameter in parameters.items():
        if word in table:
            chosen = axis(table[word], parameter, (*path, word), findings)
            sound = sound and chosen is not None
            values[parameter.name] = chosen or ()
        elif parameter.required:
            findings.add(path, f"'{family}' needs the parameter '{word}'", f"Add {word} = ...")
            sound = False
        elif parameter.default is not None:
            values[parameter.name] = (parameter.default,)
    if not isinstance(zone, str):
        findings.add((*path, "zone"), "a zone is named by a text", 'Write zone = "dock".')
        sound = False
    if not sound:
        return None
    return Entry(path=path, name=family, build=build, values=values, zone=zone)


def _range(value: Mapping[str, Any], parameter: Parameter, path: KeyPath, findings: Findings) -> Values | None:
    """Return evenly spaced values with both ends; without steps every whole number, or an interval."""
    if set(value) not in _RANGE_KEYS or parameter.kind == "text":
        findings.add(
            path,
            "a range is { from, to, steps } of numbers, or { from, to } for all in between",
            'Write { from = "60 mm", to = "300 mm", steps = 9 }.',
        )
        return None
    steps = value.get("steps", 2)
    if isinstance(steps, bool) or not isinstance(steps, int) or not 2 <= steps <= MAXIMUM_STEPS:
        findings.add((*path, "steps"), f"a range has 2 to {MAXIMUM_STEPS} steps", "Write steps = 9.")
        return None
    ends = [_one(value[key], parameter, (*path, key), findings) for key in ("from", "to")]
    if ends[0] is None or ends[1] is None:
        return None
    first, last = ends
    if not last > first:
        findings.add(path, "a range must rise", "Exchange from and to.")
        return None
    if "steps" not in value:
        if parameter.kind != "whole":
            return Interval(low=float(first), high=float(last))
        steps = last - first + 1
        if steps > MAXIMUM_STEPS:
            findings.add(path, f"the range has {steps} whole numbers", f"Give at most {MAXIMUM_STEPS}.")
            return None
    # Twelve decimals keep 0.09 from becoming 0.09000000000000001 in labels and files.
    spread = [round(first + (last - first) * step / (steps - 1), 12) for step in range(steps)]
    if parameter.kind != "whole":
        return tuple(spread)
    if any(number != int(number) for number in spread):
        findings.add(path, "the steps of this range are no whole numbers", "Change steps, or give a list.")
        return None
    return tuple(int(number) for number in spread)


def _one(value: Any, parameter: Parameter, path: KeyPath, findings: Findings) -> Any:
    """Return one value in SI, ``None`` after a fault."""
    if parameter.kind == "text":
        if isinstance(value, str):
            return value
        findings.add(path, f"'{parameter.word}' is a text", "Put it in quotes.")
    elif parameter.kind == "whole":
        if isinstance(value, int) and not isinstance(value, bool) and abs(value) <= _MAXIMUM_COUNT:
            return value
        findings.add(path, f"'{parameter.word}' is a whole number up to {_MAXIMUM_COUNT}", "Write 8.")
    elif parameter.kind == "list":
        return _nested(value, parameter, path, findings, depth=0)
    else:
        return _number(value, parameter, path, findings)
    return None


def _number(value: Any, parameter: Parameter, path: KeyPath, findings: Findings) -> float | None:
    try:
        if parameter.dimension is None:
            # A bare number goes through the reader of shares without its percent sign.
            return in_si(value if not isinstance(value, str) else None, "share")
        number = in_si(value, parameter.dimension)
        if parameter.kind == "number" and parameter.dimension == "length" and abs(number) > _LARGEST_M:
            problem = f"'{parameter.word}' is {format_length(number)}, and {format_length(_LARGEST_M)} at most"
            raise Unfit(problem, out_of_reason(value, parameter.dimension, 0.0, _LARGEST_M))
        return number
    except Unfit as error:
        repair = error.repair if parameter.dimension is not None else "Write a bare number such as 1.5."
        findings.add((*path, *error.path), error.problem, repair)
        return None


def _nested(value: Any, parameter: Parameter, path: KeyPath, findings: Findings, depth: int) -> Any:
    if isinstance(value, Mapping) and depth > 0:
        ends = _range(value, replace(parameter, kind="number"), path, findings)
        if not isinstance(ends, Interval):
            if ends is not None:
                findings.add(path, "a range within a list takes no steps", "Write { from = -0.2, to = 0.2 }.")
            return None
        return replace(ends, levels=1)
    if not isinstance(value, list):
        if depth == 0:
            findings.add(path, f"'{parameter.word}' is a list", "Write it in brackets.")
            return None
        return _number(value, parameter, path, findings)
    if depth > 1 or not 1 <= len(value) <= _MAXIMUM_POINTS:
        findings.add(
            path,
            f"'{parameter.word}' is a list of 1 to {_MAXIMUM_POINTS} numbers or points",
            "Write [[0.1, 0], [0, 0.1]].",
        )
        return None
    items = []
    for number, item in enumerate(value):
        one = _nested(item, parameter, (*path, number), findings, depth + 1)
        # One fault tells enough about a list of thousands.
        if one is None:
            return None
        items.append(one)
    return tuple(items)


def _intervals(value: Any, name: str = "at") -> dict[str, Interval]:
    """Return the ranges within a list, each under a name made of its place: ``at_2_0`` is the third point's x."""
    if isinstance(value, Interval):
        return {name: value}
    found: dict[str, Interval] = {}
    if isinstance(value, tuple):
        for number, item in enumerate(value):
            found |= _intervals(item, f"{name}_{number}")
    return found


@dataclass(frozen=True, slots=True)
class _Filled:
    """Makes lists in which each range has given way to the number under its name; see `_intervals`."""

    template: tuple[Any, ...]

    def __call__(self, **numbers: Any) -> Any:
        return self._filled(self.template, "at", numbers)

    def _filled(self, value: Any, name: str, numbers: Mapping[str, Any]) -> Any:
        if isinstance(value, Interval):
            return numbers[name]
        if isinstance(value, tuple):
            return tuple(self._filled(item, f"{name}_{number}", numbers) for number, item in enumerate(value))
        return value


def build_all(entry: Entry, findings: Findings, **fixed: Any) -> list[tuple[dict[str, Any], Any]] | None:
    """Return every combination of an entry with what it builds; ``None`` after a fault.

    What the function refuses is a fault of the spec: the refusal and the combination are noted.
    """
    built, refused = [], 0
    for arguments in entry.combinations():
        try:
            built.append((arguments, entry.build(**arguments, **fixed)))
        except ValueError as error:
            refused += 1
            if refused <= _MAXIMUM_SHOWN:
                given = ", ".join(f"{without_unit(name)} = {value}" for name, value in arguments.items())
                findings.add(
                    entry.path, f"'{entry.name}' with {given[:200]}: {error}", "Change or drop that value."
                )
    return None if refused else built


def _types_in(annotation: Any) -> set[Any]:
    """Return the types within an annotation, outermost of each branch: ``Sequence[float] | None`` has two."""
    origin = typing.get_origin(annotation)
    if origin is None:
        return {annotation}
    if isinstance(origin, type) and issubclass(origin, Sequence):
        return {origin}
    return {part for argument in typing.get_args(annotation) for part in _types_in(argument)}
