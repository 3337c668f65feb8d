"""Mutated map files: whatever the bytes, a floor or one clear error."""

import numpy as np
import pytest

from layoutopt.errors import InvalidInput
from layoutopt.plans.occupancy_map import read_occupancy_map

YAML = b"""image: map.pgm
mode: trinary
resolution: 0.1
origin: [-1.0, -2.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
PIECES = [
    b"nan",
    b"-",
    b"1e999",
    b"[",
    b"]",
    b"{",
    b"&a",
    b"*a",
    b"!!",
    b"\n",
    b"\x00",
    b"\xff",
    b"# ",
    b": ",
    b"\t",
]
PIECES += [
    b"99999999999",
    b"P2",
    b"P5",
    b"65535",
    b"0",
    b"'",
    b'"',
    b"---",
    b"0x1F",
    b"1:60",
    b"\xef\xbb\xbf",
    b" ",
]


def image(plain):
    values = np.zeros((14, 20), dtype=np.uint8)
    values[1:-1, 1:-1] = 254
    values[5:8, 5:9] = 205
    head = b"%s\n# made here\n20 14\n255\n" % (b"P2" if plain else b"P5")
    return head + (b" ".join(b"%d" % value for value in values.ravel()) if plain else values.tobytes())


def mutated(content, draws):
    """Return the bytes with one to three changes: a bit, a piece put in, a cut, or a part doubled."""
    for _ in range(draws.integers(1, 3)):
        # Half changes strike the first bytes, where the header is.
        at = int(draws.integers(len(content) + 1) * draws.choice([1.0, 0.1]))
        kind = draws.integers(5)
        if kind == 0 and at < len(content):
            content = content[:at] + bytes([content[at] ^ (1 << draws.integers(8))]) + content[at + 1 :]
        elif kind == 1:
            content = content[:at] + PIECES[draws.integers(len(PIECES))] + content[at:]
        elif kind == 2:
            content = content[:at] + content[at + draws.integers(1, 12) :]
        elif kind == 3:
            content = content[:at]
        else:
            content = content[: at + 9] + content[at:]
    return content


def result_of(path):
    try:
        return read_occupancy_map(path, place="site.plan")
    except InvalidInput as error:
        return error


def outcomes(folder, count, seed):
    draws = np.random.default_rng(seed)
    good = bad = 0
    for _ in range(count):
        pixels = image(plain=bool(draws.integers(2)))
        strike = draws.integers(3)
        (folder / "map.pgm").write_bytes(mutated(pixels, draws) if strike != 2 else pixels)
        (folder / "map.yaml").write_bytes(YAML if strike == 1 else mutated(YAML, draws))
        result = result_of(folder / "map.yaml")
        if isinstance(result, InvalidInput):
            bad += 1
            assert result.faults
            assert all(fault.place.startswith("site.plan") for fault in result.faults)
            assert len(str(result)) < 4000
        else:
            good += 1
            assert result.polygon.is_valid
            assert 0.25 <= result.polygon.area < 1e6
    return good, bad


def test_mutated_maps_end_in_a_floor_or_one_error(tmp_path):
    """200 mutations raise nothing but InvalidInput; some are read and some refused, so both ways are tried."""
    good, bad = outcomes(tmp_path, 200, seed=1)
    assert good >= 5
    assert bad >= 50


@pytest.mark.long
def test_many_mutated_maps_end_in_a_floor_or_one_error(tmp_path):
    """The same for 5,000 mutations."""
    good, bad = outcomes(tmp_path, 5000, seed=2)
    assert good >= 150
    assert bad >= 1250
