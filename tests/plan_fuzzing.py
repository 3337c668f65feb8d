"""Reads damaged plans in a process with bounds on memory and time; prints how many were read and refused.

Called as ``python plan_fuzzing.py KIND SEED COUNT FOLDER``. A file that raises anything but `InvalidInput`, or
computes longer than `LONGEST_S`, stays in the folder and ends the process.
"""

import faulthandler
import io
import json
import resource
import signal
import sys
import warnings
from pathlib import Path

import numpy as np
from mutated_files import mutated, with_other_lines, with_other_numbers, with_sound_checksums
from plan_drawings import lines, new, rectangle, two_rooms

from layoutopt.errors import InvalidInput

LONGEST_S = 10.0
MEMORY_BYTES = 1 << 30


def drawings():
    """Return drawings with all that is read: lines, curves, nested blocks, doors, zones; two versions."""
    found = []
    for version in ("R12", "R2000"):
        # A drawing of R12 has no unit of its own.
        drawing, space = new(version=version)
        lines(space, two_rooms())
        space.add_arc((4000, 1050), 900, 0, 90, dxfattribs={"layer": "DOORS"})
        space.add_circle((1000, 1000), 300, dxfattribs={"layer": "WALLS"})
        space.add_polyline2d(
            [(6000, 1000, 1), (7000, 1000, 0.5)], "xyb", close=True, dxfattribs={"layer": "METAL"}
        )
        if version != "R12":
            space.add_spline([(500, 2000), (900, 2500), (1500, 2600)], dxfattribs={"layer": "WALLS"})
            space.add_ellipse((2500, 2000), (300, 0), 0.5, dxfattribs={"layer": "WALLS"})
        lines(drawing.blocks.new("INNER"), rectangle(0, 0, 100, 100), "0")
        drawing.blocks.new("OUTER").add_blockref("INNER", (50, 50), dxfattribs={"rotation": 30})
        space.add_blockref("OUTER", (3000, 500), dxfattribs={"layer": "WALLS", "xscale": 2}).grid(
            (1, 2), (400, 300)
        )
        stream = io.StringIO()
        drawing.write(stream)
        found.append(stream.getvalue().encode())
    return found


def geojsons():
    """Return a small plan with every kind of feature."""
    square = [[0, 0], [12.5, 0], [12.5, 8], [0, 8], [0, 0]]
    hole = [[3, 3], [3, 4], [4, 4], [4, 3], [3, 3]]
    features = [
        {"type": "Feature", "properties": {"kind": kind}, "geometry": {"type": what, "coordinates": rings}}
        for kind, what, rings in (
            ("floor", "Polygon", [square, hole]),
            ("floor", "MultiPolygon", [[[[x + 12.5, y] for x, y in square]]]),
            ("obstacle", "Polygon", [[[x + 2, y] for x, y in hole]]),
            ("metal", "Polygon", [[[x + 4, y + 2] for x, y in hole]]),
        )
    ]
    return [json.dumps({"type": "FeatureCollection", "features": features}).encode()]


def images():
    """Return a small plan as grey, coloured and indexed image."""
    from PIL import Image

    values = np.full((60, 120), 255, dtype=np.uint8)
    values[10:50, 10:110] = 0
    values[12:48, 12:108] = 255
    found = []
    for mode in ("L", "RGBA", "P"):
        buffer = io.BytesIO()
        Image.fromarray(values).convert(mode).save(buffer, format="PNG")
        found.append(buffer.getvalue())
    return found


def reader_of(kind):
    """Return file name, sound contents, damages and reader of a kind of plan."""
    from layoutopt.plans.dxf import read_dxf
    from layoutopt.plans.geojson import read_geojson
    from layoutopt.plans.image import read_image
    from layoutopt.plans.placing import Layers, Scale

    layers = Layers(walls=("WALLS",), doors=("DOORS",), metal=("METAL",))
    scale = Scale(first_px=(0.0, 0.0), second_px=(110.0, 0.0), distance_m=11.0)

    def read_drawing(path, draws):
        accepted = bool(draws.integers(2))
        return read_dxf(path, place="site.plan", units="mm", layers=layers, gap_m=1.0, accept_recovered=accepted)

    def read_map(path, draws):
        return read_geojson(path, place="site.plan", units="m", repair=bool(draws.integers(2)))

    def read_picture(path, draws):
        return read_image(path, place="site.plan", scale=scale, gap_m=float(draws.choice([0.0, 0.5])))

    damages = [mutated, with_other_numbers, with_other_lines]
    return {
        "dxf": ("plan.dxf", drawings, damages, read_drawing),
        "geojson": ("plan.geojson", geojsons, damages[:2], read_map),
        "png": ("plan.png", images, [mutated, lambda *given: with_sound_checksums(mutated(*given))], read_picture),
    }[kind]


def main(kind, seed, count, folder):
    """Read damaged plans and print the counts as JSON."""
    name, sound, damages, read = reader_of(kind)
    contents, path = sound(), folder / name
    draws = np.random.default_rng(seed)
    for content in contents:
        path.write_bytes(content)
        read(path, draws)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    warnings.simplefilter("error")
    # Time of the processor, so that a busy machine makes no difference; the signal kills, after a traceback.
    faulthandler.register(signal.SIGPROF, chain=True)
    good = bad = 0
    for _ in range(count):
        content = contents[draws.integers(len(contents))]
        path.write_bytes(damages[draws.integers(len(damages))](content, draws))
        signal.setitimer(signal.ITIMER_PROF, LONGEST_S)
        try:
            floor = read(path, draws)
        except InvalidInput as error:
            bad += 1
            refused = error
        else:
            good += 1
            assert floor.polygon.is_valid
            assert 0.0 < floor.polygon.area < 1e6
            refused = None
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        if refused is not None:
            assert all(fault.place.startswith("site.plan") for fault in refused.faults)
            assert len(str(refused)) < 6000
    print(json.dumps({"good": good, "bad": bad}))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
