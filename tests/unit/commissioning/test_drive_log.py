"""Logs of drives: what is written is read, and every fault of a file is told with line and column."""

import csv

import numpy as np
import pytest

from layoutopt.commissioning.drive_log import write_log
from layoutopt.commissioning.log_reading import read_log
from layoutopt.commissioning.resampling import resampled
from layoutopt.detection import antennas_of
from layoutopt.errors import InvalidInput
from layoutopt.layout import Layout, ReaderGroup
from layoutopt.readings import UNKNOWN_TAG

HEAD = "time_s,odom_x_m,odom_y_m,odom_theta_rad,reads\n"
SOUND = HEAD + "0,0,0,0,\n0.05,0.01,0,0,0:17\n0.1,0.02,0,0,1:18 3:?\n"


@pytest.fixture
def read(tiny, tmp_path):
    spec, layouts = tiny

    def of(text, layout=layouts[0]):
        path = tmp_path / "drive.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_log(path, layout=layout, tag_map=layout.floor_tags.lay_on(spec.site), robot=spec.robot)

    return of


@pytest.fixture
def faults(read):
    def of(text):
        with pytest.raises(InvalidInput) as caught:
            read(text)
        return [str(fault).partition("drive.csv")[2] for fault in caught.value.faults]

    return of


def columns(path, keep):
    """Return a log with only some of its columns."""
    rows = list(csv.reader(path.read_text().splitlines()))
    places = [place for place, name in enumerate(rows[0]) if keep(name)]
    return "\n".join(",".join(row[place] for place in places) for row in rows) + "\n"


@pytest.mark.parametrize("number", [0, 9])
def test_a_written_drive_gives_the_same_observations(tiny, driven, tmp_path, read, number):
    """Increments, reads, scans, gyro and truth of a simulated drive come back from its log."""
    spec, layouts = tiny
    layout = layouts[number]
    record = driven(number, missed_read_share=0.05, wrong_identity_share=0.02)
    path = tmp_path / "written.csv"
    write_log(path, record, layout=layout, tag_map=layout.floor_tags.lay_on(spec.site))
    drive = resampled(read(path.read_bytes(), layout), spec, antennas_of(layout, spec.study.step_s))
    wanted, found = record.observations, drive.observations
    assert found.increments == pytest.approx(wanted.increments, abs=1e-9)
    assert found.gyro_turn_rad == pytest.approx(wanted.gyro_turn_rad, abs=1e-9)
    for name in ("read_start", "read_antenna", "read_tag", "active"):
        assert np.array_equal(getattr(found, name), getattr(wanted, name)), name
    assert drive.truth == pytest.approx(record.drive.poses[1:], abs=1e-9)
    assert drive.steady.all()


def test_poses_and_motion_are_the_same_drive(read):
    """A pose a row and the motion since the row before give the same path, from any origin."""
    poses = read(HEAD + "0,5,5,1.5707963267948966,\n0.1,5,5.01,1.6,\n0.2,5,5.02,1.6,\n")
    motion = read(
        "time_s,forward_m,left_m,turn_rad,reads\n0,9,9,9,\n0.1,0.01,0,0.0292036732051034,\n"
        f"0.2,{0.01 * np.sin(1.6):.17g},{0.01 * np.cos(1.6):.17g},0,\n"
    )
    assert motion.poses == pytest.approx(poses.poses, abs=1e-12)
    assert poses.poses[0].tolist() == [0.0, 0.0, 0.0]


def test_topics_may_stand_in_rows_of_their_own(read):
    """Rows of odometry, reads and truth can be merged by time, also at the same time."""
    log = read(
        "time_s,odom_x_m,odom_y_m,odom_theta_rad,reads,truth_x_m,truth_y_m,truth_theta_rad\n"
        "0,0,0,0,,,,\n0,,,,0:17,,,\n0.03,,,,,1,1,3.1\n0.05,0.01,0,0,,,,\n0.05,,,,1:18,,,\n0.06,,,,,1,1,-3.1\n"
    )
    assert log.time_s.tolist() == [0.0, 0.05]
    assert log.read_time_s.tolist() == [0.0, 0.05]
    assert log.truth_time_s.tolist() == [0.03, 0.06]
    assert log.truth[1, 2] == pytest.approx(2 * np.pi - 3.1)


def test_a_tag_outside_the_map_is_known_as_such(read):
    """A read of "?" counts as a read without an identity."""
    assert read(SOUND).read_tag.tolist() == [16, 17, UNKNOWN_TAG]


