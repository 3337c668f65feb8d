import pytest

from layoutopt.spec.lines import key_lines, line_of, written

TEXT = '''schema = 1
"odd key".inner = """first
second = 3 """  # a comment
[site]
plan = { size = [1,
  2, { deep = [3] }], since = 1979-05-27 07:32:00 }
[[site.zone]]
names = ["a]", 'b,', # comment ]
  "c" ]
[[site.zone]]
name = "two"
[site.zone.inner]
last = 2
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("schema",), 1),
        (("odd key", "inner"), 2),
        (("site",), 4),
        (("site", "plan", "size", 0), 5),
        (("site", "plan", "size", 1), 6),
        (("site", "plan", "size", 2, "deep", 0), 6),
        (("site", "plan", "since"), 6),
        (("site", "zone", 0, "names", 1), 8),
        (("site", "zone", 0, "names", 2), 9),
        (("site", "zone", 1, "name"), 11),
        (("site", "zone", 1, "inner", "last"), 13),
    ],
)
def test_every_key_has_its_line(path, line):
    """Keys in tables, lists of tables, inline tables and lists over several lines are found where they stand."""
    assert key_lines(TEXT)[path] == line


def test_a_key_without_a_line_gets_that_of_the_table_above():
    """A key that is missing from the text is reported where its table stands."""
    lines = key_lines(TEXT)
    assert line_of(("site", "zone", 1, "region", 3), lines) == 10
    assert line_of(("nowhere",), lines) is None


def test_any_text_ends():
    """The scanner comes to an end on every truncation of a text, even where it is no longer TOML."""
    for length in range(len(TEXT)):
        assert max(key_lines(TEXT[:length]).values(), default=1) <= TEXT.count("\n") + 1


def test_paths_are_written_as_people_write_them():
    """Numbers stand in brackets, keys behind dots, and odd keys in quotes."""
    assert written(("space", "antenna_side", 2)) == "space.antenna_side[2]"
    assert written(("a b", "c")) == "'a b'.c"
