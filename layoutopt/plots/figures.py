"""What all figures share: size, ink, logarithmic axes, and files that are the same byte for byte every time."""

import math
import re
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from hashlib import sha256
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Final

from layoutopt.atomic_file import replacing

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    Drawn = Axes | Figure

INK: Final = "#1b1c1e"
"""Lines and text; in a figure for a page it follows the page's own text colour."""
PAPER: Final = "#fefefd"
"""Behind lines and text, and inside open marks; in a figure for a page it follows the page's background."""
FAINT: Final = "#85898f"
"""Grey that shows on white and on black."""
SERIES: Final = ("#0072b2", "#d55e00", "#009e73", "#b8608f", "#7d45d8", "#3f9fd0")
"""Colours of Okabe and Ito, those too light for white paper darkened, and a violet for their yellow, which
darkened is nearly the vermilion to eyes without red or green cones. Told apart in every colour vision."""
DASHES: Final = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (7, 2, 1.5, 2)), (0, (4, 1, 1, 1, 1, 1)), (0, (1, 2)))
MARKERS: Final = ("o", "s", "^", "v", "P", "X")
HATCHES: Final = ("", "///", "\\\\\\", "...", "xxx", "---")
"""Of areas, which in grey are as alike as lines are: their series are told apart by dashes, marks and hatches."""
TEXT_PT: Final = 8.0
SMALL_PT: Final = 7.0
MAX_VECTOR_POINTS: Final = 5000
"""More points than this go into an SVG as a picture, which keeps files small and browsers quick."""
_PICTURE_DPI: Final = 200
_MM_PER_INCH: Final = 25.4
_POINTS_PER_INCH: Final = 72.0

_STYLE: Final = {
    "font.family": "DejaVu Sans",
    "font.size": TEXT_PT,
    "text.color": INK,
    "text.parse_math": False,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.facecolor": "none",
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": TEXT_PT,
    "axes.unicode_minus": True,
    "figure.facecolor": PAPER,
    "hatch.linewidth": 0.5,
    "lines.linewidth": 1.2,
    "lines.markersize": 5.0,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": SMALL_PT,
    "ytick.labelsize": SMALL_PT,
}


