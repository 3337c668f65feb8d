"""Bad input through the command line: one message with place, value and repair, exit 2, nothing written."""

import subprocess
import sys

import pytest
from command_line import called

FLOOR = "[site]\nfloor = [[0,0],[4,0],[4,3],[0,3]]\n"
ZONE = FLOOR + '[[site.zone]]\nname = "dock"\nregion = {region}\n{more}\n'
CASES = {
    "unknown key": (FLOOR + "[robots]\ncuont = 2\n", ("bad.toml:4", "cuont", "count")),
    "nan": (FLOOR + "[goal]\ntarget_error = nan\n", ("bad.toml:4", "target_error", "nan")),
    "infinite": (FLOOR + "[robots]\nspeed = inf\n", ("bad.toml:4", "speed", "inf")),
    "self-crossing": ("[site]\nfloor = [[0,0],[4,3],[4,0],[0,3]]\n", ("bad.toml:2", "floor")),
    "absurd extents": ("[site]\nfloor = [[0,0],[4000,0],[4000,3000],[0,3000]]\n", ("bad.toml:2", "4000")),
    "reader outside": (
        FLOOR + '[space]\nreaders = [{ family = "ring", count = 3, radius = "2 m" }]\n',
        ("bad.toml:4", "outline"),
    ),
    "pitch below tag size": (
        FLOOR + '[space]\npatterns = [{ family = "square", pitch = "10 mm" }]\n',
        ("bad.toml:4", "10 mm", "20 mm"),
    ),
    "empty space": (FLOOR + "[space]\npatterns = []\n", ("bad.toml:4", "patterns")),
    "missing plan": ('[site]\nplan = "no.yaml"\n', ("bad.toml:2", "no.yaml")),
    "zone outside": (ZONE.format(region="[[9,9],[10,9],[10,10]]", more=""), ("bad.toml:", "dock")),
    "target without tags": (
        ZONE.format(region="[[0,0],[1,0],[1,1],[0,1]]", more='tags = false\ntarget_error = "10 mm"'),
        ("bad.toml:7", "target_error", "10 mm", "tags = false"),
    ),
    "pattern of later": (
        FLOOR + '[space]\npatterns = [{ family = "hexagonal" }]\n',
        ("bad.toml:4", "hexagonal", "square"),
    ),
    "estimator of later": (
        FLOOR + '[study]\nvalidate_with = ["uhf_laser"]\n',
        ("bad.toml:4", "uhf_laser"),
    ),
    "tilt out of range": (
        FLOOR + '[space]\npatterns = [{ family = "tilted", tile = "0.7 m", angle = "100 deg" }]\n',
        ("bad.toml:4", "between 0 and 90°", "100°"),
    ),
    "tile too small at a tilt": (
        FLOOR
        + '[space]\npatterns = [{ family = "tilted", tile = "0.6 m", angle = "45 deg", radius = "0.1 m" }]\n',
        ("bad.toml:4", "tilted by 45°", "682.8 mm"),
    ),
    "tile too small for a Sudoku": (
        FLOOR + '[space]\npatterns = [{ family = "sudoku", tile = "0.6 m", seed = 1, radius = "0.1 m" }]\n',
        ("bad.toml:4", "(6.83 r)", "682.8 mm"),
    ),
    "no room at random": (
        FLOOR + '[space]\npatterns = [{ family = "random", tile = "0.3 m", seed = 1, radius = "0.1 m" }]\n',
        ("bad.toml:4", "(4 r)", "400 mm"),
    ),
    "radius not positive": (
        FLOOR + '[space]\npatterns = [{ family = "sudoku", tile = "0.7 m", seed = 1, radius = "0 mm" }]\n',
        ("bad.toml:4", "radius must be positive"),
    ),
    "tags that overlap": (
        FLOOR + '[space]\npatterns = [{ family = "listed", points = [[0, 0], [1, 0]], cell = ["1 m", "1 m"] }]\n',
        ("bad.toml:4", "share a place"),
    ),
    "empty cell": (
        FLOOR + '[space]\npatterns = [{ family = "listed", points = [], cell = ["1 m", "1 m"] }]\n',
        ("bad.toml:4", "points", "list of 1 to"),
    ),
    "a target without its unit": (
        FLOOR + "[goal]\ntarget_error = 20\n",
        ("bad.toml:4", "at most 1 m", "A bare number is in m", 'Did you mean "20 mm"?'),
    ),
    "a pitch without its unit": (
        FLOOR + '[space]\npatterns = [{ family = "square", pitch = 200 }]\n',
        ("bad.toml:4", "'pitch' is 200 m, and 10 m at most", 'Did you mean "200 mm"?'),
    ),
    "an angle without its unit": (
        FLOOR + "[study]\nstart_uncertainty = { heading = 3 }\n",
        ("bad.toml:4", "degrees or radians", 'Write "3 deg" or "3 rad".'),
    ),
    "a turn rate without its unit": (
        FLOOR + "[robots]\nturn_rate = 45\n",
        ("bad.toml:4", "degrees or radians", 'Write "45 deg/s" or "45 rad/s".'),
    ),
    "a speed without its unit": (
        FLOOR + "[robots]\nspeed = 300\n",
        ("bad.toml:4", "at most 50 m/s", 'Did you mean "300 mm/s"?'),
    ),
    "a share without its unit": (
        FLOOR + "[study]\nleast_difference = 20\n",
        ("bad.toml:4", "at most 1", 'A bare number counts from 0 to 1. Did you mean "20 %"?'),
    ),
    "more than everything": (
        FLOOR + '[goal]\nlimits = ["walk_coverage >= 120 %"]\n',
        ("bad.toml:4", "'walk_coverage' is a share", "more than 100 %"),
    ),
    "one trial of docking": (
        FLOOR + "[docking]\ntrials = 1\n",
        ("bad.toml:4", "docking.trials = 1", "2"),
    ),
    "one trial of tracking": (
        FLOOR + "[tracking]\ntrials = 1\n",
        ("bad.toml:4", "tracking.trials = 1", "2"),
    ),
    "a crowd of bystanders": (
        FLOOR + "[tracking]\nbystanders = 500\n",
        ("bad.toml:4", "tracking.bystanders = 500", "100"),
    ),
    "no TOML": ("[site\n", ("bad.toml",)),
    "empty": ("", ("bad.toml", "the file is empty")),
}


