"""The page of the mi2016 study: the paper beside ours, and in words what was chosen and what does not come out."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from layoutopt.streams import Streams
from studies.page import Page, Section, Table
from studies.published import mi2016_figures as figures
from studies.published import mi2016_setting as setting
from studies.published.comparison import comparison_table, scaled, with_interval
from studies.published.mi2016_cells import FRAMES, NOISES, SPEEDS_M_S
from studies.published.mi2016_data import data_of
from studies.published.mi2016_printed import ROW_HEAD, STATISTIC_WORDS, STATISTICS
from studies.published.mi2016_real_section import real_section
from studies.published.mi2016_results import MEAN_COLUMNS, Ratio, Results, decided, ratio_text

_AXES: Final = dict(zip(MEAN_COLUMNS, ("x", "y", "θ"), strict=True))


def page_of(results: Results, streams: Streams) -> Page:
    """Return the whole page."""
    sections = (
        _simulated(results, "2", "Table 2: 96 readers"),
        _simulated(results, "4", "Table 4: 8 readers"),
        _third(results),
        _claims(results),
        _arrays(results),
        _open_choices(results),
        _reach(),
        _speeds(results, streams),
        real_section(results),
        _choices(results),
        _not_reproduced(),
    )
    return Page(
        study="published/mi2016",
        title="mi2016: several readers under the robot, run again",
        summary=tuple(results.summary()),
        sections=sections,
        facts={
            "Paper": "J. Mi, Y. Takahashi: Design of an HF-Band RFID System with Multiple Readers and Passive "
            "Tags for Indoor Mobile Robot Self-Localization, Sensors 2016, 16(8), 1200",
            "Seed": str(results.seed),
            "Trials": str(results.trials),
            "Trials a cell of Tables 2 to 4": str(results.effort.tables),
            "Trials a cell of the open choices": str(results.effort.changes),
            "Failed tasks": str(len(results.failures)),
            "Intervals": "± is half the width of the two-sided 95 % interval of the mean over trials (Student); "
            "ratios between settings are paired by drive",
        },
        data=data_of(results),
    )


def _choices(results: Results) -> Section:
    translation_m_s, rotation_rad_s = setting.NOISE
    return Section(
        heading="What the paper states, and what was chosen",
        paragraphs=(
            "Stated: the algorithm (Algorithm 1, Eq. 1 to 4), both likelihoods (Eq. 6), 500 particles, the "
            "detection sphere (Eq. 5) with heights and radii, the densities, readings every 50 ms, and 100 mm/s "
            "and the stops of the real robot.",
            f"Chosen, because the paper does not say: motion noise {1e3 * translation_m_s:g} mm/s and "
            f"{rotation_rad_s:g} rad/s; σ of Eq. 6 equal to the radius of the read disc on the floor (9.0 mm for "
            "the 96 readers, 30 mm for the 8) and horizontal distances in it; β = 1; α = 0.01 on the geometric "
            "mean likelihood of a detection of the particle drawn as parent; a circle of radius "
            f"{1e3 * setting.CIRCLE_RADIUS_M:g} mm at 100 mm/s for {setting.DURATION_S:g} s, its centre anywhere "
            "against the lattice; a start that is known. These were chosen so that Tables 2 and 4 come out: "
            "they show that one plausible setting gives the paper's numbers, not that it is the authors'.",
            "Assumed: the reader coordinates of all four arrays. The figures that show them are lost from the "
            "copy at hand; they are reconstructed from the text.",
            "The true path follows the circle exactly and the odometry errs by the noise of Eq. 1; in the paper "
            "the true motion errs and the filter knows the command. For the filter, whose particles carry the "
            "same noise, the two are the same in distribution.",
            "Mean, maximum and variance are of the absolute error within a trial of 60 s, then averaged over "
            "trials. Largest errors at 25 and 16 tags/m² are single events and grow with the length of a trial, "
            "which the paper does not state.",
        ),
    )


def _not_reproduced() -> Section:
    return Section(
        heading="What does not come out",
        paragraphs=(
            "Table 3 from a start that is known rightly: without re-initialisation the filter is as good as "
            "with it.",
            "The heading of the combination, which the paper prints as worse than the Gaussian's at 400 and 100 "
            "tags/m²: here it is better on the same drives.",
            "Table 4's errors in x, larger than those in y: a circle on which the robot takes every heading knows "
            "neither axis. A route that prefers an axis would, but the paper's is lost.",
            "16 tags/m² a little better than 25: here they are worse. The authors put that down to their routes.",
            "Largest errors at 25 and 16 tags/m²: single events, of a run whose length is not stated.",
            "The real robot's heading, and its 96 readers at 100 tags/m²: with the placement error that the "
            "eight readers ask for, the 96 lose themselves, because it exceeds their read radius of 9 mm; no "
            "error of the surveyed heading is in the model.",
            "That 15 mm is a better height than 20 mm: the sphere of Eq. 5 says the contrary, by a little.",
        ),
    )


def _simulated(results: Results, table: str, heading: str) -> Section:
    means = results.simulated(table, "mean")
    known = [item for item in means if item.ours is not None]
    return Section(
        heading=heading,
        paragraphs=(
            f"With re-initialisation. {sum(item.within(1.5) for item in known)} of {len(known)} means within a "
            f"factor of 1.5 of the paper, {sum(item.within(2.0) for item in known)} within 2.",
        ),
        parts=(
            *figures.ratio_pictures(f"ratios_table_{table}", means),
            *(
                comparison_table(
                    f"Table {table}, {STATISTIC_WORDS[statistic]}", ROW_HEAD, results.simulated(table, statistic)
                )
                for statistic in STATISTICS
            ),
        ),
    )


def _third(results: Results) -> Section:
    x_m, y_m, heading_rad = setting.WRONG_START
    row = ("likelihood", "motion noise", "frame", "re-initialisation")
    return Section(
        heading="Table 3: without re-initialisation",
        paragraphs=(
            "From a start that is known rightly, leaving re-initialisation out changes little at 100 tags/m²: "
            "the last table. The paper's numbers come out if every particle starts on one wrong pose, "
            f"{1e3 * x_m:g} mm, {1e3 * y_m:g} mm and {heading_rad:g} rad off: these are about the printed "
            "largest errors, so ours are the same by construction and only means and variances are a test. With "
            f"{next(iter(NOISES))} the filter finds back as slowly as the paper's; with the noise of Tables 2 "
            "and 4 it is quicker.",
            "Eq. 1 adds the velocity in the floor frame, so a particle that is wrong about its heading still "
            "goes where the robot goes, and its error stays. Wheels measure in the robot's frame: there the "
            "particles of a wrong heading drive off and the filter is lost (frame “robot”). The robot keeps the "
            "heading 0 on its circle here, which makes the two comparable.",
            "That both likelihoods print nearly the same is explained too: the way back from the wrong start "
            "dominates.",
        ),
        parts=(
            *(
                comparison_table(
                    f"Table 3, {STATISTIC_WORDS[statistic]}, wrong start, odometry in the floor frame",
                    row[:2],
                    [
                        replace(item, row=item.row[:2])
                        for item in results.third(statistic)
                        if item.row[2:] == (FRAMES[0], "without")
                    ],
                )
                for statistic in STATISTICS
            ),
            comparison_table(
                "Mean error from the wrong start with every choice", row, results.third("mean"), with_paper=False
            ),
            comparison_table(
                "The same with the start known rightly: mean error, combination, 30 mm/s and 0.05 rad/s",
                ("re-initialisation",),
                results.right_start(),
                with_paper=False,
            ),
        ),
    )


def _claims(results: Results) -> Section:
    return Section(
        heading="What the paper concludes",
        paragraphs=(
            "Each line compares two cells on the same drives. A ratio below 1 favours the first; it is decided "
            "where its 95 % interval leaves out 1 (one line in twenty would be by chance).",
        ),
        parts=(
            _ratio_table(
                "Mean errors: combination over Gaussian", results.combination_over_gaussian(), with_what=False
            ),
            _ratio_table("Mean errors: densities and arrays, combination", results.claims()),
        ),
    )


def _arrays(results: Results) -> Section:
    return Section(
        heading="The arrays of 24 and 20 readers",
        paragraphs=(
            "The paper built them and prints no numbers. Antennas of 60 mm hang at 24 mm as those of the eight; "
            "that height is assumed.",
        ),
        parts=(
            comparison_table("Mean error of all four arrays", ROW_HEAD, results.arrays("mean"), with_paper=False),
            comparison_table(
                "Largest error of all four arrays", ROW_HEAD, results.arrays("max"), with_paper=False
            ),
        ),
    )


def _open_choices(results: Results) -> Section:
    changes = results.changes()
    places = list(dict.fromkeys(item.where for item in changes))
    rows = []
    for what in dict.fromkeys(item.what for item in changes):
        for column, axis in _AXES.items():
            own = {item.where: item.ratio for item in changes if item.what == what and item.column == column}
            rows.append((what, axis, *(ratio_text(own[place]) if place in own else "–" for place in places)))
    return Section(
        heading="What each open choice does",
        paragraphs=(
            "One choice is made otherwise at a time; the ratio is of mean errors with the change to those "
            "without, combination likelihood, on the same random numbers.",
        ),
        parts=(
            Table(
                caption="Mean error with the change over that without",
                head=("change", "axis", *places),
                rows=tuple(rows),
                words=2,
            ),
        ),
    )


def _reach() -> Section:
    antenna = setting.mount(8).antenna
    heights_mm = (0, 10, 15, 20, 24, 30, 40, 50, 60)
    radii = tuple(f"{1e3 * antenna.read_radius_m(1e-3 * height):.1f}" for height in heights_mm)
    return Section(
        heading="Detection and antenna height (Fig. 8 to 10)",
        paragraphs=(
            "The measured curves of Fig. 9 and 10 are lost from the copy at hand. Their text says that a tag "
            "within range is read almost always and one outside almost never, at 15 and at 20 mm: the model "
            "reads all or none. It also says that 15 mm was chosen for its better success rate; the sphere of "
            "Eq. 5 gives a slightly larger disc at 20 mm (29.7 mm) than at 15 mm (28.6 mm), so that preference "
            "is not in the model.",
        ),
        parts=(
            figures.reach_picture(),
            Table(
                caption="60 mm antenna: radius of the read disc by height of the antenna, mm",
                head=("height", *(str(height) for height in heights_mm)),
                rows=(("radius", *radii),),
            ),
        ),
    )


def _speeds(results: Results, streams: Streams) -> Section:
    picture = figures.speed_picture(results)
    ratios = []
    for kind, words in (("time", "by the clock"), ("way", "by the way")):
        for likelihood in setting.LIKELIHOODS:
            found = dict(results.speeds(kind, likelihood, "position_error_mean"))
            cells = [
                with_interval(scaled(found[speed], 1e3, unit="mm"), 2) if speed in found else "–"
                for speed in SPEEDS_M_S
            ]
            ratios.append((f"noise {words}", likelihood, *cells))
    return Section(
        heading="Speed and paths (Fig. 14 and 15)",
        paragraphs=(
            "The paper sees no loss of accuracy up to 350 mm/s and sometimes a gain, and explains it by motor "
            "noise that has less time to act. Two meanings of the noise are compared: Eq. 1 adds it by the "
            "clock, wheels add it by the way.",
        ),
        parts=(
            *((picture,) if picture is not None else ()),
            Table(
                caption="Mean position error, mm, by speed in mm/s",
                head=("noise", "likelihood", *(f"{1e3 * speed:g}" for speed in SPEEDS_M_S)),
                rows=tuple(ratios),
                words=2,
            ),
            figures.path_picture(streams),
        ),
    )


def _ratio_table(caption: str, ratios: Sequence[Ratio], *, with_what: bool = True) -> Table:
    """Return a row for each comparison, a ratio and its verdict for each axis."""
    rows: dict[tuple[str, ...], dict[str, Ratio]] = {}
    for item in ratios:
        rows.setdefault((item.what, item.where) if with_what else (item.where,), {})[item.column] = item
    body = [
        (
            *labels,
            *(text for column in _AXES for text in (ratio_text(own[column].ratio), decided(own[column].ratio))),
        )
        for labels, own in rows.items()
    ]
    head = (*(("first / second",) if with_what else ()), "where")
    columns = tuple(text for axis in _AXES.values() for text in (axis, f"{axis}: first has"))
    return Table(caption=caption, head=(*head, *columns), rows=tuple(body), words=len(head))
