"""The workload that all benchmarks share, and how ratios are taken.

8 readers of 60 mm at 24 mm (radius of the read disc 30 mm), 100 tags a square metre on a floor of 4 m x 4 m,
1,200 steps of 50 ms on a circle of 0.5 m at 0.1 m/s (mi2016, Section 5.4). Nearly nothing is known of the start.
"""

import itertools
import math
import os
import platform
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.estimators.likelihood import detections_of
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.identity import FloatArray
from layoutopt.layout import FloorTags, Layout, ReaderProfile, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Estimator, FloorKnowledge, Mount
from layoutopt.readers.mi2016 import eight
from layoutopt.readings import Observations, Prior
from layoutopt.robot import Odometry, Robot
from layoutopt.scenario import Judgement, Role, Routes, Scenario
from layoutopt.simulation.trials import knowledge_of, record_trial
from layoutopt.site import Site
from layoutopt.streams import Streams

STREAMS = Streams(seed=2016)
START = Prior(pose=(0.0, 0.0, 0.0), sigma_m=1.0, sigma_rad=math.pi)
"""Somewhere about the middle of the floor, at any heading: nearly all particles start anew at the first reads."""

ONE_THREAD = {
    name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
}

NEW_REPLICATIONS = itertools.count(1)
"""Each replication comes once: trials remember their drives, and making one is to be timed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Log:
    """One drive as every filter gets it: what was read, what is known beforehand, and the truth, shape (n, 3)."""

    observations: Observations
    knowledge: FloorKnowledge
    truth: FloatArray

    def error_m(self, poses: FloatArray) -> float:
        """Return the mean position error over the second half of the drive."""
        off_m = (poses - self.truth)[len(self.truth) // 2 :, :2]
        return float(np.hypot(off_m[:, 0], off_m[:, 1]).mean())

    def save(self, path: Path) -> None:
        """Write the drive for filters that know nothing of this project: detections in columns, SI units."""
        detections = detections_of(self.observations, self.knowledge)
        np.savez(
            path,
            increments=self.observations.increments,
            sigma=self.observations.sigma,
            start=detections.start,
            antenna_m=detections.antenna_m,
            tag_m=detections.tag_m,
            radius_m=detections.radius_m,
            prior=np.array([*START.pose, START.sigma_m, START.sigma_rad]),
            truth=self.truth,
        )


def layout() -> Layout:
    """Return 8 readers over 100 tags a square metre."""
    mount = Mount(
        antenna=SphereAntenna(side_m=0.06),
        height_m=0.024,
        profile=ReaderProfile(name="mi2016", scan_period_s=0.05, tags_per_scan="several"),
    )
    floor_tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.1), origin_m=(0.047, 0.041)),))
    return Layout(floor_tags=floor_tags, readers=(eight(mount=mount),))


def scenario(side_m: float = 4.0, step_count: int = 1200) -> Scenario:
    """Return a drive of 50 ms a step about the middle of a square floor."""
    outline_m = np.array([(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)])
    odometry = Odometry(
        translation_share=0.0212, lateral_share=0.0212, rotation_rad_per_m=0.0354, half_track_m=0.0
    )
    half_m = side_m / 2.0
    return Scenario(
        name="mi2016",
        role=Role.DESIGN,
        site=Site(name="laboratory", floor=box(-half_m, -half_m, half_m, half_m)),
        robot=Robot(outline_m=outline_m, odometry=odometry, speed_m_s=0.1),
        routes=Routes(kind="circle"),
        judgement=Judgement(settle_s=0.0),
        step_count=step_count,
        start_sigma_m=0.0,
        start_sigma_rad=0.0,
    )


def logged(side_m: float = 4.0, step_count: int = 1200) -> Log:
    """Return the detection log of one drive."""
    proposal, world = layout(), scenario(side_m, step_count)
    record = record_trial(proposal, world, OdometryAlone(), STREAMS, 0)
    return Log(
        observations=record.observations,
        knowledge=knowledge_of(proposal, world, OdometryAlone()),
        truth=record.drive.poses[1:],
    )


def run_whole(estimator: Estimator, log: Log, seed: int) -> FloatArray:
    """Return the poses of a whole drive from an estimator's fast form."""
    return estimator.run(START, log.knowledge, log.observations, np.random.default_rng(seed)).poses


def run_by_steps(estimator: Estimator, log: Log, seed: int) -> FloatArray:
    """Return the poses of a whole drive from an estimator's plain form, step by step."""
    running = estimator.start(START, log.knowledge, np.random.default_rng(seed))
    return np.array([running.step(motion, readings).values for motion, readings in log.observations.steps()])


def seconds(call: Callable[[], object]) -> float:
    """Return how long a call takes."""
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def order(names: Iterable[str], number: int) -> list[str]:
    """Return the names in the order of a round: each round starts with another one."""
    listed = list(names)
    first = number % len(listed)
    return listed[first:] + listed[:first]


def median_and_range(ratios: FloatArray) -> str:
    """Return the median of the rounds' ratios with their range, in three digits."""
    return f"{np.median(ratios):.3g} ({ratios.min():.3g} to {ratios.max():.3g})"


def machine() -> str:
    """Return date, processor, versions and load: what belongs beside a measured table."""
    processor, info = platform.machine(), Path("/proc/cpuinfo")
    if info.exists():
        lines = info.read_text(encoding="utf-8").splitlines()
        processor = next((line.partition(": ")[2] for line in lines if line.startswith("model name")), processor)
    load = f"load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "load unknown"
    return (
        f"{datetime.now(UTC):%Y-%m-%d}, {processor}, {os.cpu_count()} cores, Python {platform.python_version()}, "
        f"numpy {np.__version__}, {load}"
    )


def use_one_core() -> None:
    """Keep this process, and those it starts, to one core and one thread.

    Thread counts are read when numpy is imported, so the script starts itself anew where they are not set.
    """
    if any(os.environ.get(name) != count for name, count in ONE_THREAD.items()):
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **ONE_THREAD})
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
