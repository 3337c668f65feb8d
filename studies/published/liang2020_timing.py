"""Running time of one update by number of particles, beside that of Table 4: measured anew, in no table."""

import time
from dataclasses import replace
from typing import Final

from layoutopt.simulation.tracking_trials import observe_target, target_knowledge
from layoutopt.streams import Purpose, Streams
from studies.published.liang2020_printed import UPDATE_MS
from studies.published.liang2020_setting import BASE, layout, scenario, tracker

_REPEATS: Final = 5
_WALK: Final = 0


def update_ms(streams: Streams, particles: int) -> float:
    """Return the running time of one update in ms: the shortest of a few runs over a walk, over its samples."""
    choice = replace(BASE, particles=particles)
    world, antennas, estimator = scenario(choice), layout(choice), tracker(choice)
    observations, _ = observe_target(antennas, world, streams, _WALK)
    knowledge = target_knowledge(antennas, world, estimator)
    best_s = float("inf")
    for _ in range(_REPEATS):
        draws = streams.generator(world.name, _WALK, Purpose.FILTER)
        began_s = time.perf_counter()
        estimator.run(knowledge, observations, draws)
        best_s = min(best_s, time.perf_counter() - began_s)
    return 1e3 * best_s / len(observations)


def timing_lines(streams: Streams) -> list[str]:
    """Return the running times of Table 4 in one line, as measured now, scans included."""
    told = ", ".join(f"N = {n}: {update_ms(streams, n):.3f} ms ({paper:g})" for n, paper in UPDATE_MS.items())
    return [f"one update with the clustering of its scan takes, here and now (paper): {told}"]
