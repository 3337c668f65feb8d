"""A reader of spec texts for all tests of specs."""

import pytest

from layoutopt.spec.reading import read_spec


@pytest.fixture
def read(tmp_path):
    """Return a reader of spec texts."""

    def of(text):
        path = tmp_path / "spec.toml"
        path.write_text(text, encoding="utf-8")
        return read_spec(path)

    return of
