"""From what ``antenna`` names to antennas, and what people should know of them."""

import functools
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeVar

import numpy as np

from layoutopt import registry
from layoutopt.errors import InvalidInput, did_you_mean
from layoutopt.protocols import AntennaModel
from layoutopt.spec.findings import Findings
from layoutopt.spec.lines import KeyPath, written
from layoutopt.spec.options import axis, parameters_of
from layoutopt.units import format_length

_Value = TypeVar("_Value")
_HEIGHT_STEP_M: Final = 0.001
_HEIGHT_STEPS: Final = 60
"""Steps a side at most, for antennas of more than 60 mm."""
_MOST_NAMED: Final = 6
_MOST_TRIED: Final = 6
"""Sides and heights for which discs are looked at: a field takes milliseconds, and a spec may list thousands."""


def antenna_model(given: Any, path: KeyPath, findings: Findings) -> Callable[..., Any] | None:
    """Return what makes an antenna of a side, by the model that ``antenna`` names; ``None`` after a fault."""
    table = {"model": given} if isinstance(given, str) else given
    if not isinstance(table, dict) or not isinstance(table.get("model"), str):
        known = ", ".join(registry.names("antennas"))
        findings.add(path, "an antenna model is named by a text", f"Known: {known}.")
        return None
    before = findings.count
    try:
        model = registry.load("antennas", table["model"], place=written(path))
    except InvalidInput as error:
        findings.take(error, path)
        return None
    parameters = parameters_of(model)
    own: dict[str, Any] = {}
    for word, value in table.items():
        if word == "model":
            continue
        if word not in parameters or word == "side":
            findings.add((*path, word), "the model has no such parameter", did_you_mean(word, parameters))
            continue
        chosen = axis(value, parameters[word], (*path, word), findings)
        if chosen is not None and not (isinstance(chosen, tuple) and len(chosen) == 1):
            findings.add((*path, word), "an antenna parameter takes one value", "Give one value, and no range.")
        elif chosen is not None:
            own[parameters[word].name] = chosen[0]
    return None if findings.count > before else functools.partial(model, **own)


def heights_read(antennas: Sequence[AntennaModel]) -> str:
    """Return from which heights antennas read a tag, in words, to the millimetre or a sixtieth of the side."""
    by_side = {antenna.side_m: antenna for antenna in antennas}
    words = []
    for side_m in _spread(sorted(by_side), _MOST_NAMED):
        heights_m = np.arange(0.0, 3.0 * side_m, max(_HEIGHT_STEP_M, side_m / _HEIGHT_STEPS)).tolist()
        read_m = [height_m for height_m in heights_m if by_side[side_m].read_radius_m(height_m) > 0.0]
        side = format_length(side_m)
        if read_m:
            words.append(f"{side} reads from {format_length(read_m[0])} to {format_length(read_m[-1])}")
        else:
            words.append(f"{side} reads from no height")
    return ", ".join(words)


def disc_notes(antennas: Sequence[AntennaModel], heights_m: Sequence[float]) -> list[str]:
    """Return what the read discs of antennas leave out at these heights, one sentence each.

    Of many sides and heights the ends and some between are looked at.
    """
    by_side = {antenna.side_m: antenna for antenna in antennas}
    seen = [
        (by_side[side_m], height_m)
        for side_m in _spread(sorted(by_side), _MOST_TRIED)
        for height_m in _spread(sorted(heights_m), _MOST_TRIED)
        if by_side[side_m].read_radius_m(height_m) > 0.0
    ]
    notes = []
    errors_m = [antenna.disc_error_m(height_m) for antenna, height_m in seen]
    if max(errors_m, default=0.0) > 0.0:
        worst, height_m = seen[int(np.argmax(errors_m))]
        notes.append(
            f"read outlines leave the discs that stand for them by up to {format_length(max(errors_m))} "
            f"({format_length(worst.side_m)} antenna, {format_length(height_m)} high)"
        )
    rings = [
        f"{format_length(antenna.side_m)} at {format_length(height_m)}"
        for antenna, height_m in seen
        if antenna.reads_beside_disc(height_m)
    ]
    if rings:
        notes.append(
            "antennas so near the tags also read in a ring beside their disc, which is left out: "
            f"{', '.join(_spread(rings, _MOST_NAMED))}"
        )
    return notes


def _spread(values: Sequence[_Value], most: int) -> list[_Value]:
    """Return at most so many of the values, the first and the last among them."""
    if len(values) <= most:
        return list(values)
    return [values[round(number * (len(values) - 1) / (most - 1))] for number in range(most)]
