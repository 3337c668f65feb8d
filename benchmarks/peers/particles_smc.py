"""The filter in `particles` (N. Chopin): a Feynman-Kac model run by its SMC class with systematic resampling."""

from importlib.metadata import version

import mcl_parts
import numpy as np
import particles
from mcl_parts import Drive, FloatArray
from particles.collectors import Moments


class Localisation(particles.FeynmanKac):
    """Particles are rows (x, y, heading, log likelihood); time t is the end of step t of the drive."""

    def __init__(self, drive: Drive, draws: np.random.Generator) -> None:
        super().__init__(len(drive))
        self.drive = drive
        self.draws = draws

    def M0(self, N: int) -> FloatArray:
        """Return particles drawn from the prior and moved by the first step."""
        return self._moved(0, mcl_parts.initial(self.drive, N, self.draws))

    def M(self, t: int, xp: FloatArray) -> FloatArray:
        """Start implausible particles anew if the last step resampled, then move all."""
        before = np.ascontiguousarray(xp.T)
        if len(self.drive.detections[t - 1]):
            mcl_parts.reinitialise(before, self.drive.detections[t - 1], self.draws)
        return self._moved(t, before)

    def logG(self, t: int, xp: FloatArray, x: FloatArray) -> FloatArray:
        """Return the log likelihood, and keep it with the particles."""
        if len(self.drive.detections[t]) == 0:
            return np.zeros(len(x))
        x[:, 3] = mcl_parts.log_likelihood(x.T, self.drive.detections[t])
        return x[:, 3].copy()

    def time_to_resample(self, smc: particles.SMC) -> bool:
        """Return whether the last step had a detection."""
        return len(self.drive.detections[smc.t - 1]) > 0

    def _moved(self, t: int, before: FloatArray) -> FloatArray:
        # Laid out by columns, so that each column stays in one piece and needs no copy.
        return mcl_parts.moved(before, self.drive.increments[t], self.drive.sigma[t], self.draws).T


def mean_pose(W: FloatArray, X: FloatArray) -> FloatArray:
    """Return the estimate that is collected after each step."""
    return mcl_parts.estimate(X.T, W)


def run(drive: Drive, count: int, seed: int) -> FloatArray:
    """Return the estimated poses of a drive, shape (n, 3)."""
    np.random.seed(seed)  # noqa: NPY002  # the library draws from the global stream
    model = Localisation(drive, np.random.Generator(np.random.SFC64(seed)))
    filtering = particles.SMC(fk=model, N=count, resampling="systematic", collect=[Moments(mom_func=mean_pose)])
    filtering.run()
    return np.array(filtering.summaries.moments)


if __name__ == "__main__":
    mcl_parts.serve(run, f"particles {version('particles')}")
