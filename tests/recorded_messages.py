"""A plugin of pytest that lists every fault that tests provoke, once each kind: for reading them all.

``LAYOUTOPT_MESSAGES=listing.json python -m pytest -p tests.recorded_messages tests/hostile`` writes a list of
``[place, problem, repair]``; kinds differ in more than numbers and quoted texts.
"""

import json
import os
import re
from pathlib import Path

from layoutopt import errors

_found = {}
_begin = errors.InvalidInput.__init__


def _kind(fault):
    return tuple(re.sub(r"'[^']*'|\"[^\"]*\"|[\d.]+", "", text) for text in (fault.problem, fault.repair))


def _recorded(self, faults):
    _begin(self, faults)
    for fault in self.faults:
        _found.setdefault(_kind(fault), fault)


def pytest_configure(config):
    """Begin to listen."""
    errors.InvalidInput.__init__ = _recorded


def pytest_unconfigure(config):
    """Write what was heard."""
    errors.InvalidInput.__init__ = _begin
    listing = [[fault.place, fault.problem, fault.repair] for fault in _found.values()]
    Path(os.environ["LAYOUTOPT_MESSAGES"]).write_text(json.dumps(sorted(listing), indent=1), encoding="utf-8")
