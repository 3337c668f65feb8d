"""Scans, surveys and tag maps that are another thing than they are called: one error that says what to do."""

import pytest
from command_line import called
from small_studies import SPEC

from layoutopt.commissioning.site_records import read_scans, read_survey
from layoutopt.errors import InvalidInput
from layoutopt.spec.layout_file import write_layout
from layoutopt.spec.reading import read_spec
from layoutopt.tables.tag_files import read_tag_file

FILES = [
    (b"PK\x03\x04" + bytes(range(256)), "this is a spreadsheet or a zip archive"),
    (b"\xd0\xcf\x11\xe0" + bytes(100), "this is a spreadsheet of an old kind"),
    (b"%PDF-1.7\n", "this is a PDF document"),
    ("tag_id,uid\n1,E004015000000101\n".encode("utf-16"), "is not UTF-8"),
    (b"tag_id;uid\n1;E004015000000101\n", "not separated by commas"),
    (b"", "the file is empty"),
]


@pytest.mark.parametrize("reader", [read_scans, read_survey], ids=["scans", "survey"])
@pytest.mark.parametrize(("content", "said"), FILES)
def test_records_of_another_format_are_told_apart(tmp_path, reader, content, said):
    path = tmp_path / "records.csv"
    path.write_bytes(content)
    with pytest.raises(InvalidInput) as caught:
        reader(path)
    assert said in str(caught.value)
    assert all(fault.place.startswith(str(path)) and fault.repair for fault in caught.value.faults)


@pytest.mark.parametrize("cell", ["=1+1", "../7", "<script>", "-1", "1e3", "\u0661", "9" * 5000])
def test_no_number_of_a_tag_becomes_a_formula_or_a_path(tmp_path, cell):
    path = tmp_path / "scans.csv"
    path.write_text(f"tag_id,uid\n{cell},E004015000000101\n", encoding="utf-8")
    with pytest.raises(InvalidInput, match="is no number of a tag") as caught:
        read_scans(path)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("tags.yaml", "tags: !!python/object/apply:os.mkdir [pwned]\n"),
        ("tags.csv", "tag_id,uid,x_m,y_m\n=1,<script>,nan,1\n"),
        ("tags.json", '{"tags": [NaN]}'),
        ("tags.json", "[" * 100_000),
    ],
)
def test_tag_maps_with_more_than_a_map_are_refused(tmp_path, monkeypatch, name, content):
    """No object is made of what a file says, and nothing is run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(content, encoding="utf-8")
    with pytest.raises(InvalidInput):
        read_tag_file(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_frame_of_its_own_without_a_survey_is_refused(tmp_path):
    """The option would have been passed over without a word."""
    (tmp_path / "spec.toml").write_text(SPEC, encoding="utf-8")
    spec = read_spec(tmp_path / "spec.toml")
    write_layout(next(iter(spec.space.layouts())), spec, tmp_path / "layout.toml")
    (tmp_path / "scans.csv").write_text("tag_id,uid\n1,E004015000000101\n", encoding="utf-8")
    done = called("commission", "layout.toml", "--scans", "scans.csv", "--own-frame", cwd=tmp_path)
    assert done.returncode == 2
    assert "--own-frame: speaks of a survey, and none is given. Add --survey FILE." in done.stderr
    assert not (tmp_path / "out").exists()
