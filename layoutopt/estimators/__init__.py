"""Estimators: what turns readings into the robot's pose, each a `layoutopt.protocols.Estimator`.

An estimator is a frozen value with its settings. `start` gives the plain form that works step by step, as on
a robot; `run` takes a whole drive in columns and may be compiled.
"""

from typing import Final

EXTENSION_POINT: Final = "estimators"
ROWS: Final = {
    "mcl": "layoutopt.estimators.mcl:MonteCarloLocalisation",
    "midrange": "layoutopt.estimators.midrange:Midrange",
    "odometry": "layoutopt.estimators.odometry:OdometryAlone",
}
