"""The page of a transponder's place: the answer, the map, the last places, guides, and what cheap scores tell."""

from collections import Counter
from typing import Final

import numpy as np

from layoutopt.plots.docking_map import DockingMap, draw_docking_map
from layoutopt.score_text import NOT_KNOWN, percent_text, score_name, shown_unit
from layoutopt.scores import Score, TrialOutcomes, wilson
from layoutopt.spec.building import Spec
from layoutopt.units import format_length
from studies.columns import number, pair
from studies.page import Data, Page, Picture, Section, Table
from studies.screening import correlation_text
from studies.transponder_placement_race import STEPS, hits_of
from studies.transponder_placement_results import Finalist, Results
from studies.transponder_placement_setting import CHEAP, Place
from studies.transponder_placement_words import (
    guide_text,
    lead_text,
    place_text,
    share_text,
    steps_text,
    success_of,
    summary,
)


def page_of(results: Results, spec: Spec) -> Page:
    """Return the whole page."""
    sections = [_asked(results, spec), _map(results)]
    if results.best is not None:
        sections += [_where(results, results.best), _places(results), _guides(results)]
    sections.append(_cheap(results))
    return Page(
        study="transponder_placement",
        title="A place for the transponder",
        summary=tuple(summary(results)),
        sections=tuple(sections),
        facts={
            "Seed": str(spec.seed),
            "Places": f"{len(results.places)}, {format_length(results.asked.pitch_m)} apart",
            "Trials": f"{_drives(results)} drives in the race, scenario '{results.asked.scenario.name}'; "
            f"{results.asked.effort.fresh} to each of the last places in '{results.asked.fresh.name}'",
            "Guide": results.asked.estimator.name,
            "Failed tasks": str(len(results.failures)),
        },
        data=_data(results),
        found=results.status.exit_code == 0,
    )


def _asked(results: Results, spec: Spec) -> Section:
    world, settings = results.asked.settings.world, results.asked.settings
    random = f", {world.random_scatterers} more at random places in every drive" if world.random_scatterers else ""
    rows = (
        ("transponder", f"{world.frequency_hz / 1e6:g} MHz"),
        ("scatterers", f"{len(settings.scatterers_m)}, each sends on {percent_text(world.reflection)}{random}"),
        (
            "walls",
            f"reflect {percent_text(world.wall_reflection)} of the amplitude"
            if world.wall_reflection
            else "do not reflect",
        ),
        ("what stands in the way", "takes the direct wave away" if world.blocks_wave else "lets waves pass"),
        ("least clearance", format_length(results.asked.least_clearance_m)),
        (
            "drive",
            f"{format_length(world.step_m)} between readings, {world.steps} of them at most; docked within "
            f"{format_length(world.stop_m)}",
        ),
        ("robots", f"radius {format_length(spec.robot.radius_m)}"),
    )
    return Section(
        heading="What was asked",
        paragraphs=(
            "Every place of a lattice is scored exactly: how far scattered waves turn the direction of the "
            "transponder, cell by cell. Robots are then sent to all places that are not refused, the same drives "
            "to each. Each round doubles the drives; at most a third of the places go on, and none that its "
            "interval tells from the best. The last places get fresh drives, on which nothing was chosen: only "
            "these are stated as their success.",
        ),
        parts=(Table(caption="The world", head=("what", "is"), rows=rows, words=2),),
    )


def _map(results: Results) -> Section:
    site = results.asked.scenario.site
    driven = [place for place in results.places if place.key in results.raced]
    reasons = Counter(place.refusal for place in results.places if place.refusal)
    refused = "; ".join(f"{count} {reason}" for reason, count in reasons.most_common())
    given = next((place.xy_m for place in results.places if place.given), None)
    picture = Picture(
        name="docking_map",
        caption="Share of drives of the race that dock, by place of the transponder; the darker, the more.",
        drawn=draw_docking_map(
            site,
            DockingMap(
                places_m=np.array([place.xy_m for place in driven]).reshape(-1, 2),
                success=np.array([success_of(results.raced[place.key]) for place in driven]),
                refused_m=np.array([place.xy_m for place in results.places if place.refusal]).reshape(-1, 2),
                side_m=results.asked.pitch_m,
                scatterers_m=results.asked.settings.scatterers_m,
                clearance_m=results.asked.least_clearance_m,
                best_m=None if results.best is None else results.best.xy_m,
                given_m=given,
            ),
        ),
    )
    level = results.asked.effort.levels[0]
    told = [
        f"Most places have {level} drives, those that went on more; near places may differ by chance. All are in "
        "tables/places.csv.",
    ]
    if refused:
        told.append(f"Refused: {refused}.")
    return Section(heading="Docking over the site", paragraphs=tuple(told), parts=(picture,))


def _where(results: Results, best: Place) -> Section:
    return Section(
        heading="Where it goes",
        paragraphs=(
            f"drawings/ holds a drawing of the floor with the transponder at {place_text(best)} and its distances "
            f"from a corner, as PDF, SVG and DXF. The layout is layouts/{best.layout.short_key}.toml.",
        ),
    )


def _places(results: Results) -> Section:
    return Section(
        heading="The last places",
        paragraphs=(
            f"{results.asked.effort.fresh} fresh drives to each, the same for all. Intervals of shares are "
            "Wilson's at 95 %; those of differences are of the paired drives. A difference is of the best place "
            "less this one, in percentage points. Misleading is a cell where a step of a fifth of the way leads "
            "no nearer.",
        ),
        parts=(
            Table(
                caption="Places in the order of the race",
                head=(
                    "place", "remark", "clearance", "direction error", "misleading", "docked", "steps",
                    "best less this", "best is better",
                ),
                rows=tuple(_row(item) for item in results.finalists),
                words=2,
            ),
        ),
    )  # fmt: skip


