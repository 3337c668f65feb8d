"""Makes the pictures of README and docs from a finished study: ``python docs/make_pictures.py [FOLDER]``."""

import shutil
import sys
from pathlib import Path

PICTURES = Path(__file__).with_name("pictures")
NAMES = ("front.png", "layout.png", "error_over_time.png")


def main() -> None:
    """Copy the figures of the study in the folder given, by default that of ``make study``."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out/cost_vs_accuracy")
    PICTURES.mkdir(exist_ok=True)
    for name in NAMES:
        shutil.copyfile(folder / "figures" / name, PICTURES / name)


if __name__ == "__main__":
    main()
