"""
A tracking trial
================

A robot stands and follows a person who wears a UHF tag. Its antennas hear the tag, and a laser scanner sees
what moves.
"""

import numpy as np

import layoutopt as lo
from layoutopt.plots.trajectories import Paths, draw_trajectories
from layoutopt.simulation.tracking_trials import observe_target, target_knowledge
from layoutopt.streams import Purpose

spec = lo.read_spec(lo.built_in("hybrid"))
scenario, streams, tracker = spec.tracking_scenario, lo.Streams(seed=1), lo.load("estimators", "uhf_laser")()
layout = next(iter(spec.space.layouts()))

# %%
# What is heard and seen in one trial, and where the person really was:

observations, places_m = observe_target(layout, scenario, streams, 0)
heard = ~np.isnan(observations.strength_dbm)
print(f"{len(places_m)} instants; the tag is heard by some antenna at {heard.any(axis=1).mean():.0%} of them")

# %%
# What the tracker makes of it. It may know the floor, its antennas and how they hear, not where the person is.

knowledge = target_knowledge(layout, scenario, tracker)
track = tracker.run(knowledge, observations, streams.generator(scenario.name, 0, Purpose.FILTER))
error_m = np.hypot(*(track.places_m - places_m).T)
print(f"error: median {np.median(error_m):.2f} m, largest {error_m.max():.2f} m, one trial")

estimated_m = {"uhf_laser": track.places_m}
paths = draw_trajectories(
    [Paths(title="Walk and track", true_m=places_m, estimated_m=estimated_m, window_m=spec.site.bounds_m)]
)
