"""Study folders of strangers or broken disks: read, or refused with an error of ours, and harming nothing else."""

import json
import math
import os
import random
import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest
from command_line import called
from made_studies import NAME, made_study

from layoutopt import evaluate, journal
from layoutopt.errors import LayoutoptError, StudyDamaged
from layoutopt.journal import Journal, read_manifest, read_recorded
from layoutopt.progress import Silent
from layoutopt.spec.layout_file import read_layout
from layoutopt.spec.reading import read_spec
from layoutopt.stopping import StopRequest
from layoutopt.workers import Workers
from studies import front_answer, repricing, shards
from studies.folder import Run, run_shard, run_study
from studies.shards import Shard
from studies.status import read_status

PRICES = 'schema = 1\nname = "own"\ndate = 2026-12-01\nbase = "default-2026"\n'
NASTY = [
    None, True, False, -1, 0, 1, 2**63, 10**30, 10**4000, 0.5, 1e308, -1e308, math.nan, math.inf, -math.inf, "",
    "x", "\ud800", "\x1b[31m", "../../x", "x" * 100_000, "published/mi2016", [], {}, [[]], [1, 2], ["a"], [["a"]],
    [{}], {"a": 1}, "DEEP LIST", "DEEP TABLE", "MANY DIGITS", "BEYOND FLOATS",
]  # fmt: skip
"""Values in place of a field; the words in capitals stand for what no value gives."""
WORDS = {
    '"DEEP LIST"': "[" * 900 + "]" * 900,
    '"DEEP TABLE"': '{"a":' * 900 + "1" + "}" * 900,
    '"MANY DIGITS"': "9" * 5000,
    '"BEYOND FLOATS"': "1e400",
}
PIECES = [b"\n", b"\0", b"\xff", b"NaN", b"1e400", b"[", b"{", b'"', b"9" * 5000, b"[" * 2000, b",", b":", b"-"]
FILES = {
    "manifest.json": ("status", "journal", "merge", "reprice", "resume"),
    "results.jsonl": ("status", "recorded", "journal", "merge", "reprice", "resume", "shard"),
    "status.json": ("status",),
    "spec.toml": ("spec", "merge", "reprice", "resume"),
    "layouts/one.toml": ("layout",),
    "shards/1_of_2/manifest.json": ("status", "merge", "shard"),
    "shards/1_of_2/results.jsonl": ("status", "merge", "shard"),
    "shards/1_of_2/spec.toml": ("merge",),
    "shards/2_of_2/manifest.json": ("merge",),
}
"""Files of a folder, and who reads them."""
REPLAYING = ("merge", "reprice", "resume", "shard")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return made_study(tmp_path_factory.mktemp("spec"))


@pytest.fixture(scope="module")
def good(made, tmp_path_factory):
    """A finished study with two shards that hold the same once more."""
    folder = made.write(tmp_path_factory.mktemp("good") / "study")
    made.write_shards(folder)
    folder.with_name("prices.toml").write_text(PRICES, encoding="utf-8")
    return folder


@pytest.fixture
def case(good, tmp_path):
    """A copy of the good folder, to be damaged."""
    return Path(shutil.copytree(good, tmp_path / "case"))


@pytest.fixture(autouse=True)
def answers_without_drawings(monkeypatch):
    monkeypatch.setattr(front_answer.FrontAnswer, "write", lambda *_, **__: None)
    monkeypatch.setattr(evaluate, "warm_up", lambda _: None)


class Idle(Workers):
    """Workers who ask for the end in place of computing anything."""

    def map(self, function, items):
        self.stop.ask()
        yield from ()


