"""Floors from PNG images with a scale."""

import io
import struct
import zlib

import numpy as np
import pytest
from mutated_files import with_sound_checksums
from PIL import Image
from shapely.geometry import box

from layoutopt.errors import InvalidInput
from layoutopt.plans.image import read_image
from layoutopt.plans.placing import Scale
from layoutopt.plans.png import MAGIC

SCALE = Scale(first_px=(20.0, 130.0), second_px=(220.0, 130.0), distance_m=10.0)  # 0.05 m per pixel


def drawing():
    """Two rooms of 100 x 80 and 96 x 80 pixels with a door of 18 between them, walls of 4, on white paper."""
    values = np.full((140, 260), 255, dtype=np.uint8)
    values[26:114, 26:234] = 0
    values[30:110, 30:130] = 255
    values[30:110, 134:230] = 255
    values[60:78, 130:134] = 255
    return values


@pytest.fixture
def read(tmp_path):
    def call(values, mode=None, **settings):
        path = tmp_path / "hall.png"
        if isinstance(values, bytes):
            path.write_bytes(values)
        else:
            Image.fromarray(values, mode=None).convert(mode or "L").save(path)
        return read_image(path, place="site.plan", **{"scale": SCALE, "tolerance_m": 0.0, **settings})

    return call


def test_light_pixels_within_walls_are_the_floor_and_paper_around_is_not(read):
    floor = read(drawing())
    assert floor.polygon.geom_type == "Polygon"
    assert floor.polygon.area == pytest.approx((100 * 80 + 96 * 80 + 18 * 4) * 0.05**2)
    # The lower left corner of the image is (0, 0) and y goes up: the rooms begin 30 rows above the last row.
    assert floor.polygon.bounds == pytest.approx((30 * 0.05, 30 * 0.05, 230 * 0.05, 110 * 0.05))
    assert any("outside the walls, so no floor" in note for note in floor.notes)


def test_what_lies_high_in_the_image_lies_high_on_the_floor(read):
    values = drawing()
    values[30:50, 30:50] = 0  # a column in the upper left corner of the image
    floor = read(values).polygon
    assert not floor.contains(box(1.6, 4.6, 2.4, 5.4))
    assert floor.contains(box(1.6, 1.6, 2.4, 2.4))


def test_an_entrance_lets_the_paper_in_unless_its_gap_is_closed(read):
    values = drawing()
    values[60:80, 26:30] = 255  # 1 m wide
    with pytest.raises(InvalidInput, match="closed off from the border") as caught:
        read(values)
    assert 'gap = "1.2 m"' in str(caught.value)
    closed = read(values, gap_m=1.1).polygon
    whole = read(drawing()).polygon
    assert closed.area == pytest.approx(whole.area, abs=0.3)
    assert closed.intersection(whole).area == pytest.approx(whole.area, abs=0.15)


@pytest.mark.parametrize("gap_m", [0.0, 0.3, 0.8, 1.2])
def test_closing_gaps_takes_nothing_from_a_closed_building(read, gap_m):
    assert read(drawing(), gap_m=gap_m).polygon.equals(read(drawing()).polygon)


def test_without_an_outside_all_that_is_light_is_floor(read):
    assert read(drawing(), border="floor", smallest_room_m2=0.0).polygon.area == pytest.approx(
        (drawing() == 255).sum() * 0.05**2
    )


@pytest.mark.parametrize("mode", ["L", "RGB", "RGBA", "P", "1", "LA", "I;16"])
def test_every_kind_of_png_is_read_alike(read, mode):
    whole = read(drawing()).polygon
    if mode == "I;16":
        image = Image.fromarray(drawing().astype(np.uint16) * 257)
        buffer = io.BytesIO()
        image.save(buffer, format="PNG")
        assert read(buffer.getvalue()).polygon.equals(whole)
    else:
        assert read(drawing(), mode).polygon.equals(whole)


