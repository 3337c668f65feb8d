"""The filter in numpy alone: the same parts in the shortest loop, so that a peer's ratio to it is its overhead."""

import mcl_parts
import numpy as np
from mcl_parts import Drive, FloatArray


def run(drive: Drive, count: int, seed: int) -> FloatArray:
    """Return the estimated poses of a drive, shape (n, 3)."""
    draws = np.random.Generator(np.random.SFC64(seed))
    particles = mcl_parts.initial(drive, count, draws)
    level = np.ones(count)
    poses = np.empty((len(drive), 3))
    for step, detections in enumerate(drive.detections):
        particles = mcl_parts.moved(particles, drive.increments[step], drive.sigma[step], draws)
        if len(detections) == 0:
            poses[step] = mcl_parts.estimate(particles, level)
            continue
        particles[3] = mcl_parts.log_likelihood(particles, detections)
        weight = np.exp(particles[3] - particles[3].max())
        poses[step] = mcl_parts.estimate(particles, weight)
        reached = np.cumsum(weight)
        marks = (draws.random() + np.arange(count)) * (reached[-1] / count)
        # Rounding may put the last mark at the very end.
        particles = particles[:, np.minimum(np.searchsorted(reached, marks, side="right"), count - 1)]
        mcl_parts.reinitialise(particles, detections, draws)
    return poses


if __name__ == "__main__":
    mcl_parts.serve(run, f"numpy {np.__version__}")
