"""The installed package away from its source: hidden names, and the wheel in an environment of its own."""

import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

import layoutopt

ROOT = Path(layoutopt.__file__).parent.parent


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


@pytest.mark.long
def test_the_wheel_runs_a_study_in_an_environment_of_its_own(tmp_path, tiny_text):
    """Built, installed and run from a foreign folder, the wheel brings templates, prices and examples along."""
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    if subprocess.run([*pip, "--version"], capture_output=True, check=False).returncode:
        pip = ["uv", "pip"]
        subprocess.run(["uv", "build", "--wheel", "--out-dir", tmp_path, ROOT], check=True, capture_output=True)
    else:
        build = ["wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", tmp_path, ROOT]
        subprocess.run([*pip, *build], check=True, capture_output=True)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "env"], check=True)
    site = next((tmp_path / "env").glob("lib/python*/site-packages"))
    wheel = next(tmp_path.glob("layoutopt-*.whl"))
    subprocess.run([sys.executable, "-m", "zipfile", "-e", wheel, site], check=True)
    # The dependencies of this environment serve the other one too; only our own package comes from the wheel.
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    (tmp_path / "work").mkdir()
    (tmp_path / "work" / "tiny.toml").write_text(tiny_text)
    python = tmp_path / "env" / "bin" / "python"
    where = subprocess.run(
        [python, "-c", "import layoutopt; print(layoutopt.__file__)"],
        cwd=tmp_path / "work",
        capture_output=True,
        text=True,
        check=True,
    )
    assert where.stdout.startswith(str(tmp_path))
    subprocess.run(
        [python, "-m", "layoutopt", "study", "cost_vs_accuracy", "tiny.toml", "--quick", "--jobs", "1"],
        cwd=tmp_path / "work",
        check=True,
        capture_output=True,
    )
    assert (tmp_path / "work/out/cost_vs_accuracy_quick/report.html").exists()
    subprocess.run([python, "-m", "layoutopt", "new", "own.toml"], cwd=tmp_path / "work", check=True)
