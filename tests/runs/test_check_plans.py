"""`layoutopt check` on plans: proposals for what is missing, rooms and repairs in words, a picture."""

import pytest
from command_line import called
from plan_drawings import lines, new, two_rooms

# A budget that no layout keeps spares the pilot: what is looked at here stands before it.
PLAN = '[goal]\nbudget = "1 EUR"\n[site.plan]\nfile = "ward.dxf"\n'


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
