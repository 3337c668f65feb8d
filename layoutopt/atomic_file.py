"""Files that are written complete or not at all, and read only if they are plain files of a sensible size."""

import errno
import os
import stat
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give the name of a temporary file beside ``path`` and put it in place of ``path`` on success.

    On an error the temporary file is removed and what was at ``path`` stays; the system's errors name ``path``.
    """
    target = Path(path)
    # Same folder, hence same file system: the replacement is one step for every other process.
    temporary = target.parent / f".{uuid.uuid4().hex}.part"
    try:
        yield temporary
        temporary.replace(target)
    except OSError as error:
        # Of a full disk the system says no name, and the temporary one tells nobody anything.
        if error.errno is None or error.filename not in (None, str(temporary)):
            raise
        raise OSError(error.errno, error.strerror, str(target)) from error
    finally:
        temporary.unlink(missing_ok=True)


def not_plain(path: str | os.PathLike[str]) -> str:
    """Return what is at ``path`` if it is no plain file; empty for a plain file, and where nothing is.

    >>> not_plain("/")
    'a folder'
    """
    try:
        mode = os.lstat(path).st_mode
    except (OSError, ValueError):
        return ""
    if stat.S_ISREG(mode):
        return ""
    return "a symbolic link" if stat.S_ISLNK(mode) else "a folder" if stat.S_ISDIR(mode) else "a pipe or device"


def plain_file(path: str | os.PathLike[str]) -> BinaryIO:
    """Open a file that must be plain: no link that leads elsewhere, and no pipe on which reading would wait.

    Raises
    ------
    OSError
        If it is no plain file, or cannot be opened.
    """
    kind = not_plain(path)
    if kind:
        raise OSError(errno.EINVAL, f"it is {kind}", os.fspath(path))
    flags = os.O_RDONLY | getattr(os, "O_BINARY", 0) | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    return os.fdopen(os.open(path, flags), "rb")


def plain_bytes(path: str | os.PathLike[str], *, largest: int) -> bytes:
    """Return what a plain file holds.

    Raises
    ------
    OSError
        If it is no plain file, or cannot be read.
    ValueError
        If it holds more than ``largest`` bytes.
    """
    with plain_file(path) as file:
        content = file.read(largest + 1)
    if len(content) > largest:
        raise ValueError(f"it has more than {largest / 1e6:g} MB")
    return content
