"""Floors from GeoJSON."""

import json

import pytest

from layoutopt.errors import InvalidInput
from layoutopt.plans.geojson import read_geojson

HALL = [[0, 0], [12, 0], [12, 8], [0, 8], [0, 0]]
COLUMN = [[3, 3], [4, 3], [4, 4], [3, 4], [3, 3]]
BOW_TIE = [[0, 0], [4, 4], [4, 0], [0, 4], [0, 0]]


def feature(rings, kind=None, what="Polygon"):
    properties = None if kind is None else {"kind": kind}
    return {"type": "Feature", "properties": properties, "geometry": {"type": what, "coordinates": rings}}


def collection(*features):
    return {"type": "FeatureCollection", "features": list(features)}


@pytest.fixture
def read(tmp_path):
    def call(document, **settings):
        path = tmp_path / "hall.geojson"
        text = document if isinstance(document, (str, bytes)) else json.dumps(document)
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_geojson(path, place="site.plan", **{"units": "m", **settings})

    return call


def fault_of(read, document, **settings):
    with pytest.raises(InvalidInput) as caught:
        read(document, **settings)
    assert all(fault.place.startswith("site.plan") for fault in caught.value.faults)
    return str(caught.value)


@pytest.mark.parametrize(
    "document",
    [
        {"type": "Polygon", "coordinates": [HALL]},
        {"type": "MultiPolygon", "coordinates": [[HALL]]},
        feature([HALL]),
        feature([HALL], "floor"),
        {"type": "GeometryCollection", "geometries": [{"type": "Polygon", "coordinates": [HALL]}]},
        {"type": "Polygon", "coordinates": [[[x, y, 2.5] for x, y in HALL]]},
    ],
)
def test_a_floor_is_read_from_every_form_that_the_standard_has(read, document):
    floor = read(document)
    assert floor.polygon.area == 96.0
    assert floor.polygon.bounds == (0.0, 0.0, 12.0, 8.0)
    assert not floor.rooms
    assert floor.source == "hall.geojson"


def test_features_say_what_their_polygons_are(read):
    plate = [[10, 6], [14, 6], [14, 8], [10, 8], [10, 6]]
    floor = read(collection(feature([HALL]), feature([COLUMN], "obstacle"), feature([plate], "metal")))
    assert [obstacle.area for obstacle in floor.obstacles] == [1.0]
    (zone,) = floor.zones
    assert (zone.name, zone.metal, zone.tags) == ("metal_1", True, True)
    assert zone.region.area == pytest.approx(4.0)
    assert any("cut 4 m² of metal" in note for note in floor.notes)


def test_rooms_that_touch_are_joined_and_kept_as_rooms(read):
    other = [[x + 12, y] for x, y in HALL]
    floor = read(collection(feature([HALL]), feature([other])))
    assert floor.polygon.geom_type == "Polygon"
    assert floor.polygon.area == pytest.approx(192.0)
    assert [room.area for room in floor.rooms] == [96.0, 96.0]


def test_overlapping_rooms_count_once_and_are_told(read):
    other = [[x + 11, y] for x, y in HALL]
    floor = read(collection(feature([HALL]), feature([other])))
    assert floor.polygon.area == pytest.approx(184.0)
    assert any("overlap by 8 m²" in note for note in floor.notes)


@pytest.mark.parametrize(("units", "metres"), [("mm", 0.001), ("cm", 0.01), ("ft", 0.3048), ("in", 0.0254)])
def test_units_scale_the_floor(read, units, metres):
    rings = [[[x / metres, y / metres] for x, y in HALL]]
    assert read(feature(rings), units=units).polygon.area == pytest.approx(96.0)


def test_a_plan_far_from_its_origin_is_moved_and_says_so(read):
    rings = [[[x + 500_123.4, y + 5_400_000.25] for x, y in HALL]]
    floor = read(feature(rings))
    assert floor.polygon.bounds == pytest.approx((0.4, 0.25, 12.4, 8.25))
    assert floor.source == "hall.geojson, from (500123, 5400000) m"
    assert any("(500123, 5400000) m is (0, 0)" in note for note in floor.notes)


def test_a_bow_tie_is_refused_with_its_crossing(read):
    assert "crosses itself at (2, 2) m" in fault_of(read, feature([BOW_TIE]))


def test_a_bow_tie_is_repaired_only_when_allowed_and_its_area_is_told(read):
    floor = read(feature([BOW_TIE]), repair=True)
    assert floor.polygon.area == pytest.approx(8.0)
    note = floor.notes[0]
    assert "crosses itself at (2, 2) m" in note
    assert "area 0 m² became 8 m² in 2 part(s)" in note


