"""Studies in parts: for batch systems that start many jobs and have no scheduler that they could ask for work.

Shard ``i`` of ``n`` runs every n-th task of the first round that the study's folder does not hold in full, into a
folder of its own, ``shards/i_of_n``. ``merge`` brings the journals of all shards together. A study whose tasks are
known in advance has one round; an adaptive one goes round by round: shards, merge, shards, merge.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from layoutopt import registry
from layoutopt.atomic_file import replacing
from layoutopt.errors import InvalidInput, StudyDamaged
from layoutopt.journal import (
    BOUND,
    FROZEN_SPEC,
    JOURNAL,
    MANIFEST,
    SHARDS,
    Journal,
    read_manifest,
    read_recorded,
    task_key,
)
from layoutopt.progress import Progress
from layoutopt.protocols import Answer, Evaluation, Failure, Round, Study, Task
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from studies.runner import recorded_rounds
from studies.status import FINISHED, SHARDED, StatusFile, merge_command, shard_folders

_SHARD: Final = re.compile(r"([1-9][0-9]{0,5})/([1-9][0-9]{0,5})", re.ASCII)
_FOLDER: Final = re.compile(r"([0-9]{1,6})_of_([1-9][0-9]{0,5})", re.ASCII)


@dataclass(frozen=True, slots=True, kw_only=True)
class Shard:
    """Shard ``number`` of ``count``, counted from 1."""

    number: int
    count: int

    def folder(self, study_folder: Path) -> Path:
        """Return where the shard writes."""
        return study_folder / SHARDS / f"{self.number}_of_{self.count}"

    def share(self, tasks: Sequence[Task]) -> tuple[Task, ...]:
        """Return the tasks of a round that are this shard's."""
        return tuple(tasks[self.number - 1 :: self.count])

    def __str__(self) -> str:
        return f"shard {self.number} of {self.count}"


def parse_shard(text: str) -> Shard:
    """Return the shard that a text such as ``"3/16"`` names.

    Raises
    ------
    InvalidInput
        If it names none.
    """
    match = _SHARD.fullmatch(text.strip())
    if match is None or int(match[1]) > int(match[2]):
        raise InvalidInput.at("--shard", f"{text!r} is no shard", "Write 1/16 for the first of sixteen.")
    return Shard(number=int(match[1]), count=int(match[2]))


