"""The colours of figures and of the report's words are told apart in every common colour vision, and in grey."""

import re
from importlib import resources
from itertools import combinations

import numpy as np
import pytest

from layoutopt.plots.figures import SERIES

# Machado, Oliveira and Fernandes, IEEE Trans. Vis. Comput. Graph. 15(6), 2009, severity 1.0: linear to linear RGB.
VISIONS = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [(0.152286, 1.052583, -0.204868), (0.114503, 0.786281, 0.099216), (-0.003882, -0.048116, 1.051998)]
    ),
    "deuteranopia": np.array(
        [(0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881)]
    ),
    "tritanopia": np.array(
        [(1.255528, -0.076749, -0.178779), (-0.078411, 0.930809, 0.147602), (0.004733, 0.691367, 0.303900)]
    ),
}
TO_XYZ = np.array([(0.4124, 0.3576, 0.1805), (0.2126, 0.7152, 0.0722), (0.0193, 0.1192, 0.9505)])
LEAST = 10.0
"""CIELAB distance of marks that a reader has to keep apart; just noticeable side by side is about 2.3."""


def lab(colour, vision):
    """Return CIELAB (D65) of a colour ``#rrggbb`` as a colour vision sees it."""
    channels = np.array([int(colour[place : place + 2], 16) for place in (1, 3, 5)]) / 255.0
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    seen = TO_XYZ @ np.clip(VISIONS[vision] @ linear, 0.0, 1.0)
    ratio = seen / TO_XYZ.sum(axis=1)
    x, y, z = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


def distance(one, other, vision):
    return float(np.linalg.norm(lab(one, vision) - lab(other, vision)))


@pytest.mark.parametrize("vision", VISIONS)
def test_series_are_told_apart(vision):
    """Every two colours of the palette keep a distance, as each vision sees them."""
    apart = {pair: distance(*pair, vision) for pair in combinations(SERIES, 2)}
    assert min(apart.values()) >= LEAST, min(apart.items(), key=lambda item: item[1])


def test_vermilion_beside_darkened_yellow_does_not_pass():
    """The measure fails a pair that looks well apart to most eyes and is one colour without red or green cones."""
    pair = ("#d55e00", "#a07800")
    assert distance(*pair, "normal") > 30.0
    assert max(distance(*pair, "protanopia"), distance(*pair, "deuteranopia")) < LEAST


@pytest.mark.parametrize("vision", VISIONS)
@pytest.mark.parametrize("page", [0, 1])
def test_met_and_broken_are_told_apart_on_light_and_dark_pages(vision, page):
    """Verdicts and links have colours of their own on both kinds of page, besides their words and marks."""
    style = resources.files("studies").joinpath("style.css").read_text("utf-8")
    good, bad, link = (re.findall(rf"--{name}: (#[0-9a-f]{{6}})", style)[page] for name in ("good", "bad", "link"))
    assert distance(good, bad, vision) >= LEAST
    assert distance(link, bad, vision) >= LEAST