def test_antennas_are_numbered_through_all_groups(tiny, read):
    """Antennas that read no floor tags keep their number on the sheet, and reads count the others."""
    group = tiny[1][0].readers[0]
    other = ReaderGroup(
        name="uhf",
        poses=group.poses[:2],
        antenna=group.antenna,
        profile=group.profile,
        slots=(0, 0),
        kind="signal",
    )
    layout = Layout(floor_tags=tiny[1][0].floor_tags, readers=(other, group))
    assert read(SOUND.replace("0:17", "2:17").replace("1:18 3:?", "5:?"), layout).read_antenna.tolist() == [0, 3]
    with pytest.raises(InvalidInput, match=r"no antenna '0'.* Its numbers are 2 to 5"):
        read(SOUND, layout)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (SOUND.replace("odom_y_m", "odom_y"), ":1 odom_y: unknown column. Did you mean 'odom_y_m'?"),
        (SOUND.replace("time_s", "t"), ":1 time_s: this column is missing."),
        (SOUND.replace("reads", "scans"), ":1 reads: this column is missing."),
        (SOUND.replace("odom_x_m,odom_y_m,odom_theta_rad", "a,b,c"), ":1: there is no odometry."),
        (SOUND.replace("odom_y_m", "left_m"), ":1: there is odometry as poses and as motion."),
        (SOUND.replace("odom_y_m", "odom_x_m"), ":1 odom_x_m: this column stands twice."),
        (SOUND.replace(",", ";"), ":1: the columns are not separated by commas."),
        (SOUND.replace("0.01", "one"), ":3 odom_x_m: 'one' is no finite number."),
        (SOUND.replace("0.01", "nan"), ":3 odom_x_m: 'nan' is no finite number. Leave the cell empty"),
        (SOUND.replace("0.01", "1e7"), ":3 odom_x_m: 1e7 is out of range."),
        (SOUND.replace("0.01", "1_0"), ":3 odom_x_m: '1_0' is no finite number."),
        (SOUND.replace("0.01", ""), ":3 odom_x_m: this cell is empty."),
        (SOUND.replace("0.1,", "0.01,"), ":4 time_s: 0.01 is before the 0.05 of line 3."),
        (SOUND.replace("0.1,", "0.05,"), ":4 time_s: 0.05 is also the time of the odometry in line 3."),
        (SOUND.replace("0.1,", ","), ":4 time_s: this cell is empty."),
        (SOUND.replace("0.1,", "1700000000000,"), ":4 time_s: 1700000000000 is out of range."),
        (SOUND.replace("0:17", "0:9999"), ":3 reads: no tag '9999' in the layout's tag map. Its tags are 1 to"),
        (SOUND.replace("0:17", "0:x"), ":3 reads: no tag 'x'"),
        (SOUND.replace("0:17", "4:17"), ":3 reads: no antenna '4' that reads tags"),
        (SOUND.replace("0:17", "17"), ":3 reads: '17' is no read."),
        (SOUND.replace("0:17", "0:17,"), ":3: this row has 6 cells."),
        (SOUND + '"0.2', ":5: this is no CSV"),
        (HEAD, ": there is no row behind the header."),
        (HEAD + "0,0,0,0,\n", " odom_x_m: there is odometry in 1 rows."),
        ("", ": the file is empty."),
        (SOUND.encode("utf-16"), ":1: byte 0 is not UTF-8."),
        (SOUND.replace("0:17", "0:\0"), ":3: this is a binary file."),
    ],
)
def test_a_fault_is_told_with_line_and_column(faults, text, complaint):
    """A fault says where, what and what would be right; one in a row gives one message."""
    found = faults(text)
    assert any(line.startswith(complaint) for line in found)
    assert len(found) == 1 or complaint.startswith(":1")
    assert all(line.endswith((".", "?", ")")) for line in found)


def test_all_faults_come_at_once_up_to_a_limit(faults):
    """Three faults, three messages; of a thousand the first hundred and how many more there are."""
    assert len(faults(SOUND.replace("0.01", "x").replace("0:17", "9:17").replace("0.02", "inf"))) == 3
    many = faults(HEAD + "0,0,0,0,\n" + "1,x,0,0,\n" * 1000)
    assert len(many) == 101
    assert "there are 900 more faults" in many[-1]


def test_files_of_windows_and_padded_cells_are_read(read):
    """Line ends, byte order mark and blanks do no harm, and empty lines none either."""
    assert read("\ufeff" + SOUND.replace("\n", "\r\n")).read_tag.tolist() == read(SOUND).read_tag.tolist()
    assert read(SOUND.replace(",", " , ") + "\n,,,,\n").read_tag.tolist() == read(SOUND).read_tag.tolist()


def test_a_jump_of_the_odometry_is_told_and_taken_out(read):
    """Encoders that were reset do not move the robot, and the note names the line."""
    log = read(HEAD + "0,7,3,1,\n0.05,7,3.01,1,\n0.1,0,0,0,\n0.15,0.01,0,0,\n")
    assert log.jumps.tolist() == [2]
    assert "drive.csv:4: the odometry jumps by 7.62 m" in log.notes[0]
    assert np.hypot(*np.diff(log.poses[:, :2], axis=0).T) == pytest.approx([0.01, 0.0, 0.01])
