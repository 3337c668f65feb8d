"""Specs that are broken, absurd or hostile: one clear error of ours, in bounded time, and never a traceback."""

import os
import random
import re
import time

import pytest

from layoutopt.errors import InvalidInput, LayoutoptError
from layoutopt.spec.layout_file import read_layout, write_layout
from layoutopt.spec.options import MAXIMUM_STEPS
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in, template

HALL = "[site]\nfloor = [[0, 0], [8, 0], [8, 5], [0, 5]]\n"
SQUARE_KM = "[[0, 0], [1e3, 0], [1e3, 1e3], [0, 1e3]]"
ZONE = '[[site.zone]]\nname = "dock"\nregion = [[0, 0], [2, 0], [2, 2]]\n'
BOMB = 20_000


@pytest.fixture
def save(tmp_path):
    def to(content):
        path = tmp_path / "spec.toml"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return to


def faults_of(path):
    with pytest.raises(InvalidInput) as caught:
        read_spec(path)
    return caught.value.faults


VALUES = {
    "unknown table": ("[sight]\n" + HALL, "sight", "unknown key"),
    "unknown key": (HALL + "[robots]\ncont = 3", "robots.cont", "unknown key"),
    "unknown key in a zone": (HALL + ZONE + "metall = true", "site.zone[0].metall", "unknown key"),
    "not a number": (HALL + "[robots]\nspeed = nan", "robots.speed = nan", "not a finite number"),
    "infinite": (HALL + "[goal]\nbudget = inf", "goal.budget = inf", "not a finite number"),
    "too large for a float": (HALL + "[goal]\nbudget = 1e400", "goal.budget = inf", "not a finite number"),
    "too large in a text": (HALL + '[goal]\nbudget = "1e400 EUR"', "goal.budget", "not a finite number"),
    "nan in a list": (HALL + "[space]\nantenna_side = [0.04, nan]", "space.antenna_side[1] = nan", "finite"),
    "huge whole number": (HALL + f"[robots]\ncount = {'9' * 60}", "robots.count", "no use in a spec"),
    "date": (HALL + "[robots]\nspeed = 1979-05-27", "robots.speed = 1979-05-27", "no number"),
    "truth": (HALL + "[robots]\ncount = true", "robots.count = true", "a whole number"),
    "no robot": (HALL + "[robots]\ncount = 0", "robots.count = 0", "greater than or equal to 1"),
    "negative speed": (HALL + '[robots]\nspeed = "-1 m/s"', 'robots.speed = "-1 m/s"', "more than 0"),
    "negative target": (HALL + '[goal]\ntarget_error = "-5 mm"', 'goal.target_error = "-5 mm"', "more than 0"),
    "negative budget": (HALL + "[goal]\nbudget = -5", "goal.budget = -5", "more than 0"),
    "noise that is no number": (
        HALL + "[robots]\nodometry = { rotation_after_1s = nan }",
        "1s = nan",
        "not a finite",
    ),
    "infinite noise": (HALL + "[robots]\nodometry = { translation_after_1s = inf }", "1s = inf", "not a finite"),
    "negative noise": (
        HALL + '[robots.odometry]\ntranslation_after_1s = "-1 mm"',
        'robots.odometry.translation_after_1s = "-1 mm"',
        "at least 0",
    ),
    "negative gyro noise": (
        HALL + '[robots.gyro]\nrandom_walk_after_1s = "-1 deg"',
        "robots.gyro.random_walk_after_1s",
        "at least 0",
    ),
    "bias without a rate": (
        HALL + '[robots.gyro]\nbias = "0.1 deg"',
        'robots.gyro.bias = "0.1 deg"',
        "none of angular",
    ),
    "infinite bias": (HALL + "[robots.gyro]\nbias = inf", "robots.gyro.bias = inf", "not a finite"),
    "fitted by half": (HALL + "[robots.gyro]\nfitted = 0.5", "robots.gyro.fitted = 0.5", "true or false"),
    "gyro of odd parts": (HALL + "[robots.gyro]\nbiass = 1", "robots.gyro.biass", "unknown key"),
    "pause without way points": (HALL + '[robots]\npause = "5 s"', 'robots.pause = "5 s"', "made at way points"),
    "negative pause": (HALL + '[robots]\nroutes = [[1, 1], [4, 4]]\npause = "-1 s"', "robots.pause", "at least 0"),
    "heading of a differential drive": (
        HALL + '[robots]\nheading = "0 deg"',
        'robots.heading = "0 deg"',
        "cannot keep a heading",
    ),
    "no particles": (HALL + "[study]\nparticles = 0", "study.particles = 0", "greater than or equal to 1"),
    "negative slips": (
        HALL + "[study.design_faults]\nslips_per_m = -1",
        "slips_per_m = -1",
        "greater than or equal to 0",
    ),
    "slips that are no number": (HALL + "[study.design_faults]\nslips_per_m = nan", "slips_per_m = nan", "finite"),
    "endless slips": (
        HALL + "[study.design_faults]\nslips_per_m = 1e9",
        "slips_per_m",
        "less than or equal to 1000",
    ),
    "slips without a size": (
        HALL + "[study.held_out_faults]\nslips_per_m = 1",
        "slips_per_m = 1",
        "slip_sigma is zero",
    ),
    "slips that never come": (
        HALL + '[study.design_faults]\nslip_sigma = "1 mm"',
        'study.design_faults.slip_sigma = "1 mm"',
        "slips_per_m is zero",
    ),
    "offset of an unknown start": (
        HALL + '[study]\nstart_known = false\n[study.design_faults]\nstart_offset = { y = "1 m" }',
        "study.design_faults.start_offset",
        "cannot be told wrongly",
    ),
    "offset that is no number": (
        HALL + "[study.design_faults]\nstart_offset = { heading = nan }",
        "start_offset.heading = nan",
        "not a finite",
    ),
    "kidnapped when all is over": (
        HALL + '[study.held_out_faults]\nkidnapped_at = "60 s"',
        'study.held_out_faults.kidnapped_at = "60 s"',
        "over after 60 s",
    ),
    "asynchronous by words": (
        HALL + '[study.design_faults]\nasynchronous = "yes"',
        'asynchronous = "yes"',
        "true or false",
    ),
    "share above one": (HALL + '[study.design_faults]\ndead_tag_share = "200 %"', "dead_tag_share", "at most 1"),
    "other schema": ("schema = 2\n" + HALL, "schema = 2", "reads schema 1"),
    "negative seed": ("seed = -1\n" + HALL, "seed = -1", "whole number from 0"),
    "no floor": ("[site]\nname = 'x'", "site", "needs a floor"),
    "plan and floor": (HALL + 'plan = "x.yaml"', "site", "either a plan or a floor"),
    "no such plan": ('[site]\nplan = "x.yaml"', 'site.plan = "x.yaml"', "not exist"),
    "foreign plan": ('[site]\nplan = "x.dwg"', 'site.plan = "x.dwg"', "no plan reader"),
    "no such drawing": ('[site]\nplan = "x.dxf"', 'site.plan = "x.dxf"', "not exist"),
    "plan of no file": ("[site]\nplan = { units = 'mm' }", "site.plan.file", "missing"),
    "plan with a setting of another kind": (
        "[site]\nplan = { file = 'x.yaml', units = 'mm' }",
        "site.plan",
        "no use for units It takes smallest_room, tolerance",
    ),
    "plan with layers but no walls": (
        "[site]\nplan = { file = 'x.dxf', layers = { walls = [] } }",
        "site.plan.layers.walls = []",
        "the list has 0 entries and needs 1",
    ),
    "scale of one point": (
        "[site]\nplan = { file = 'x.png', scale = { first = [1], second = [200, 9], distance = '1 m' } }",
        "site.plan.scale.first = [1]",
        "column and row",
    ),
    "scale in words": (
        "[site]\nplan = { file = 'x.png', scale = { first = [1, 'b'], second = [200, 9], distance = '1 m' } }",
        'site.plan.scale.first[1] = "b"',
        "no number of pixels",
    ),
    "scale of nothing": (
        "[site]\nplan = { file = 'x.png', scale = { first = [1, 1], second = [200, 9], distance = '0 m' } }",
        'site.plan.scale.distance = "0 m"',
        "more than 0",
    ),
    "no such price list": (HALL + '[parts]\nprices = "default-1900"', 'prices = "default-1900"', "no price list"),
    "no such price file": (HALL + '[parts]\nprices = "x.toml"', 'parts.prices = "x.toml"', "no file"),
    "no such tag": (HALL + '[parts]\ntag = "lable"', 'parts.tag = "lable"', "no tag"),
    "no such reader": (HALL + '[parts]\nreader = "antenna"', 'parts.reader = "antenna"', "no reader"),
    "no such profile": (HALL + '[parts]\nreader_profile = "comercial"', "parts.reader_profile", "no such reader"),
    "self-crossing floor": ("[site]\nfloor = [[0, 0], [5, 5], [5, 0], [0, 5]]", "site.floor", "crosses itself"),
    "self-crossing zone": (
        HALL + ZONE.replace("[2, 2]", "[2, 2], [1, -1]"),
        "zone[0].region",
        "lie outside|crosses",
    ),
    "floor on a line": ("[site]\nfloor = [[0, 0], [5, 0], [9, 0]]", "site.floor", "no area"),
    "two corners": ("[site]\nfloor = [[0, 0], [5, 0]]", "site.floor", "at least three points"),
    "no point": ("[site]\nfloor = [[0, 0], [5, 0], [5]]", "site.floor[2]", "a list of x and y"),
    "uneven nesting": ("[site]\nfloor = [[[0, 0], [5, 0], [5, 5]], 3]", "site.floor[1]", "at least three points"),
    "floor of millimetres": ("[site]\nfloor = [[0, 0], [0.1, 0], [0.1, 0.1]]", "site.floor", "check the unit"),
    "floor of kilometres": (
        "[site]\nfloor = [[0, 0], [9e4, 0], [9e4, 1], [0, 1]]",
        "site.floor",
        "check the unit",
    ),
    "floor in orbit": ("[site]\nfloor = [[0, 0], [1e9, 0], [1e9, 1]]", "site.floor[1][0]", "no floor reaches"),
    "obstacle outside": (HALL + "obstacles = [[[9, 9], [10, 9], [10, 10]]]", "site.obstacles[0]", "outside"),
    "obstacles everywhere": (
        HALL + "obstacles = [[[-1, -1], [9, -1], [9, 6], [-1, 6]]]",
        "obstacles",
        "whole floor",
    ),
    "zone outside": (HALL + ZONE.replace("[2, 2]", "[2, -2]"), "site.zone[0].region", "outside the floor"),
    "zone without name": (
        HALL + "[[site.zone]]\nregion = [[0, 0], [2, 0], [2, 2]]",
        "site.zone[0].name",
        "missing",
    ),
    "zone with a path for a name": (HALL + ZONE.replace("dock", "../x"), "site.zone[0].name", "no name for files"),
    "two zones of a name": (HALL + ZONE + ZONE, "site.zone[1].name", "two zones"),
    "target without tags": (
        HALL + ZONE + 'tags = false\ntarget_error = "5 mm"',
        'site.zone[0].target_error = "5 mm"',
        "target in a zone without tags",
    ),
    "target on metal": (HALL + ZONE + 'metal = true\ntarget_error = "5 mm"', "site.zone[0].target_error", "metal"),
    "target out of reach": (
        HALL + ZONE.replace("[2, 0], [2, 2]", "[0.1, 0], [0.1, 0.1]") + 'target_error = "5 mm"',
        "zone 'dock'",
        "cannot bring its centre",
    ),
    "robot larger than the floor": (
        HALL + "[robots]\noutline = [[-4, -3], [4, -3], [4, 3], [-4, 3]]",
        "robots",
        "room to turn",
    ),
    "robot of millimetres": (
        HALL + "[robots]\noutline = [[0, 0], [0.01, 0], [0, 0.01]]",
        "outline",
        "check the unit",
    ),
    "robot beside itself": (HALL + "[robots]\noutline = [[1, 1], [2, 1], [2, 2]]", "outline", "base_link"),
    "one way point": (HALL + "[robots]\nroutes = [[1, 1]]", "robots.routes", "at least two way points"),
    "equal way points": (HALL + "[robots]\nroutes = [[1, 1], [1, 1]]", "robots.routes", "all the same"),
    "no readers": (HALL + "[space]\nreaders = []", "space.readers", "the list is empty"),
    "no patterns": (HALL + "[space]\npatterns = []", "space.patterns", "the list is empty"),
    "empty axis": (HALL + "[space]\nantenna_side = []", "space.antenna_side", "the list is empty"),
    "empty parameter": (
        HALL + '[space]\npatterns = [{ family = "square", pitch = [] }]',
        "space.patterns[0].pitch",
        "the list is empty",
    ),
    "family of a number": (HALL + "[space]\nreaders = [{ family = 3 }]", "readers[0].family = 3", "by a text"),
    "negative pitch": (
        HALL + '[space]\npatterns = [{ family = "square", pitch = -1 }]',
        "space.patterns[0]",
        "must be positive",
    ),
    "pitch below the tag": (
        HALL + '[space]\npatterns = [{ family = "square", pitch = "19 mm" }]',
        'space.patterns[0].pitch = "19 mm"',
        "'label' is 20 mm long",
    ),
    "readers outside the robot": (
        HALL + '[space]\nreaders = [{ family = "ring", count = 3, radius = [1.0, 2.0] }]',
        "space.readers[0]",
        "beyond robots.outline",
    ),
    "count of a text": (
        HALL + '[space]\nreaders = [{ family = "cross", count = "four" }]',
        'readers[0].count = "four"',
        "whole number",
    ),
    "antenna of a metre": (HALL + '[space]\nantenna_side = "2 m"', 'antenna_side = "2 m"', "out of reason"),
    "endless range": (
        HALL + f'[space]\nantenna_side = {{ from = "30 mm", to = "80 mm", steps = {MAXIMUM_STEPS + 1} }}',
        "space.antenna_side.steps",
        "2 to",
    ),
    "half a range": (HALL + '[space]\nantenna_side = { from = "30 mm" }', "space.antenna_side", "a range is"),
    "too many layouts": (
        HALL + '[space]\npatterns = [{ family = "triangular", pitch = { from = 0.1, to = 1, steps = 300 }, '
        "row_gap = { from = 0.1, to = 1, steps = 300 } }]\nantenna_side = { from = 0.03, to = 0.08, steps = 99 }\n"
        'antennas_per_module = 1\nreaders = [{ family = "ring", count = [3, 4, 6], radius = 0.1 }]',
        "space",
        r"the design space has 26730000 layouts \(297 × 90000\)",
    ),
    "too many patterns": (
        HALL + '[space]\npatterns = [{ family = "triangular", pitch = { from = 0.1, to = 1, steps = 9999 }, '
        "row_gap = { from = 0.1, to = 1, steps = 9999 } }]",
        "space.patterns",
        "these are 99980001 options",
    ),
    "too many tags": (
        f'[site]\nfloor = {SQUARE_KM}\n[space]\npatterns = [{{ family = "square", pitch = "30 mm" }}]',
        "space.patterns[0].pitch",
        r"1.11e\+09 tags",
    ),
    "two tags on one spot": (
        HALL + '[space]\npatterns = [{ family = "listed", points = [[1, 1], [1, 1]] }]',
        "space.patterns[0]",
        "share a place",
    ),
    "no estimator": (HALL + "[study]\nvalidate_with = []", "study.validate_with", "the list is empty"),
    "estimator not built": (
        HALL + '[study]\nvalidate_with = ["uhf_lazer"]',
        "validate_with[0]",
        "no such estim",
    ),
    "objective not built": (HALL + '[goal]\nminimise = ["cost", "coverage"]', "minimise[1]", "no score named"),
    "cost is no goal": (HALL + '[goal]\nminimise = ["position_error_mean"]', "goal.minimise", "cost and one"),
    "drive before it settles": (HALL + '[study]\nduration = "1 s"', 'study.duration = "1 s"', "after 3 s"),
    "endless drive": (
        HALL + '[study]\nduration = "200 h"\nstep = "1 ms"',
        "study.duration",
        "at most 1000000 steps",
    ),
    "control characters": (HALL + 'name = "a\\u0000b"', "site.name", "control characters"),
    "endless text": (HALL + f'name = "{"x" * 5000}"', "site.name", "too long"),
    "table for a list": (HALL + "[goal]\nlimits = {}", "goal.limits", "should be a list"),
    "list for a table": ("site = []", "site", "should be a table"),
    "text for a table": (HALL + "[robots]\nodometry = 'good'", "robots.odometry", "should be a table"),
}


