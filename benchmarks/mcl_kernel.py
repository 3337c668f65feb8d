"""How much faster the compiled Monte Carlo localisation is than its plain twin, on the workload of mi2016.

Run with ``python benchmarks/mcl_kernel.py [ROUNDS]``; the protocol is in the README beside this file.
"""

import sys
import time
from collections.abc import Callable

import numpy as np
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.layout import FloorTags, Layout, ReaderProfile, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.mi2016 import eight
from layoutopt.readings import Prior
from layoutopt.robot import Odometry, Robot
from layoutopt.scenario import Judgement, Role, Routes, Scenario
from layoutopt.simulation.sensing import observe
from layoutopt.simulation.trials import knowledge_of, record_trial, run_trials, warm_up
from layoutopt.site import Site
from layoutopt.streams import Streams

ESTIMATOR = MonteCarloLocalisation()
STREAMS = Streams(seed=2016)


def layout() -> Layout:
    """Return 8 readers over 100 tags a square metre."""
    mount = Mount(
        antenna=SphereAntenna(side_m=0.06),
        height_m=0.024,
        profile=ReaderProfile(name="mi2016", scan_period_s=0.05, tags_per_scan="several"),
    )
    floor_tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.1), origin_m=(0.013, 0.007)),))
    return Layout(floor_tags=floor_tags, readers=(eight(mount=mount),))


def scenario() -> Scenario:
    """Return 60 s, 1,200 steps, of a circle of 0.5 m at 0.1 m/s."""
    outline_m = np.array([(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)])
    odometry = Odometry(
        translation_share=0.0212, lateral_share=0.0212, rotation_rad_per_m=0.0354, half_track_m=0.0
    )
    return Scenario(
        name="mi2016",
        role=Role.DESIGN,
        site=Site(name="laboratory", floor=box(-2.0, -2.0, 2.0, 2.0)),
        robot=Robot(outline_m=outline_m, odometry=odometry, speed_m_s=0.1),
        routes=Routes(kind="circle"),
        judgement=Judgement(settle_s=0.0),
        start_sigma_m=0.0,
        start_sigma_rad=0.0,
    )


def seconds(call: Callable[[], object]) -> float:
    """Return how long a call takes."""
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def main(rounds: int) -> None:
    """Time kernel and twin in turn, and print the median of the ratios of each round with their range."""
    proposal, world = layout(), scenario()
    knowledge = knowledge_of(proposal, world, ESTIMATOR)
    record = record_trial(proposal, world, OdometryAlone(), STREAMS, 0)
    x_m, y_m, heading_rad = (float(value) for value in record.drive.poses[0])
    prior = Prior(pose=(x_m, y_m, heading_rad), sigma_m=0.0, sigma_rad=0.0)
    steps = list(record.observations.steps())

    def kernel() -> None:
        ESTIMATOR.run(prior, knowledge, record.observations, np.random.default_rng(1))

    def twin() -> None:
        running = ESTIMATOR.start(prior, knowledge, np.random.default_rng(1))
        for motion, readings in steps:
            running.step(motion, readings)

    def sensing() -> None:
        observe(record.drive, proposal, world, knowledge.tags, STREAMS, 0)

    warm_up()
    times_s = []
    for number in range(rounds):
        # A new replication each round: its drive is simulated, not remembered.
        trial_s = seconds(lambda number=number: run_trials(proposal, world, ESTIMATOR, STREAMS, number + 1, 1))
        times_s.append((seconds(kernel), seconds(twin), seconds(sensing), trial_s))
    kernel_s, twin_s, sensing_s, trial_s = np.array(times_s).T
    ratio = twin_s / kernel_s
    work = ESTIMATOR.particles * world.step_count
    print(
        f"{ESTIMATOR.particles} particles, {world.step_count} steps, {len(record.observations.read_tag)} reads, "
        f"{rounds} rounds"
    )
    print(f"twin / kernel   {np.median(ratio):6.1f}   (range {ratio.min():.1f} to {ratio.max():.1f})")
    for name, taken_s in (("kernel", kernel_s), ("plain twin", twin_s)):
        rate = work / np.median(taken_s) / 1e6
        print(f"{name:15s} {np.median(taken_s) * 1e3:6.1f} ms   ({rate:.1f} million particle-steps a second)")
    print(f"{'sensing':15s} {np.median(sensing_s) * 1e3:6.1f} ms")
    print(f"{'whole trial':15s} {np.median(trial_s) * 1e3:6.1f} ms   (drive, sensing, kernel, outcomes)")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 15)
