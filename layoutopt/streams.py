"""Random streams keyed by scenario, replication and purpose, and by nothing else.

A stream does not know which layout is judged, so all layouts meet the same drives, faults and draws (common
random numbers); it does not know its worker or its turn either, so any order of work gives the same bits.
"""

import hashlib
from dataclasses import dataclass
from enum import IntEnum, unique

import numpy as np


@unique
class Purpose(IntEnum):
    """What a stream is drawn for; a value is part of every stream's key and is never given anew."""

    ROUTE = 1
    ODOMETRY = 2
    SENSING = 3
    TAG_FAULTS = 4
    FILTER = 6
    START = 7
    GYRO = 8
    SLIP = 9
    ASYNCHRONY = 10
    TARGET = 11
    SIGNAL = 12
    LASER = 13
    CLUTTER = 14
    DOCKING = 15
    SCATTERERS = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Streams:
    """The family of all random streams of a study with one ``seed``."""

    seed: int

    def generator(self, scenario: str, replication: int, purpose: Purpose) -> np.random.Generator:
        """Return the stream of a scenario (by name), a replication and a purpose, from its beginning.

        A Philox generator (Salmon et al., SC 2011) whose key numpy's SeedSequence derives from the four
        words; the scenario enters by the first 64 bits of its name's SHA-256.
        """
        digest = hashlib.sha256(scenario.encode()).digest()
        words = (int.from_bytes(digest[:4], "big"), int.from_bytes(digest[4:8], "big"))
        sequence = np.random.SeedSequence(self.seed, spawn_key=(*words, replication, int(purpose)))
        return np.random.Generator(np.random.Philox(sequence))
