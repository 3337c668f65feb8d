"""Makes the pictures of README and docs from finished studies: ``python docs/make_pictures.py [FOLDER]``."""

import shutil
import sys
from pathlib import Path

PICTURES = Path(__file__).with_name("pictures")
FIGURES = {
    "cost_vs_accuracy": {"front": "front", "layout": "layout", "error_over_time": "error_over_time"},
    "estimator_comparison": {"ratios_as_planned": "estimators", "ratios_faults": "estimators_with_faults"},
    "pattern_comparison": {"patterns": "patterns", "rose_sparse": "blind_rose"},
    "pattern_search": {"found": "patterns_found"},
    "tag_placement": {"floor": "tag_placement"},
    "reader_groups": {"groups": "reader_groups"},
    "robustness": {"error_against_tolerance": "robustness"},
    "published/han2006": {"radius": "han2006_radius"},
    "published/kim2010": {"homing": "kim2010_homing"},
    "published/mi2016": {"ratios_table_4": "mi2016_table_4"},
}
"""By study: figure of the study, and name of the picture."""


def main() -> None:
    """Copy the figures of the studies in the folder given, by default ``out``; leave out what was not run."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    PICTURES.mkdir(exist_ok=True)
    for study, figures in FIGURES.items():
        for figure, picture in figures.items():
            source = folder / study / "figures" / f"{figure}.png"
            if source.exists():
                shutil.copyfile(source, PICTURES / f"{picture}.png")
            else:
                print(f"left out: {source} (layoutopt study {study} makes it)")


if __name__ == "__main__":
    main()
