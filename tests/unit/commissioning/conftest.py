"""One simulated drive as its robot would have logged it."""

import dataclasses

import pytest

from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.scenario import Faults
from layoutopt.simulation.trials import record_trial
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams


@pytest.fixture(scope="session")
def tiny(tmp_path_factory, tiny_text):
    """Spec, its layouts by number, and the tag map of the first."""
    path = tmp_path_factory.mktemp("tiny") / "tiny.toml"
    path.write_text(tiny_text.replace('duration = "15 s"', 'duration = "60 s"'), encoding="utf-8")
    spec = read_spec(path)
    return spec, list(spec.space.layouts())


@pytest.fixture(scope="session")
def driven(tiny):
    """Return the record of a drive with the faults and layout asked for."""
    spec, layouts = tiny

    def record(number=0, replication=0, steps=1200, odometry=None, **faults):
        robot = spec.robot if odometry is None else dataclasses.replace(spec.robot, odometry=odometry)
        scenario = dataclasses.replace(spec.design, robot=robot, faults=Faults(**faults), step_count=steps)
        return record_trial(layouts[number], scenario, OdometryAlone(), Streams(seed=5), replication)

    return record
