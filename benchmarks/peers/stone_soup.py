"""The filter in Stone Soup (Dstl): its particle predictor, updater and systematic resampler on models of our own.

One joint detection a step, where its usual one update for each detection would be slower. Headings are plain
numbers, because its `Bearing` type turns the state into an array of Python objects.
"""

from datetime import datetime, timedelta
from importlib.metadata import version
from typing import Any

import mcl_parts
import numpy as np
from mcl_parts import Drive, FloatArray
from stonesoup.base import Property
from stonesoup.models.measurement import MeasurementModel
from stonesoup.models.transition import TransitionModel
from stonesoup.predictor.particle import ParticlePredictor
from stonesoup.resampler.particle import SystematicResampler
from stonesoup.types.array import StateVector, StateVectors
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.state import ParticleState, State
from stonesoup.updater.particle import ParticleUpdater

BEGIN = datetime(2016, 1, 1)
STEP = timedelta(milliseconds=50)


class OdometryStep(TransitionModel):
    """Motion with the odometry of the drive and its noise; the state is (x, y, heading, log likelihood)."""

    drive: Drive = Property(doc="The drive.")
    draws: np.random.Generator = Property(doc="Random stream of the noise.")

    @property
    def ndim_state(self) -> int:
        """Number of rows of the state."""
        return 4

    def function(self, state: State, noise: bool = False, *, step: int, **kwargs: Any) -> StateVectors:
        """Return the particles after a step."""
        sigma = self.drive.sigma[step] if noise else np.zeros(3)
        before = state.state_vector.view(np.ndarray)
        return mcl_parts.moved(before, self.drive.increments[step], sigma, self.draws).view(StateVectors)

    def rvs(self, num_samples: int = 1, **kwargs: Any) -> StateVectors:
        """Refuse: the noise is in each particle's own frame, so `function` adds it."""
        raise NotImplementedError

    def pdf(self, state1: State, state2: State, **kwargs: Any) -> FloatArray:
        """Refuse: a bootstrap filter needs no density of the motion."""
        raise NotImplementedError


class TagsRead(MeasurementModel):
    """All reads of a step as one measurement: the tags' places, with antennas and radii in its metadata."""

    @property
    def ndim_meas(self) -> int:
        """Number of rows of a measurement; it varies from step to step."""
        raise NotImplementedError

    def logpdf(self, state1: Detection, state2: ParticleState, **kwargs: Any) -> FloatArray:
        """Return the log likelihood of each particle, and keep it in the last row of the state."""
        particles = state2.state_vector.view(np.ndarray)
        particles[3] = mcl_parts.log_likelihood(particles, state1.metadata["reads"])
        return particles[3].copy()

    def function(self, state: State, noise: bool = False, **kwargs: Any) -> StateVectors:
        """Refuse: nothing is predicted of a measurement."""
        raise NotImplementedError

    def rvs(self, num_samples: int = 1, **kwargs: Any) -> StateVectors:
        """Refuse: nothing is simulated here."""
        raise NotImplementedError

    def pdf(self, state1: Detection, state2: ParticleState, **kwargs: Any) -> FloatArray:
        """Return the likelihood of each particle."""
        return np.exp(self.logpdf(state1, state2, **kwargs))


def run(drive: Drive, count: int, seed: int) -> FloatArray:
    """Return the estimated poses of a drive, shape (n, 3)."""
    np.random.seed(seed)  # noqa: NPY002  # the library draws from the global stream
    draws = np.random.Generator(np.random.SFC64(seed))
    predictor = ParticlePredictor(OdometryStep(drive=drive, draws=draws))
    # The estimate is taken between weighting and resampling, so the resampler is called after the updater.
    updater = ParticleUpdater(TagsRead(ndim_state=4, mapping=(0, 1, 2)))
    resampler = SystematicResampler()
    state = ParticleState(
        mcl_parts.initial(drive, count, draws).view(StateVectors),
        log_weight=np.full(count, -np.log(count)),
        timestamp=BEGIN,
    )
    poses = np.empty((len(drive), 3))
    for step, reads in enumerate(drive.detections):
        time = BEGIN + (step + 1) * STEP
        state = predictor.predict(state, timestamp=time, step=step)
        if len(reads):
            detection = Detection(StateVector(reads.tag_m.ravel()), timestamp=time, metadata={"reads": reads})
            state = updater.update(SingleHypothesis(state, detection))
        poses[step] = mcl_parts.estimate(state.state_vector.view(np.ndarray), np.exp(state.log_weight))
        if len(reads):
            state = resampler.resample(state)
            mcl_parts.reinitialise(state.state_vector.view(np.ndarray), reads, draws)
    return poses


if __name__ == "__main__":
    mcl_parts.serve(run, f"Stone Soup {version('stonesoup')}")
