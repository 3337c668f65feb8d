"""Studies to be disturbed, and one that nothing disturbed."""

import csv
import sys

import fault_hooks
import pytest
from struck_studies import SPEC, STUDY, Running, here

from layoutopt.spec.reading import read_spec


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory):
    """A folder with the spec and a finished study in ``out`` that nothing disturbed."""
    home = tmp_path_factory.mktemp("undisturbed")
    (home / "spec.toml").write_text(SPEC, encoding="utf-8")
    code, _, told = here(home, *STUDY, "--backend", "serial")
    assert code == 0, told
    return home


@pytest.fixture
def home(tmp_path):
    """A folder with the spec, for a study to be disturbed."""
    (tmp_path / "spec.toml").write_text(SPEC, encoding="utf-8")
    return tmp_path


@pytest.fixture
def start(home):
    """Start the study with faults, by options of the command line; whatever still runs after the test is ended."""
    started = []

    def start(*options, through=(), before=None, changed=None, **faults):
        environment = {**fault_hooks.environment(home / "hooks", **faults), **(changed or {})}
        arguments = [*through, sys.executable, "-m", "layoutopt", *STUDY, *options]
        started.append(Running(home, arguments, environment, before=before))
        return started[-1]

    yield start
    for running in started:
        running.end_at_once()


@pytest.fixture(scope="session")
def layout_keys(undisturbed):
    """The keys of all layouts of the spec, those off the front first."""
    keys = [layout.key for layout in read_spec(undisturbed / "spec.toml").problem().space.layouts()]
    with (undisturbed / "out/front.csv").open(encoding="utf-8", newline="") as file:
        front = {row["layout"] for row in csv.DictReader(file)}
    return sorted(keys, key=lambda key: (key[:10] in front, key))
