"""From what ``antenna`` names to antennas, and what people should know of them."""

import functools
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from layoutopt import registry
from layoutopt.errors import InvalidInput, did_you_mean
from layoutopt.protocols import AntennaModel
from layoutopt.spec.findings import Findings
from layoutopt.spec.lines import KeyPath, written
from layoutopt.spec.options import axis, parameters_of
from layoutopt.units import format_length

_HEIGHT_STEP_M: Final = 0.001
_MOST_NAMED: Final = 6


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
    """Return from which heights each antenna reads a tag, in words, to the millimetre."""
    words = []
    for antenna in {antenna.side_m: antenna for antenna in antennas}.values():
        heights_m = np.arange(0.0, 3.0 * antenna.side_m, _HEIGHT_STEP_M)
        read_m = [height_m for height_m in heights_m.tolist() if antenna.read_radius_m(height_m) > 0.0]
        side = format_length(antenna.side_m)
        if read_m:
            words.append(f"{side} reads from {format_length(read_m[0])} to {format_length(read_m[-1])}")
        else:
            words.append(f"{side} reads from no height")
    more = f" and {len(words) - _MOST_NAMED} more" if len(words) > _MOST_NAMED else ""
    return ", ".join(words[:_MOST_NAMED]) + more


def disc_notes(antennas: Sequence[AntennaModel], heights_m: Sequence[float]) -> list[str]:
    """Return what the read discs of antennas leave out at these heights, one sentence each."""
    seen = [
        (antenna, height_m)
        for antenna in antennas
        for height_m in heights_m
        if antenna.read_radius_m(height_m) > 0.0
    ]
    notes = []
    error_m, antenna, height_m = max(
        ((antenna.disc_error_m(height_m), antenna, height_m) for antenna, height_m in seen), key=lambda row: row[0]
    )
    if error_m > 0.0:
        notes.append(
            f"read outlines leave the discs that stand for them by up to {format_length(error_m)} "
            f"({format_length(antenna.side_m)} antenna, {format_length(height_m)} high)"
        )
    rings = [
        f"{format_length(antenna.side_m)} at {format_length(height_m)}"
        for antenna, height_m in seen
        if antenna.reads_beside_disc(height_m)
    ]
    if rings:
        more = f" and {len(rings) - _MOST_NAMED} more" if len(rings) > _MOST_NAMED else ""
        notes.append(
            "antennas so near the tags also read in a ring beside their disc, which is left out: "
            f"{', '.join(rings[:_MOST_NAMED])}{more}"
        )
    return notes
