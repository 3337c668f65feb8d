"""How often a robot has to read a tag to track who wears it: error and ambiguous phases against the interval."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.protocols import Evaluation, Failure, StudyCard
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from studies.antenna_yaw_setting import check_world, tracking_layout
from studies.cells import Cell, CellStudy
from studies.held_out import failures_of
from studies.page_answer import PageAnswer
from studies.sampling_page import page_of
from studies.sampling_setting import Place, Setting, setting_of
from studies.sampling_words import recommended_s, summary

CARD: Final = StudyCard(
    summary="Sampling interval against tracking error and ambiguous phases, by walking speed, reading and tag.",
    reference="liang2020, Eq. 9-10 and Section 4 (walking speeds, types of tag); own",
    question="How often must a tag be read so that a walking person is tracked?",
    adaptive=False,
    rests_on="Tracking is simulated with signals after liang2020, the same walks for all intervals; "
    "differences are paired. Readers that share their time with many tags are slower.",
    next_step="Set the longest interval that still tracks in [tracking], and run antenna_yaw with it.",
    guide="tracking",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampling(CellStudy[Place]):
    """The comparison in a spec's world of tracking, with its first number of antennas and its first yaw."""

    setting: Setting
    seed: int
    card: ClassVar[StudyCard] = CARD

    @classmethod
    def for_spec(cls, spec: Spec, *, quick: bool, workers: Workers | None = None) -> "Sampling":
        """Return the study of a spec; a quick one takes few values, and few and short trials.

        Raises
        ------
        InvalidInput
            If the site has no room for the robot and the walk that are taken where a spec names none, or as
            `check_world`.
        """
        setting = setting_of(spec, quick=quick)
        check_world(setting.scenario, [tracking_layout(setting.tracking)], spec.seed)
        return cls(setting=setting, seed=spec.seed)

    def cells(self) -> Iterator[tuple[Place, Cell]]:
        """Yield every cell under its place."""
        return self.setting.cells()

    def answer(self, evaluations: Sequence[Evaluation | Failure], spec: Spec) -> PageAnswer:
        """Return the outcomes, ready to be told; the spec has nothing to add."""
        found, failures = self.finished(evaluations), failures_of(evaluations)
        return PageAnswer(
            study="sampling",
            found=recommended_s(self.setting, found) is not None,
            summary=tuple(summary(self.setting, found)),
            page=lambda _: page_of(self.setting, found, seed=self.seed, failed=len(failures)),
            failures=failures,
        )