def use(what, folder, made, good):
    """Read a folder as the command of that name does; where a trial would be run, it stops instead."""
    stop = StopRequest()
    run = Run(resume=True, quick=True, stop=stop, workers=Idle(stop=stop))
    if what == "status":
        found = read_status(folder)
        lines = found.lines()
        assert all(line.isprintable() and len(line) < 5000 for line in lines)
        json.dumps(found.as_json(), allow_nan=False).encode()
    elif what == "recorded":
        read_recorded(folder)
    elif what == "journal":
        with Journal(folder, facts=made.facts) as opened:
            assert all(note.isprintable() and len(note) < 1000 for note in opened.notes)
    elif what == "merge":
        merged = shards.merge(folder, [], Silent())
        "\n".join([*merged.lines, *(merged.answer.lines(folder) if merged.answer else [])]).encode()
    elif what == "reprice":
        repricing.reprice(folder, good.with_name("prices.toml"))
    elif what == "resume":
        "\n".join(
            run_study(NAME, made.question, made.spec, folder, run=run, progress=Silent()).lines(folder)
        ).encode()
    elif what == "shard":
        run_shard(NAME, made.question, made.spec, folder, Shard(number=1, count=2), run=run, progress=Silent())
    elif what == "spec":
        read_spec(folder / "spec.toml")
    else:
        read_layout(folder / "layouts" / "one.toml")


def refusal(read, *arguments):
    """Return how a call was refused; empty if it was not. No other error than ours may come out of it."""
    try:
        read(*arguments)
    except LayoutoptError as error:
        return str(error) or "refused"
    return ""


def collect(found, read, folder):
    """Add to a list what is read of a folder."""
    found.extend(read(folder))


def dumped(value):
    text = json.dumps(value)
    for word, meant in WORDS.items():
        text = text.replace(word, meant)
    return text


def places(value, path=()):
    """Yield the path of each value within a JSON document; of long lists only the first and last."""
    yield path
    if isinstance(value, dict):
        for name in value:
            yield from places(value[name], (*path, name))
    elif isinstance(value, list):
        for number in range(len(value)) if len(value) < 4 else (0, 1, len(value) - 1):
            yield from places(value[number], (*path, number))


def with_value(document, path, value):
    """Return a JSON document with another value at a path; ``KeyError`` drops what is there."""
    if not path:
        return value
    inner = document
    for part in path[:-1]:
        inner = inner[part]
    if value is KeyError:
        del inner[path[-1]]
    else:
        inner[path[-1]] = value
    return document


def with_wrong_value(text, draws):
    """Return JSON with one value lost, or another in its place."""
    document = json.loads(text)
    path = draws.choice(list(places(document)))
    drop = path and isinstance(path[-1], str) and draws.random() < 0.15
    return dumped(with_value(document, path, KeyError if drop else draws.choice(NASTY)))


def with_wrong_bytes(content, draws):
    """Return bytes with bits flipped, pieces put in or cut out, the end cut off, or lines lost or doubled."""
    for _ in range(draws.choice([1, 1, 3, 20])):
        at = draws.randrange(len(content) or 1)
        kind = draws.randrange(6)
        if kind == 0 and content:
            content = content[:at] + bytes([content[at] ^ 1 << draws.randrange(8)]) + content[at + 1 :]
        elif kind == 1:
            content = content[:at] + content[at + draws.choice([1, 10, 1000]) :]
        elif kind == 2:
            content = content[:at] + draws.choice(PIECES) + content[at:]
        elif kind == 3:
            content = content[:at]
        else:
            lines = content.split(b"\n")
            number = draws.randrange(len(lines))
            if kind == 4:
                lines.insert(draws.randrange(len(lines) + 1), lines[number])
            else:
                del lines[number]
            content = b"\n".join(lines)
    return content


def mutated(name, content, draws):
    """Return a damaged file: half of those that hold JSON stay JSON, with a wrong value."""
    if Path(name).suffix not in (".json", ".jsonl") or draws.random() < 0.4:
        return with_wrong_bytes(content, draws)
    lines = content.decode().split("\n") if name.endswith("jsonl") else [content.decode()]
    number = draws.randrange(max(1, len(lines) - 1))
    lines[number] = with_wrong_value(lines[number], draws)
    return "\n".join(lines).encode()


