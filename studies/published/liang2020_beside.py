"""What goes beyond liang2020 and what its open choices do: the last sections of its page."""

from layoutopt.scores import paired_difference
from studies.page import Section
from studies.published.comparison import with_interval
from studies.published.liang2020_cells import (
    BASE_PLACE,
    HEADING_SIGMA_M,
    PAPERS,
    Place,
    open_choices,
    variants,
)
from studies.published.liang2020_orderings import GOAL, Found
from studies.published.liang2020_printed import APPROACHES, TABLE_5
from studies.published.liang2020_tables import HEAD, error_cells, table_of
from studies.published.medians import median


def beside_section(found: Found) -> Section:
    """Return what several aliases, a smaller random step and a heading gain on the same walks."""
    names = list(variants())
    rows = []
    for speed in TABLE_5:
        base = found.get(("beside", f"{speed:g}", PAPERS))
        for name in names:
            table = found.get(("beside", f"{speed:g}", name))
            if base is None or table is None:
                continue
            gain = "–"
            if name != PAPERS:
                gain = with_interval(paired_difference(base, table, GOAL), 3)
                gain += f"; median {median(base.column(GOAL) - table.column(GOAL)).text}"
            rows.append((f"{speed:g}", name, error_cells(None, table)[1], gain))
    if not rows:
        return Section(heading="Beside the paper's")
    return Section(
        heading="Beside the paper's: several aliases, and a heading",
        paragraphs=(
            "Three aliases allow for three quarters of a wavelength between samples. With a heading, "
            "particles carry a direction and a speed that change slowly, and "
            f"{100.0 * HEADING_SIGMA_M:g} cm of random step on top. Some of its gain needs no heading, only a "
            "smaller random step: hence the rows with σ = 0.4 m a sample. Gains are differences on the same "
            "walks: positive is better than the paper's method.",
            "uhf_laser_heading is the tracker of that name: heading and three aliases, a tenth of the particles "
            "put to the matched clusters at each sample so that the filter does not follow a wrong one for long, "
            "and particles that walk on where nothing is heard.",
        ),
        parts=table_of(
            "Error, and gain on the paper's method, m",
            ("speed, m/s", "method", HEAD[1], "gain: mean, and median (95 % interval)"),
            rows,
            words=2,
        ),
    )


def open_section(found: Found) -> Section:
    """Return the errors with one open choice changed at a time."""
    columns = (*APPROACHES, "right")
    base: dict[str, Place] = {name: ("1", BASE_PLACE[1], name) for name in APPROACHES}
    base["right"] = ("2", "right", "fused")
    rows = []
    for name in ("as chosen", *open_choices()):
        places = [base[column] if name == "as chosen" else ("open", name, column) for column in columns]
        if all(place in found for place in places):
            rows.append((name, *(error_cells(None, found[place])[1] for place in places)))
    if len(rows) < 2:
        return Section(heading="What the open choices do")
    return Section(
        heading="What the open choices do",
        paragraphs=("One change at a time, the same walks.",),
        parts=table_of(
            "Error, m: median (95 % interval)", ("choice", *APPROACHES, "fused, right antenna alone"), rows
        ),
    )
