"""What check says of a floor beyond the reach of every antenna."""

from layoutopt.spec.reading import read_spec
from studies.effort import describe

SPEC = """
[site]
floor = {floor}
{more}
[space]
antenna_side = "60 mm"
readers = [{{ family = "ring", count = 3, radius = "150 mm" }}]
patterns = [{{ family = "square", pitch = {pitch} }}]
"""
HALL = "[[0, 0], [8, 0], [8, 5], [0, 5]]"
POCKET = "[[9, 1], [10, 1], [10, 2], [9, 2]]"
NO_TAGS = f"[[site.zone]]\nname = 'pocket'\nregion = {POCKET}\ntags = false"


def notes(tmp_path, floor, pitch='"200 mm"', more=""):
    """Return what is said of pockets."""
    path = tmp_path / "hall.toml"
    path.write_text(SPEC.format(floor=floor, pitch=pitch, more=more), encoding="utf-8")
    return [line for line in describe(read_spec(path)) if "pocket(s)" in line]


def test_a_pocket_that_no_robot_reaches_is_told_with_its_tags(tmp_path):
    """One square metre beside the hall takes 25 tags of 200 mm, or as many as the patterns lay."""
    both = f"[[{HALL}], [{POCKET}]]"
    (note,) = notes(tmp_path, both)
    assert note == (
        "note: 1.00 m² in 1 pocket(s), the largest near (9.50, 1.50) m, are in reach of no antenna: about 25 tags "
        "are laid and paid there that no robot reads; a zone with tags = false over a pocket saves them, and so "
        "does closing it in the plan"
    )
    (several,) = notes(tmp_path, both, pitch='["200 mm", "500 mm"]')
    assert "about 4 to 25 tags, by the pattern, are laid" in several


def test_strips_along_walls_and_zones_without_tags_are_no_pockets(tmp_path):
    """A plain hall has strips and corners only, and a zone does what the note says."""
    assert notes(tmp_path, HALL) == []
    assert notes(tmp_path, f"[[{HALL}], [{POCKET}]]", more=NO_TAGS) == []


def test_a_niche_narrower_than_the_robot_is_a_pocket(tmp_path):
    """A dead end of 600 mm by 2 m counts whole, with the piece of the strip along the wall at its mouth."""
    niche = "[[0, 0], [8, 0], [8, 2], [10, 2], [10, 2.6], [8, 2.6], [8, 5], [0, 5]]"
    (note,) = notes(tmp_path, niche)
    assert 1.2 <= float(note.split()[1]) < 1.35
