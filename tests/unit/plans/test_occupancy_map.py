"""ROS maps, on small files made here."""

import numpy as np
import pytest
import shapely
from PIL import Image
from shapely.geometry import Point

from layoutopt.errors import InvalidInput
from layoutopt.plans.occupancy_map import read_occupancy_map

SETTINGS = {
    "image": "room.pgm",
    "mode": "trinary",
    "resolution": "0.1",
    "origin": "[-1.0, -2.0, 0.0]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}


def pgm(values, largest=255, plain=False):
    values = np.asarray(values)
    head = f"{'P2' if plain else 'P5'}\n# made here\n{values.shape[1]} {values.shape[0]}\n{largest}\n".encode()
    if plain:
        return head + b"\n".join(b" ".join(b"%d" % value for value in row) for row in values)
    return head + values.astype(np.uint8 if largest < 256 else ">u2").tobytes()


def room():
    """Return the image of a room of 38 x 28 free cells with a pillar of 4 x 6 cells at its top left."""
    values = np.full((30, 40), 0)
    values[1:-1, 1:-1] = 254
    values[3:9, 2:6] = 0
    return values


def write(folder, pixels=None, **changes):
    settings = {name: text for name, text in {**SETTINGS, **changes}.items() if text is not None}
    folder.mkdir(exist_ok=True)
    (folder / "room.pgm").write_bytes(pgm(room()) if pixels is None else pixels)
    path = folder / "room.yaml"
    path.write_text("".join(f"{name}: {text}\n" for name, text in settings.items()))
    return path


def read(folder, pixels=None, **changes):
    return read_occupancy_map(write(folder, pixels, **changes), place="site.plan")


def test_room_has_the_area_and_place_that_its_cells_say(tmp_path):
    """The origin is the lower left corner of the lower left pixel; image rows run downwards."""
    floor = read(tmp_path)
    assert floor.polygon.area == pytest.approx((38 * 28 - 24) * 0.01)
    assert floor.polygon.bounds == pytest.approx((-0.9, -1.9, 2.9, 0.9))
    pillar = shapely.box(-0.8, 0.1, -0.4, 0.7)
    assert floor.polygon.intersection(pillar).area == pytest.approx(0.0, abs=1e-9)
    assert floor.polygon.boundary.distance(pillar) == pytest.approx(0.0, abs=1e-9)
    assert floor.source == "room.yaml"


def test_yaw_turns_the_room_about_the_origin(tmp_path):
    """With a yaw of 30 degrees every point is the unturned one, turned about the origin."""
    straight = read(tmp_path / "a").polygon
    turned = read(tmp_path / "b", origin="[-1.0, -2.0, 0.5235987755982988]").polygon
    expected = shapely.affinity.rotate(straight, 30.0, origin=(-1.0, -2.0))
    assert turned.symmetric_difference(expected).area < 1e-9


def test_all_encodings_of_one_room_are_the_same_floor(tmp_path):
    """Binary and plain, one byte and two, and negated values mean the same."""
    values = room()
    floors = [
        read(tmp_path / "1"),
        read(tmp_path / "2", pgm(values, plain=True)),
        read(tmp_path / "3", pgm(values * 257, largest=65535)),
        read(tmp_path / "4", pgm(values * 257, largest=65535, plain=True)),
        read(tmp_path / "5", pgm(254 - values, largest=254), negate="1"),
        read(tmp_path / "6", pgm(values > 0, largest=1), negate="false", mode=None),
        read(tmp_path / "7", mode="scale"),
        read(tmp_path / "8", pgm(np.where(values > 0, 0, 100)), mode="raw"),
    ]
    assert all(floor.polygon.equals(floors[0].polygon) for floor in floors)


@pytest.mark.parametrize("kind", ["# before\nP5", "P5\n40 30\n256\n", "P5 40 30 0\n", "P5 x 30 255\n", "P5\n40"])
def test_bad_headers_are_refused(tmp_path, kind):
    """A header that is no PGM's, or says what the pixels are not, ends in one error."""
    with pytest.raises(InvalidInput, match=r"room\.pgm"):
        read(tmp_path, kind.encode() + b"\x00" * 1200)


def test_header_may_hold_comments_anywhere(tmp_path):
    """Comments and blanks before each number do not count, and a pixel may look like a blank."""
    values = room()
    values[values == 0] = 10
    head = b"P5 #a\n# 7 7\n40 # width\n\t30\r\n#b\n255\n"
    assert read(tmp_path, head + values.astype(np.uint8).tobytes()).polygon.equals(read(tmp_path / "b").polygon)


def test_unknown_cells_are_no_floor(tmp_path):
    """Grey 205 with the threshold of ROS 1 is unknown."""
    values = room()
    values[10:20, 10:20] = 205
    assert read(tmp_path, pgm(values)).polygon.area == pytest.approx(9.4)


def test_saved_unknown_stays_unknown_under_the_threshold_of_nav2(tmp_path):
    """free_thresh 0.25 takes grey 205 for free; in an image of a map saver it is not, and a note says so."""
    values = room()
    values[10:20, 10:20] = 205
    floor = read(tmp_path, pgm(values), free_thresh="0.25")
    assert floor.polygon.area == pytest.approx(9.4)
    assert any("100 cells of grey 205" in note for note in floor.notes)


def test_grey_of_an_image_with_other_greys_follows_the_threshold(tmp_path):
    """An image that no map saver wrote is read by its thresholds alone."""
    values = room()
    values[10:20, 10:20] = 205
    values[25, 25] = 220
    floor = read(tmp_path, pgm(values), free_thresh="0.25")
    assert floor.polygon.area == pytest.approx(10.4)
    assert not any("205" in note for note in floor.notes)


def test_small_parts_are_left_out_and_noted(tmp_path):
    """Parts below the smallest area do not become floor, and the note gives number and area."""
    values = room()
    values[3:9, 2:6] = [[0, 0, 0, 0], [0, 254, 254, 0], [0, 0, 0, 0], [0, 254, 254, 0], [0, 254, 254, 0], [0] * 4]
    floor = read(tmp_path, pgm(values))
    assert floor.polygon.area == pytest.approx(10.4)
    assert "left out 2 free part(s) below 0.25 m², 0.06 m² together" in floor.notes
    kept = read_occupancy_map(tmp_path / "room.yaml", place="p", smallest_room_m2=0.03)
    assert kept.polygon.area == pytest.approx(10.44)
    assert "left out 1 free part(s)" in kept.notes[-1]


def test_simplification_is_stated(tmp_path):
    """A slanted wall is simplified within one pixel, and a note gives tolerance and change of area."""
    row, column = np.indices((100, 100))
    values = np.where((row > column // 2) & (row < 99) & (column > 0) & (column < 99), 254, 0)
    floor = read(tmp_path, pgm(values))
    exact = read_occupancy_map(tmp_path / "room.yaml", place="p", tolerance_m=0.0).polygon
    assert exact.area == pytest.approx((values == 254).sum() * 0.01)
    assert floor.polygon.hausdorff_distance(exact) <= 0.1
    assert len(floor.polygon.exterior.coords) < 10 < len(exact.exterior.coords)
    change = 100.0 * (floor.polygon.area / exact.area - 1.0)
    assert f"outlines simplified within 0.1 m, which changed the area by {change:+.3f} %" in floor.notes


def test_unknown_keys_are_noted(tmp_path):
    """Keys that mean nothing here are named."""
    assert any(
        "'" not in note and "frame_id, zeta" in note for note in read(tmp_path, zeta="1", frame_id="map").notes
    )


def test_number_in_scientific_form_is_a_number(tmp_path):
    """YAML 1.1 takes 1e-1 for text; a resolution is meant."""
    assert read(tmp_path / "a", resolution="1e-1").polygon.equals(read(tmp_path / "b").polygon)


def test_point_in_the_room_keeps_its_place_whatever_the_format(tmp_path):
    """A hand-picked point in the lower right corner of the image is free, its mirror image is not."""
    values = np.zeros((30, 40))
    values[20:29, 30:39] = 254
    polygon = read(tmp_path, pgm(values)).polygon
    assert polygon.contains(Point(-1.0 + 3.5, -2.0 + 0.5))
    assert not polygon.contains(Point(-1.0 + 3.5, -2.0 + 2.5))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"image": None}, ["image", "missing"]),
        ({"image": "none.pgm"}, ["none.pgm", "does not exist"]),
        ({"image": "."}, ["folder"]),
        ({"image": "room.yaml"}, ["room.yaml is no PGM image"]),
        ({"resolution": None}, ["resolution", "missing"]),
        ({"resolution": ".nan"}, ["room.yaml:3 resolution", "no number"]),
        ({"resolution": "nan"}, ["resolution", "no number"]),
        ({"resolution": "-0.05"}, ["resolution", "positive"]),
        ({"resolution": "0"}, ["resolution", "positive"]),
        ({"resolution": "inf"}, ["resolution", "positive"]),
        ({"resolution": "1e-300"}, ["m x", "unit"]),
        ({"resolution": "1e300"}, ["m x", "unit"]),
        ({"resolution": "[0.1]"}, ["resolution", "no number"]),
        ({"resolution": "100"}, ["3800 m x 2800 m"]),
        ({"resolution": "0.001"}, ["0.038 m x 0.028 m"]),
        ({"origin": None}, ["origin is missing", "lower left"]),
        ({"origin": "[0, 0]"}, ["room.yaml:4 origin", "lower left"]),
        ({"origin": "[0, .inf, 0]"}, ["origin"]),
        ({"origin": "[0, 1e7, 0]"}, ["origin"]),
        ({"origin": "{x: 1}"}, ["origin"]),
        ({"mode": "trinery"}, ["Did you mean 'trinary'?"]),
        ({"negate": "2"}, ["negate"]),
        ({"mode": "raw", "negate": "1"}, ["negate", "ROS 1"]),
        ({"free_thresh": "0.7"}, ["free_thresh"]),
        ({"free_thresh": "0"}, ["free_thresh"]),
    ],
)
def test_bad_settings_are_refused_with_key_and_line(tmp_path, changes, words):
    """Each fault names key and line and what would be right."""
    with pytest.raises(InvalidInput) as caught:
        read(tmp_path, **changes)
    for word in ["site.plan", *words]:
        assert word in str(caught.value)