def open_round(study: Study, folder: Path, streams: Streams) -> Round:
    """Return the first round that a folder does not hold in full; one without tasks if the study is done.

    Raises
    ------
    StudyDamaged
        If the folder or a shard in it belongs to another study.
    """
    for path in (folder, *shard_folders(folder)):
        if (path / MANIFEST).exists():
            facts = read_manifest(path)
            for name, wanted in (("seed", streams.seed), ("spec", study.key)):
                if facts.get(name) != wanted:
                    raise StudyDamaged(
                        f"{path / MANIFEST}: the folder belongs to another study ({name} is {facts.get(name)!r}, "
                        f"now {wanted!r}); choose another --out"
                    )
    recorded = read_recorded(folder) if (folder / JOURNAL).exists() else {}
    return recorded_rounds(study, streams=streams, recorded=recorded)[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Merged:
    """What came of a merge.

    Attributes
    ----------
    added
        Tasks that the folder did not hold before.
    differing
        Tasks of which two shards hold different outcomes, as processors or versions may cause; the first counts.
    missing
        Tasks of the open round that no shard holds, in the order of the round.
    counts
        Into how many shards rounds were divided, as far as folders tell.
    answer
        The answer, if the study is done.
    """

    folder: Path
    shards: int
    added: int
    differing: int
    round: Round
    missing: tuple[int, ...]
    counts: frozenset[int]
    answer: Answer | None = None

    @property
    def lines(self) -> list[str]:
        """What happened, and what is to be done next."""
        lines = [f"{self.folder}: {self.added} tasks added from {self.shards} shards"]
        if self.differing:
            lines.append(
                f"note: {self.differing} tasks differ between shards, as other processors or versions cause; "
                "the first shard's outcomes were kept"
            )
        if self.answer is None:
            open_tasks = f"{len(self.missing)} of {len(self.round.tasks)} tasks"
            lines.append(f"round '{self.round.name}' is open: {open_tasks} are missing{self._missing_shards}")
            lines.append(f"run these shards again, then: {merge_command(self.folder)}")
        return lines

    @property
    def _missing_shards(self) -> str:
        """Whose tasks are missing, if all shards are shards of the same number."""
        if len(self.counts) != 1:
            return ""
        (count,) = self.counts
        numbers = sorted({index % count + 1 for index in self.missing})
        names = "all shards" if len(numbers) == count else "shard " + ", ".join(f"{n}/{count}" for n in numbers)
        return f", those of {names}"


def merge(folder: Path, others: Iterable[Path], progress: Progress) -> Merged:
    """Bring the journals of shards together in a study's folder, and write the answer if the study is done.

    ``others`` are shards that lie elsewhere, or folders that hold some, beside those in ``folder/shards``.

    Raises
    ------
    StudyDamaged, InvalidInput
        If there is no shard, a folder is damaged, or shards belong to different studies.
    """
    elsewhere = [part for path in sorted(others) for part in shard_folders(path) or [path]]
    parts = list({path.resolve(): path for path in (*shard_folders(folder), *elsewhere)}.values())
    if not parts:
        raise InvalidInput.at(str(folder), "holds no shard", "Run layoutopt study ... --shard 1/2 first.")
    facts = _common_facts(parts)
    spec = read_spec(parts[0] / FROZEN_SPEC)
    quick = bool(facts.get("quick"))
    study: Study = registry.load("studies", str(facts.get("study")), place=str(parts[0] / MANIFEST)).for_spec(
        spec, quick=quick
    )
    if facts.get("spec") != study.key:
        raise StudyDamaged(f"{parts[0] / MANIFEST}: spec and manifest do not belong together; run the shard again")
    streams = Streams(seed=spec.seed)
    tables = [read_recorded(path) for path in parts if (path / JOURNAL).exists()]
    before = read_recorded(folder) if (folder / JOURNAL).exists() else {}
    with Journal(folder, facts=facts) as journal:
        for note in journal.notes:
            progress.note(note)
        _write_spec_once(parts[0], folder)
        together, differing = _together([before, *tables])
        added = 0
        for key, item in together.items():
            if before.get(key) != item:
                journal.append(key, item)
                added += 1
        evaluations, batch = recorded_rounds(study, streams=streams, recorded=together)
        answer = None if batch.tasks else study.answer(evaluations, spec)
        if answer is not None:
            answer.write(folder, streams=streams, quick=quick)
        status = StatusFile(folder, go_on=merge_command(folder))
        status.best(study.best_so_far(evaluations))
        status.end(SHARDED if answer is None else FINISHED)
    return Merged(
        folder=folder,
        shards=len(parts),
        added=added,
        differing=differing,
        round=batch,
        missing=tuple(index for index, task in enumerate(batch.tasks) if task_key(task, streams) not in together),
        counts=frozenset(int(found[2]) for path in parts if (found := _FOLDER.fullmatch(path.name))),
        answer=answer,
    )


def _common_facts(parts: Sequence[Path]) -> dict[str, Any]:
    """Return the manifest of the first part, with the environments of all."""
    first = read_manifest(parts[0])
    environments: list[object] = []
    for path in parts:
        facts = read_manifest(path)
        known = facts.get("environments")
        environments += [item for item in known if item not in environments] if isinstance(known, list) else []
        for name in BOUND:
            if facts.get(name) != first.get(name):
                raise StudyDamaged(
                    f"{path / MANIFEST}: belongs to another study than {parts[0]} ({name} is {facts.get(name)!r}, "
                    f"there {first.get(name)!r}); merge shards of one study only"
                )
    return {**first, "environments": environments}


def _together(
    tables: Iterable[Mapping[str, Evaluation | Failure]],
) -> tuple[dict[str, Evaluation | Failure], int]:
    """Return what any table holds, outcomes before failures, and how many outcomes differ."""
    found: dict[str, Evaluation | Failure] = {}
    differing = 0
    for table in tables:
        for key, item in table.items():
            known = found.get(key)
            if known is None or (isinstance(known, Failure) and isinstance(item, Evaluation)):
                found[key] = item
            elif isinstance(known, Evaluation) and isinstance(item, Evaluation):
                differing += known.outcomes != item.outcomes
    return found, differing


def _write_spec_once(shard: Path, folder: Path) -> None:
    if not (folder / FROZEN_SPEC).exists():
        with replacing(folder / FROZEN_SPEC) as temporary:
            temporary.write_bytes((shard / FROZEN_SPEC).read_bytes())
