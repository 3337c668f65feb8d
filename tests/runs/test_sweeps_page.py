"""The page on long studies: its scripts do what it says, and it names what the program tells."""

import dataclasses
import os
import re
import subprocess
from pathlib import Path

import pytest

from layoutopt import registry
from layoutopt.progress import Snapshot
from studies import status

PAGE = (Path(__file__).parents[2] / "docs/sweeps.md").read_text(encoding="utf-8")
SBATCH = """#!/bin/bash
[ "$1" = --wait ] || exit 99
export SLURM_ARRAY_TASK_COUNT=$(sed -n 's/^#SBATCH --array=1-//p' "$2")
export SLURM_CPUS_PER_TASK=$(sed -n 's/^#SBATCH --cpus-per-task=//p' "$2")
worst=0
for number in $(seq "$SLURM_ARRAY_TASK_COUNT"); do
    SLURM_ARRAY_TASK_ID=$number bash "$2" || worst=$?
done
exit $worst
"""
LAYOUTOPT = """#!/bin/bash
echo "$@" >> calls
[ "$1" = merge ] && codes=merges || codes=shards
code=$(head -n 1 $codes)
sed -i 1d $codes
exit "${code:-0}"
"""


def _script(of):
    """Return the only script of the page that holds a text."""
    (found,) = [block for block in re.findall(r"```bash\n(.*?)```", PAGE, re.DOTALL) if of in block]
    return found


@pytest.fixture
def batch_system(tmp_path):
    """A call that runs a script of the page, with codes for its commands to end with; returns code and calls."""
    for name, text in (("sbatch", SBATCH), ("layoutopt", LAYOUTOPT)):
        (tmp_path / name).write_text(text, encoding="utf-8")
        (tmp_path / name).chmod(0o755)
    (tmp_path / "shards.sh").write_text(_script("--array=1-4"), encoding="utf-8")
    (tmp_path / "ward.sh").write_text(_script("--array=1-2"), encoding="utf-8")

    def run(script, *, merges, shards=()):
        for name, codes in (("merges", merges), ("shards", shards)):
            (tmp_path / name).write_text("".join(f"{code}\n" for code in codes), encoding="utf-8")
        environment = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
        done = subprocess.run(["bash", "-c", script], cwd=tmp_path, env=environment, check=False, timeout=60)
        return done.returncode, (tmp_path / "calls").read_text(encoding="utf-8").splitlines()

    return run


def test_the_array_of_one_round_runs_every_shard_and_merges(batch_system):
    """Each job runs its own shard with the processors that it was given, then the merge follows."""
    code, calls = batch_system(_script("merge out/estimators"), merges=[0])
    shard = "study estimator_comparison hospital.toml --out out/estimators --shard {}/4 --jobs 2"
    assert calls == [*(shard.format(number) for number in (1, 2, 3, 4)), "merge out/estimators"]
    assert code == 0


@pytest.mark.parametrize("last", [0, 1, 2])
def test_the_loop_runs_rounds_until_a_merge_ends_it(batch_system, last):
    """As long as tasks are missing it goes on; its exit code is that of the merge that asks for no more."""
    code, calls = batch_system(_script("while"), merges=[3, 3, last])
    assert code == last
    assert calls[:2] == [
        f"study cost_vs_accuracy hospital.toml --out out/ward --shard {number}/2 --jobs 2" for number in (1, 2)
    ]
    assert calls[2::3] == ["merge out/ward"] * 3
    assert len(calls) == 9


def test_the_loop_gives_up_on_shards_that_fail_three_times_running(batch_system):
    """Shards that failed are run again; after three times in a row the loop ends with 3."""
    code, calls = batch_system(_script("while"), merges=[3] * 9, shards=[0, 2, 0, 0, 2, 2, 0, 2, 2, 0])
    assert code == 3
    assert calls.count("merge out/ward") == 5


def test_the_page_names_every_state_and_every_field_of_progress():
    """States of a folder and fields of JSON progress stand on the page as they are written."""
    names = [field.name for field in dataclasses.fields(Snapshot)]
    names += [status.RUNNING, status.FINISHED, status.STOPPED, status.SILENT, status.SHARDED]
    assert [name for name in names if f"`{name}`" not in PAGE] == []


def test_the_page_names_the_adaptive_studies():
    """The studies said to have several rounds are those whose cards say so."""
    (sentence,) = re.findall(r"The studies ([^:]*) are adaptive", PAGE)
    adaptive = {name for name in registry.names("studies") if registry.card("studies", name).adaptive}
    assert set(re.findall(r"`([^`]*)`", sentence)) == adaptive
