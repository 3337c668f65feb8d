"""The tables of the extension points: every file has a row, every row resolves and carries a card."""

import ast
import importlib
import inspect
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

from layoutopt import registry
from layoutopt.errors import NotInstalled, UnknownName
from layoutopt.protocols import (
    AntennaCard,
    Card,
    EstimatorCard,
    ObjectiveCard,
    PatternCard,
    ReaderCard,
    SolverCard,
    StudyCard,
)

CARDS = {
    "patterns": PatternCard,
    "readers": ReaderCard,
    "antennas": AntennaCard,
    "estimators": EstimatorCard,
    "plans": Card,
    "objectives": ObjectiveCard,
    "solvers": SolverCard,
    "studies": StudyCard,
}
NO_EXTENSION = {
    "antennas": {"loop_field", "mi2016_antennas", "no_floor_reads"},
    "estimators": {
        "bearings",
        "compiled_run",
        "counter_normals",
        "crossing_velocity",
        "crossed_antennas",
        "crossings",
        "direction_of_arrival",
        "disc_filter",
        "disc_localisation",
        "evidence",
        "instant_centre",
        "laser_clusters",
        "likelihood",
        "particles",
        "phase_velocity",
        "reader_chord",
        "reader_place",
        "sensor_model",
        "step_by_step",
        "straight_legs",
        "targets",
        "uhf_laser_filter",
    },
    "objectives": {
        "blind_runs",
        "box_error",
        "corridors",
        "directions",
        "disc_outline",
        "gap_pieces",
        "half_gap",
        "outcome_means",
        "periodic_discs",
        "site_invisibility",
    },
    "patterns": {"checks", "sudoku_grid", "tiles"},
    "plans": {
        "drawing",
        "drawn_rooms",
        "floor",
        "grey_map",
        "inline",
        "joining",
        "outlines",
        "placing",
        "png",
        "rooms",
    },
    "readers": {"finders", "inventory", "mounting", "profiles"},
    "solvers": {
        "allocation",
        "antenna_slots",
        "borrowing",
        "candidates",
        "conflicts",
        "covering/bounds",
        "covering/integer",
        "covering/lattices",
        "covering/local_search",
        "covering/plain_search",
        "covering/problem",
        "covering/reduction",
        "covering/search",
        "covering/single_rows",
        "covering/surplus",
        "covering/windows",
        "demands",
        "placement",
        "placement_answer",
        "placement_budget",
        "placement_check",
        "placement_model",
        "placement_relaxation",
        "placement_stages",
        "epsilon_constraint",
        "exchange",
        "front",
        "front_measures",
        "front_membership",
        "halving",
        "information",
        "judging",
        "layout_difference",
        "pattern_search",
        "portfolio",
        "relaxation",
        "replayed",
        "robust",
        "run_off",
        "search_stages",
        "slots",
        "stop",
        "zone_terms",
        "zones",
    },
    "studies": {
        "as_built",
        "as_built_output",
        "snapping",
        "snapping_output",
        "against_reference_page",
        "against_reference_results",
        "against_reference_setting",
        "aliasing_page",
        "alternatives",
        "answers",
        "antenna_yaw_page",
        "antenna_yaw_results",
        "antenna_yaw_setting",
        "antenna_yaw_statistics",
        "antenna_yaw_words",
        "cells",
        "choices",
        "cited",
        "columns",
        "compiled",
        "dead_reckoning",
        "doctor",
        "effort",
        "estimator_page",
        "expand",
        "expand_output",
        "explain",
        "explain_limits",
        "explain_lines",
        "explain_variants",
        "finder_scores",
        "findings",
        "first_page",
        "fresh_drives",
        "fleet_size_page",
        "folder",
        "front_answer",
        "front_tables",
        "held_out",
        "hybrid_answer",
        "layout_cards",
        "local_error",
        "one_steps",
        "output",
        "page",
        "page_answer",
        "page_frame",
        "page_script",
        "page_words",
        "pairing",
        "pattern_goals",
        "pattern_page",
        "pattern_scores",
        "pattern_search_page",
        "pattern_setting",
        "pattern_verdict",
        "published/before_another",
        "published/comparison",
        "published/floor_frame",
        "published/han2006_page",
        "published/han2006_setting",
        "published/han2006_static",
        "published/kim2009_docking",
        "published/kim2009_maps",
        "published/kim2009_page",
        "published/kim2009_paths",
        "published/kim2009_printed",
        "published/kim2009_setting",
        "published/kim2010_page",
        "published/kim2010_setting",
        "published/liang2020_beside",
        "published/liang2020_cells",
        "published/liang2020_figures",
        "published/liang2020_orderings",
        "published/liang2020_page",
        "published/liang2020_printed",
        "published/liang2020_setting",
        "published/liang2020_tables",
        "published/liang2020_timing",
        "published/medians",
        "published/mi2016_cells",
        "published/mi2016_data",
        "published/mi2016_figures",
        "published/mi2016_page",
        "published/mi2016_printed",
        "published/mi2016_real",
        "published/mi2016_real_section",
        "published/mi2016_results",
        "published/mi2016_setting",
        "published/mi2016_tour",
        "published/one_by_one",
        "published/timed_noise",
        "race_plan",
        "reader_group_page",
        "reader_group_setting",
        "reader_group_verdicts",
        "recovery_page",
        "references",
        "repricing",
        "report",
        "report_rows",
        "report_words",
        "robustness_findings",
        "robustness_page",
        "robustness_picks",
        "robustness_words",
        "rewriting",
        "runner",
        "sampling_page",
        "sampling_setting",
        "sampling_words",
        "same_reads",
        "screening",
        "shards",
        "shortfall",
        "status",
        "summary",
        "swept",
        "swept_page",
        "trade_off",
        "tag_placement_page",
        "tag_placement_rivals",
        "tag_placement_sections",
        "tag_placement_setting",
        "tag_placement_words",
        "transponder_placement_page",
        "transponder_placement_race",
        "transponder_placement_results",
        "transponder_placement_setting",
        "transponder_placement_words",
        "what_if",
        "zones_candidates",
        "zones_closing",
        "zones_page",
        "zones_results",
        "zones_search",
        "zones_setting",
        "zones_validation",
    },
}
"""Modules that help the extensions of their package and are none themselves; kernels beside a twin are neither."""