@pytest.mark.parametrize("name", VALUES)
def test_bad_values_are_named_with_place_and_repair(save, name):
    """Each fault names file, line or key, and the value, and says what would be right."""
    text, place, said = VALUES[name]
    faults = faults_of(save(text))
    matching = [
        fault for fault in faults if place in fault.place and re.search(said, f"{fault.problem} {fault.repair}")
    ]
    assert matching, [str(fault) for fault in faults]
    for fault in faults:
        assert re.search(r"spec\.toml:\d+ |spec\.toml \w", fault.place + " ")
        assert fault.repair, str(fault)


@pytest.mark.parametrize(
    "text",
    [
        "x = " + "[" * BOMB,
        "x = " + "[" * BOMB + "]" * BOMB,
        "x = " + "{ a = " * BOMB + "1" + " }" * BOMB,
        "[" + ".".join("a" * BOMB) + "]\nb = 1",
        ".".join("a" * 400_000) + " = 1",
        '"a".' * BOMB + "a = 1",
        "x = " + "9" * 100_000,
        "x = 0b" + "1" * 1_000_000,
        HALL + "[space]\nreaders = [" + "{ family = 'cross', count = 4 }," * BOMB + "]",
        HALL + "[[site.zone]]\n" * BOMB,
        "".join(f"k{number} = nan\n" for number in range(BOMB)),
        "[site]\nfloor = [" + "[0, 0]," * 120_000 + "]",
    ],
    ids=[
        "brackets open", "brackets", "tables", "dotted table", "dotted key", "quoted key", "digits", "bits",
        "readers", "zones", "nans", "corners",
    ],
)  # fmt: skip
def test_bombs_end_soon_in_an_error(save, text):
    """Deep, long and repetitive files are refused within seconds."""
    began = time.process_time()
    assert faults_of(save(text))
    assert time.process_time() - began < 10.0  # seconds of this process alone; two or three at most are needed


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "empty"),
        (b"  \n\n", "empty"),
        (b"\xff\xfe[\x00s\x00", "not UTF-8"),
        (HALL.encode() + b"[robots] # \xe9\n", "not UTF-8"),
        (b"PK\x03\x04", "zip"),
        (b"%PDF-1.7", "PDF"),
        (b"AC1027 drawing", "DWG"),
        (b"just some words", "not TOML"),
        (b"[site]\nfloor = [[0, 0], [8 m, 0]]", "not TOML"),
        (b"#" * 5_000_001, "MB"),
    ],
)
def test_files_that_are_no_spec(save, content, said):
    """Empty files, other encodings, other formats and oversized files are told apart."""
    fault = faults_of(save(content))[0]
    assert said in fault.problem
    assert "spec.toml" in fault.place
    assert fault.repair


