"""Names of our packages that files of a user's own hide."""

import subprocess
import sys

import pytest


@pytest.mark.parametrize("package", ["objectives", "solvers", "studies"])
def test_a_file_that_hides_a_package_of_ours_is_named(tmp_path, package):
    """A user's own file of that name in the folder is refused with its path, not with a traceback."""
    (tmp_path / f"{package}.py").write_text("x = 1\n")
    done = subprocess.run(
        [sys.executable, "-m", "layoutopt", "study", "list"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert f"{package}.py" in done.stderr
    assert "Traceback" not in done.stderr
