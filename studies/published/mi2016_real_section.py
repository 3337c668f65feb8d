"""The part of the mi2016 page on the real robot: what was fitted, what is predicted, what hangs on it."""

from studies.page import Section, Table
from studies.published import mi2016_figures as figures
from studies.published.comparison import comparison_table
from studies.published.mi2016_printed import ROW_HEAD, STATISTIC_WORDS, STATISTICS
from studies.published.mi2016_real import Fit
from studies.published.mi2016_results import Results, fitted


def real_section(results: Results) -> Section:
    """Return the fit, the fitted rows, the predicted rows and what other placement errors would give."""
    if results.fit is None:
        return Section(
            heading="Tables 5 and 6: the real robot", paragraphs=("Not judged: trials of the fit failed.",)
        )
    means = results.real("mean")
    held = [item for item in means if not fitted(item)]
    return Section(
        heading="Tables 5 and 6: the real robot",
        paragraphs=(
            "Eight points, 20 s at each, heading along the lattice, judged at rest; eight readers at 15 mm, 96 "
            "at 20 mm (not stated). The points of Fig. 13 are lost. What goes wrong is fitted: a placement "
            "error of each tag and a share of scans that bring nothing, common to both carpets, and for each "
            "carpet a common offset and whether the points lie over tags or anywhere.",
            "The fit uses two rows of Table 6, the combination at 100 and at 16 tags/m²: the paper's own "
            "proposal, one row a carpet, without a lost robot. They were chosen before any trial was run. Ten "
            "numbers (means, and standard deviations in x and y) fix eight choices, so the fitted rows are no "
            "test; the other six rows are predicted, four of them for another array.",
            "One thing was corrected after a first fit had been seen: points “over tags” stand over the tags as "
            "they truly lie, not as planned, so that an offset is one of the surveyed points against the carpet.",
            *_fit_words(results.fit),
        ),
        parts=(
            *figures.ratio_pictures("ratios_real", means),
            comparison_table("Fitted rows: mean error", ROW_HEAD, [item for item in means if fitted(item)]),
            comparison_table("Predicted rows: mean error", ROW_HEAD, held),
            *(
                comparison_table(f"All rows: {STATISTIC_WORDS[statistic]}", ROW_HEAD, results.real(statistic))
                for statistic in STATISTICS[1:]
            ),
            *_spread_tables(results),
        ),
    )


def _spread_tables(results: Results) -> tuple[Table, ...]:
    """Return the predictions with other placement errors: how much hangs on this one number."""
    found = []
    for sigma_m, items in results.spread().items():
        known = [item for item in items if item.ours is not None]
        counts = [sum(item.within(factor) for item in known) for factor in (1.5, 2.0)]
        found.append(
            comparison_table(
                f"After the fact, no prediction: tags {1e3 * sigma_m:g} mm off, the rest as fitted. Mean error; "
                f"{counts[0]} of {len(known)} within 1.5, {counts[1]} within 2",
                ROW_HEAD,
                items,
            )
        )
    return tuple(found)


def _fit_words(fit: Fit) -> tuple[str, ...]:
    carpets = "; ".join(
        f"{tags} tags/m²: points {carpet.place}, all tags {1e3 * carpet.offset_m[0]:g} mm off in x and "
        f"{1e3 * carpet.offset_m[1]:g} mm in y"
        for tags, carpet in fit.carpets.items()
    )
    return (
        f"Found: tags {1e3 * fit.common.sigma_m:g} mm off on each axis (standard deviation), "
        f"{fit.common.missed:.0%} of the scans missed; {carpets}. Root mean square of the logarithms of ours over "
        f"printed on the fitted rows: {fit.loss:.2f}. {fit.candidates} candidates were tried.",
    )