def outcomes_of_damage(made, good, case, count, seed):
    """Damage the folder again and again, use it, and return how often it was read and how often refused."""
    draws = random.Random(seed)
    read = refused = 0
    for number in range(count):
        name = draws.choice(list(FILES))
        what = draws.choice(FILES[name])
        shutil.rmtree(case)
        shutil.copytree(good, case)
        (case / name).write_bytes(mutated(name, (case / name).read_bytes(), draws))
        # Absurd values that are finite make scores that are not, which numpy warns of.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            said = refusal(use, what, case, made, good)
        assert len(said) < 20_000, (number, name, what)
        assert all(line.isprintable() for line in said.split("\n")), (number, name, what, said[:200])
        read, refused = read + (not said), refused + bool(said)
    return read, refused


@pytest.mark.parametrize("seed", range(4))
def test_damaged_folders_are_read_or_refused(made, good, case, seed):
    """Damaged journals, manifests, specs and layouts raise nothing but errors of ours, whoever reads them."""
    read, refused = outcomes_of_damage(made, good, case, 60, seed)
    assert read > 5
    assert refused > 10


@pytest.mark.long
@pytest.mark.parametrize("seed", range(10, 14))
def test_many_damaged_folders_are_read_or_refused(made, good, case, seed):
    """The same for thousands."""
    read, refused = outcomes_of_damage(made, good, case, 1000, seed)
    assert read > 100
    assert refused > 200


@pytest.mark.parametrize("change", ["group", "first", "count", "columns"])
@pytest.mark.parametrize("what", REPLAYING)
@pytest.mark.timeout(20)
def test_outcomes_under_the_key_of_another_task_are_refused(made, good, case, what, change):
    """A journal whose lines belong to other tasks than their keys say is damaged, and is not replayed for ever."""
    for path in (case / "results.jsonl", *case.glob("shards/*/results.jsonl")):
        records = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
        for record in records:
            if change == "columns" and "names" in record:
                record["names"][0] = "zone.lost_share"
            if "values" in record:
                record["values"] *= 2 if change == "count" else 1
                record["first"] += change == "first"
                record["group"][3] = "x" if change == "group" else record["group"][3]
        path.write_text("".join(json.dumps(record) + "\n" for record in records), encoding="utf-8")
    with pytest.raises(StudyDamaged) as raised:
        use(what, case, made, good)
    assert ("another version of layoutopt" in str(raised.value)) == (change == "columns")


@pytest.mark.parametrize("name", ["manifest.json", "status.json"])
def test_every_field_of_a_table_may_hold_anything(good, case, name):
    """Each field of manifest and status in turn is lost or of any wrong kind: the status is told, or refused."""
    shutil.rmtree(case / "shards")
    document = json.loads((good / name).read_text(encoding="utf-8"))
    for path in places(document):
        for value in (KeyError, *NASTY):
            if path or value is not KeyError:
                text = dumped(with_value(json.loads(json.dumps(document)), path, value))
                (case / name).write_text(text, encoding="utf-8")
                lines = []
                said = refusal(collect, lines, lambda folder: read_status(folder).lines(), case)
                assert all(line.isprintable() and len(line) < 1000 for line in (*lines, said)), (path, value)


def test_every_field_of_a_journal_line_may_hold_anything(good, tmp_path):
    """Each field of a line in turn is lost or of any wrong kind: the line is refused, or it is sound."""
    text = (good / "results.jsonl").read_text(encoding="utf-8").splitlines()
    refused = 0
    for number, line in enumerate(text[:2]):
        document = json.loads(line)
        for path in places(document):
            for value in (KeyError, *NASTY):
                if path or value is not KeyError:
                    changed = dumped(with_value(json.loads(line), path, value))
                    lines = [*text[:number], changed, *text[number + 1 : 3], ""]
                    (tmp_path / "results.jsonl").write_text("\n".join(lines), encoding="utf-8")
                    items = []
                    said = refusal(collect, items, lambda folder: read_recorded(folder).values(), tmp_path)
                    refused += bool(said)
                    assert said.isprintable()
                    assert len(said) < 1000
                    for item in items:
                        assert all(isinstance(word, str) for word in item.group)
                        assert 0 <= item.first == item.outcomes.replications[0]
                        assert not np.isinf(item.outcomes.values).any()
    assert refused > 500


