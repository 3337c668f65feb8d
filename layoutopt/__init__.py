"""layoutopt designs RFID positioning systems for indoor mobile robots.

Conventions: SI units inside, names carry their unit (``pitch_m``, ``angle_rad``, ``price_eur``); angles
counter-clockwise; robot frame after REP-103 (x forward, y left); floor frame with x right and y up. Arrays of
places have shape (n, 2), in metres.

The public names below are loaded when they are first used, so that ``import layoutopt`` costs nothing.
"""

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from layoutopt.feasibility import Violation as Violation
    from layoutopt.feasibility import check as check
    from layoutopt.layout import FloorTags as FloorTags
    from layoutopt.layout import Layout as Layout
    from layoutopt.layout import ReaderGroup as ReaderGroup
    from layoutopt.layout import ReaderProfile as ReaderProfile
    from layoutopt.layout import TagMap as TagMap
    from layoutopt.layout import TagPattern as TagPattern
    from layoutopt.layout import ZonePattern as ZonePattern
    from layoutopt.problem import Limit as Limit
    from layoutopt.problem import Problem as Problem
    from layoutopt.protocols import Mount as Mount
    from layoutopt.registry import load as load
    from layoutopt.registry import names as names
    from layoutopt.result import Front as Front
    from layoutopt.result import Result as Result
    from layoutopt.result import Status as Status
    from layoutopt.robot import Robot as Robot
    from layoutopt.scenario import Faults as Faults
    from layoutopt.scenario import Scenario as Scenario
    from layoutopt.scores import Score as Score
    from layoutopt.scores import TrialOutcomes as TrialOutcomes
    from layoutopt.simulation.trials import run_trials as run_trials
    from layoutopt.site import Site as Site
    from layoutopt.site import Zone as Zone
    from layoutopt.spec.layout_file import read_layout as read_layout
    from layoutopt.spec.layout_file import write_layout as write_layout
    from layoutopt.spec.reading import read_spec as read_spec
    from layoutopt.spec.template import built_in as built_in
    from layoutopt.streams import Streams as Streams

__version__ = "0.1.0"

_HOMES: Final = {
    "FloorTags": "layout",
    "Faults": "scenario",
    "Front": "result",
    "Layout": "layout",
    "Limit": "problem",
    "Mount": "protocols",
    "Problem": "problem",
    "ReaderGroup": "layout",
    "ReaderProfile": "layout",
    "Result": "result",
    "Robot": "robot",
    "Scenario": "scenario",
    "Score": "scores",
    "Site": "site",
    "Status": "result",
    "Streams": "streams",
    "TagMap": "layout",
    "TagPattern": "layout",
    "TrialOutcomes": "scores",
    "Violation": "feasibility",
    "Zone": "site",
    "ZonePattern": "layout",
    "built_in": "spec.template",
    "check": "feasibility",
    "load": "registry",
    "names": "registry",
    "read_layout": "spec.layout_file",
    "read_spec": "spec.reading",
    "run_trials": "simulation.trials",
    "write_layout": "spec.layout_file",
}
__all__ = [*_HOMES]


def __getattr__(name: str) -> Any:
    """Load a public name from the module that holds it."""
    if name not in _HOMES:
        raise AttributeError(f"module 'layoutopt' has no attribute '{name}'")
    return getattr(importlib.import_module(f"layoutopt.{_HOMES[name]}"), name)