def test_all_faults_of_the_settings_come_at_once(tmp_path):
    """Three bad keys are three faults."""
    with pytest.raises(InvalidInput) as caught:
        read(tmp_path, resolution="x", origin="[1]", mode="y")
    assert len(caught.value.faults) == 3


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"- a\n- b\n", "no keys"),
        (b"", "empty"),
        (b"image: [\n", "no YAML"),
        (b"[" * 50_000, "no YAML"),
        (b"image: room.pgm\nimage: b.pgm\n", "twice"),
        (b"!!python/object/apply:os.system ['true']", "no keys"),
        ("image: 地図.pgm\n".encode("cp932"), "no YAML"),
        (b"P5\n1 1\n255\n\x00", "is an image"),
        (b"\x89PNG\r\n", "is an image"),
        (b"a: 1\n" * 30_000, "few lines"),
        (b"a: 1\n---\nb: 1\n", "no YAML"),
    ],
)
def test_what_is_no_map_is_refused(tmp_path, content, words):
    """Lists, torn files, other encodings, images and bombs end in one error."""
    path = tmp_path / "map.yaml"
    path.write_bytes(content)
    with pytest.raises(InvalidInput, match=words):
        read_occupancy_map(path, place="site.plan")


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (b"\x89PNG\r\n\x1a\n", "is a PNG image.*pgm"),
        (b"P6\n1 1\n255\nabc", "colour"),
        (pgm(room())[:-1], "cut off: 1199 bytes of pixels where 1200"),
        (pgm(room()) + b"12345", "goes on for 5 bytes"),
        (pgm(room(), plain=True)[:-4], "1198 numbers where 1200"),
        (pgm(room(), plain=True) + b" 7", "1201 numbers"),
        (pgm(room(), plain=True) + b" -7", "among its numbers"),
        (pgm(room(), plain=True).replace(b"254", b"256", 1), "256, beyond"),
        (pgm(room(), largest=253), "254 in row 1, column 1, beyond 253"),
        (b"P5\n100000 100000\n255\n", "pixels.*40,000,000"),
        (b"P5\n0 5\n255\n", "pixels"),
        (pgm(np.zeros((30, 40))), "no free cell"),
        (b"", "empty"),
    ],
)
def test_bad_images_are_refused(tmp_path, image, words):
    """Other formats, torn and overlong data and absurd sizes are told apart."""
    with pytest.raises(InvalidInput, match=words):
        read(tmp_path, image)