MINE = b"mine\n"


def outside_of(case, content=MINE):
    """Return a file and a folder that a link in the folder might lead to."""
    file, folder = case.parent / "outside.txt", case.parent / "outside"
    file.write_bytes(content)
    folder.mkdir()
    (folder / "front.svg").write_text("mine\n", encoding="utf-8")
    return file, folder


def untouched(file, folder, content=MINE):
    return file.read_bytes() == content and [path.name for path in folder.iterdir()] == ["front.svg"]


USES = ("status", "merge", "reprice", "resume", "shard", "journal")
WRITING = ("merge", "resume", "journal")


@pytest.mark.timeout(30)
@pytest.mark.parametrize("kind", ["link", "dangling link", "pipe", "folder", "second name"])
@pytest.mark.parametrize("name", [".lock", "manifest.json", "results.jsonl", "spec.toml"])
def test_own_files_must_be_plain_files(made, good, case, name, kind):
    """Whoever opens a folder refuses links, pipes and folders in place of its files, and says which one it is."""
    # A whole file of that kind, as it might be another study's; a journal would be cut where it is torn.
    content = (good / name).read_bytes() + (b'{"torn' if name == "results.jsonl" else b"")
    file, folder = outside_of(case, content)
    (case / name).unlink()
    if kind == "link":
        (case / name).symlink_to(file)
    elif kind == "dangling link":
        (case / name).symlink_to(folder / "new.txt")
    elif kind == "pipe":
        os.mkfifo(case / name)
    elif kind == "folder":
        (case / name).mkdir()
    else:
        os.link(file, case / name)
    # A file with a second name is refused where it would be written to in place.
    for what in USES if kind != "second name" else WRITING if name in (".lock", "results.jsonl") else ():
        said = refusal(use, what, case, made, good)
        assert str(case / name) in said or (what, kind) == ("reprice", "dangling link"), (what, said)
        assert said
        assert untouched(file, folder, content)


@pytest.mark.parametrize("name", ["layouts", "recommended", "figures", "tables", "shards"])
def test_folders_that_lead_elsewhere_are_not_written_to(made, good, case, name):
    """A link in place of a folder into which a study writes is refused before anything is written."""
    file, folder = outside_of(case)
    shutil.rmtree(case / name, ignore_errors=True)
    (case / name).symlink_to(folder, target_is_directory=True)
    for what in ("resume", "journal"):
        with pytest.raises(StudyDamaged, match="symbolic link"):
            use(what, case, made, good)
    assert untouched(file, folder)


def test_a_shard_that_leads_elsewhere_is_not_written_to(made, good, case):
    """A link in place of a shard's folder is not followed by the shard, and nothing is made at its end."""
    file, folder = outside_of(case)
    (case / "results.jsonl").unlink()
    shutil.rmtree(case / "shards" / "1_of_2")
    (case / "shards" / "1_of_2").symlink_to(folder, target_is_directory=True)
    with pytest.raises(StudyDamaged, match="symbolic link"):
        use("shard", case, made, good)
    assert untouched(file, folder)


@pytest.mark.timeout(30)
@pytest.mark.parametrize("kind", ["link", "pipe", "large"])
def test_a_status_that_is_no_plain_small_file_says_nothing(good, case, kind):
    """The status is told from the journal alone where its file is a link, a pipe or larger than any."""
    file, _ = outside_of(case)
    file.write_text('{"state": "finished", "best": "from elsewhere"}', encoding="utf-8")
    (case / "status.json").unlink()
    if kind == "link":
        (case / "status.json").symlink_to(file)
    elif kind == "pipe":
        os.mkfifo(case / "status.json")
    else:
        text = json.dumps({"state": "finished", "best": "from elsewhere", "x": "x" * journal.LARGEST_JSON})
        (case / "status.json").write_text(text, encoding="utf-8")
    found = read_status(case)
    assert "from elsewhere" not in "\n".join(found.lines())
    assert found.tasks == read_status(good).tasks


