"""Trials of mi2016 beside its tables: comparisons, ratios between settings, and the answer in words."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from layoutopt.protocols import Group
from layoutopt.scores import Score, TrialOutcomes
from studies.cells import Cell
from studies.published import mi2016_cells as cells
from studies.published.comparison import Compared, half_width, paired_ratio, score_of, with_interval
from studies.published.mi2016_cells import PROBED, Effort
from studies.published.mi2016_printed import QUANTITIES, REAL, SIMULATED, TABLE_3, Row
from studies.published.mi2016_real import Fit, predicted_cells, spread_cells

MEAN_COLUMNS: Final = tuple(quantity.column for quantity in QUANTITIES["mean"])


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratio:
    """How a quantity changes between two groups that met the same random numbers."""

    what: str
    where: str
    column: str
    ratio: Score


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """Everything that the trials gave."""

    effort: Effort
    seed: int
    known: Mapping[Group, TrialOutcomes]
    fit: Fit | None
    failures: Mapping[Group, str]

    @property
    def trials(self) -> int:
        """Number of all trials."""
        return sum(len(table) for table in self.known.values())

    def simulated(self, table: str, statistic: str) -> list[Compared]:
        """Return Table 2 or 4 beside ours."""
        own = cells.table_cells(self.effort)
        return [
            item
            for row in SIMULATED[table]
            for item in self._row(table, row, statistic, own[row.readers, row.tags_per_m2, row.likelihood])
        ]

    def arrays(self, statistic: str) -> list[Compared]:
        """Return all four arrays at all densities; the paper prints nothing for two of them."""
        found = []
        for (readers, tags, likelihood), cell in cells.table_cells(self.effort).items():
            outcomes = cell.outcomes(self.known)
            labels = (str(readers), str(tags), likelihood)
            found += [
                Compared(table="", row=labels, quantity=quantity, printed=None, ours=score_of(outcomes, quantity))
                for quantity in QUANTITIES[statistic]
            ]
        return found

    def third(self, statistic: str) -> list[Compared]:
        """Return Table 3 beside ours under both noises and frames, without and with re-initialisation."""
        found = []
        for (likelihood, noise, frame, reinitialise), cell in cells.third_cells(self.effort).items():
            row = next(row for row in TABLE_3 if row.likelihood == likelihood)
            labels = (likelihood, noise, frame, "with" if reinitialise else "without")
            outcomes = cell.outcomes(self.known)
            for quantity, printed in zip(QUANTITIES[statistic], row.printed(statistic), strict=True):
                found.append(
                    Compared(
                        table="3",
                        row=labels,
                        quantity=quantity,
                        printed=None if reinitialise else printed,
                        ours=score_of(outcomes, quantity),
                    )
                )
        return found

    def right_start(self) -> list[Compared]:
        """Return Table 3's combination row beside ours from a start that is known rightly."""
        row = next(row for row in TABLE_3 if row.likelihood == "combination")
        found = []
        for reinitialise, cell in cells.right_start_cells(self.effort).items():
            outcomes = cell.outcomes(self.known)
            for quantity, printed in zip(QUANTITIES["mean"], row.mean, strict=True):
                found.append(
                    Compared(
                        table="3",
                        row=("with" if reinitialise else "without",),
                        quantity=quantity,
                        printed=printed,
                        ours=score_of(outcomes, quantity),
                    )
                )
        return found

    def real(self, statistic: str) -> list[Compared]:
        """Return Tables 5 and 6 beside the predictions; empty while there is no fit."""
        if self.fit is None:
            return []
        predicted = predicted_cells(self.fit, self.effort)
        return [
            item
            for table, rows in REAL.items()
            for row in rows
            for item in self._row(table, row, statistic, predicted[table, row])
        ]

    def spread(self) -> dict[float, list[Compared]]:
        """Return Tables 5 and 6 beside ours with other placement errors, m; empty while there is no fit."""
        found: dict[float, list[Compared]] = {}
        if self.fit is not None:
            for (sigma_m, table, row), cell in spread_cells(self.fit, self.effort).items():
                found.setdefault(sigma_m, []).extend(self._row(table, row, "mean", cell))
        return found

    def _row(self, table: str, row: Row, statistic: str, cell: Cell) -> list[Compared]:
        outcomes = cell.outcomes(self.known)
        return [
            Compared(
                table=table,
                row=row.labels,
                quantity=quantity,
                printed=printed,
                ours=score_of(outcomes, quantity),
            )
            for quantity, printed in zip(QUANTITIES[statistic], row.printed(statistic), strict=True)
        ]

    def mean_cells(self) -> list[Compared]:
        """Return the 48 means of Tables 2 and 4."""
        return [item for table in SIMULATED for item in self.simulated(table, "mean")]

    def changes(self) -> list[Ratio]:
        """Return what each open choice does to the three means, as a ratio to the unchanged setting."""
        own = cells.changed_cells(self.effort)
        found = []
        for name in cells.change_names():
            for readers, tags in PROBED:
                base = own[cells.unchanged(readers, tags)].outcomes(self.known)
                other = own[name, readers, tags].outcomes(self.known)
                if base is None or other is None:
                    continue
                found += [
                    Ratio(
                        what=name,
                        where=f"{readers} readers, {tags} tags/m²",
                        column=column,
                        ratio=paired_ratio(other, base, column),
                    )
                    for column in MEAN_COLUMNS
                ]
        return found

    def combination_over_gaussian(self) -> list[Ratio]:
        """Return the combination's means over the Gaussian's on the same drives."""
        own = cells.table_cells(self.effort)
        found = []
        for readers, tags, likelihood in own:
            first, second = (own[readers, tags, which] for which in ("combination", "gaussian"))
            above, below = first.outcomes(self.known), second.outcomes(self.known)
            if likelihood != "combination" or above is None or below is None:
                continue
            where = f"{readers} readers, {tags} tags/m²"
            found += [
                Ratio(
                    what="combination / Gaussian",
                    where=where,
                    column=column,
                    ratio=paired_ratio(above, below, column),
                )
                for column in MEAN_COLUMNS
            ]
        return found

    def between(self, what: str, first: cells.TableKey, second: cells.TableKey) -> Iterator[Ratio]:
        """Yield the means of one cell over those of another, if both are there."""
        own = cells.table_cells(self.effort)
        pair = (own[first].outcomes(self.known), own[second].outcomes(self.known))
        if pair[0] is not None and pair[1] is not None:
            for column in MEAN_COLUMNS:
                where = (
                    f"{first[0]} readers, {first[2]}"
                    if first[0] == second[0]
                    else f"{first[1]} tags/m², {first[2]}"
                )
                yield Ratio(what=what, where=where, column=column, ratio=paired_ratio(pair[0], pair[1], column))

    def claims(self) -> list[Ratio]:
        """Return the comparisons behind the paper's other claims, with the combination."""
        found: list[Ratio] = []
        for readers in (96, 8):
            for dense, sparse in ((400, 100), (100, 25), (16, 25)):
                found += self.between(
                    f"{dense} / {sparse} tags/m²",
                    (readers, dense, "combination"),
                    (readers, sparse, "combination"),
                )
        for tags in (400, 100, 25, 16):
            for few in (8, 20, 24):
                found += self.between(f"{few} / 96 readers", (few, tags, "combination"), (96, tags, "combination"))
        return found

    def speeds(self, kind: str, likelihood: str, column: str) -> list[tuple[float, Score]]:
        """Return a mean error by speed, m/s, for one meaning of the noise."""
        found = []
        for (speed_m_s, other, which), cell in cells.speed_cells(self.effort).items():
            outcomes = cell.outcomes(self.known)
            if (other, which) == (kind, likelihood) and outcomes is not None:
                found.append((speed_m_s, outcomes.score(column)))
        return found

    def summary(self) -> list[str]:
        """Return the answer in a few sentences."""
        means = [item for item in self.mean_cells() if item.ours is not None]
        lines = [
            f"Tables 2 and 4: of {len(means)} mean errors {_within(means, 1.5)} lie within a factor of 1.5 of the "
            f"printed ones and {_within(means, 2.0)} within 2."
        ]
        outside = [item for item in means if not item.within(1.5)]
        if outside:
            lines.append(f"Beyond 1.5: {'; '.join(_place(item) for item in outside)}.")
        third = [item for item in self.third("mean") if item.ours is not None and third_of_paper(item)]
        if third:
            lines.append(
                "Table 3 (no re-initialisation) comes out only from a start that is known wrongly: then "
                f"{_within(third, 1.5)} of {len(third)} means lie within 1.5."
            )
        if self.fit is not None:
            lines.append(self._prediction())
        return lines

    def _prediction(self) -> str:
        real = [item for item in self.real("mean") if item.ours is not None]
        held = [item for item in real if not fitted(item)]
        return (
            f"Real robot: faults fitted on two rows of Table 6; of the {len(held)} means of the other six rows "
            f"{_within(held, 1.5)} lie within 1.5 and {_within(held, 2.0)} within 2."
        )


def third_of_paper(item: Compared) -> bool:
    """Return whether a number of Table 3 comes from the setting that is compared with the paper."""
    return item.row[1:] == (next(iter(cells.NOISES)), cells.FRAMES[0], "without")


def fitted(item: Compared) -> bool:
    """Return whether a number of Tables 5 and 6 belongs to a row on which faults were fitted."""
    return item.table == "6" and item.row[2] == "combination"


def ratio_text(ratio: Score) -> str:
    """Return a ratio with its interval; whole numbers of hundredths."""
    return with_interval(ratio, 2)


def decided(ratio: Score) -> str:
    """Return what an interval of a ratio says: less, more, or not decided."""
    half = half_width(ratio)
    return "less" if ratio.value + half < 1.0 else "more" if ratio.value - half > 1.0 else "not decided"


def _within(items: Sequence[Compared], factor: float) -> int:
    return sum(item.within(factor) for item in items)


def _place(item: Compared) -> str:
    ratio = item.ratio
    shown = "" if ratio is None else f" {ratio.value:.2f}"
    readers, tags, likelihood = item.row
    return f"{item.quantity.heading} of {readers} readers, {tags} tags/m², {likelihood}{shown}"
