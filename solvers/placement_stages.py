"""Tags laid in stages: zones are equipped one after the other, and what lies stays."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from layoutopt.layout import WHOLE_FLOOR
from solvers.placement import place_tags
from solvers.placement_answer import Placed, PlacementEffort
from solvers.placement_model import TagPlacement


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stage:
    """What a stage was asked, with the tags of those before installed, and its answer."""

    question: TagPlacement
    placed: Placed


def staged(
    question: TagPlacement,
    stages: Sequence[Sequence[str]],
    *,
    effort: PlacementEffort | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> tuple[Stage, ...]:
    """Return the stages up to the last, or up to the first without an answer.

    Parameters
    ----------
    stages
        Names of the zones of each stage; the demands of a zone count from its stage on. Required slots get their
        tags in the first stage.

    Raises
    ------
    ValueError
        If there is no stage, the zone of a demand is in none, or a stage comes before any demand.
    """
    if not stages:
        raise ValueError("there is no stage")
    known = {zone for stage in stages for zone in stage}
    missing = [demand.zone for demand in question.demands if demand.zone not in known]
    if missing:
        raise ValueError(f"no stage equips {'the whole floor' if missing[0] == WHOLE_FLOOR else missing[0]}")
    found: list[Stage] = []
    part, equipped = question, set[str]()
    for stage in stages:
        equipped |= set(stage)
        demands = tuple(demand for demand in question.demands if demand.zone in equipped)
        if not demands:
            raise ValueError(f"nothing is demanded up to the stage of {', '.join(stage)}")
        part = replace(part, demands=demands)
        placed = place_tags(part, effort=effort, stop=stop)
        found.append(Stage(question=part, placed=placed))
        if placed.xy_m is None:
            break
        part = replace(part, installed_m=placed.xy_m, required=question.required[:0])
    return tuple(found)
