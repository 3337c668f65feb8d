"""Equality, hash, pickling and protection of values that hold arrays."""

import copy
import os
import pickle
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Polygon, box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.identity import by_content, content_key, read_only
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """A value with an array and a mapping."""

    places_m: np.ndarray
    words: Mapping[str, object] = field(default_factory=dict)
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self):
        """Freeze."""
        object.__setattr__(self, "places_m", read_only(self.places_m, (-1, 2)))
        object.__setattr__(self, "words", MappingProxyType(dict(self.words)))


class Colour(Enum):
    """Two members."""

    RED = 1
    BLUE = 2


def layout():
    """Return a layout with every kind of field."""
    mount = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.02, profile=COMMERCIAL, antennas_per_module=4)
    floor_tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.1)),))
    return Layout(floor_tags=floor_tags, readers=(cross(count=8, mount=mount),))


def test_read_only_is_a_copy_that_cannot_be_written():
    """What the caller does to the array afterwards changes nothing, and nobody else can change it either."""
    given_m = np.zeros((2, 2))
    frozen_m = read_only(given_m, (-1, 2))
    given_m[0, 0] = 5.0
    assert frozen_m[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        frozen_m[0, 0] = 1.0


@pytest.mark.parametrize("values", [[1.0, 2.0], [[1.0]], [[1.0, np.nan]], [[1.0, np.inf]]])
def test_read_only_refuses_wrong_shapes_and_numbers(values):
    """Another shape, NaN and infinity are errors."""
    with pytest.raises(ValueError, match="array"):
        read_only(values, (-1, 2))


def test_nothing_at_all_fits_any_length():
    """An empty list is an array of no points."""
    assert read_only([], (-1, 2)).shape == (0, 2)


def test_equal_content_is_equal_and_hashes_alike():
    """Two values of the same content are one in a set; the order of a mapping does not matter."""
    first = Sample(places_m=[(0, 1)], words={"a": 1, "b": 2.5})
    second = Sample(places_m=np.array([(0.0, 1.0)]), words={"b": 2.5, "a": 1})
    assert first == second
    assert len({first, second}) == 1


@pytest.mark.parametrize(
    "words",
    [
        {},
        {"a": 2},
        {"a": True},
        {"a": "1"},
        {"a": None},
        {"b": 1},
        {"a": 1, "b": 1},
        {"a": (1.0).hex()},
        {"a": [1]},
        {"a": Colour.RED},
        {"a": np.ones(1)},
        {"a": box(0, 0, 1, 1)},
    ],
    ids=repr,
)
def test_any_difference_is_a_difference(words):
    """A value, a type or a name more or less gives another key."""
    sample = Sample(places_m=[(0, 1)], words={"a": 1})
    assert sample != Sample(places_m=[(0, 1)], words=words)
    assert sample != Sample(places_m=[(0, 1.0 + 1e-15)], words={"a": 1})


@given(st.floats(allow_nan=False), st.floats(allow_nan=False))
def test_numbers_enter_by_their_bits(first, second):
    """Keys of two numbers are equal if and only if their bits are."""
    same = np.float64(first).tobytes() == np.float64(second).tobytes()
    assert (content_key(first) == content_key(second)) is same


def test_a_number_is_not_its_own_text():
    """A float and the text of its bits have different keys, and so have a key and the value it belongs to."""
    assert content_key(1.5) != content_key((1.5).hex())
    pattern = square(pitch_m=0.1)
    assert content_key(pattern) != content_key(pattern.key)


def test_shapes_are_equal_wherever_their_ring_begins():
    """The same polygon with another first corner has the same key."""
    corners = [(0, 0), (2, 0), (2, 1), (0, 1)]
    assert content_key(Polygon(corners)) == content_key(Polygon(corners[2:] + corners[:2]))
    assert content_key(Polygon(corners)) != content_key(box(0, 0, 2, 1.5))


def test_what_has_no_canonical_form_is_refused():
    """A key is never made of an object's address."""
    with pytest.raises(TypeError, match="no canonical form"):
        content_key(object())


@pytest.mark.parametrize("again", [lambda v: pickle.loads(pickle.dumps(v)), copy.copy, copy.deepcopy])
def test_a_copy_is_equal_and_still_protected(again):
    """A layout survives the way to a worker: same key, same scores, arrays still read-only."""
    first = layout()
    second = again(first)
    assert second == first
    assert hash(second) == hash(first)
    assert not second.readers[0].poses.flags.writeable
    assert second.floor_tags.zones[0].pattern.parameters == {"pitch_m": 0.1}
    with pytest.raises(TypeError):
        second.floor_tags.zones[0].pattern.parameters["pitch_m"] = 0.2


def test_the_key_is_the_same_in_every_process():
    """The key depends on content alone, not on hash seeds."""
    code = "from layoutopt.patterns.square import square; print(square(pitch_m=0.1).key)"
    keys = set()
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": os.pathsep.join(sys.path)}
        run = subprocess.run(
            [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
        )
        keys.add(run.stdout.strip())
    assert keys == {square(pitch_m=0.1).key}
