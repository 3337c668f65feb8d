"""Mutated drawings, GeoJSON files and images: whatever the bytes, a floor or one clear error."""

import json
import os
import subprocess
import sys
from pathlib import Path

import plan_fuzzing
import pytest

KINDS = ["dxf", "geojson", "png"]
# So many of the damaged files are still read, and so many refused: both ways are tried.
READ_SHARE, REFUSED_SHARE = 0.02, 0.3


def fuzzed(kind, seed, count, folder):
    """Return how many damaged files were read and refused, by a process of 1 GB and ten seconds for each."""
    paths = os.pathsep.join([str(Path(plan_fuzzing.__file__).parent), *sys.path])
    done = subprocess.run(
        [sys.executable, plan_fuzzing.__file__, kind, str(seed), str(count), str(folder)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"},
    )
    assert done.returncode == 0, done.stderr[-4000:]
    counts = json.loads(done.stdout.splitlines()[-1])
    assert counts["good"] + counts["bad"] == count
    return counts["good"], counts["bad"]


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_plans_end_in_a_floor_or_one_error(kind, tmp_path):
    """200 damaged files of each kind raise nothing but InvalidInput, within bounds of memory and time."""
    good, bad = fuzzed(kind, 1, 200, tmp_path)
    assert good >= READ_SHARE * 200
    assert bad >= REFUSED_SHARE * 200


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("kind", KINDS)
def test_many_damaged_plans_end_in_a_floor_or_one_error(kind, tmp_path):
    """The same for 5,000 damaged files."""
    good, bad = fuzzed(kind, 2, 5000, tmp_path)
    assert good >= READ_SHARE * 5000
    assert bad >= REFUSED_SHARE * 5000


def test_a_plan_that_takes_too_long_or_too_much_memory_would_be_found(tmp_path):
    """The process that reads damaged plans ends itself when a file hangs, and has no more memory than stated."""
    program = (
        "import plan_fuzzing, sys\nfrom pathlib import Path\n"
        "plan_fuzzing.LONGEST_S = 0.5\n"
        "from layoutopt.errors import InvalidInput\n"
        "calls = []\n"
        "def read(path, draws):\n"
        "    calls.append(path)\n"
        "    if len(calls) == 2:\n"
        "        try:\n"
        "            bytearray(2 * plan_fuzzing.MEMORY_BYTES)\n"
        "        except MemoryError:\n"
        "            print('bounded', flush=True)\n"
        "            while True:\n"
        "                pass\n"
        "plan_fuzzing.reader_of = lambda kind: ('x', lambda: [b'abc'], [lambda content, draws: content], read)\n"
        "plan_fuzzing.main('x', 1, 5, Path(sys.argv[1]))\n"
    )
    paths = os.pathsep.join([str(Path(plan_fuzzing.__file__).parent), *sys.path])
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"},
    )
    assert done.stdout.split() == ["bounded"]
    assert done.returncode != 0
    assert "in read" in done.stderr
