"""Finds the figures of the examples in ``docs/examples`` for the gallery of the site."""

from typing import Any, Final

from matplotlib.artist import Artist
from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

_DPI: Final = 144
_shown: Final[dict[int, Figure]] = {}
"""Figures by their identity; they are kept, so that no other one gets the identity of a lost one."""


def draw_figures(block: tuple[Any, ...], block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Save the figures to which a part of an example gave a name, and return what shows them.

    Figures of layoutopt are no figures of pyplot, where the gallery itself would look for them.
    """
    paths = []
    for value in block_vars["example_globals"].values():
        figure = value.get_figure() if isinstance(value, Artist) and not isinstance(value, Figure) else value
        if isinstance(figure, Figure) and id(figure) not in _shown:
            _shown[id(figure)] = figure
            paths.append(next(block_vars["image_path_iterator"]))
            figure.savefig(paths[-1], dpi=_DPI)
    return figure_rst(paths, gallery_conf["src_dir"])
