"""The numbers that mi2016 prints in Tables 2 to 6: mean, maximum and variance of the absolute error."""

from dataclasses import dataclass
from typing import Final

from studies.published.comparison import Quantity

STATISTICS: Final = ("mean", "max", "variance")
STATISTIC_WORDS: Final = {
    "mean": "mean error",
    "max": "largest error",
    "variance": "variance of the absolute error",
}
ROW_HEAD: Final = ("readers", "tags/m²", "likelihood")
"""What the labels of a row are."""
QUANTITIES: Final = {
    statistic: (
        Quantity(column=f"x_error_{statistic}", heading="x", unit=length, factor=factor),
        Quantity(column=f"y_error_{statistic}", heading="y", unit=length, factor=factor),
        Quantity(column=f"heading_error_{statistic}", heading="θ", unit=angle, factor=1e3),
    )
    for statistic, length, angle, factor in (
        ("mean", "mm", "mrad", 1e3),
        ("max", "mm", "mrad", 1e3),
        ("variance", "mm²", "10⁻³ rad²", 1e6),
    )
}
"""x, y and heading by statistic; the paper has radians with three decimals, shown here as milliradians."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One row of a table: (x mm, y mm, θ mrad) as mean and maximum, (mm², mm², 10⁻³ rad²) as variance.

    Variances of the heading are printed with three decimals of rad², so most of them are nought.
    """

    readers: int
    tags_per_m2: int
    likelihood: str
    mean: tuple[float, float, float]
    max: tuple[float, float, float]
    variance: tuple[float, float, float]

    @property
    def labels(self) -> tuple[str, str, str]:
        """Readers, tags a square metre and likelihood, for people."""
        return (str(self.readers), str(self.tags_per_m2), self.likelihood)

    def printed(self, statistic: str) -> tuple[float, float, float]:
        """Return the three numbers of a statistic."""
        return {"mean": self.mean, "max": self.max, "variance": self.variance}[statistic]


def _rows(readers: int, lines: str) -> tuple[Row, ...]:
    """Return rows from lines of: tags, likelihood, and x, y, θ of mean, maximum and variance, as printed."""
    found = []
    for line in lines.strip().splitlines():
        tags, likelihood, *numbers = line.split()
        x = [float(number) for number in numbers]
        found.append(
            Row(
                readers=readers,
                tags_per_m2=int(tags),
                likelihood=likelihood,
                mean=(x[0], x[1], round(1e3 * x[2])),
                max=(x[3], x[4], round(1e3 * x[5])),
                variance=(x[6], x[7], round(1e3 * x[8])),
            )
        )
    return tuple(found)


TABLE_2: Final = _rows(
    96,
    """
    400 gaussian    1.6 1.5 0.003   9.4  8.3 0.015  2.6  2.5 0.000
    400 combination 1.3 1.2 0.005   7.0  6.9 0.019  1.2  1.2 0.000
    100 gaussian    2.2 1.9 0.003   9.5  9.1 0.018  2.9  2.6 0.000
    100 combination 1.7 1.5 0.004   7.7  7.7 0.022  1.6  1.4 0.000
    25  gaussian    4.4 4.4 0.010  16.5 33.8 0.120  8.6 20.0 0.000
    25  combination 4.0 4.2 0.011  12.4 28.6 0.099  8.4 18.7 0.000
    16  gaussian    3.8 3.7 0.007  13.3 20.7 0.055  6.6  6.6 0.000
    16  combination 3.8 3.0 0.006  13.3 14.2 0.085  6.1  4.8 0.000
    """,
)
"""Simulation with 96 readers, with re-initialisation."""

TABLE_3: Final = _rows(
    96,
    """
    100 gaussian    21.6 21.3 0.490 169.6 153.3 1.494 737.8 750.6 0.211
    100 combination 21.8 21.5 0.504 163.3 152.3 1.515 717.6 719.6 0.201
    """,
)
"""Simulation with 96 readers, without re-initialisation."""

TABLE_4: Final = _rows(
    8,
    """
    400 gaussian    3.1 2.2 0.007 13.1  8.9 0.027  5.2  2.5 0.000
    400 combination 2.5 2.2 0.010 12.2 10.7 0.038  3.4  2.8 0.000
    100 gaussian    5.2 3.1 0.012 22.3 13.9 0.127 16.7  5.0 0.000
    100 combination 4.4 3.1 0.014 18.3 16.1 0.086 14.3  6.8 0.000
    25  gaussian    7.4 5.9 0.022 23.5 28.3 0.075 23.1 21.7 0.000
    25  combination 6.7 5.3 0.020 39.7 32.7 0.089 33.1 22.8 0.000
    16  gaussian    6.7 5.0 0.015 24.8 21.9 0.055 26.0 14.3 0.000
    16  combination 6.2 4.9 0.019 31.3 50.1 0.120 22.9 23.8 0.000
    """,
)
"""Simulation with 8 readers, with re-initialisation."""

TABLE_5: Final = _rows(
    96,
    """
    100 gaussian    14.2 22.3 0.030   37.5  44.4 0.068   98.7 128.8 0.000
    100 combination  8.2 23.8 0.032   30.4  43.0 0.084   59.0  93.1 0.000
    16  gaussian    26.2 18.0 0.107 1867.3 562.4 0.402 4331.3 601.2 0.009
    16  combination 17.7 13.5 0.061 2699.0 820.2 0.248 7075.5 731.1 0.002
    """,
)
"""Real robot with 96 readers."""

TABLE_6: Final = _rows(
    8,
    """
    100 gaussian     5.7 24.3 0.020 18.1 40.0 0.053  13.2 39.2 0.000
    100 combination  4.7 22.8 0.019 16.8 38.3 0.075  11.3 52.1 0.000
    16  gaussian    33.3 12.9 0.056 88.3 40.0 0.105 502.8 84.0 0.001
    16  combination 13.0  8.7 0.046 94.0 42.5 0.097 249.2 57.9 0.001
    """,
)
"""Real robot with 8 readers."""

SIMULATED: Final = {"2": TABLE_2, "4": TABLE_4}
REAL: Final = {"5": TABLE_5, "6": TABLE_6}
