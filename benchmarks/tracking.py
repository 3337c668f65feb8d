"""How fast people are tracked by UHF and laser: against real time, and against the plain form.

Run with ``make benchmark`` or ``python benchmarks/tracking.py [ROUNDS]``; the protocol is in the README beside
this file. Prints the rows of the table there.
"""

import argparse
import math
from dataclasses import dataclass

import numpy as np
import workload
from scaling import in_turn
from shapely.geometry import box

from layoutopt.antennas.uhf_patch import UhfPatch
from layoutopt.estimators.targets import TargetKnowledge, TargetObservations
from layoutopt.estimators.uhf_laser import UhfLaser
from layoutopt.estimators.uhf_laser_heading import UhfLaserHeading
from layoutopt.identity import FloatArray
from layoutopt.layout import FloorTags, Layout
from layoutopt.readers.finders import yawed_antennas
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.simulation.tracking_trials import observe_target, target_knowledge
from layoutopt.site import Site
from layoutopt.tracking_world import TrackingWorld

TRACKERS = {"uhf_laser": UhfLaser(), "uhf_laser_heading": UhfLaserHeading()}
DURATION_S = 150.0
"""Five rounds of liang2020's walk, 60 m at 0.4 m/s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Walk:
    """One simulated walk as every tracker gets it, and what is known beforehand."""

    knowledge: TargetKnowledge
    observations: TargetObservations

    def run(self, tracker: UhfLaser) -> FloatArray:
        """Return the track of the compiled run."""
        return tracker.run(self.knowledge, self.observations, np.random.default_rng(1)).places_m

    def run_by_steps(self, tracker: UhfLaser) -> FloatArray:
        """Return the track of the plain form."""
        running = tracker.start(self.knowledge, np.random.default_rng(1))
        return np.array([running.step(sample).values for sample in self.observations.samples()])


def walk(duration_s: float = DURATION_S) -> Walk:
    """Return liang2020's walk: two antennas at 45 degrees to either side, 541 beams, a sample every 0.4 s."""
    corners_m = np.array([[1.0, -2.0], [3.0, -2.0], [3.0, 2.0], [1.0, 2.0]])
    scenario = Scenario(
        name="tracking",
        role=Role.DESIGN,
        site=Site(name="room", floor=box(-1.0, -3.5, 5.0, 3.5)),
        robot=Robot(outline_m=np.array([(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)])),
        step_count=round(duration_s / 0.05),
        tracking=TrackingWorld(robot_pose=(0.0, 0.0, 0.0), walk_m=corners_m),
    )
    group = yawed_antennas(antenna=UhfPatch(), count=2, yaw_rad=math.radians(45.0))
    layout = Layout(floor_tags=FloorTags(zones=()), readers=(group,), target_tags=1)
    observations, _ = observe_target(layout, scenario, workload.STREAMS, 0)
    return Walk(knowledge=target_knowledge(layout, scenario, UhfLaser()), observations=observations)


def rows(rounds: int, duration_s: float = DURATION_S) -> list[str]:
    """Return a row of each tracker: microseconds an instant, times real time, times the plain form.

    Raises
    ------
    RuntimeError
        If the two forms do not agree: then there is nothing to compare.
    """
    given = walk(duration_s)
    found = []
    for name, tracker in TRACKERS.items():
        if np.abs(given.run(tracker) - given.run_by_steps(tracker)).max() > 1e-9:
            raise RuntimeError(f"the compiled run of {name} and its plain form give other tracks")
        times_s = in_turn(
            {
                "compiled": lambda tracker=tracker: given.run(tracker),
                "plain": lambda tracker=tracker: given.run_by_steps(tracker),
            },
            rounds,
        )
        instants = len(given.observations)
        found.append(
            f"| {name} | {workload.median_and_range(times_s['compiled'] / instants * 1e6)} | "
            f"{workload.median_and_range(instants * given.observations.interval_s / times_s['compiled'])} | "
            f"{workload.median_and_range(times_s['plain'] / times_s['compiled'])} |"
        )
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("rounds", nargs="?", type=int, default=15)
    rounds = parser.parse_args().rounds
    workload.use_one_core()
    print(f"{workload.machine()}; {rounds} rounds\n")
    head = "| tracker | an instant, µs | times real time | times as fast as the plain form |"
    print(head, "| --- | --- | --- | --- |", sep="\n")
    print(*rows(rounds), sep="\n")


if __name__ == "__main__":
    main()
