"""What reader groups are compared: for each mount and number of antennas, chosen ones beside those of a spec."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, TypeVar

import numpy as np

from layoutopt import feasibility
from layoutopt.errors import InvalidInput
from layoutopt.layout import FloorTags, Layout, ReaderGroup, ZonePattern
from layoutopt.protocols import Estimator, Mount
from layoutopt.scenario import Scenario
from layoutopt.space import DesignSpace
from objectives.expected_reads import swept_area_m2, tag_density_per_m2
from solvers.antenna_slots import slots_under
from solvers.information import CRITERIA, Merit, drift_of, kept_information, pose_information
from solvers.relaxation import GroupChoice, choose_group

MOST_RIVALS: Final = 12
"""Groups of the spec beside the chosen ones in one setting: more would only be drives."""
MOST_SETTINGS: Final = 48
_Item = TypeVar("_Item")


@dataclass(frozen=True, slots=True, kw_only=True)
class Contender:
    """A reader group with what the model says of it.

    Attributes
    ----------
    label
        ``"D-optimal"``, ``"A-optimal"``, or family and sizes.
    merits
        By criterion, as `solvers.information.Merit`.
    sigma_m, sigma_rad
        Standard deviations of place (both axes together) and heading that the model keeps after a look.
    """

    label: str
    group: ReaderGroup
    layout: Layout
    merits: Mapping[str, float]
    sigma_m: float
    sigma_rad: float

    @property
    def chosen(self) -> bool:
        """Whether the optimisation chose it, and not the spec."""
        return self.label in {chosen_label(criterion) for criterion in CRITERIA}


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """One mount and number of antennas.

    Attributes
    ----------
    choices
        What came of the optimisation, by criterion.
    contenders
        Chosen groups first, then those of the spec; only what can be built and judged.
    refused
        Labels of the others with the reason.
    """

    mount: Mount
    count: int
    choices: Mapping[str, GroupChoice]
    contenders: tuple[Contender, ...]
    refused: tuple[tuple[str, str], ...] = ()

    @property
    def mount_name(self) -> str:
        """How the antennas are built, in words."""
        ports = self.mount.antennas_per_module
        many = f", {ports} a module" if ports > 1 else ""
        return f"{1000.0 * self.mount.antenna.side_m:g} mm, {1000.0 * self.mount.height_m:g} mm high{many}"

    @property
    def name(self) -> str:
        """Number and mount in words."""
        return f"{self.count} × {self.mount_name}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """All settings over one floor; ``left_out`` tells what was not looked at, one sentence each."""

    floor_tags: FloorTags
    scenario: Scenario
    estimator: Estimator
    density_per_m2: float
    settings: tuple[Setting, ...]
    left_out: tuple[str, ...] = field(default=())


def chosen_label(criterion: str) -> str:
    """Return the label of the group that a criterion chose."""
    return f"{criterion}-optimal"


def middle_floor(space: DesignSpace) -> FloorTags:
    """Return the floor with the pattern of middle density of each zone; of an even number the sparser one."""
    zones = []
    for zone, families in space.patterns.items():
        options = sorted(
            (pattern for family in families for pattern in family.options()),
            key=lambda pattern: pattern.density_per_m2 if pattern.cell_m is not None else len(pattern.points_m),
        )
        middle = options[(len(options) - 1) // 2]
        zones.append(ZonePattern(zone=zone, pattern=middle, origin_m=space.origin_m))
    return FloorTags(
        zones=tuple(zones),
        tag_part=space.tag_part,
        tag_size_m=space.tag_size_m,
        placement_sigma_m=space.placement_sigma_m,
    )


def comparison_of(
    space: DesignSpace, scenario: Scenario, estimator: Estimator, *, seed: int, most: int = MOST_SETTINGS
) -> Comparison:
    """Return the comparison over a space's mounts and numbers of antennas, at most so many of them.

    Raises
    ------
    InvalidInput
        If the floor has no tags.
    """
    floor_tags = middle_floor(space)
    density = tag_density_per_m2(floor_tags, floor_tags.base, scenario.site)
    if not density > 0.0:
        raise InvalidInput.at(
            "space.patterns",
            f"the pattern in the middle of the list, {floor_tags.base.pattern.name}, lays no tag on the floor",
            "Give a pattern that covers the floor.",
        )
    every: dict[tuple[Mount, int], list[ReaderGroup]] = {}
    for family in space.readers:
        for group in family.options():
            every.setdefault((mount_of(group), group.count), []).append(group)
    models = {mount: _model_of(mount, floor_tags, scenario, estimator, density) for mount, _ in every}
    wanted = sorted(every, key=_mount_order)
    if len(wanted) > most:
        # What is left out is first that which has nothing of the spec to stand beside.
        beside = [place for place in wanted if any(not models[place[0]].refusal(g) for g in every[place])]
        wanted = spread(beside or wanted, most)
    left_out = []
    if len(wanted) < len(every):
        left_out.append(f"{len(every) - len(wanted)} of {len(every)} mounts and numbers of antennas")
    settings = []
    for mount, count in wanted:
        model = models[mount]
        setting, dropped = _setting(model, count, every[mount, count], seed)
        settings.append(setting)
        if dropped:
            left_out.append(f"{dropped} groups of the spec with {setting.name}")
    return Comparison(
        floor_tags=floor_tags,
        scenario=scenario,
        estimator=estimator,
        density_per_m2=density,
        settings=tuple(settings),
        left_out=tuple(left_out),
    )


def mount_of(group: ReaderGroup) -> Mount:
    """Return how the antennas of a group are built; of the families all hang at one height."""
    return Mount(
        antenna=group.antenna,
        height_m=float(group.poses[0, 2]),
        profile=group.profile,
        antennas_per_module=group.antennas_per_module,
    )


def _mount_order(place: tuple[Mount, int]) -> tuple[float, float, int, str, int]:
    mount, count = place
    return mount.antenna.side_m, mount.height_m, mount.antennas_per_module, mount.antenna.key, count


def spread(items: Sequence[_Item], most: int) -> list[_Item]:
    """Return at most so many items, evenly spaced, both ends among them; of one only the middle.

    >>> spread([1, 2, 3, 4, 5], 3), spread([1, 2, 3], 1), spread([1, 2], 4)
    ([1, 3, 5], [2], [1, 2])
    """
    if len(items) <= most:
        return list(items)
    if most == 1:
        return [items[len(items) // 2]]
    return [items[round(number * (len(items) - 1) / (most - 1))] for number in range(most)]


def way_between_looks_m(radius_m: float, way_between_scans_m: float) -> float:
    """Return after how much way an antenna has read as many new tags as a disc holds on average.

    An antenna that listens all the time has them after pi r / 2, the mean chord of its disc; one whose turn comes
    after more than 2 r has them at each turn.
    """
    swept = swept_area_m2(np.array([radius_m]), np.array([way_between_scans_m]))
    return float(way_between_scans_m * math.pi * radius_m**2 / swept[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Model:
    """What one mount sees of a floor, and what counts; no merits where it reads nothing."""

    mount: Mount
    floor_tags: FloorTags
    scenario: Scenario
    estimator: Estimator
    density_per_m2: float
    radius_m: float
    merits: Mapping[str, Merit]

    def layout(self, group: ReaderGroup) -> Layout:
        return Layout(floor_tags=self.floor_tags, readers=(group,))

    def refusal(self, group: ReaderGroup) -> str:
        """Return why a group cannot be built or judged, or an empty string."""
        layout = self.layout(group)
        broken = feasibility.check(layout, self.scenario)
        return broken[0].message if broken else self.estimator.applies(layout)

    def contender(self, label: str, group: ReaderGroup) -> Contender:
        look = pose_information(group.poses[:, :2], self.radius_m, self.density_per_m2).sum(axis=0)
        drift = self.merits[CRITERIA[0]].drift
        covariance = np.linalg.inv(kept_information(look, drift))
        return Contender(
            label=label,
            group=group,
            layout=self.layout(group),
            merits={name: float(merit(look)) for name, merit in self.merits.items()},
            sigma_m=math.sqrt(covariance[0, 0] + covariance[1, 1]),
            sigma_rad=math.sqrt(covariance[2, 2]),
        )


def _model_of(
    mount: Mount, floor_tags: FloorTags, scenario: Scenario, estimator: Estimator, density_per_m2: float
) -> _Model:
    robot, radius_m = scenario.robot, mount.antenna.read_radius_m(mount.height_m)
    merits = {}
    if radius_m > 0.0:
        steps = math.ceil(mount.profile.scan_period_s / scenario.step_s - 1e-9) * mount.antennas_per_module
        way_m = way_between_looks_m(radius_m, robot.speed_m_s * scenario.step_s * steps)
        drift = drift_of(robot.odometry, way_m, robot.speed_m_s)
        merits = {name: Merit(criterion=name, drift=drift, lever_m=robot.radius_m) for name in CRITERIA}
    return _Model(
        mount=mount,
        floor_tags=floor_tags,
        scenario=scenario,
        estimator=estimator,
        density_per_m2=density_per_m2,
        radius_m=radius_m,
        merits=merits,
    )


def _setting(model: _Model, count: int, groups: Sequence[ReaderGroup], seed: int) -> tuple[Setting, int]:
    """Return the setting of a number of antennas, and how many groups of the spec it leaves out."""
    reasons = [(group, model.refusal(group)) for group in groups]
    refused = [(label_of(group), reason) for group, reason in reasons if reason]
    rivals = [model.contender(label_of(group), group) for group, reason in reasons if not reason]
    rivals.sort(key=lambda contender: (-contender.merits[CRITERIA[0]], contender.label))
    kept = spread(rivals, MOST_RIVALS)
    choices: dict[str, GroupChoice] = {}
    chosen = []
    try:
        slots = slots_under(model.scenario.robot, model.mount)
    except ValueError as error:
        refused += [(chosen_label(criterion), str(error)) for criterion in CRITERIA]
    else:
        for criterion, merit in model.merits.items():
            choice = choose_group(slots, count, model.density_per_m2, merit, seed=seed)
            choices[criterion] = choice
            reason = choice.message
            if choice.chosen:
                group = slots.group(choice.chosen, model.mount)
                reason = model.refusal(group)
                if not reason:
                    chosen.append(model.contender(chosen_label(criterion), group))
            if reason:
                refused.append((chosen_label(criterion), reason))
    setting = Setting(
        mount=model.mount,
        count=count,
        choices=choices,
        contenders=(*chosen, *kept),
        refused=tuple(refused),
    )
    return setting, len(rivals) - len(kept)


def label_of(group: ReaderGroup) -> str:
    """Return a family and its sizes, such as ``ring 200 mm``; those of one setting have as many antennas."""
    words = [
        f"{1000.0 * float(value):g} mm"
        if name.endswith("_m") and not isinstance(value, str)
        else f"{value} {name.replace('_', ' ')}"
        for name, value in group.parameters.items()
        if name != "count"
    ]
    return " ".join([group.name, *words])


def pairs(settings: Sequence[Setting]) -> Iterator[tuple[int, Setting, Contender]]:
    """Yield every contender with its setting and the number of that."""
    for number, setting in enumerate(settings):
        for contender in setting.contenders:
            yield number, setting, contender
