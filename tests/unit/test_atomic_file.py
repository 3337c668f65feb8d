"""Files that are written complete or not at all."""

import errno
import resource

import pytest

from layoutopt.atomic_file import replacing


@pytest.fixture
def path(tmp_path):
    """A file that is there already."""
    path = tmp_path / "table.csv"
    path.write_text("old")
    return path


def test_a_file_is_replaced_in_one_step(path):
    """Until all is written the old file is there, then the new one, and nothing else is left."""
    with replacing(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
        assert temporary.parent == path.parent
    assert path.read_text() == "new"
    assert list(path.parent.iterdir()) == [path]


def test_after_an_error_the_old_file_is_there(path):
    """Whatever is raised on the way, the old file stays and the temporary one goes."""

    def fail():
        with replacing(path) as temporary:
            temporary.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert path.read_text() == "old"
    assert list(path.parent.iterdir()) == [path]


def test_a_full_disk_is_told_with_the_name_of_the_file(path):
    """The system does not say which file found no room; whoever is told reads of the one that was wanted."""
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limit[1]))
    try:
        with pytest.raises(OSError, match=r"large: '.*table\.csv'$") as caught, replacing(path) as temporary:
            temporary.write_bytes(bytes(2000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert caught.value.errno == errno.EFBIG
    assert caught.value.filename == str(path)
    assert path.read_text() == "old"
    assert list(path.parent.iterdir()) == [path]


def test_a_missing_folder_is_told_with_the_name_of_the_file(tmp_path):
    """The temporary file could not be made, but it is not what anybody asked for."""
    path = tmp_path / "no/table.csv"
    with pytest.raises(FileNotFoundError) as caught, replacing(path) as temporary:
        temporary.write_text("new")
    assert caught.value.filename == str(path)


def test_what_cannot_be_replaced_is_told_by_its_name(tmp_path):
    """A folder in the place of the file stays, and is named."""
    path = tmp_path / "table.csv"
    path.mkdir()
    with pytest.raises(OSError, match=r"table\.csv'$") as caught, replacing(path) as temporary:
        temporary.write_text("new")
    assert caught.value.filename == str(path)
    assert list(tmp_path.iterdir()) == [path]


def test_the_error_of_another_file_keeps_its_name(path):
    """Only what befell the file itself is renamed."""
    with pytest.raises(FileNotFoundError) as caught, replacing(path):
        (path.parent / "other").read_text()
    assert caught.value.filename == str(path.parent / "other")
