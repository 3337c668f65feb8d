"""layoutopt designs RFID positioning systems for indoor mobile robots.

Conventions: SI units inside, names carry their unit (``pitch_m``, ``angle_rad``, ``price_eur``); angles
counter-clockwise; robot frame after REP-103 (x forward, y left); floor frame with x right and y up. Arrays of
places have shape (n, 2), in metres.

The public names below are loaded when they are first used, so that ``import layoutopt`` costs nothing. From a spec
to the layout to build, in a quick look at a small hall:

>>> import layoutopt as lo
>>> spec = lo.read_spec(lo.built_in("small_hall"))
>>> findings = lo.solve(spec, quick=True)
>>> findings.result.status.value
'A layout meets every limit at the stated confidence on held-out drives.'
>>> layout = findings.result.recommended["cheapest"].layout
>>> layout.label
'ring 3 × 60 mm, square 300 mm'
>>> [violation.message for violation in lo.check(layout, spec.design)]
[]
>>> lo.bill_of_material(layout, layout.floor_tags.lay_on(spec.site), spec.robot_count, spec.prices).total_eur
985.88

``lo.draw(layout, spec, "drawings")`` writes sheets and tables, ``lo.write_layout(layout, spec, "layout.toml")``
the file that the command line reads. ``lo.score(layout, spec)`` judges a layout of one's own, and
``lo.study("cost_vs_accuracy", spec, "out")`` runs a study with report and figures. In a notebook, sites, layouts
and findings show themselves.
"""

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from layoutopt.errors import InvalidInput as InvalidInput
    from layoutopt.errors import LayoutoptError as LayoutoptError
    from layoutopt.feasibility import Violation as Violation
    from layoutopt.feasibility import check as check
    from layoutopt.layout import FloorTags as FloorTags
    from layoutopt.layout import Layout as Layout
    from layoutopt.layout import ReaderGroup as ReaderGroup
    from layoutopt.layout import ReaderProfile as ReaderProfile
    from layoutopt.layout import TagMap as TagMap
    from layoutopt.layout import TagPattern as TagPattern
    from layoutopt.layout import ZonePattern as ZonePattern
    from layoutopt.parts import bill_of_material as bill_of_material
    from layoutopt.prices import default_prices as default_prices
    from layoutopt.prices import read_prices as read_prices
    from layoutopt.problem import Limit as Limit
    from layoutopt.problem import Problem as Problem
    from layoutopt.protocols import Mount as Mount
    from layoutopt.questions import draw as draw
    from layoutopt.questions import explain as explain
    from layoutopt.questions import score as score
    from layoutopt.questions import solve as solve
    from layoutopt.questions import study as study
    from layoutopt.registry import load as load
    from layoutopt.registry import names as names
    from layoutopt.result import Front as Front
    from layoutopt.result import Result as Result
    from layoutopt.result import Status as Status
    from layoutopt.robot import Odometry as Odometry
    from layoutopt.robot import Robot as Robot
    from layoutopt.scenario import Faults as Faults
    from layoutopt.scenario import Routes as Routes
    from layoutopt.scenario import Scenario as Scenario
    from layoutopt.scores import Score as Score
    from layoutopt.scores import TrialOutcomes as TrialOutcomes
    from layoutopt.simulation.trials import run_trials as run_trials
    from layoutopt.site import Site as Site
    from layoutopt.site import Tiling as Tiling
    from layoutopt.site import Zone as Zone
    from layoutopt.spec.building import Spec as Spec
    from layoutopt.spec.layout_file import read_layout as read_layout
    from layoutopt.spec.layout_file import write_layout as write_layout
    from layoutopt.spec.reading import read_spec as read_spec
    from layoutopt.spec.template import built_in as built_in
    from layoutopt.spec.template import example_names as example_names
    from layoutopt.streams import Streams as Streams

__version__ = "0.1.0"

_HOMES: Final = {
    "Faults": "scenario",
    "FloorTags": "layout",
    "Front": "result",
    "InvalidInput": "errors",
    "Layout": "layout",
    "LayoutoptError": "errors",
    "Limit": "problem",
    "Mount": "protocols",
    "Odometry": "robot",
    "Problem": "problem",
    "ReaderGroup": "layout",
    "ReaderProfile": "layout",
    "Result": "result",
    "Robot": "robot",
    "Routes": "scenario",
    "Scenario": "scenario",
    "Score": "scores",
    "Site": "site",
    "Spec": "spec.building",
    "Status": "result",
    "Streams": "streams",
    "TagMap": "layout",
    "TagPattern": "layout",
    "Tiling": "site",
    "TrialOutcomes": "scores",
    "Violation": "feasibility",
    "Zone": "site",
    "ZonePattern": "layout",
    "bill_of_material": "parts",
    "built_in": "spec.template",
    "check": "feasibility",
    "default_prices": "prices",
    "draw": "questions",
    "example_names": "spec.template",
    "explain": "questions",
    "load": "registry",
    "names": "registry",
    "read_layout": "spec.layout_file",
    "read_prices": "prices",
    "read_spec": "spec.reading",
    "run_trials": "simulation.trials",
    "score": "questions",
    "solve": "questions",
    "study": "questions",
    "write_layout": "spec.layout_file",
}
__all__ = [*_HOMES]


def __getattr__(name: str) -> Any:
    """Load a public name from the module that holds it."""
    if name not in _HOMES:
        raise AttributeError(f"module 'layoutopt' has no attribute '{name}'")
    return getattr(importlib.import_module(f"layoutopt.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    """Return the names that are there and those that would be loaded, for those who complete them."""
    return sorted({*globals(), *__all__})
