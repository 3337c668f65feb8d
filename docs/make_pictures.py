"""Makes the pictures of README and docs from finished studies: ``python docs/make_pictures.py [FOLDER]``.

Those of the sheets for the installer need no study: they are of the built-in ward. Nor do most of those of the
explanations.
"""

import shutil
import sys
from pathlib import Path

from explanation_pictures import draw_explanations
from figure_pictures import draw_figure_page
from PIL import Image
from plan_picture import draw_plan_example

from layoutopt.drawings import canvas
from layoutopt.drawings.sheet_set import Job, sheet_set
from layoutopt.layout import FloorTags, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.patterns.triangular import triangular
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in

PICTURES = Path(__file__).with_name("pictures")
FIGURES = {
    "cost_vs_accuracy": {"front": "front", "layout": "layout", "error_over_time": "error_over_time"},
    "estimator_comparison": {"ratios_as_planned": "estimators", "ratios_faults": "estimators_with_faults"},
    "pattern_comparison": {
        "patterns": "patterns",
        "rose_sparse": "blind_rose",
        "which_pattern": "pattern_comparison",
    },
    "pattern_search": {"found": "patterns_found"},
    "tag_placement": {"floor": "tag_placement"},
    "reader_groups": {"groups": "reader_groups"},
    "antenna_yaw": {"error_by_yaw": "antenna_yaw"},
    "sampling": {"error_by_interval": "sampling"},
    # These two are of the specs `--from hybrid` and `--from small_hall`.
    "hybrid": {"costs": "hybrid"},
    "robustness": {"error_against_tolerance": "robustness"},
    "zones": {"costs": "zones"},
    "speed": {"speed": "speed"},
    "dead_tags": {"dead_tags": "dead_tags"},
    "placement_tolerance": {"placement_tolerance": "placement_tolerance"},
    "reader_count": {"reader_count": "reader_count"},
    "antenna_sizing": {"antenna_sizing": "antenna_sizing"},
    "fleet_size": {"fleet_size": "fleet_size"},
    "recovery": {"recovery": "recovery"},
    "aliasing": {"aliasing": "aliasing"},
    "published/han2006": {"radius": "han2006_radius"},
    "published/kim2009": {"docked": "kim2009_docked", "paths": "kim2009_paths"},
    "published/kim2010": {"homing": "kim2010_homing"},
    "published/liang2020": {"sensor_model": "liang2020_sensor_model", "tracks": "liang2020_tracks"},
    "published/mi2016": {"ratios_table_4": "mi2016_table_4"},
}
"""By study: figure of the study, and name of the picture."""
SHEETS = {
    "hospital_ward": {
        "G-001": "sheet_cover",
        "A-101": "sheet_key_plan",
        "A-201": "sheet_tag_plan",
        "R-101": "sheet_underside",
        "T-102": "sheet_template",
    },
    "hybrid": {"A-102": "sheet_transponder", "R-102": "sheet_top", "W-101": "sheet_wiring"},
}
"""By example: number of the sheet, and name of the picture."""
SHEET_DPI = 90
COLOURS = 64


def main() -> None:
    """Copy figures of the studies in the folder given, by default ``out``, and draw the sheets."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    PICTURES.mkdir(exist_ok=True)
    for study, figures in FIGURES.items():
        for figure, picture in figures.items():
            source = folder / study / "figures" / f"{figure}.png"
            if source.exists():
                shutil.copyfile(source, PICTURES / f"{picture}.png")
            else:
                print(f"left out: {source} (layoutopt study {study} makes it)")
    draw_sheets()
    draw_plan_example(PICTURES)
    draw_figure_page(PICTURES)
    draw_explanations(PICTURES, folder / "cost_vs_accuracy")


def draw_sheets() -> None:
    """Draw sheets of two examples: tags 300 mm apart, in the dock of the ward 120 mm."""
    for example, pictures in SHEETS.items():
        spec = read_spec(built_in(example))
        zones = [ZonePattern(zone="", pattern=triangular(pitch_m=0.3))]
        if "dock" in spec.site.zone_names:
            zones.append(ZonePattern(zone="dock", pattern=square(pitch_m=0.12)))
        first = next(iter(spec.space.layouts()))
        layout = first.replace(floor_tags=FloorTags(zones=tuple(zones)))
        tag_map = layout.floor_tags.lay_on(spec.site)
        job = Job(layout=layout, site=spec.site, robot=spec.robot, tag_map=tag_map, title=spec.site.name)
        for sheet in sheet_set(job):
            if sheet.number in pictures:
                picture = PICTURES / f"{pictures[sheet.number]}.png"
                with canvas.drawing_settings():
                    canvas.figure(sheet).savefig(picture, dpi=SHEET_DPI)
                # Line drawings need few colours, rare ones among them: a palette makes the file a third.
                with Image.open(picture) as drawn:
                    few = drawn.convert("RGB").quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE)
                few.save(picture, optimize=True)


if __name__ == "__main__":
    main()
