"""What an installation compiles is everything that is compiled."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PACKAGES = ("layoutopt", "objectives", "solvers", "studies")


@pytest.mark.long
def test_no_file_of_kernels_is_left_out(tmp_path):
    """With an empty cache every file of kernels leaves machine code in it."""
    subprocess.run(
        [sys.executable, "-c", "from studies.compiled import compile_all; compile_all()"],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        cwd=tmp_path,
        check=True,
        timeout=290,
    )
    compiled = {path.name.partition(".")[0] for path in tmp_path.rglob("*.nbi")}
    kernels = {path.stem for package in PACKAGES for path in (ROOT / package).rglob("*_kernels.py")}
    assert kernels
    assert kernels <= compiled
