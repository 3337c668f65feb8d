"""How values of the domain show themselves in a notebook, without knowing how pictures are drawn.

The pictures are made far above, in `layoutopt.notebook`, which knows plots. It is loaded by its name when
somebody asks, as `layoutopt.registry` loads extensions, so that imports go on pointing down.
"""

import importlib


class Shown:
    """A value that a notebook shows as a table with a picture."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        """Return a piece of HTML that stands by itself."""
        html: str = importlib.import_module("layoutopt.notebook").html_of(self)
        return html
