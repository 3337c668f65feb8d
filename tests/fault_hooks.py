"""Faults put into the processes of a study that runs for real: command and workers import this as they start.

A test writes a ``sitecustomize.py`` that calls `install` and puts it on ``PYTHONPATH``. What is to go wrong stands
in an environment variable; workers inherit both. Nothing here is imported by the product.
"""

import ctypes
import functools
import importlib.machinery
import json
import os
import resource
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

VARIABLE = "LAYOUTOPT_TEST_FAULTS"
SITECUSTOMIZE = "import fault_hooks\n\nfault_hooks.install()\n"
_TOO_MUCH_BYTES = 2**30
_LITTLE_BYTES = 512 * 2**20


def environment(folder, *, drawings=False, pause_s=0.0, misbehave=None, begun=None, interrupt_at=""):
    """Return the environment of a process with faults; ``folder`` takes the file that installs them.

    Parameters
    ----------
    drawings
        Whether drawings, figures and report are made, which take most of the time of a tiny study.
    pause_s
        How long every task waits before it begins.
    misbehave
        How the estimator misbehaves for a layout, by key: a method of `Misbehaving`.
    begun
        File that gets a line for every task that a process began.
    interrupt_at
        Module whose import sends the process a Ctrl-C.
    """
    folder.mkdir(exist_ok=True)
    (folder / "sitecustomize.py").write_text(SITECUSTOMIZE, encoding="utf-8")
    settings = {
        "drawings": drawings,
        "pause_s": pause_s,
        "misbehave": misbehave or {},
        "begun": None if begun is None else str(begun),
        "interrupt_at": interrupt_at,
    }
    places = [str(folder), str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, places)), VARIABLE: json.dumps(settings)}


def install():
    """Have modules changed as soon as they are imported, so that processes which do not need them stay quick."""
    settings = json.loads(os.environ.get(VARIABLE, "null"))
    if settings is None:
        return
    changes = {"layoutopt.simulation.trials": _change_trials}
    if not settings["drawings"]:
        changes["studies.output"] = _change_output
    if settings["interrupt_at"]:
        changes[settings["interrupt_at"]] = _interrupt
    sys.meta_path.insert(0, _Changing(changes, settings))


class _Changing:
    """Finds modules as usual and changes some of them once they are loaded."""

    def __init__(self, changes, settings):
        self._changes, self._settings = changes, settings

    def find_spec(self, name, path=None, target=None):
        change = self._changes.get(name)
        if change is None:
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path)
        load = spec.loader.exec_module

        def load_and_change(module):
            load(module)
            change(module, self._settings)

        spec.loader.exec_module = load_and_change
        return spec


def _change_output(module, settings):
    module.write_overview = lambda *_, **__: []
    module.write_report = lambda *_, **__: None


def _interrupt(module, settings):
    # What a shell starts in the background ignores Ctrl-C, and its children with it: the tests may run there.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.kill(os.getpid(), signal.SIGINT)


def _change_trials(module, settings):
    run_trials = module.run_trials

    @functools.wraps(run_trials)
    def with_faults(layout, scenario, estimator, streams, first, count):
        if scenario.name != "warm-up":
            if settings["begun"] is not None:
                with Path(settings["begun"]).open("a", encoding="utf-8") as file:
                    file.write(f"{layout.key} {scenario.name} {estimator.name} {first}\n")
            time.sleep(settings["pause_s"])
        how = settings["misbehave"].get(layout.key)
        used = estimator if how is None else Misbehaving(estimator, how)
        return run_trials(layout, scenario, used, streams, first, count)

    module.run_trials = with_faults


class Misbehaving:
    """An estimator in another's name that does a run in its own way."""

    def __init__(self, estimator, how):
        self._estimator, self._how = estimator, how

    def __getattr__(self, name):
        return getattr(self._estimator, name)

    def run(self, *known):
        return getattr(self, f"_{self._how}")(*known)

    def _raises(self, *known):
        raise RuntimeError("a wheel came off")

    def _gives_no_number(self, *known):
        trajectory = self._estimator.run(*known)
        poses = np.array(trajectory.poses)
        poses[7] = np.nan
        return replace(trajectory, poses=poses)

    def _finds_no_memory(self, *known):
        limit = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (_LITTLE_BYTES, limit[1]))
        try:
            bytearray(_TOO_MUCH_BYTES)
        finally:
            resource.setrlimit(resource.RLIMIT_AS, limit)

    def _is_killed(self, *known):
        os.kill(os.getpid(), signal.SIGKILL)

    def _sleeps(self, *known):
        while True:
            time.sleep(0.05)

    def _waits_in_compiled_code(self, *known):
        """Call C that does not come back and lets no other thread run."""
        ctypes.PyDLL(None).sleep(10**6)

    def _spins_in_compiled_code(self, *known):
        import numba

        @numba.njit
        def spin(value):
            while value >= 0.0:
                value += 1.0
            return value

        return spin(1.0)