@pytest.mark.parametrize("name", CASES)
def test_a_bad_spec_ends_in_a_message_and_exit_2(tmp_path, name):
    """The message names file, line or key and value; there is no traceback and no output folder."""
    text, parts = CASES[name]
    (tmp_path / "bad.toml").write_text(text, encoding="utf-8")
    done = called("study", "cost_vs_accuracy", "bad.toml", "--out", "out", cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert not done.stdout
    assert "Traceback" not in done.stderr
    for part in parts:
        assert part in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bad.toml"]


def test_a_process_of_its_own_ends_alike(tmp_path):
    """Exit code and words that the tests here see without a process are those that a shell sees."""
    (tmp_path / "bad.toml").write_text(CASES["nan"][0], encoding="utf-8")
    arguments = ("study", "cost_vs_accuracy", "bad.toml", "--out", "out")
    here = called(*arguments, cwd=tmp_path)
    own = subprocess.run(
        [sys.executable, "-m", "layoutopt", *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert (own.returncode, own.stdout, own.stderr) == (here.returncode, here.stdout, here.stderr)
    assert own.returncode == 2
    assert [path.name for path in tmp_path.iterdir()] == ["bad.toml"]


def test_an_estimator_that_fits_no_layout_is_told_before_any_trial(tmp_path):
    """Crossing times know one antenna, and every layout has several: a status, exit 1, no trial."""
    (tmp_path / "several.toml").write_text(
        FLOOR + '[study]\nvalidate_with = ["crossing_time"]\n', encoding="utf-8"
    )
    done = called("study", "cost_vs_accuracy", "several.toml", "--out", "out", cwd=tmp_path)
    assert done.returncode == 1, done.stderr
    assert "can be built and judged" in done.stdout
    assert "estimator 'crossing_time' does not apply: it works with one antenna" in done.stdout
    assert not (tmp_path / "out").exists()


def test_every_fault_is_told_at_once(tmp_path):
    """Three faults of one file come in one run."""
    (tmp_path / "bad.toml").write_text(
        FLOOR + '[robots]\ncount = 0\nspeed = "3 kg"\n[goal]\ntarget_eror = "1 mm"\n', encoding="utf-8"
    )
    done = called("check", "bad.toml", cwd=tmp_path)
    assert done.returncode == 2
    assert all(word in done.stderr for word in ("count", "speed", "target_eror"))


def test_a_negative_price_is_refused(tmp_path):
    """A price list with a negative price names file, item and value."""
    (tmp_path / "mine.toml").write_text(
        'schema = 1\nbase = "default-2026"\nname = "mine"\ndate = "2026"\n'
        '[items.label]\nprice = "-1 EUR"\nsource = "a test"\n'
    )
    (tmp_path / "spec.toml").write_text(FLOOR + '[parts]\nprices = "mine.toml"\n')
    done = called("check", "spec.toml", cwd=tmp_path)
    assert done.returncode == 2
    assert "mine.toml" in done.stderr
    assert "label" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("study", "cost_vs_acuracy"), ("cost_vs_acuracy", "Did you mean 'cost_vs_accuracy'?")),
        (("score", "none.toml"), ("none.toml",)),
        (("reprice", ".", "none.toml"), ("holds no study",)),
        (("solve", "--target-error", "10 kg"), ("--target-error", "10 kg")),
        (("solve", "--budget", "-5"), ("--budget",)),
        (("check", "."), (".",)),
        (("study", "cost_vs_accuracy", "--wrong"), ("--wrong",)),
    ],
)
def test_wrong_arguments_end_in_exit_2(tmp_path, arguments, words):
    """Names, files and values of the command line are named in the message."""
    done = called(*arguments, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    for word in words:
        assert word in done.stderr


def test_new_never_overwrites(tmp_path):
    """`layoutopt new` refuses a file that exists and leaves it as it is."""
    (tmp_path / "own.toml").write_text("mine")
    done = called("new", "own.toml", cwd=tmp_path)
    assert done.returncode == 2
    assert (tmp_path / "own.toml").read_text() == "mine"


def test_the_template_is_a_spec_that_checks(tmp_path):
    """What `layoutopt new` writes passes `layoutopt check`."""
    assert called("new", "own.toml", cwd=tmp_path).returncode == 0
    done = called("check", "own.toml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "layouts: 1440, of which 780" in done.stdout