def test_transparent_pixels_are_no_floor_and_are_told(read):
    values = np.stack([drawing(), np.full((140, 260), 255, dtype=np.uint8)], axis=2)
    values[30:50, 30:130, 1] = 0
    buffer = io.BytesIO()
    Image.fromarray(values).save(buffer, format="PNG")
    floor = read(buffer.getvalue())
    assert floor.polygon.area == pytest.approx((60 * 100 + 96 * 80 + 18 * 4) * 0.05**2)
    assert any("transparent, so no floor: 5 m²" in note for note in floor.notes)


def test_the_threshold_decides_what_is_light(read):
    values = np.where(drawing() == 255, 180, 60).astype(np.uint8)
    assert read(values).polygon.equals(read(drawing()).polygon)
    with pytest.raises(InvalidInput, match=r"no pixel as light as 0\.8"):
        read(values, threshold=0.8)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"scale": None}, "the scale of hall.png is not stated"),
        ({"scale": Scale(first_px=(0, 0), second_px=(30, 0), distance_m=1.0)}, "30 pixels apart"),
        ({"scale": Scale(first_px=(0, 0), second_px=(261, 0), distance_m=1.0)}, "lies outside hall.png"),
        ({"scale": Scale(first_px=(0, 0), second_px=(200, 0), distance_m=0.05)}, "check the unit"),
        ({"scale": Scale(first_px=(0, 0), second_px=(200, 0), distance_m=9e4)}, "check the unit"),
        ({"smallest_room_m2": 900.0}, "the largest free part has"),
        ({"border": "wall"}, "is no rule"),
    ],
)
def test_settings_that_do_not_fit_are_refused(read, settings, said):
    with pytest.raises(InvalidInput, match=r"site\.plan") as caught:
        read(drawing(), **settings)
    assert said in str(caught.value)


def png_of(values):
    buffer = io.BytesIO()
    Image.fromarray(values).save(buffer, format="PNG")
    return buffer.getvalue()


def with_rows(count):
    """Return the image of 140 rows with a header that says another number of them."""
    content = png_of(drawing())
    return with_sound_checksums(content[:20] + count.to_bytes(4, "big") + content[24:])


def interlaced():
    """Return the image with one bit a pixel in the seven passes of Adam7, which the image library only reads."""
    bits = drawing() == 255
    passes = [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)]
    rows = b"".join(
        b"\0" + np.packbits(row).tobytes() for x, y, dx, dy in passes for row in bits[y::dy, x::dx] if len(row)
    )
    header = struct.pack(">IIBBBBB", 260, 140, 1, 0, 0, 0, 1)
    chunks = [(b"IHDR", header), (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
    body = b"".join(struct.pack(">I", len(data)) + name + data + b"1234" for name, data in chunks)
    return with_sound_checksums(MAGIC + body)


def test_an_interlaced_image_is_read_like_any_other(read):
    assert read(interlaced()).polygon.equals(read(drawing()).polygon)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty"),
        (b"P5\n1 1\n255\n\x00", "no PNG image"),
        (b"\x89PNG\r\n\x1a\n", "no PNG image"),
        (png_of(drawing())[:200], "damaged"),
        (png_of(drawing())[:16] + b"\x00\x01\x00\x00\x00\x01\x00\x00" + png_of(drawing())[24:], "65536 x 65536"),
        (png_of(drawing())[:16] + b"\x00\x00\x00\x00" + png_of(drawing())[20:], "0 x 140"),
        (with_rows(141), "holds 36540 bytes of pixels where 36801 are needed"),
        (with_rows(139), "where 36279 are needed"),
        (png_of(np.zeros((140, 260), dtype=np.uint8)), "no pixel as light as 0.5 of white"),
        (png_of(np.full((140, 260), 255, dtype=np.uint8)), "no light part"),
    ],
)
def test_what_is_no_image_of_a_plan_is_refused_with_the_reason(read, content, said):
    with pytest.raises(InvalidInput, match=r"site\.plan") as caught:
        read(content)
    assert said in str(caught.value)
