"""The page of the reader groups: what the model says, what drives say, and whether the two agree."""

import math
from collections.abc import Mapping
from typing import Final

from layoutopt.plots.undersides import UndersidePicture, draw_undersides
from layoutopt.result import Status
from layoutopt.score_text import percent_text
from layoutopt.scores import Score
from objectives.coverage import Coverage
from solvers.information import CRITERIA
from studies import columns
from studies.page import Data, Listing, Page, Picture, Section, Table
from studies.published.comparison import paired_ratio, scaled, with_interval
from studies.reader_group_setting import Comparison, Contender, Setting, chosen_label, pairs
from studies.reader_group_verdicts import COLUMNS, Found, agreement, best_rival, mean_ratio_text, verdicts
from studies.screening import correlation_text

_DEGREES: Final = 180.0 / math.pi
_PANELS: Final = 3
_TERMS: Final = (
    "D-optimal groups have the greatest determinant of the information about the pose that a filter keeps, "
    "A-optimal ones the least mean square error of the robot's farthest corner."
)
_MODEL: Final = (
    "The model: a read places an antenna within its disc, with a variance of a quarter of the squared radius "
    "along each axis; the information of all antennas adds up, through their lever arms, to that of position and "
    "heading; between looks the odometry loses what the spec's robot loses on a straight way; what a filter keeps "
    "is the fixed point of the two. D-optimal is the greatest determinant of what is kept, A-optimal the least "
    "mean square error of the robot's farthest corner, averaged over its direction.",
    "The model does not know of places where no antenna sees a tag (their share is in the tables, with all "
    "antennas listening at once), of tags that several antennas of one group meet in step because the floor is a "
    "lattice, of turns, or of faults, and it takes every robot to drive straight ahead. The drives have all of "
    "these.",
    "All drives are over one pattern. Ratios of position errors over one pattern need not hold over another: run "
    "the study with each pattern that may be laid.",
    "Efficiencies compare with a proven upper bound over all groups on the places of a grid under the robot; a "
    "group of the spec may stand off that grid.",
)


def summary(comparison: Comparison, found: Found, *, seed: int) -> list[str]:
    """Return the answer in a few sentences, from the numbers alone."""
    lines = []
    for criterion in CRITERIA:
        for column, word in COLUMNS.items():
            made = [item for item in verdicts(comparison, found, column) if item.criterion == criterion]
            if not made:
                continue
            better, worse = sum(item.better for item in made), sum(item.worse for item in made)
            lines.append(
                f"{chosen_label(criterion)} groups: mean {word} error "
                f"{mean_ratio_text(comparison, found, column, criterion)} times that of the spec's best group "
                f"with as many antennas of that kind; lower in {better} of {len(made)} settings, higher in "
                f"{worse}, not told apart in {len(made) - better - worse}."
            )
    if lines:
        lines.append(
            "Ratios are geometric means over settings with 95 % intervals, and each setting is decided at 95 %; "
            f"both are paired by drive: {trials_text(found)} of {comparison.scenario.name} with the estimator "
            f"{comparison.estimator.name}, seed {seed}."
        )
    else:
        lines.append("No chosen group was driven beside one of the spec.")
    for column, word in COLUMNS.items():
        ranks = agreement(comparison, found, column)
        lines.append(
            f"Does the model foresee it? Rank correlation of predicted and simulated {word} error at equal "
            f"antennas: {correlation_text(ranks.own)} among the spec's own groups, "
            f"{correlation_text(ranks.equal)} with the chosen ones (95 % intervals)."
        )
    return [*lines, *_proof(comparison), _TERMS]


def trials_text(found: Found) -> str:
    """Return how many drives a group has, in words."""
    counts = sorted({len(table) for table in found.values()})
    return f"{' or '.join(map(str, counts)) or 'no'} drives a group"


def _proof(comparison: Comparison) -> list[str]:
    choices = [choice for setting in comparison.settings for choice in setting.choices.values()]
    made = [choice for choice in choices if choice.chosen]
    lines = []
    if made:
        proven = sum(choice.status is Status.OPTIMAL for choice in made)
        least = min(choice.efficiency for choice in made)
        lines.append(
            f"{len(made)} groups were chosen, {proven} of them proven optimal among the places looked at; "
            f"each has at least {percent_text(least, 2)} of the proven bound of the model."
        )
    if len(made) < len(choices):
        lines.append(f"{len(choices) - len(made)} choices have no group; the page says why.")
    return lines


