"""A filter whose particles all move as the robot was told to, whatever each believes of its heading."""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Final

import numpy as np

from layoutopt.identity import by_content
from layoutopt.protocols import Estimator, EstimatorCard, FloorKnowledge, RunningEstimator
from layoutopt.readings import Observations, Prior, Trajectory
from studies.published.before_another import BeforeAnother

CARD: Final = EstimatorCard(
    summary="Another estimator with odometry in the floor frame, as mi2016, Eq. 1, has it.",
    reference="mi2016, Eq. 1",
    estimates="robot",
    needs="tag_read",
    states_covariance=True,
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FloorFrame(BeforeAnother):
    """An estimator that adds the velocity of Eq. 1 in the floor frame.

    Wheels measure in the robot's frame: a particle that is wrong about its heading goes elsewhere. In Eq. 1 the
    velocity is that over the floor, the same for all particles. For a robot that keeps the heading 0 the two are
    one for the truth and differ for particles alone.

    The estimator within works in a frame that moves with the velocity: there the robot stands, its noise is the
    same, and the tag of each read lies where it was relative to the moving frame at that moment.

    Raises
    ------
    ValueError
        If asked to work step by step, which needs the velocity over the floor in the readings.
    """

    inner: Estimator
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Check nothing: any estimator may stand within."""

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> RunningEstimator:
        """Refuse: only whole drives are estimated.

        Raises
        ------
        ValueError
            Always.
        """
        raise ValueError("the velocity over the floor is taken from a whole drive")

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the estimates of a whole drive of a robot with the heading 0."""
        way_m = np.cumsum(observations.increments[:, :2], axis=0)
        known = observations.read_tag >= 0
        step = np.repeat(np.arange(len(observations)), np.diff(observations.read_start))[known]
        tag = observations.read_tag[known]
        tags = knowledge.tags
        seen = replace(
            tags,
            ids=np.arange(1, len(tag) + 1),
            xy_m=tags.xy_m[tag] - way_m[step],
            tile=tags.tile[tag],
            zone=tags.zone[tag],
            sigma_m=tags.sigma_m[tag],
            status=tuple(tags.status[index] for index in tag),
            uid=tuple(tags.uid[index] for index in tag),
        )
        still = observations.increments.copy()
        still[:, :2] = 0.0
        start = np.concatenate([[0], np.cumsum(known)])[observations.read_start]
        found = self.inner.run(
            prior,
            replace(knowledge, tags=seen),
            replace(
                observations,
                increments=still,
                read_start=start.astype(np.int64),
                read_antenna=observations.read_antenna[known],
                read_tag=np.arange(len(tag), dtype=np.int64),
            ),
            draws,
        )
        poses = found.poses.copy()
        poses[:, :2] += way_m
        return replace(found, poses=poses)
