"""Mutated map files: whatever the bytes, a floor or one clear error."""

import numpy as np
import pytest
from mutated_files import mutated

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


def image(plain):
    values = np.zeros((14, 20), dtype=np.uint8)
    values[1:-1, 1:-1] = 254
    values[5:8, 5:9] = 205
    head = b"%s\n# made here\n20 14\n255\n" % (b"P2" if plain else b"P5")
    return head + (b" ".join(b"%d" % value for value in values.ravel()) if plain else values.tobytes())


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
