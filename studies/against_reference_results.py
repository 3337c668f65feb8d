"""How the layouts that were found compare with the published one, paired by drive, and what binds them."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely
from shapely.geometry import Polygon

from layoutopt.feasibility import check
from layoutopt.layout import Layout
from layoutopt.parts import bill_of_needs, needs
from layoutopt.scenario import Scenario
from layoutopt.score_text import percent_text
from layoutopt.scores import Score, Scores, TrialOutcomes
from objectives.cost import Cost
from studies.published.comparison import paired_ratio

ERROR: Final = "position_error_mean"
REFERENCE: Final = "reference"
Driven = Mapping[tuple[str, ...], TrialOutcomes]


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """What one search found: its layout, the scores of fresh trials, and what the search took."""

    filter: str
    share: float
    layout: Layout
    scores: Scores
    stage: str
    layouts: int
    trials: int

    @property
    def cost_eur(self) -> float:
        """Cost of the layout."""
        return self.scores["cost"].value


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """A layout that was found beside the reference with one filter, on the same held-out drives.

    ``ratio`` is that of the mean errors, paired by drive, layout over reference.
    """

    found: Found
    scenario: str
    reference_filter: str
    error: Score
    reference_error: Score
    ratio: Score

    @property
    def as_accurate(self) -> bool:
        """Whether the layout is shown to err no more: the one-sided 95 % bound of the ratio is at most 1."""
        return self.ratio.upper() <= 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """All that was found; ``refused`` says of a filter and share why no layout was."""

    found: tuple[Found, ...]
    rows: tuple[Compared, ...]
    refused: Mapping[tuple[str, float], str]
    reference: Layout
    reference_cost_eur: float
    reference_in_reach_eur: float
    driven: Driven
    cost: Cost
    design: Scenario
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Binding:
    """How far a layout is from what bounds it.

    Attributes
    ----------
    antennas, side_m, height_m, radius_m, widest_radius_m
        The readers: number, side, height, radius of the read disc, and the widest disc of such an antenna.
    antenna_room_m, outline_room_m
        By how much the nearest two antennas could come closer, and every antenna move outwards, within the rules.
    tags_per_m2, tag_room_m
        Tags over the open floor, and by how much the nearest two are farther apart than a tag is long.
    floor_eur
        What tags, their labour and their survey cost; the rest of the cost is readers.
    """

    antennas: int
    side_m: float
    height_m: float
    radius_m: float
    widest_radius_m: float
    antenna_room_m: float
    outline_room_m: float
    tags_per_m2: float
    tag_room_m: float
    floor_eur: float


def compared(
    found: Iterable[Found], driven: Driven, filters: Sequence[str], scenarios: Sequence[str]
) -> tuple[Compared, ...]:
    """Return every layout beside the reference with the paper's own filter, the first, and with the same one."""
    return tuple(_rows(found, driven, filters, scenarios))


def _rows(
    found: Iterable[Found], driven: Driven, filters: Sequence[str], scenarios: Sequence[str]
) -> Iterator[Compared]:
    for item in found:
        for reference_filter in dict.fromkeys((filters[0], item.filter)):
            for scenario in scenarios:
                mine = driven.get((item.filter, str(item.share), scenario))
                theirs = driven.get((reference_filter, REFERENCE, scenario))
                if mine is not None and theirs is not None:
                    yield Compared(
                        found=item,
                        scenario=scenario,
                        reference_filter=reference_filter,
                        error=mine.score(ERROR),
                        reference_error=theirs.score(ERROR),
                        ratio=paired_ratio(mine, theirs, ERROR),
                    )


def pairs_of(rows: Iterable[Compared]) -> tuple[tuple[str, str], ...]:
    """Return the pairs of a filter and the filter of the reference that were compared."""
    return tuple(dict.fromkeys((row.found.filter, row.reference_filter) for row in rows))


def cheapest_as_accurate(rows: Iterable[Compared]) -> Compared | None:
    """Return the cheapest of rows that is shown to err no more than the reference."""
    return min((row for row in rows if row.as_accurate), key=lambda row: row.found.cost_eur, default=None)


def dearest(rows: Iterable[Compared]) -> Compared | None:
    """Return the row of the largest budget: at equal cost, if the searches go so far."""
    return max(rows, key=lambda row: row.found.share, default=None)


