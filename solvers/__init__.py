"""Solvers: what searches a design space, each a `layoutopt.protocols.Solver`."""

from typing import Final

EXTENSION_POINT: Final = "solvers"
ROWS: Final = {
    "exhaustive": "solvers.exhaustive:Exhaustive",
    "racing": "solvers.racing:Racing",
    "global_search": "solvers.global_search:GlobalSearch",
}
