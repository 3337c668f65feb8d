"""The kernels never reach outside their arrays, whatever they are given."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
CHECKED = (
    "hostile/test_hostile_drives.py",
    "properties/test_counter_normals.py",
    "properties/test_likelihood_twins.py",
    "properties/test_particle_twins.py",
    "properties/test_restart_twins.py",
    "properties/test_sensing_twins.py",
)


@pytest.mark.long
def test_hostile_cases_run_with_checked_bounds(tmp_path):
    """Hostile drives and the twins' cases (off the floor, no tag, nonsense reads) pass with every index checked.

    In a process of its own, because the check is chosen when a kernel is compiled, with a cache of its own; what
    is checked does not depend on how well LLVM optimises, and compiling is most of the time.
    """
    environment = os.environ | {"NUMBA_BOUNDSCHECK": "1", "NUMBA_OPT": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    run = subprocess.run(
        [
            sys.executable,
            *("-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-k", "not plain_form"),
            *(str(TESTS / name) for name in CHECKED),
        ],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=280,
    )
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-1000:]
    assert "passed" in run.stdout