def summary(results: Results) -> list[str]:
    """Return for each pair of filters, and each scenario, how much cheaper and how much more accurate."""
    lines = [_least_cost(results)] if results.rows else []
    for mine, theirs in pairs_of(results.rows):
        for scenario in dict.fromkeys(row.scenario for row in results.rows):
            place = (mine, theirs, scenario)
            rows = [row for row in results.rows if (row.found.filter, row.reference_filter, row.scenario) == place]
            lines.append(
                f"With {mine}, beside the published layout with {theirs} on {scenario}: {_verdict(rows, results)}."
            )
    if results.rows:
        drives = sorted({row.ratio.count for row in results.rows})
        lines.append(
            "Ratios are those of the mean position errors, layout over published layout, paired by drive, with "
            f"their one-sided 95 % bound; {' or '.join(map(str, drives))} held-out drives in each scenario, "
            f"seed {results.seed}."
        )
    for (name, share), why in results.refused.items():
        lines.append(
            f"With {name}, for at most {percent_text(share)} of the cost: no layout found; of the nearest one "
            f"{why}."
        )
    return lines


def _least_cost(results: Results) -> str:
    """Return the least cost at which one layout was shown to be as accurate everywhere, both with one filter."""
    by_layout: dict[tuple[str, float], list[Compared]] = {}
    for row in results.rows:
        if row.found.filter == row.reference_filter:
            by_layout.setdefault((row.found.filter, row.found.cost_eur), []).append(row)
    fitting = [place for place, rows in by_layout.items() if all(row.as_accurate for row in rows)]
    if not fitting:
        return "No layout was shown to be as accurate as the published one in every held-out scenario."
    name, cost_eur = min(fitting, key=lambda place: place[1])
    return (
        f"A layout for {percent_text(cost_eur / results.reference_cost_eur, 1)} of the published one's cost was "
        f"shown to be as accurate in every held-out scenario, both with {name}."
    )


def _verdict(rows: Sequence[Compared], results: Results) -> str:
    cheap, dear = cheapest_as_accurate(rows), dearest(rows)
    found = "no layout was shown to be as accurate"
    if cheap is not None:
        share = cheap.found.cost_eur / results.reference_cost_eur
        found = f"as accurate at {percent_text(share, 1)} of its cost (error ratio {ratio_text(cheap.ratio)})"
    if dear is not None:
        share = dear.found.cost_eur / results.reference_cost_eur
        found += f"; at {percent_text(share, 1)} of its cost an error ratio of {ratio_text(dear.ratio)}"
    return found


def ratio_text(ratio: Score) -> str:
    """Return a ratio with its one-sided 95 % bound.

    >>> ratio_text(Score(value=0.5, unit="", standard_error=0.01, count=200))
    '0.500, at most 0.517'
    """
    return f"{ratio.value:.3f}, at most {ratio.upper():.3f}"


def binding(layout: Layout, results: Results) -> Binding:
    """Return how far a layout of one reader group and one pattern is from its bounds."""
    group, scenario = layout.readers[0], results.design
    antenna, height_m = group.antenna, float(group.poses[0, 2])
    gap_m = np.linalg.norm(group.poses[:, None, :2] - group.poses[None, :, :2], axis=2)
    np.fill_diagonal(gap_m, np.inf)
    slots = np.array(group.slots)
    together_m = np.where(slots[:, None] == slots[None, :], gap_m, np.inf)
    profile = group.profile
    rooms_m = [
        float(gap_m.min(initial=np.inf)) - profile.spacing_sides * antenna.side_m,
        float(together_m.min(initial=np.inf)) - profile.simultaneous_spacing_sides * antenna.side_m,
    ]
    outline = Polygon(scenario.robot.outline_m)
    corners = antenna.side_m / 2.0 * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    places = shapely.points((group.poses[:, None, :2] + corners).reshape(-1, 2))
    pattern = layout.floor_tags.zones[0].pattern
    tags = len(layout.floor_tags.lay_on(scenario.site))
    cost = results.cost
    whole, bare = (
        bill_of_needs(needs(layout, count, cost.robot_count, cost.reader_part), cost.robot_count, cost.prices)
        for count in (tags, 0)
    )
    return Binding(
        antennas=group.count,
        side_m=antenna.side_m,
        height_m=height_m,
        radius_m=antenna.read_radius_m(height_m),
        widest_radius_m=max(
            antenna.read_radius_m(float(value)) for value in np.linspace(0.0, antenna.side_m, 401)
        ),
        antenna_room_m=min(rooms_m),
        outline_room_m=float(shapely.distance(places, outline.exterior).min()),
        tags_per_m2=tags / scenario.site.open_floor.area,
        tag_room_m=pattern.minimum_spacing_m() - max(layout.floor_tags.tag_size_m),
        floor_eur=whole.total_eur - bare.total_eur,
    )


def reference_faults(results: Results) -> tuple[str, ...]:
    """Return why the published layout cannot be built under this robot; nothing if it can."""
    return tuple(violation.message for violation in check(results.reference, results.design))
