"""Estimators: what turns readings into the robot's pose, each a `layoutopt.protocols.Estimator`.

An estimator is a frozen value with its settings. `start` gives the plain form that works step by step, as on
a robot; `run` takes a whole drive in columns and may be compiled.
"""

from typing import Final

EXTENSION_POINT: Final = "estimators"
ROWS: Final = {
    "mcl": "layoutopt.estimators.mcl:MonteCarloLocalisation",
    "mcl_crossings": "layoutopt.estimators.mcl_crossings:CrossingConstraints",
    "mcl_negative_information": "layoutopt.estimators.mcl_negative_information:NegativeInformation",
    "mcl_adaptive": "layoutopt.estimators.mcl_adaptive:AdaptiveParticles",
    "bayes_limit": "layoutopt.estimators.bayes_limit:BayesLimit",
    "midrange": "layoutopt.estimators.midrange:Midrange",
    "one_reader": "layoutopt.estimators.one_reader:OneReader",
    "one_reader_centroid": "layoutopt.estimators.one_reader_centroid:OneReaderCentroid",
    "one_reader_minimax": "layoutopt.estimators.one_reader_minimax:OneReaderMinimax",
    "crossing_time": "layoutopt.estimators.crossing_time:CrossingTime",
    "crossing_time_branches": "layoutopt.estimators.crossing_time_branches:CrossingTimeBranches",
    "odometry": "layoutopt.estimators.odometry:OdometryAlone",
    "odometry_gyro": "layoutopt.estimators.odometry_gyro:OdometryWithGyro",
    "direction_as_measured": "layoutopt.estimators.direction_as_measured:DirectionAsMeasured",
    "direction_corrected": "layoutopt.estimators.direction_corrected:DirectionCorrected",
    "bearing_filter": "layoutopt.estimators.bearing_filter:FilteredBearing",
    "bearing_bumper": "layoutopt.estimators.bearing_bumper:BearingAroundStops",
    "uhf_laser": "layoutopt.estimators.uhf_laser:UhfLaser",
    "uhf_laser_heading": "layoutopt.estimators.uhf_laser_heading:UhfLaserHeading",
}
