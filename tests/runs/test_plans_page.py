"""The whole example of docs/plans.md is what happens."""

import re
from pathlib import Path

import pytest

import layoutopt
from layoutopt.spec.reading import read_spec
from studies.effort import describe

PAGE = (Path(layoutopt.__file__).parent.parent / "docs" / "plans.md").read_text(encoding="utf-8")


def _first(language):
    return re.search(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)[1]


@pytest.fixture
def office(tmp_path):
    """The spec of the page, with its plan beside it."""
    (tmp_path / "office.geojson").write_text(_first("json"), encoding="utf-8")
    (tmp_path / "office.toml").write_text(_first("toml"), encoding="utf-8")
    return tmp_path / "office.toml"


def test_the_example_says_what_the_page_shows(office):
    """Every line of the block but the command's own comes from plan and spec, in that order."""
    told = iter(describe(read_spec(office)))
    shown = [line for line in _first("console").splitlines() if not line.startswith(("$", "...", "picture"))]
    assert len(shown) > 6
    for line in shown:
        assert line in told, line


def test_a_bare_number_is_in_si(office):
    """Metres, seconds, metres per second, euro and shares: as the page says, each as if it had its unit."""
    with_units = office.read_text(encoding="utf-8").replace(
        "[[0, 0], [1.5, 0]", '[["0 m", "0 m"], ["1500 mm", "0 m"]'
    )
    bare = with_units.replace('"20 mm"', "0.02\nbudget = 3000").replace("count = 2", "count = 2\nspeed = 0.25")
    bare += "[study]\nduration = 45\nleast_difference = 0.25\n"
    office.write_text(bare, encoding="utf-8")
    spec = read_spec(office)
    assert (spec.target_error_m, spec.budget_eur, spec.robot.speed_m_s) == (0.02, 3000.0, 0.25)
    assert (spec.study.duration_s, spec.study.least_difference) == (45.0, 0.25)
    assert spec.site.zone("dock").region.bounds == (0.0, 0.0, 1.5, 1.5)
