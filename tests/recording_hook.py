"""Writes down what a process asks of the system: put on the path as ``sitecustomize``, so that workers do so too.

The variable ``RECORD_TO`` names a folder in which each process has a file of its own, with a JSON list a line: the
event, where it came from, and what it was about. `site` imports this before anything of the program.
"""

import json
import os
import sys
from pathlib import Path

WRITE = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
LOOKING = ("os.listdir", "os.scandir", "os.walk", "os.fwalk", "os.getxattr", "os.listxattr", "os.chdir")
OF_OPEN_FILES = ("os.chmod", "os.chown", "os.truncate", "os.utime", "os.setxattr", "os.removexattr")
"""What may name an open file by its number in place of its path."""
ENVIRONMENT = ("os.putenv", "os.unsetenv")
TALKING = ("socket", "urllib", "http", "ftplib", "smtplib", "poplib", "imaplib", "nntplib", "telnetlib")
STARTING = ("subprocess", "pty", "webbrowser")
PICKLED = (".nbi", ".nbc", ".pkl", ".pickle", ".joblib", ".npy", ".npz")


def origin():
    """Return file and function of the innermost Python code; the import system's is called so."""
    frame = sys._getframe()
    while frame is not None:
        name = frame.f_code.co_filename
        if name.startswith("<frozen importlib"):
            return "import system"
        if name != __file__ and not name.startswith("<frozen"):
            return f"{name}:{frame.f_code.co_name}"
        frame = frame.f_back
    return "interpreter"


def whole(path, folder=-1):
    """Return a path, relative to an open folder if one is given, with all links in its folder followed."""
    path = Path(os.fsdecode(path))
    if folder >= 0 and not path.is_absolute():
        path = Path(f"/proc/self/fd/{folder}").readlink() / path
    return str(path.parent.absolute().resolve() / path.name)


def is_path(argument):
    """Return whether an argument names a file."""
    return isinstance(argument, (str, bytes)) or hasattr(argument, "__fspath__")


def entries_of(event, arguments):
    """Yield what is to be written down of an event."""
    kind = event.partition(".")[0]
    if event == "open":
        path, _, flags = arguments
        if is_path(path):
            if isinstance(flags, int) and flags & WRITE:
                yield "write", origin(), whole(path)
            elif os.fsdecode(path).endswith(PICKLED):
                yield "read", origin(), whole(path)
    elif (kind == "os" and event not in (*LOOKING, *ENVIRONMENT)) or kind == "shutil":
        paths = [argument for argument in arguments if is_path(argument)]
        if event in OF_OPEN_FILES and isinstance(arguments[0], int):
            paths = [Path(f"/proc/self/fd/{arguments[0]}").readlink()]
        if not paths:
            yield event, origin(), ""
            return
        # Open folders to which the paths are relative come last.
        folders = [argument for argument in arguments if isinstance(argument, int)][-len(paths) :]
        folders += [-1] * (len(paths) - len(folders))
        for path, folder in zip(paths, folders, strict=True):
            yield event, origin(), whole(path, folder)
    elif kind in TALKING or kind in STARTING:
        yield event, origin(), repr(arguments)[:300]
    elif event == "ctypes.dlopen":
        yield event, origin(), str(arguments[0])
    elif event == "pickle.find_class":
        yield event, origin(), ""
    elif event in ("exec", "compile"):
        place = origin()
        if place != "import system":
            source = arguments[0] if event == "compile" else None
            text = source.decode("utf-8", "replace") if isinstance(source, bytes) else str(source or "")
            yield event, place, "MARK" if "MARK" in text else ""


def begin(folder):
    """Write down what this process asks from now on."""
    log = os.open(Path(folder) / f"{os.getpid()}.jsonl", os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    told = set()

    def hook(event, arguments):
        for entry in entries_of(event, arguments):
            if entry not in told:
                told.add(entry)
                os.write(log, (json.dumps(entry) + "\n").encode())

    sys.addaudithook(hook)


if "RECORD_TO" in os.environ:
    begin(os.environ["RECORD_TO"])