def test_byte_order_mark_and_foreign_line_ends_do_no_harm(save):
    """A spec saved by a Windows editor reads like any other, and its faults have the right lines."""
    spec = read_spec(save(b"\xef\xbb\xbf" + HALL.replace("\n", "\r\n").encode()))
    assert spec.site.floor.area == 40.0
    fault = faults_of(save(b"\xef\xbb\xbf" + (HALL + "[robots]\ncont = 1").replace("\n", "\r\n").encode()))[0]
    assert "spec.toml:4 robots.cont" in fault.place


def test_things_that_are_no_plain_file(tmp_path):
    """Missing files, folders, pipes, loops of links and impossible names end in an error and never block."""
    (tmp_path / "folder.toml").mkdir()
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "loop.toml").symlink_to(tmp_path / "loop.toml")
    for name in ("missing.toml", "folder.toml", "pipe.toml", "loop.toml", "x" * 300, "nul\0.toml"):
        assert faults_of(tmp_path / name)[0].repair


def test_plans_and_prices_that_are_no_plain_file(tmp_path, save):
    """What a spec names is opened with the same care as the spec itself."""
    os.mkfifo(tmp_path / "pipe.yaml")
    os.mkfifo(tmp_path / "pipe.toml")
    assert faults_of(save('[site]\nplan = "pipe.yaml"'))
    assert faults_of(save(HALL + '[parts]\nprices = "pipe.toml"'))
    assert faults_of(save('[site]\nplan = "."'))