def test_shards_within_shards_are_not_looked_for(case):
    """Links that lead round in a circle are followed once: the status ends, however they are entangled."""
    for number in range(20):
        (case / "shards" / f"loop_{number}").symlink_to(case, target_is_directory=True)
    found = read_status(case)
    assert len(found.shards) == 22
    assert not any(shard.shards for shard in found.shards.values())


def test_a_manifest_of_any_size_is_not_read(case):
    """A manifest beyond five megabytes is refused by its size, whatever it holds."""
    with (case / "manifest.json").open("ab") as file:
        file.write(b" " * journal.LARGEST_JSON)
    with pytest.raises(StudyDamaged, match="more than 5 MB"):
        read_manifest(case)


@pytest.mark.timeout(60)
def test_an_endless_line_is_not_read(case, monkeypatch):
    """Of a file of a terabyte without a line end only so much is read as a line may have."""
    monkeypatch.setattr(journal, "LONGEST_LINE", 1_000_000)
    os.truncate(case / "results.jsonl", 2**40)
    with pytest.raises(StudyDamaged, match="line has more than"):
        read_recorded(case)


@pytest.mark.parametrize(
    "command",
    [
        "layoutopt study x --resume; rm -rf ~",
        "layoutopt study `id`",
        "layoutopt study $(id)",
        "layoutopt study x > ~/.profile",
        "layoutopt study x\nrm -rf ~",
        "rm -rf ~",
        "layoutopt study 'x",
        "layoutopt study \x1b[2J",
        ["layoutopt"],
    ],
)
def test_a_command_to_go_on_is_one_of_ours_or_none(case, command):
    """People copy what the status says: anything but one plain call of layoutopt is left out."""
    told = json.loads((case / "status.json").read_text(encoding="utf-8"))
    shutil.rmtree(case / "shards")
    assert "go on with: layoutopt study" in "\n".join(read_status(case).lines())
    (case / "status.json").write_text(json.dumps({**told, "go_on": command}), encoding="utf-8")
    assert "go on with" not in "\n".join(read_status(case).lines())


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("manifest.json", b'{"study": "\\u001b[2J", "seed": 3}'),
        ("manifest.json", b"\x80\x04\x95\x0c\x00\x00\x00"),
        ("results.jsonl", b'{"key": "\\u001b[2J"}\n'),
        ("results.jsonl", b'{"key": 1, "group": ["\\ud800"]}\n'),
        ("spec.toml", b"PK\x03\x04"),
    ],
)
def test_the_command_line_refuses_damage_in_one_message(good, case, tmp_path, name, content):
    """Status, merge, reprice and a study that goes on end with exit 2, a line each and no traceback."""
    (case / name).write_bytes(content)
    for part in (case / "shards").iterdir():
        (part / name).write_bytes(content)
    spec = tmp_path / "spec.toml"
    spec.write_bytes((good / "spec.toml").read_bytes())
    commands = [("merge", case), ("reprice", case, good.with_name("prices.toml"))]
    commands += [] if name == "spec.toml" else [("status", case), ("status", case, "--json")]
    if name != "spec.toml":
        commands += [("study", NAME, spec, "--quick", "--out", case, "--resume", "--backend", "serial")]
    for command in commands:
        ended = called(*command, cwd=tmp_path)
        assert ended.returncode == 2, ended
        assert ended.stdout == ""
        assert ended.stderr.strip()
        assert all(line.isprintable() for line in ended.stderr.splitlines())
        assert "Traceback" not in ended.stderr
