"""Mutated logs of drives: whatever the bytes, a drive of sound numbers or one clear error."""

import contextlib
import time

import numpy as np
import pytest

from layoutopt.commissioning.log_reading import read_log
from layoutopt.commissioning.resampling import resampled
from layoutopt.detection import antennas_of
from layoutopt.errors import InvalidInput
from layoutopt.readings import UNKNOWN_TAG
from layoutopt.spec.reading import read_spec

LOG = (
    b"time_s,odom_x_m,odom_y_m,odom_theta_rad,gyro_turn_rad,reads,scans,truth_x_m,truth_y_m,truth_theta_rad\n"
    b"10,0,0,0,0,,,1,1,3.1\n10.05,0.015,0,0.01,0.01,0:17 1:18,0 1 2 3,1.015,1,3.11\n"
    b"10.06,,,,,2:?,2,,,\n10.1,0.03,0.0001,0.02,0.01,,0 1 2 3,1.03,1,3.12\n10.12,,,,,,,1.04,1,-3.13\n"
    b"10.15,0.045,-1e-4,0.03,0.01,3:1000,0 1 2 3,1.045,1,3.13\n"
)
PIECES = (
    b'nan inf -inf 1e999 -0 9999999999 0x1F 1_0 .5 5. - + e 17 ? : :: 0:0 -1:3 9:17 , ,, ; \t \r\n \n " "" \''
).split(b" ")
PIECES += [b" ", b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\x1b[31m", b"9" * 200, b"=1+1", "\u00b5\u0661".encode()]


@pytest.fixture(scope="module")
def world(tmp_path_factory, tiny_text):
    path = tmp_path_factory.mktemp("hostile") / "tiny.toml"
    path.write_text(tiny_text, encoding="utf-8")
    spec = read_spec(path)
    return spec, next(iter(spec.space.layouts()))


def mutated(draws):
    """Return the log with one to four changes: a byte, a piece put in, a cut, a part doubled, or lines swapped."""
    content = LOG
    for _ in range(int(draws.integers(1, 5))):
        place = int(draws.integers(len(content) + 1))
        length = int(draws.integers(1, 12))
        kind = draws.integers(5)
        if kind == 0:
            content = content[:place] + bytes([int(draws.integers(256))]) + content[place + 1 :]
        elif kind == 1:
            content = content[:place] + PIECES[int(draws.integers(len(PIECES)))] + content[place:]
        elif kind == 2:
            content = content[:place] + content[place + length :]
        elif kind == 3:
            content = content[:place] + content[place : place + 4 * length] + content[place:]
        else:
            lines = content.split(b"\n")
            first, second = (int(number) for number in draws.integers(len(lines), size=2))
            lines[first], lines[second] = lines[second], lines[first]
            content = b"\n".join(lines)
    return content


def check(content, world, path):
    """Read a log to observations, or see it refused with short printable messages, quickly."""
    spec, layout = world
    path.write_bytes(content)
    tag_map = layout.floor_tags.lay_on(spec.site)
    begin = time.monotonic()
    try:
        log = read_log(path, layout=layout, tag_map=tag_map, robot=spec.robot)
        drive = resampled(log, spec, antennas_of(layout, spec.study.step_s))
    except InvalidInput as error:
        messages = [str(fault) for fault in error.faults]
    else:
        messages = ["sound"]
        observations = drive.observations
        assert np.isfinite(observations.increments).all()
        assert np.isfinite(observations.sigma).all()
        tags = observations.read_tag
        assert ((tags == UNKNOWN_TAG) | ((tags >= 0) & (tags < len(tag_map)))).all()
        assert observations.read_start[0] == 0
        assert observations.read_start[-1] == len(tags)
        assert (np.diff(observations.read_start) >= 0).all()
        assert observations.active.shape == (len(observations), 4)
    assert messages
    assert all(len(message) < 1000 and message.isprintable() for message in messages)
    assert time.monotonic() - begin < 20.0


@pytest.mark.parametrize("seed", range(4))
def test_a_mutated_log_is_read_or_refused(tmp_path, world, seed):
    """A hundred mutations a seed: no other exception, no number that is not finite, no endless table."""
    draws = np.random.Generator(np.random.Philox(seed))
    for _ in range(100):
        check(mutated(draws), world, tmp_path / "drive.csv")


@pytest.mark.long
@pytest.mark.parametrize("seed", range(100, 108))
def test_thousands_of_mutated_logs_are_read_or_refused(tmp_path, world, seed):
    """The same for eight thousand mutations."""
    draws = np.random.Generator(np.random.Philox(seed))
    for _ in range(1000):
        check(mutated(draws), world, tmp_path / "drive.csv")


def test_the_log_itself_is_sound(tmp_path, world):
    """What is mutated can be read, so that the mutations reach every part of the reader."""
    spec, layout = world
    (tmp_path / "drive.csv").write_bytes(LOG)
    log = read_log(
        tmp_path / "drive.csv", layout=layout, tag_map=layout.floor_tags.lay_on(spec.site), robot=spec.robot
    )
    assert len(log.read_tag) == 4
    assert len(log.truth) == 5


@pytest.mark.parametrize(
    "content",
    [
        b"PK\x03\x04" + bytes(range(256)),
        LOG.decode().encode("utf-16"),
        b"\x00" * 1000,
        b"," * 100_000,
        b"\n" * 100_000,
        b'"' + b"x" * 300_000,
        b"time_s," + b"a," * 50_000,
        LOG + b"11," + b"0" * 200_000 + b",0,0,0,,,,,\n",
        LOG + b"11,0,0,0,0," + b"0:1 " * 40_000 + b",,,,\n",
        LOG + b"9e10,0,0,0,0,,,,,\n",
        LOG + b"11,1e6,1e6,1e6,1e6,,,1e6,1e6,1e6\n",
    ],
    ids=range(11),
)
def test_files_made_to_hurt_are_read_or_refused(tmp_path, world, content):
    """Archives, other encodings, endless cells and absurd numbers do no harm."""
    check(content, world, tmp_path / "drive.csv")


def test_places_that_are_no_files_are_refused(tmp_path, world):
    """Folders, missing files and impossible names get a message too."""
    spec, layout = world
    for path in (tmp_path, tmp_path / "none.csv", tmp_path / ("x" * 300), "a\0b"):
        with pytest.raises(InvalidInput), contextlib.suppress(OSError):
            read_log(path, layout=layout, tag_map=layout.floor_tags.lay_on(spec.site), robot=spec.robot)