EVERY_ROW = [(point, name) for point in registry.PACKAGES for name in registry.names(point)]


def folder(point):
    """Return the folder of an extension point."""
    return Path(importlib.import_module(registry.PACKAGES[point]).__file__).parent


def modules(point):
    """Return the names of the Python files on an extension point, and of its folders of extensions."""
    top = folder(point)
    files = {path.relative_to(top).with_suffix("").as_posix() for path in top.rglob("*.py")}
    return {name for name in files if not name.endswith(("__init__", "_kernels"))}


def rowed(point):
    """Return the modules that the table of an extension point names, as `modules` does."""
    package = registry.PACKAGES[point] + "."
    return {
        target.partition(":")[0].removeprefix(package).replace(".", "/")
        for target in registry.rows(point).values()
    }


def test_every_extension_point_has_a_card():
    """The points of the registry and the kinds of cards are the same list."""
    assert set(CARDS) == set(registry.PACKAGES)


@pytest.mark.parametrize("point", registry.PACKAGES)
def test_every_file_has_a_row(point):
    """A file on an extension point without a row is unreachable, unless it is listed as a helper."""
    assert modules(point) - rowed(point) - NO_EXTENSION.get(point, set()) == set()


@pytest.mark.parametrize("point", NO_EXTENSION)
def test_the_list_of_helpers_is_not_stale(point):
    """What is listed as a helper exists and has no row."""
    assert NO_EXTENSION[point] - modules(point) == set()
    assert NO_EXTENSION[point] & rowed(point) == set()


@pytest.mark.parametrize(("point", "name"), EVERY_ROW)
def test_every_row_resolves(point, name):
    """A row names a callable of its own package."""
    assert registry.rows(point)[name].startswith(registry.PACKAGES[point] + ".")
    assert callable(registry.load(point, name))


@pytest.mark.parametrize(("point", "name"), EVERY_ROW)
def test_every_row_has_a_card(point, name):
    """The card is of the point's kind and says what the extension does and where that comes from."""
    card = registry.card(point, name)
    assert isinstance(card, CARDS[point])
    assert card.summary.strip().endswith(".")
    assert len(card.summary) > 15
    assert len(card.reference.strip()) > 2


@pytest.mark.parametrize(("point", "name"), EVERY_ROW)
def test_every_row_is_documented(point, name):
    """What a user can name has a docstring of its own, not one that a dataclass made up."""
    target = registry.load(point, name)
    text = inspect.getdoc(target) or ""
    assert len(text) > 20
    assert not text.startswith(f"{target.__name__}(")


@pytest.mark.parametrize("point", registry.PACKAGES)
def test_names_are_unique_and_can_be_typed(point):
    """A name twice in a table would silently hide a row; names are words of small letters, in folders or not."""
    tree = ast.parse((folder(point) / "__init__.py").read_text(encoding="utf-8"))
    assigned = {node.target.id: node.value for node in tree.body if isinstance(node, ast.AnnAssign)}
    names = [key.value for key in assigned["ROWS"].keys]
    assert names == list(registry.names(point))
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z][a-z0-9_]*(/[a-z][a-z0-9_]*)?", name) for name in names)


@pytest.mark.parametrize("point", ["antennas", "estimators", "objectives", "solvers", "studies"])
def test_values_carry_the_card_of_their_module(point):
    """The class attribute ``card`` and the module's CARD are one object."""
    for name in registry.names(point):
        assert registry.load(point, name).card is registry.card(point, name)


def test_an_unknown_name_is_answered_with_the_nearest():
    """The message says where the name was read."""
    with pytest.raises(UnknownName, match=r"ward.toml:9: no pattern named 'sqare'. Did you mean 'square'"):
        registry.load("patterns", "sqare", place="ward.toml:9")


def test_a_package_that_hides_ours_is_found_out(monkeypatch):
    """A user's own objectives.py in the current folder is named instead of failing strangely."""
    stranger = ModuleType("objectives")
    stranger.__file__ = "/home/somebody/objectives.py"
    monkeypatch.setitem(sys.modules, "objectives", stranger)
    with pytest.raises(NotInstalled, match=r"hidden by /home/somebody/objectives\.py"):
        registry.rows("objectives")
