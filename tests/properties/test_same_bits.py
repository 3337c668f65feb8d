"""Compiled code gives the same bits in the process that compiled it as in one that loads it from the cache."""

import ast
import math
import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from numba import njit

import layoutopt
from layoutopt.estimators.counter_normals_kernels import fused

ROOT = Path(layoutopt.__file__).parents[1]
KERNELS = sorted(path for name in ("layoutopt", "objectives") for path in (ROOT / name).rglob("*_kernels.py"))
PROGRAM = """
import sys
from pathlib import Path
from layoutopt.evaluate import run_task
from layoutopt.protocols import Task
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
problem = read_spec(Path(sys.argv[1])).problem()
layout = next(iter(problem.space.layouts()))
for estimator in problem.estimators:
    found = run_task(
        Task(layout=layout, scenario=problem.design, estimator=estimator, first=0, count=2), Streams(seed=1)
    )
    print(estimator.name, found.outcomes.values.tobytes().hex())
"""


@pytest.mark.parametrize("path", KERNELS, ids=lambda path: path.stem)
def test_no_kernel_lets_the_compiler_reorder(path):
    """With fastmath, the bits would depend on what is inlined where, which a load from the cache changes."""
    words = {node.arg for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.keyword)}
    assert not words & {"fastmath", "parallel"}


def test_a_fused_product_is_rounded_once():
    """On a million random triples the result is the float32 that is nearest to the exact sum."""
    draws = np.random.default_rng(5)
    factor, other, term = draws.normal(0.0, 1.0, (3, 1000)).astype(np.float32)
    term[:500] = -(factor[:500] * other[:500])
    found = njit(lambda a, b, c: fused(a, b, c))
    for a, b, c in zip(factor, other, term, strict=True):
        exact = Fraction(float(a)) * Fraction(float(b)) + Fraction(float(c))
        value = float(found(a, b, c))
        assert np.float32(value) == value
        beside = [float(np.nextafter(np.float32(value), np.float32(side))) for side in (-math.inf, math.inf)]
        assert all(abs(Fraction(value) - exact) <= abs(Fraction(near) - exact) for near in beside)


@pytest.mark.long
def test_code_from_the_cache_gives_the_bits_of_code_just_compiled(tmp_path, tiny_spec):
    """Two processes, of which the first compiles everything and the second loads it, agree to the last bit."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-c", PROGRAM, str(tiny_spec)]
    compiled, loaded = (
        subprocess.run(command, env=environment, capture_output=True, check=True).stdout for _ in range(2)
    )
    assert list(tmp_path.rglob("*.nbc"))
    assert compiled == loaded
    assert b"mcl_adaptive" in compiled
