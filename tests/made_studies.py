"""Finished studies without a trial: folders like those of the main study, with outcomes that are made up."""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from layoutopt.journal import FROZEN_SPEC, Journal, manifest, task_key
from layoutopt.protocols import Evaluation, Task
from layoutopt.scores import TrialOutcomes
from layoutopt.simulation.outcomes import outcome_columns
from layoutopt.spec.building import Spec
from layoutopt.spec.layout_file import write_layout
from layoutopt.spec.reading import read_spec
from layoutopt.spec.writing import write_spec
from layoutopt.streams import Streams
from studies.cost_vs_accuracy import CostVersusAccuracy
from studies.runner import recorded_rounds
from studies.shards import Shard
from studies.status import StatusFile

NAME = "cost_vs_accuracy"
SPEC = """
schema = 1
seed = 3
[site]
floor = [[0,0],[3,0],[3,2],[0,2]]
[robots]
outline = [["-0.2 m","-0.2 m"],["0.2 m","-0.2 m"],["0.2 m","0.2 m"],["-0.2 m","0.2 m"]]
[space]
antenna_side = "60 mm"
antenna_height = "20 mm"
antennas_per_module = 4
readers = [{ family = "ring", count = 4, radius = "0.15 m" }]
patterns = [{ family = "square", pitch = ["100 mm", "200 mm"] }]
[goal]
target_error = "300 mm"
[study]
validate_with = ["mcl"]
search_trials = 40
validation_trials = 20
duration = "4 s"
particles = 50
"""
"""Two layouts, few short drives."""


@dataclass(frozen=True)
class MadeStudy:
    """A quick study of a spec, whose every task has an outcome that its key decides."""

    spec: Spec

    @cached_property
    def question(self):
        """The study."""
        return CostVersusAccuracy.for_spec(self.spec, quick=True)

    @property
    def streams(self):
        """The streams of its tasks."""
        return Streams(seed=self.spec.seed)

    @property
    def facts(self):
        """What its manifest says."""
        own = {"study": NAME, "quick": True, "source": self.spec.site.source}
        return {**manifest(self.streams, self.question.key), **own}

    @cached_property
    def recorded(self):
        """Made-up outcomes of all its tasks, by key."""
        found = {}
        while (batch := recorded_rounds(self.question, streams=self.streams, recorded=found)[1]).tasks:
            found.update({task_key(task, self.streams): self.outcome(task) for task in batch.tasks})
        return found

    def outcome(self, task: Task) -> Evaluation:
        """Return what a task might have given."""
        seed = int(hashlib.sha256(task_key(task, self.streams).encode()).hexdigest()[:8], 16)
        columns = outcome_columns(task.scenario)
        values = np.random.default_rng(seed).uniform(0.001, 0.02, (task.count, len(columns)))
        replications = np.arange(task.first, task.first + task.count)
        outcomes = TrialOutcomes(replications=replications, columns=columns, values=values)
        return Evaluation(group=task.group, first=task.first, outcomes=outcomes, seconds=0.1)

    def write(self, folder: Path, recorded=None) -> Path:
        """Write journal, manifest, spec, status and one layout, as a finished run leaves them."""
        with Journal(folder, facts=self.facts) as journal:
            write_spec(self.spec, folder / FROZEN_SPEC)
            for key, item in (self.recorded if recorded is None else recorded).items():
                journal.append(key, item)
        told = StatusFile(folder, go_on=f"layoutopt study {NAME} --resume")
        told.round("search", 2, 4)
        told.best("the cheaper of two")
        told.end("stopped")
        (folder / "layouts").mkdir()
        write_layout(next(self.spec.space.layouts()), self.spec, folder / "layouts" / "one.toml")
        return folder

    def write_shards(self, folder: Path, count: int = 2) -> None:
        """Write the folders of shards, each with its share of all tasks."""
        items = list(self.recorded.items())
        for number in range(1, count + 1):
            own = Shard(number=number, count=count).folder(folder)
            self.write(own, dict(items[number - 1 :: count]))


def made_study(folder: Path, text: str = SPEC) -> MadeStudy:
    """Return a study of the spec in a text, which is written to the folder."""
    path = folder / "given.toml"
    path.write_text(text, encoding="utf-8")
    return MadeStudy(read_spec(path))