def _row(item: Finalist) -> tuple[str, ...]:
    place = item.place
    remarks = [word for word, holds in (("given", place.given), (place.refusal, place.refusal)) if holds]
    remarks += ["the best"] if item.lead is None else ["as good"] if item.as_good else []
    return (
        place_text(place),
        ", ".join(remarks),
        format_length(place.clearance_m),
        *(_rounded(place, name) for name in CHEAP),
        share_text(item.drives),
        steps_text(item.drives),
        "–" if item.lead is None else lead_text(item.lead),
        "–" if item.lead is None else percent_text(item.better),
    )


def _rounded(place: Place, name: str) -> str:
    """Return an exact score to a tenth of its unit."""
    if name not in place.scores:
        return NOT_KNOWN
    factor, unit = shown_unit(name)
    return f"{factor * place.scores[name].value:.1f}{'' if unit == '°' else ' '}{unit}"


def _guides(results: Results) -> Section:
    rows = tuple(
        (
            guide_text(item.name),
            share_text(item.drives),
            steps_text(item.drives),
            "–" if item.gain is None else lead_text(item.gain),
        )
        for item in results.guides
    )
    return Section(
        heading="Guides at the best place",
        paragraphs=(
            "How a robot chooses its heading, on the same fresh drives. Gains are in percentage points, steps are "
            "means with their standard errors.",
        ),
        parts=(
            Table(caption="Drives by guide", head=("guide", "docked", "steps", "gain on as measured"), rows=rows),
        ),
    )


def _cheap(results: Results) -> Section:
    rows = []
    for name in CHEAP:
        ranks, count = results.correlation(name)
        rows.append((score_name(name), str(count), correlation_text(ranks)))
    return Section(
        heading="Would the exact scores do?",
        paragraphs=(
            "Spearman's rank correlation of exact scores with the share of the first "
            f"{results.asked.effort.levels[0]} drives that dock, over all places of the first round. The interval "
            "takes places for independent, but neighbours are alike, so it is too narrow; that shares of few "
            "drives are rough draws the correlation towards zero. Exact scores know nothing of what stops robots.",
        ),
        parts=(
            Table(
                caption="Rank correlation with its 95 % interval",
                head=("score", "places", "correlation"),
                rows=tuple(rows),
            ),
        ),
    )


def _drives(results: Results) -> int:
    return sum(len(outcomes) for outcomes in results.raced.values())


def _data(results: Results) -> tuple[Data, ...]:
    places = [
        (
            f"{place.xy_m[0]:.6f}",
            f"{place.xy_m[1]:.6f}",
            place.layout.short_key,
            "yes" if place.given else "",
            place.refusal,
            number(place.clearance_m),
            *(number(place.scores[name].value) if name in place.scores else "" for name in CHEAP),
            number(place.in_view),
            *_counts(results.raced.get(place.key)),
        )
        for place in results.places
    ]
    ranks = []
    for name in CHEAP:
        found, count = results.correlation(name)
        ranks.append((name, str(count), *(number(value) for value in (found.value, found.low, found.high))))
    tables = [
        Data(
            name="places",
            head=("x_m", "y_m", "layout", "given", "refusal", "scatterer_clearance_m", "direction_error_mean_rad",
                  "direction_bad_share", "in_view_share", *_COUNTS),
            rows=tuple(places),
        ),
        Data(
            name="rank_correlation",
            head=("score", "places", "rank_correlation", "rank_correlation_low", "rank_correlation_high"),
            rows=tuple(ranks),
        ),
    ]  # fmt: skip
    if results.finalists:
        finalists = [
            (
                f"{item.place.xy_m[0]:.6f}",
                f"{item.place.xy_m[1]:.6f}",
                item.place.layout.short_key,
                *_counts(item.drives),
                *_difference(item.lead),
                "" if item.lead is None else number(item.better),
                "yes" if item.as_good else "",
            )
            for item in results.finalists
        ]
        head = (
            "x_m",
            "y_m",
            "layout",
            *_COUNTS,
            *(f"best_less_this_{name}" for name in _DIFFERENCE),
            "best_is_better",
            "as_good",
        )
        tables.append(Data(name="last_places", head=head, rows=tuple(finalists)))
    if results.guides:
        guides = [(item.name, *_counts(item.drives), *_difference(item.gain)) for item in results.guides]
        head = ("guide", *_COUNTS, *(f"gain_{name}" for name in _DIFFERENCE))
        tables.append(Data(name="guides", head=head, rows=tuple(guides)))
    return tuple(tables)


_COUNTS: Final = ("drives", "docked", "docked_share", "docked_share_low", "docked_share_high", "steps", "steps_se")
_DIFFERENCE: Final = ("share", "share_se", "share_low", "share_high")


def _counts(drives: TrialOutcomes | None) -> tuple[str, ...]:
    """Return the cells under `_COUNTS`."""
    if drives is None:
        return ("",) * len(_COUNTS)
    hits, count = hits_of(drives), len(drives)
    shares = (hits / count, *wilson(hits, count))
    return (str(count), str(hits), *(number(share) for share in shares), *pair(drives.score(STEPS)))


def _difference(difference: Score | None) -> tuple[str, ...]:
    """Return the cells under `_DIFFERENCE`."""
    if difference is None:
        return ("",) * len(_DIFFERENCE)
    return (*pair(difference), *(number(end) for end in difference.interval()))
