"""Studies: the questions that users ask, each answered in rounds of trials."""

from typing import Final

EXTENSION_POINT: Final = "studies"
ROWS: Final = {"cost_vs_accuracy": "studies.cost_vs_accuracy:CostVersusAccuracy"}
