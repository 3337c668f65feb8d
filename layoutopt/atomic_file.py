"""Files that are there complete or not at all."""

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give the name of a temporary file beside ``path`` and put it in place of ``path`` on success.

    On an error the temporary file is removed and what was at ``path`` stays.
    """
    target = Path(path)
    # Same folder, hence same file system: the replacement is one step for every other process.
    temporary = target.parent / f".{uuid.uuid4().hex}.part"
    try:
        yield temporary
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