def page_of(comparison: Comparison, found: Found, *, seed: int, failed: int) -> Page:
    """Return the whole page."""
    scenario = comparison.scenario
    return Page(
        study="reader_groups",
        title="Reader groups by convex optimisation",
        summary=tuple(summary(comparison, found, seed=seed)),
        sections=(
            *_picture(comparison, found),
            *_mounts(comparison, found),
            _agreement_section(comparison, found),
            *_refusals(comparison),
            Section(heading="Model", paragraphs=_MODEL),
        ),
        facts={
            "Floor": f"middle pattern of the spec, {comparison.density_per_m2:.4g} tags/m²",
            "Drives": f"{scenario.name}, {scenario.step_count * scenario.step_s:g} s each, estimator "
            f"{comparison.estimator.name}",
            "Seed": str(seed),
            "Trials": f"{sum(map(len, found.values()))}; {trials_text(found)}",
            "Failed tasks": str(failed),
            "Left out": "; ".join(comparison.left_out) or "nothing",
            "Intervals": "± is half the width of the two-sided 95 % interval over trials (Student); ratios are "
            "paired by drive; those of rank "
            "correlations take groups for a random sample of independent ones and are too narrow",
        },
        data=(_groups_data(comparison, found), _places_data(comparison)),
    )


def _picture(comparison: Comparison, found: Found) -> list[Section]:
    """Return the chosen group with the least position error, beside the best one of the spec with its antennas."""
    column = next(iter(COLUMNS))
    driven = {
        (number, item.label): (setting, item)
        for number, setting, item in pairs(comparison.settings)
        if item.chosen and (number, item.label) in found
    }
    if not driven:
        return []
    # A group that has one of the spec to stand beside says more.
    beside = [place for place in driven if best_rival(driven[place][0], place[0], found, column) is not None]
    place = min(beside or driven, key=lambda place: (found[place].score(column).value, place))
    number, (setting, _) = place[0], driven[place]
    shown: dict[str, Contender] = {}
    for item in [item for item in setting.contenders if item.chosen]:
        shown.setdefault(item.layout.key, item)
    rival = best_rival(setting, number, found, column)
    items = [*shown.values(), *([] if rival is None else [rival])][:_PANELS]
    both = len(shown) == 1 and sum(item.chosen for item in setting.contenders) > 1
    labels = ["D- and A-optimal" if both and item.chosen else item.label for item in items]
    picture = Picture(
        name="groups",
        caption=f"{setting.name}: antennas (squares) and read discs under the chassis from above, to scale; the "
        "arrow points ahead, the cross is base_link, numbers are scan slots.",
        drawn=draw_undersides(
            comparison.scenario.robot,
            [UndersidePicture(label=label, group=item.group) for label, item in zip(labels, items, strict=True)],
        ),
    )
    listing = Listing(
        caption="Readers for a spec, in m in base_link, antennas in the order that gives them their scan slots. "
        "Side, height and antennas a module are those of the comment.",
        text="\n".join(
            f'# {label}, {where.name}\n{{ family = "listed", points = {_points(item)} }}'
            for where, label, item in _distinct(comparison)
        ),
    )
    return [Section(heading="The groups", parts=(picture, listing))]


def _distinct(comparison: Comparison) -> list[tuple[Setting, str, Contender]]:
    """Return every chosen group once, with its label; that of both criteria names both."""
    made: dict[tuple[int, str], tuple[Setting, str, Contender]] = {}
    for number, setting, item in pairs(comparison.settings):
        if item.chosen:
            _, label, _ = made.get((number, item.layout.key), (setting, "", item))
            made[number, item.layout.key] = (setting, f"{label} and {item.label}" if label else item.label, item)
    return list(made.values())


def _points(item: Contender) -> str:
    return "[" + ", ".join(f"[{x:.10g}, {y:.10g}]" for x, y in item.group.poses[:, :2] + 0.0) + "]"


def _mounts(comparison: Comparison, found: Found) -> list[Section]:
    sections: dict[str, list[tuple[str, ...]]] = {}
    for number, setting in enumerate(comparison.settings):
        rows = sections.setdefault(setting.mount_name, [])
        rivals = {column: best_rival(setting, number, found, column) for column in COLUMNS}
        rows += [_row(comparison, setting, number, item, found, rivals) for item in setting.contenders]
    head = ("antennas", "group", "D-efficiency, %", "A-efficiency, %", "sees no tag, %", "predicted, mm")
    return [
        Section(
            heading=f"Antennas of {name}",
            parts=(
                Table(
                    caption="Predicted: standard deviations after a look. Position and heading: mean errors over "
                    f"{trials_text(found)}. Ratios: over the best group of the spec with as many antennas, each "
                    "error for itself.",
                    head=(
                        *head,
                        "predicted, °",
                        "position, mm",
                        "ratio",
                        "heading, °",
                        "ratio",
                    ),
                    rows=tuple(rows),
                    words=2,
                ),
            ),
        )
        for name, rows in sections.items()
        if rows
    ]


