"""Random search: all designs in a random order, and over again with fresh replications. FILE BUDGET ..."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from search_parts import Trials, run

SETTINGS = [{"replications": count} for count in (1, 2, 4, 8)]


def search(trials: Trials, setting: Mapping[str, Any], seed: int) -> None:
    """Read until the budget is spent."""
    random = np.random.default_rng(seed)
    designs = np.stack(np.meshgrid(*map(np.arange, trials.options), indexing="ij"), axis=-1)
    designs = designs.reshape(-1, len(trials.options))
    while True:
        for design in random.permutation(designs):
            trials(design, setting["replications"])


if __name__ == "__main__":
    run(search, SETTINGS)