def test_negative_price_in_a_price_file(tmp_path, save):
    """A negative price is refused with the line of the price file, behind the key of the spec."""
    (tmp_path / "mine.toml").write_text(
        'schema = 1\nname = "m"\ndate = "2026"\nbase = "default-2026"\n[items.label]\nprice = -1\nsource = "x"\n'
    )
    fault = faults_of(save(HALL + '[parts]\nprices = "mine.toml"'))[0]
    assert "spec.toml:4 parts.prices" in fault.place
    assert "mine.toml:6 items.label.price" in fault.place


def mutated(text, draws):
    """Return a text with values replaced, bytes changed, or lines lost, doubled or cut."""
    nasty = ["nan", "-1", "0", "1e400", '""', "[]", "{}", "true", "1979-05-27", "[[]]", '"-3 mm"', '"1e400 mm"',
             "9" * 30, "[nan]", '"x.yaml"', "[{ a = 1 }]", "-0.0", "0.5", '"dock"', '"\\u0000"', "[1, 1]",
             "{ from = 1, to = 2, steps = 3 }", "[[0, 0], [1, 1], [1, 0], [0, 1]]"]  # fmt: skip
    lines = text.split("\n")
    kind = draws.randrange(3)
    if kind == 0:
        for _ in range(draws.choice([1, 1, 3])):
            number = draws.choice([i for i, line in enumerate(lines) if "=" in line and not line.startswith("#")])
            lines[number] = f"{lines[number].split('=')[0]}= {draws.choice(nasty)}"
        return "\n".join(lines).encode()
    if kind == 1:
        number = draws.randrange(len(lines))
        if draws.random() < 0.5:
            del lines[number]
        else:
            lines.insert(draws.randrange(len(lines)), lines[number])
        return "\n".join(lines).encode()
    content = bytearray(text.encode())
    for _ in range(draws.choice([1, 3, 20])):
        place = draws.randrange(len(content))
        if draws.random() < 0.6:
            content[place] = draws.choice(b'0123456789"[]{}=.,\n#e-% \xff')
        else:
            del content[place : place + draws.choice([1, 3, 30])]
    return bytes(content)


