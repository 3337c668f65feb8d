"""`layoutopt check` on plans: proposals for what is missing, rooms and repairs in words, a picture."""

import pytest
from command_line import called
from plan_drawings import lines, new, two_rooms

# A budget that no layout keeps spares the pilot: what is looked at here stands before it.
PLAN = '[goal]\nbudget = "1 EUR"\n[site.plan]\nfile = "ward.dxf"\n'
HALL = """[goal]
{goal}
[site]
floor = [[0, 0], [8, 0], [8, 5], [0, 5]]
[space]
antenna_side = "60 mm"
antennas_per_module = 1
readers = [{{ family = "ring", count = {count}, radius = "150 mm" }}]
patterns = [{{ family = "square", pitch = ["400 mm", "500 mm"] }}]
"""


@pytest.fixture
def ward(tmp_path):
    """A folder with a drawing of two rooms."""
    drawing, space = new()
    lines(space, two_rooms())
    drawing.saveas(tmp_path / "ward.dxf")
    return tmp_path


def test_a_proposed_mapping_of_layers_can_be_copied_into_the_spec(ward):
    """What the first run proposes is what the second one needs."""
    (ward / "ward.toml").write_text(PLAN)
    done = called("check", "ward.toml", cwd=ward)
    assert done.returncode == 2
    proposal = done.stderr[done.stderr.index("layers = {") :].partition(" }.")[0]
    (ward / "ward.toml").write_text(f"{PLAN}{proposal}\n")
    done = called("check", "ward.toml", cwd=ward)
    assert done.returncode == 1, done.stderr
    for said in (
        "site: site, from ward.dxf",
        "extents: 8.20 m x 3.00 m",
        "rooms: 1, as the plan draws them, m²: 24.2",
        "note: ward.dxf measures 8.60 m x 3.40 m, drawn in mm, from $INSUNITS = 4 of the header",
        "note: gaps that were not closed: 900 mm from (4.100, 1.050) to (4.100, 1.950)",
    ):
        assert said in done.stdout


def test_rooms_and_repairs_are_told_and_drawn(ward):
    """With a gap there are two rooms, the closed door is told, and the picture is written."""
    (ward / "ward.toml").write_text(PLAN + 'layers = { walls = ["WALLS"] }\ngap = "1 m"\n')
    done = called("check", "ward.toml", "--picture", "rooms.png", cwd=ward)
    assert done.returncode == 1, done.stderr
    assert "rooms: 2, as the plan draws them, m²: 12.1, 12.1" in done.stdout
    assert "note: closed a gap of 900 mm from (4.100, 1.050) to (4.100, 1.950)" in done.stdout
    assert (ward / "rooms.png").stat().st_size > 1000
    assert "picture: rooms.svg" in done.stdout


def test_floors_without_rooms_of_their_own_are_divided_by_passages(tmp_path):
    """A floor of corners gets rooms too, and it is said how."""
    (tmp_path / "hall.toml").write_text(
        '[goal]\nbudget = "1 EUR"\n[site]\nfloor = [[0, 0], [8, 0], [8, 5], [0, 5]]\n'
    )
    done = called("check", "hall.toml", cwd=tmp_path)
    assert "rooms: 1, where passages below 1.3 m divide the floor, m²: 40.0" in done.stdout


def test_a_picture_without_a_folder_is_refused_before_any_work(ward):
    """The name of the picture is looked at first."""
    (ward / "ward.toml").write_text(PLAN)
    done = called("check", "ward.toml", "--picture", "nowhere/rooms.png", cwd=ward)
    assert done.returncode == 2
    assert "there is no folder nowhere" in done.stderr


def test_a_budget_below_every_layout_is_told_with_the_shortfall_and_what_comes_next(tmp_path):
    """What is missing and what helps stand there, and a run that will not happen is not predicted."""
    (tmp_path / "hall.toml").write_text(HALL.format(goal='budget = "1 EUR"', count="[3, 4]"))
    done = called("check", "hall.toml", cwd=tmp_path)
    assert done.returncode == 1, done.stderr
    assert "trying out" not in done.stderr
    told = done.stdout.splitlines()
    told = told[told.index("layouts: 4, of which 0 can be built within the limits on exact scores") :]
    example = "    such as ring 3 × 60 mm, square 500 mm: cost of 608.13 EUR exceeds 1 EUR"
    assert told[1:3] == ["  refused by the rule of cost: 2", example]
    assert told[3] == "  refused by the rule of simultaneous antennas: 2"
    assert told[4].startswith("    such as ring 4 × 60 mm, square ")
    needed = "4 sides between their centres, 240 mm for antennas of 60 mm; ring 4 of radius 150 mm has 212.1 mm"
    assert needed in told[4]
    assert told[5:] == [
        "nothing to simulate: the cheapest layout that can be built costs 608.13 EUR, 607.13 EUR more than the "
        "budget of 1.00 EUR",
        "what helps: larger pitches or fewer antennas in [space], which cost less, or a larger budget",
        "next: layoutopt check hall.toml    (once the spec is changed)",
    ]


def test_where_nothing_can_be_built_the_limits_of_the_space_are_named(tmp_path):
    """Without a budget the reason is one of construction."""
    (tmp_path / "hall.toml").write_text(HALL.format(goal="", count="4"))
    done = called("check", "hall.toml", cwd=tmp_path)
    assert done.returncode == 1, done.stderr
    reason, helps, following = done.stdout.splitlines()[-3:]
    assert reason.startswith(
        "nothing to simulate: none of 2 layouts can be built and judged; the cheapest: cannot"
    )
    assert helps.startswith("what helps: another [space]")
    assert following == "next: layoutopt check hall.toml    (once the spec is changed)"
