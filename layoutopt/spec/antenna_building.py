"""From what ``antenna`` names to antennas, and what people should know of them."""

import functools
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeVar

import numpy as np

from layoutopt import registry
from layoutopt.errors import did_you_mean
from layoutopt.protocols import AntennaModel
from layoutopt.spec.findings import Findings
from layoutopt.spec.lines import KeyPath
from layoutopt.spec.options import axis, parameters_of
from layoutopt.units import format_length

_Value = TypeVar("_Value")
_HEIGHT_STEP_M: Final = 0.001
_HEIGHT_STEPS: Final = 60
"""Steps a side at most, for antennas of more than 60 mm."""
_MOST_NAMED: Final = 6
_MOST_TRIED: Final = 6
"""Sides and heights for which discs are looked at: a field takes milliseconds, and a spec may list thousands."""


def antenna_model(
    given: Any, path: KeyPath, findings: Findings, reads: str = "tag_read"
) -> Callable[..., Any] | None:
    """Return what makes an antenna of a side, by the model that ``antenna`` names; ``None`` after a fault.

    Only models are known that read what ``reads`` says.
    """
    table = {"model": given} if isinstance(given, str) else given
    known = [name for name in registry.names("antennas") if registry.card("antennas", name).reads == reads]
    if not isinstance(table, dict) or not isinstance(table.get("model"), str):
        findings.add(path, "an antenna model is named by a text", f"Known: {', '.join(known)}.")
        return None
    if table["model"] not in known:
        name = table["model"][:80]
        findings.add(path, f"no antenna model named '{name}' reads this way", did_you_mean(name, known))
        return None
    before = findings.count
    model = registry.load("antennas", table["model"])
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