def fuzzed(save, folder, seed, count):
    """Read damaged specs and layout files; return how many an error of ours refused that names the file."""
    draws = random.Random(seed)
    spec = read_spec(built_in())
    write_layout(next(spec.space.layouts()), spec, folder / "layout.toml")
    frozen = (folder / "layout.toml").read_text(encoding="utf-8")
    small = HALL + ZONE + frozen[frozen.index("[robots]") : frozen.index("[parts.price_list]")]
    refused = read = 0
    for _ in range(count):
        path = save(mutated(draws.choice([template(), template("hybrid"), frozen, small]), draws))
        try:
            draws.choice([read_spec, read_layout])(path)
        except LayoutoptError as error:
            refused += "spec.toml" in str(error)
        else:
            read += 1
    assert refused + read == count
    return refused


@pytest.mark.parametrize("seed", range(4))
def test_mutated_specs_raise_nothing_but_our_errors(save, tmp_path, seed):
    """Of hundreds of damaged files each is read or refused with an error of ours; no other exception escapes."""
    assert fuzzed(save, tmp_path, seed, 75) > 30


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("seed", range(4, 14))
def test_many_mutated_specs_raise_nothing_but_our_errors(save, tmp_path, seed):
    """The same for 5,000 damaged files in ten parts."""
    assert fuzzed(save, tmp_path, seed, 500) > 200
