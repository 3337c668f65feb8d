"""The kernels never reach outside their arrays, whatever they are given."""

import os
import subprocess
import sys
from pathlib import Path

PROPERTIES = Path(__file__).parents[1] / "properties"


def test_hostile_cases_run_with_checked_bounds(tmp_path):
    """The twins' cases (poses off the floor, NaN, empty maps, nonsense reads) pass with every index checked.

    In a process of its own, because the check is chosen when a kernel is compiled, with a cache of its own.
    """
    environment = os.environ | {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    names = [str(PROPERTIES / name) for name in ("test_mcl_twins.py", "test_sensing_twins.py")]
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *names],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=200,
    )
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-1000:]
    assert "passed" in run.stdout
