"""Sizes of texts follow from the font alone, whatever was drawn before."""

import io

from layoutopt.drawings import lettering
from layoutopt.plots.figures import new_figure


def outline(character):
    return lettering._outline(character)


def test_a_turned_text_in_a_figure_changes_no_size():
    """A figure with a text at an angle, drawn with the same font, leaves every outline as it was."""
    before = {character: outline(character) for character in "AMgj|0"}
    figure = new_figure(80.0, 60.0)
    figure.text(0.5, 0.5, "turned AMgj|0", rotation=33.0, fontfamily="DejaVu Sans")
    figure.savefig(io.BytesIO(), format="png")
    assert {character: outline(character) for character in "AMgj|0"} == before