def new_figure(width_mm: float, height_mm: float) -> "Figure":
    """Return an empty figure of that size on paper."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with _style():
        figure = Figure(figsize=(width_mm / _MM_PER_INCH, height_mm / _MM_PER_INCH), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def new_axes(width_mm: float, height_mm: float) -> "Axes":
    """Return the only axes of a new figure of that size on paper."""
    return add_axes(new_figure(width_mm, height_mm))


def add_axes(
    figure: "Figure", *place: object, share_x: "Axes | None" = None, projection: str | None = None
) -> "Axes":
    """Return new axes in the common style; ``place`` and ``projection`` are what ``Figure.add_subplot`` takes."""
    with _style():
        return figure.add_subplot(*place, sharex=share_x, projection=projection)


def figure_of(drawn: "Artist") -> "Figure":
    """Return the whole figure that something was drawn into.

    Raises
    ------
    ValueError
        If it belongs to none any more.
    """
    figure = drawn.get_figure(root=True)
    if figure is None:
        raise ValueError("what was drawn belongs to no figure any more")
    return figure


def parent_of(ax: "Axes") -> "Figure | SubFigure":
    """Return the figure, or the part of one, that axes stand in.

    Raises
    ------
    ValueError
        If they stand in none any more.
    """
    parent = ax.get_figure()
    if parent is None:
        raise ValueError("the axes belong to no figure any more")
    return parent


def panel_axes(
    axes: "Sequence[Axes] | None", count: int, *, columns: int, width_mm: float, height_mm: float
) -> "list[Axes]":
    """Return axes for so many panels: those that were given, or those of a new figure in rows of ``columns``.

    Raises
    ------
    ValueError
        If others than ``count`` axes were given.
    """
    if axes is None:
        figure = new_figure(width_mm, height_mm)
        return [add_axes(figure, -(-count // columns), columns, number + 1) for number in range(count)]
    if len(axes) != count:
        raise ValueError(f"{len(axes)} axes for {count} panels; give one for each panel")
    return list(axes)


def legend_above(ax: "Axes", entries: "Sequence[tuple[Artist, str]]", *, columns: int) -> None:
    """Put a legend of these entries above axes, from the left."""
    ax.legend(
        [handle for handle, _ in entries],
        [words for _, words in entries],
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        frameon=False,
        fontsize=SMALL_PT,
        labelcolor=INK,
        columnspacing=1.2,
        handletextpad=0.5,
        borderaxespad=0.2,
    )


def legend_below(axes: "Sequence[Axes]", names: Sequence[str] = (), *, columns: int = 0) -> None:
    """Put one legend for axes of one figure below them; a name that stands in several is told once.

    A figure that the caller made has room for it if its layout is ``"constrained"``.

    Parameters
    ----------
    names
        Which names, in their order; by default all of them in the order of the axes.
    columns
        Names side by side; by default as many as the figure is wide.

    Raises
    ------
    ValueError
        If the axes belong to no figure any more.
    """
    shown = {text: handle for ax in axes for handle, text in zip(*ax.get_legend_handles_labels(), strict=True)}
    names = names or list(shown)
    figure = parent_of(axes[0])
    for side_by_side in [columns] if columns else range(len(names), 0, -1):
        legend = figure.legend(
            [shown[name] for name in names],
            names,
            loc="outside lower center",
            ncols=side_by_side,
            frameon=False,
            fontsize=SMALL_PT,
            labelcolor=INK,
            handlelength=2.6,
        )
        if legend.get_window_extent().width <= figure.bbox.width or side_by_side in (1, columns):
            return
        legend.remove()


def save(drawn: "Axes | Figure", path: Path) -> tuple[Path, Path]:
    """Write ``path`` (without suffix) as SVG and PNG and return both names.

    Neither file holds a date, a version or a random name, so the same figure gives the same bytes.
    """
    figure = figure_of(drawn)
    names = (path.with_name(path.name + ".svg"), path.with_name(path.name + ".png"))
    with replacing(names[0]) as temporary:
        temporary.write_text(_svg_text(figure), encoding="utf-8", newline="\n")
    engine = figure.get_layout_engine()
    # A second layout may differ from the first: both files, and what is drawn over the SVG, keep that of the SVG.
    figure.set_layout_engine("none")
    with replacing(names[1]) as temporary:
        figure.savefig(temporary, format="png", dpi=_PICTURE_DPI, metadata={"Software": None})
    figure.set_layout_engine(engine)
    return names


def as_svg(drawn: "Axes | Figure") -> str:
    """Return the figure as an ``<svg>`` element to be put into a page.

    Ink and paper become the style variables ``--ink`` and ``--paper`` of the page, so that one figure serves
    light and dark pages. Ids carry a prefix made of the content: figures on one page do not share them.
    """
    return inline_svg(_svg_text(figure_of(drawn)))


def inline_svg(text: str) -> str:
    """Return what `as_svg` returns, from the text of an SVG file that `save` wrote."""
    text = re.sub(r"<!--.*?-->", "", text[text.index("<svg") :], flags=re.DOTALL)
    prefix = f"f{sha256(text.encode()).hexdigest()[:8]}-"
    text = re.sub(r'(\bid="|url\(#|href="#)', lambda match: match[1] + prefix, text)
    for name, colour in (("ink", INK), ("paper", PAPER)):
        text = text.replace(colour, f"var(--{name}, {colour})")
    return text


@dataclass(frozen=True, slots=True, kw_only=True)
class SvgAxis:
    """An axis of a figure in the units of its SVG: the value ``low`` lies at ``start``, ``high`` at ``end``."""

    low: float
    high: float
    start: float
    end: float
    logarithmic: bool

    def place(self, value: float) -> float:
        """Return where a value lies."""
        scale = math.log if self.logarithmic else float
        share = (scale(value) - scale(self.low)) / (scale(self.high) - scale(self.low))
        return self.start + share * (self.end - self.start)


@dataclass(frozen=True, slots=True, kw_only=True)
class SvgFrame:
    """Where the axes of a figure lie in its SVG, for what a page draws over it; y grows downwards."""

    x: SvgAxis
    y: SvgAxis


def svg_frame(ax: "Axes") -> SvgFrame:
    """Return where axes lie in the SVG of their figure.

    Call it right after `save` or `as_svg`: every drawing may lay the axes out anew.
    """
    figure = figure_of(ax)
    # The SVG's unit is a point, counted from the upper left corner.
    points = _POINTS_PER_INCH / figure.dpi
    height = figure.get_figheight() * _POINTS_PER_INCH
    (left, bottom), (right, top) = (ax.transAxes.transform([(0.0, 0.0), (1.0, 1.0)]) * points).tolist()
    x_low, x_high = (float(end) for end in ax.get_xlim())
    y_low, y_high = (float(end) for end in ax.get_ylim())
    return SvgFrame(
        x=SvgAxis(low=x_low, high=x_high, start=left, end=right, logarithmic=ax.get_xscale() == "log"),
        y=SvgAxis(
            low=y_low, high=y_high, start=height - bottom, end=height - top, logarithmic=ax.get_yscale() == "log"
        ),
    )


def rasterised(count: int) -> bool:
    """Return whether that many points are drawn as a picture inside an SVG."""
    return count > MAX_VECTOR_POINTS


def spans_decade(values: Sequence[float]) -> bool:
    """Return whether positive values reach over more than a factor of ten, which asks for a logarithmic axis."""
    return len(values) > 0 and min(values) > 0.0 and max(values) > 10.0 * min(values)


def label_log_axis(
    ax: "Axes", *, x: bool = False, y: bool = False, marks: Sequence[float] = (1.0, 2.0, 5.0)
) -> None:
    """Make an axis logarithmic, with plain numbers at 1, 2 and 5 of each decade, or at other marks."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for wanted, axis, set_scale in ((x, ax.xaxis, ax.set_xscale), (y, ax.yaxis, ax.set_yscale)):
        if wanted:
            set_scale("log", nonpositive="clip")
            axis.set_major_locator(LogLocator(base=10.0, subs=marks, numticks=30))
            axis.set_major_formatter(FuncFormatter(lambda value, _: grouped(value)))
            axis.set_minor_formatter(NullFormatter())


def grouped(value: float) -> str:
    """Return a number with thin spaces between thousands.

    >>> grouped(12500.0).replace(chr(0x2009), "_"), grouped(0.5)
    ('12_500', '0.5')
    """
    return f"{value:,.0f}".replace(",", "\u2009") if abs(value) >= 1000.0 else f"{value:g}"


def _style() -> AbstractContextManager[None]:
    import matplotlib

    return matplotlib.rc_context(_STYLE)  # type: ignore[arg-type]


def _svg_text(figure: "Figure") -> str:
    import matplotlib

    buffer = StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "layoutopt", "svg.fonttype": "path"}):
        figure.savefig(
            buffer,
            format="svg",
            dpi=_PICTURE_DPI,
            metadata={"Date": None, "Creator": None, "Format": None, "Type": None},
        )
    return re.sub(r"[ \t]+\n", "\n", buffer.getvalue())