def _row(
    comparison: Comparison,
    setting: Setting,
    number: int,
    item: Contender,
    found: Found,
    rivals: Mapping[str, Contender | None],
) -> tuple[str, ...]:
    outcomes = found.get((number, item.label))
    errors: list[Score | None] = []
    ratios: list[Score | None] = []
    for (column, rival), factor in zip(rivals.items(), (1e3, _DEGREES), strict=True):
        errors.append(None if outcomes is None else scaled(outcomes.score(column), factor, unit=""))
        beside = None if rival is None or rival is item else found[number, rival.label]
        ratios.append(paired_ratio(outcomes, beside, column) if outcomes and beside else None)
    blind = scaled(_blind(comparison, item), 100.0, unit="%")
    return (
        str(setting.count),
        item.label,
        *(_efficiency(setting, item, criterion) for criterion in CRITERIA),
        with_interval(blind),
        f"{1e3 * item.sigma_m:.2f}",
        f"{_DEGREES * item.sigma_rad:.3f}",
        *(
            cell
            for error, ratio in zip(errors, ratios, strict=True)
            for cell in (with_interval(error), "–" if ratio is None else with_interval(ratio, 2))
        ),
    )


def _blind(comparison: Comparison, item: Contender) -> Score:
    """Return the share of poses on the site from which no antenna of a group sees a tag."""
    seen = Coverage()(item.layout, comparison.scenario, None)["pose_coverage"]
    return Score(value=1.0 - seen.value, unit="", standard_error=seen.standard_error, count=seen.count, share=True)


def _efficiency(setting: Setting, item: Contender, criterion: str) -> str:
    choice = setting.choices.get(criterion)
    if choice is None or not choice.chosen:
        return "–"
    return f"{100.0 * math.exp(item.merits[criterion] - choice.bound):.2f}"


def _agreement_section(comparison: Comparison, found: Found) -> Section:
    rows = []
    for column, word in COLUMNS.items():
        ranks = agreement(comparison, found, column)
        rows.append((word, *(correlation_text(one) for one in (ranks.overall, ranks.equal, ranks.own))))
    return Section(
        heading="Does information tell the error?",
        paragraphs=(
            "Rank correlation of the standard deviation that the model keeps with the mean error of the drives. "
            "At equal antennas: errors relative to the mean of the groups with as many antennas of one kind.",
            "The chosen groups differ from all others in both, which by itself makes a correlation. Only the last "
            "column says whether the model ranks groups that it did not choose; where it is low or negative, that "
            "a chosen group is better in the drives does not show that the model foresaw it.",
        ),
        parts=(
            Table(
                caption="Spearman's rank correlation with its 95 % interval",
                head=("error", "over all groups", "at equal antennas", "the spec's own groups alone"),
                rows=tuple(rows),
            ),
        ),
    )


def _refusals(comparison: Comparison) -> list[Section]:
    rows = [(setting.name, label, reason) for setting in comparison.settings for label, reason in setting.refused]
    rows += [
        (setting.name, chosen_label(criterion), choice.message)
        for setting in comparison.settings
        for criterion, choice in setting.choices.items()
        if choice.chosen and choice.message
    ]
    if not rows:
        return []
    table = Table(
        caption="Groups that were not driven, and choices with a remark",
        head=("setting", "group", "why"),
        rows=tuple(rows),
        words=3,
    )
    return [Section(heading="Not built", parts=(table,))]


def _groups_data(comparison: Comparison, found: Found) -> Data:
    head = ["setting", "antennas", "side_m", "height_m", "antennas_per_module", "group"]
    head += [f"{criterion}_{what}" for criterion in CRITERIA for what in ("merit", "bound", "relaxed")]
    head += ["predicted_position_m", "predicted_heading_rad", "trials"]
    head += [cell for column in COLUMNS for cell in columns.named(column, columns.unit_of(column))]
    rows = []
    for number, setting, item in pairs(comparison.settings):
        outcomes = found.get((number, item.label))
        cells: list[float] = []
        for criterion in CRITERIA:
            choice = setting.choices.get(criterion)
            known = (math.nan, math.nan) if choice is None else (choice.bound, choice.relaxed)
            cells += [item.merits[criterion], *known]
        cells += [item.sigma_m, item.sigma_rad, 0.0 if outcomes is None else float(len(outcomes))]
        for column in COLUMNS:
            score = None if outcomes is None else outcomes.score(column)
            cells += [math.nan, math.nan] if score is None else [score.value, score.standard_error]
        mount = setting.mount
        place = [mount.antenna.side_m, mount.height_m, float(mount.antennas_per_module)]
        rows.append(
            (
                str(number),
                str(setting.count),
                *map(columns.number, place),
                item.label,
                *(columns.number(cell) for cell in cells),
            )
        )
    return Data(name="groups", head=tuple(head), rows=tuple(rows))


def _places_data(comparison: Comparison) -> Data:
    rows = [
        (
            str(number),
            item.label,
            str(antenna),
            columns.number(float(pose[0])),
            columns.number(float(pose[1])),
            str(slot),
        )
        for number, _, item in pairs(comparison.settings)
        for antenna, (pose, slot) in enumerate(zip(item.group.poses, item.group.slots, strict=True))
    ]
    return Data(name="places", head=("setting", "group", "antenna", "x_m", "y_m", "scan_slot"), rows=tuple(rows))
