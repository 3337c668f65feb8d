"""The tables of the mi2016 study for programs."""

from dataclasses import replace
from typing import Final

from studies.page import Data
from studies.published import mi2016_setting as setting
from studies.published.comparison import comparison_data
from studies.published.mi2016_printed import STATISTICS
from studies.published.mi2016_results import Results

_ROW: Final = ("readers", "tags_per_m2", "likelihood")


def data_of(results: Results) -> tuple[Data, ...]:
    """Return every number of the page in long form."""
    simulated = [item for table in ("2", "4") for kind in STATISTICS for item in results.simulated(table, kind)]
    third = [item for kind in STATISTICS for item in results.third(kind)]
    real = [item for kind in STATISTICS for item in results.real(kind)]
    spread = [
        replace(item, row=(f"{sigma_m:g}", *item.row)) for sigma_m, own in results.spread().items() for item in own
    ]
    arrays = [item for kind in STATISTICS for item in results.arrays(kind)]
    ratios = [*results.combination_over_gaussian(), *results.claims(), *results.changes()]
    speeds = [
        (kind, likelihood, f"{speed:g}", f"{score.value:.9g}", f"{score.standard_error:.9g}", str(score.count))
        for kind in ("time", "way")
        for likelihood in setting.LIKELIHOODS
        for speed, score in results.speeds(kind, likelihood, "position_error_mean")
    ]
    return (
        comparison_data("tables_2_and_4", _ROW, simulated),
        comparison_data("table_3", ("likelihood", "motion_noise", "odometry_frame", "reinitialisation"), third),
        comparison_data("tables_5_and_6", _ROW, real),
        comparison_data("tables_5_and_6_by_placement_error", ("tag_placement_sigma_m", *_ROW), spread),
        comparison_data("arrays", _ROW, arrays),
        Data(
            name="ratios",
            head=("what", "where", "quantity", "ratio", "ratio_se", "trials"),
            rows=tuple(
                (
                    item.what,
                    item.where,
                    item.column,
                    f"{item.ratio.value:.9g}",
                    f"{item.ratio.standard_error:.9g}",
                    str(item.ratio.count),
                )
                for item in ratios
            ),
        ),
        Data(
            name="speeds",
            head=(
                "noise",
                "likelihood",
                "speed_m_s",
                "position_error_mean_m",
                "position_error_mean_se_m",
                "trials",
            ),
            rows=tuple(speeds),
        ),
    )