def test_map_without_a_part_of_floor_size_is_refused(tmp_path):
    """The message gives the area of the largest part."""
    values = np.zeros((30, 40))
    values[4:8, 4:8] = 254
    with pytest.raises(InvalidInput, match=r"m x"):
        read(tmp_path, pgm(values))
    values[20:26, 20:23] = values[8:9, 8:9] = values[28, 38] = 254
    with pytest.raises(InvalidInput, match=r"largest free part has 0\.18 m²"):
        read(tmp_path, pgm(values))


def test_tolerance_must_be_a_length(tmp_path):
    """A negative tolerance or none at all is refused before anything is read."""
    for tolerance_m in (-0.1, float("nan"), float("inf")):
        with pytest.raises(InvalidInput, match="tolerance"):
            read_occupancy_map(tmp_path / "none.yaml", place="p", tolerance_m=tolerance_m)


def test_large_map_is_read_in_two_seconds(tmp_path):
    """A map as large as the depot of nav2 (604 x 307 pixels) with hundreds of obstacles takes no time."""
    import time

    draws = np.random.default_rng(3)
    values = np.full((307, 604), 254)
    values[[0, -1]] = values[:, [0, -1]] = 0
    for row, column in zip(draws.integers(5, 295, 400), draws.integers(5, 590, 400), strict=True):
        values[row : row + 4, column : column + 5] = 0
    path = write(tmp_path, pgm(values), resolution="0.05")
    started = time.perf_counter()
    floor = read_occupancy_map(path, place="p")
    assert time.perf_counter() - started < 2.0
    assert floor.polygon.area == pytest.approx((values == 254).sum() * 0.0025, rel=0.01)


def test_a_png_image_gives_the_same_floor_as_a_grey_map(tmp_path):
    """Maps are saved in both forms; a transparent pixel could mean anything and is refused."""
    values = room().astype(np.uint8)
    expected = read(tmp_path).polygon
    path = write(tmp_path, image="room.png")
    Image.fromarray(values).save(tmp_path / "room.png")
    assert read_occupancy_map(path, place="site.plan").polygon.equals(expected)
    opaque = np.full(values.shape, 255, dtype=np.uint8)
    opaque[0, 0] = 0
    Image.fromarray(np.stack([values, opaque], axis=2)).save(tmp_path / "room.png")
    with pytest.raises(InvalidInput, match=r"room\.png has transparent pixels"):
        read_occupancy_map(path, place="site.plan")
