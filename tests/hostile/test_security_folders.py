"""What docs/security.md promises of folders: a command or worker runs nothing that lies where it is started."""

import subprocess
import sys
import sysconfig
from pathlib import Path

from command_line import PROGRAM
from made_studies import NAME, made_study

EVIL = 'import pathlib\npathlib.Path("RAN").write_text("x")\n'


def test_a_command_in_a_folder_of_strangers_runs_nothing_of_theirs(tmp_path):
    """Modules that lie in the folder where a command is called, under names that Python looks for, are not run."""
    made_study(tmp_path).write(tmp_path / "study")
    for module in ("numpy", "json", "layoutopt", "studies", "typer", "sitecustomize", "signal"):
        (tmp_path / f"{module}.py").write_text(EVIL, encoding="utf-8")
    command = Path(sysconfig.get_path("scripts")) / "layoutopt"
    ended = subprocess.run([command, "status", "study"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended
    assert f"study {NAME}" in ended.stdout
    assert not (tmp_path / "RAN").exists()


# Writes down that it was run, and gives way to the module whose name it has.
SHADOW = (
    EVIL
    + """
import sys
from pathlib import Path
here = str(Path(__file__).parent)
sys.path = [path for path in sys.path if path not in ("", here)]
del sys.modules["joblib"]
import joblib
"""
)
WORK = """
from layoutopt.workers import Backend, Workers
if __name__ == "__main__":
    print(list(Workers(Backend.LOKY, jobs=1).map(abs, [-3])))
"""


def test_workers_run_no_module_of_the_folder_they_are_started_in(tmp_path):
    """Python that is started for a worker takes no module from the folder in which the command was called."""
    program, folder = tmp_path / "program", tmp_path / "folder"
    program.mkdir()
    folder.mkdir()
    (program / "work.py").write_text(WORK, encoding="utf-8")
    (folder / "joblib.py").write_text(SHADOW, encoding="utf-8")
    ended = subprocess.run(
        [sys.executable, program / "work.py"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert "[(0, 3)]" in ended.stdout, ended
    assert not (folder / "RAN").exists()


def test_numba_takes_no_cache_of_the_folder_it_is_started_in(tmp_path):
    """Settings of numba in the folder of the command do not lead it to another cache, which is of pickles."""
    (tmp_path / ".numba_config.yaml").write_text("cache_dir: RAN\n", encoding="utf-8")
    program = PROGRAM + "import numba\nprint('CACHE', repr(str(numba.config.CACHE_DIR)))\n"
    ended = subprocess.run(
        [sys.executable, "-c", program],
        input="study|list\n",
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "ENDED 2" in ended.stdout or "CACHE ''" in ended.stdout, ended