def test_an_open_ring_is_refused_unless_repairs_are_allowed(read):
    assert "is not closed" in fault_of(read, feature([HALL[:-1]]))
    floor = read(feature([HALL[:-1]]), repair=True)
    assert floor.polygon.area == 96.0
    assert any("closed a ring" in note for note in floor.notes)


def test_a_unit_that_is_none_is_answered_with_those_there_are(read):
    assert "Known: cm, ft, in, m, mm" in fault_of(read, feature([HALL]), units="furlong")


def test_a_unit_has_to_be_stated(read):
    assert 'units = "m"' in fault_of(read, feature([HALL]), units=None)


@pytest.mark.parametrize("crs", ["urn:ogc:def:crs:OGC:1.3:CRS84", "EPSG:4326"])
def test_a_global_frame_is_refused(read, crs):
    document = collection(feature([HALL]))
    document["crs"] = {"type": "name", "properties": {"name": crs}}
    assert "degrees" in fault_of(read, document)


def test_coordinates_that_look_like_degrees_are_refused(read):
    rings = [[[8.68 + x * 1e-5, 50.11 + y * 1e-5] for x, y in HALL]]
    assert "looks like degrees" in fault_of(read, feature(rings))


def test_points_and_lines_are_passed_over_and_told(read):
    line = {
        "type": "Feature",
        "properties": {},
        "geometry": {"type": "LineString", "coordinates": [[0, 0], [1, 1]]},
    }
    assert any("1 geometries of type LineString" in note for note in read(collection(feature([HALL]), line)).notes)


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ("{", "no GeoJSON"),
        (b"\xff\xfe{", "no GeoJSON"),
        ("[" * 100_000, "nested too deeply"),
        ("[1, 2]", "no GeoJSON"),
        ('{"type": 3}', "no GeoJSON"),
        ('{"type": "FeatureCollection", "features": [{"type": []}]}', "no polygon of the kind"),
        ('{"type": "Feature", "properties": {"kind": []}, "geometry": {}}', "no kind"),
        ('{"type": "Polygon", "coordinates": [[[0, 0], [NaN, 0], [1, 1], [0, 0]]]}', "NaN"),
        ('{"type": "Polygon", "coordinates": [[[0, 0], [Infinity, 0], [1, 1], [0, 0]]]}', "Infinity"),
        ('{"type": "Polygon", "coordinates": [[[0, 0], [1e999, 0], [1, 1], [0, 0]]]}', "not usable"),
        ('{"type": "Polygon", "coordinates": [[[0, 0], [1e308, 0], [1, 1], [0, 0]]]}', "not usable"),
        ('{"type": "Polygon", "coordinates": [[[0, 0], [%s, 0], [1, 1], [0, 0]]]}' % ("9" * 400), "no rings"),
        ('{"type": "Polygon", "coordinates": [[[0, 0], [%s, 0], [1, 1], [0, 0]]]}' % ("9" * 5000), "no GeoJSON"),
        ('{"type": "Polygon", "coordinates": [[["0", 0], [1, 0], [1, 1], [0, 0]]]}', "no rings"),
        ('{"type": "Polygon", "coordinates": [[[0, 0], [1], [1, 1], [0, 0]]]}', "no rings"),
        ('{"type": "Polygon", "coordinates": [[0, 0], [1, 0]]}', "no rings"),
        ('{"type": "Polygon", "coordinates": "[]"}', "no rings"),
        ('{"type": "FeatureCollection", "features": {}}', "no list of features"),
        ('{"type": "FeatureCollection", "features": [3]}', "no object"),
        ('{"type": "FeatureCollection", "features": []}', "no polygon of the kind 'floor'"),
        (feature([HALL], "flor"), "Did you mean 'floor'?"),
        (feature([[[0, 0], [0.1, 0], [0.1, 0.1], [0, 0]]], "floor"), "degrees"),
        (feature([[[0, 0], [5, 0], [9, 0], [0, 0]]]), "no area"),
    ],
)  # fmt: skip
def test_what_is_no_plan_is_refused_with_the_reason(read, document, said):
    assert said in fault_of(read, document)


def test_endless_collections_are_refused(read):
    inner = feature([HALL])
    for _ in range(50):
        inner = {"type": "GeometryCollection", "geometries": [inner]}
    assert "nested too deeply" in fault_of(read, inner)
