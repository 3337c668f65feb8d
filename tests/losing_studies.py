"""Finished studies without a trial in which what a layout loses on held-out drives is given."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from made_studies import SPEC, MadeStudy, made_study

from layoutopt.protocols import Evaluation, Task
from layoutopt.scenario import Role

FEW_OF_THE_FRONT = SPEC.replace("validation_trials = 20", "validation_trials = 400").replace(
    '"200 mm"]', '"150 mm", "200 mm"]'
)
"""A spec of three layouts in which those of the front that nobody points out have few held-out drives."""
PUBLISHED_M = 0.05
"""Error of the layouts of mi2016 that run beside it."""
ERRORS_M = {(4, 0.1): 0.1, (4, 0.15): 0.11, (4, 0.2): 0.2}
"""Error in search by number of antennas and pitch in metres; the demand is 0.3 m."""


@dataclass(frozen=True)
class LosingStudy(MadeStudy):
    """A study in which the error of a layout in search, and how many times more it is held out, are given."""

    errors_m: Mapping[tuple[int, float], float]
    losses: Mapping[tuple[int, float], float]

    def outcome(self, task: Task) -> Evaluation:
        """Return the error of the layout, a little scattered."""
        found = super().outcome(task)
        (pattern,) = {zone.pattern for zone in task.layout.floor_tags.zones}
        place = _antennas(task.layout), round(float(pattern.cell_m[0, 0]), 3)
        times = 1.0 if task.scenario.role is Role.DESIGN else self.losses.get(place, 1.0)
        error_m = self.errors_m.get(place, PUBLISHED_M) * times
        values = found.outcomes.values.copy()
        for column in ("position_error_mean", "position_error_p95", "position_error_max"):
            values[:, found.outcomes.columns.index(column)] = error_m * (1.0 + 0.01 * values[:, 0])
        return replace(found, outcomes=replace(found.outcomes, values=values))


def losing_study(folder, losses, *, errors_m=None, text=SPEC):
    """Return the study of a spec with losses by number of antennas and pitch, or one loss for all layouts."""
    errors_m = ERRORS_M if errors_m is None else errors_m
    losses = losses if isinstance(losses, Mapping) else dict.fromkeys(errors_m, losses)
    return LosingStudy(made_study(folder, text).spec, errors_m=errors_m, losses=losses)


def choice_of(item):
    """Return number of antennas and pitch in metres of a layout."""
    (zone,) = item.layout.floor_tags.zones
    return _antennas(item.layout), round(float(zone.pattern.cell_m[0, 0]), 3)


def _antennas(layout):
    return sum(len(group.poses) for group in layout.readers)
