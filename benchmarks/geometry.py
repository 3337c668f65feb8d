"""How fast exact geometry is: static errors, blind probabilities, direction maps, segments against a million tags.

Run with ``make benchmark`` or ``python benchmarks/geometry.py [ROUNDS]``; prints the rows of the tables in the
README beside this file. The first table has seconds of one call without the memory of earlier ones, because the
user waits for these; on another machine they differ. The others have ratios within rounds.
"""

import argparse
import math
from collections.abc import Callable

import numpy as np
import shapely
import workload
from scaling import in_turn

from layoutopt.circles import arrangement
from layoutopt.docking_world import DockingWorld
from layoutopt.identity import FloatArray
from layoutopt.layout import TagPattern
from layoutopt.patterns.listed import listed
from layoutopt.patterns.square import square
from layoutopt.patterns.sudoku import sudoku
from layoutopt.patterns.tilted import tilted
from layoutopt.robot import Robot
from layoutopt.sightings import grid_for_ways, segment_sightings
from layoutopt.simulation.docking_ground import DockingGround, site_walls
from layoutopt.site import Site
from objectives.gap_pieces import gap_pieces, gap_pieces_plain
from objectives.invisibility import blind_probability
from objectives.periodic_discs import one_antenna

RADIUS_M = 0.1
LENGTH_M = 1.0
DENSITY_PER_M2 = 100.0
TILE_M = 0.7


def static_call(pattern: TagPattern, radius_m: float) -> Callable[[], object]:
    """Return the static errors of all three estimators."""

    def call() -> None:
        circles = arrangement(pattern.points_m, pattern.cell_m, radius_m)
        for places in (circles.middles(), circles.middles(centroid=True), circles.centres()):
            circles.largest_distance_m(places)
            circles.mean_distance_m(places)

    return call


def direction_call(*, blocks_wave: bool) -> Callable[[], object]:
    """Return the map of direction errors of a hall of 10 m by 10 m with a rack in it, in cells of 50 mm."""
    generator = np.random.Generator(np.random.Philox(3))
    scatterers_m = 10.0 * generator.random((20, 2))
    hall = Site(name="hall", floor=shapely.box(0.0, 0.0, 10.0, 10.0), obstacles=(shapely.box(4.0, 4.0, 6.0, 5.0),))
    ground = DockingGround(
        walls=site_walls(hall, Robot(outline_m=0.2 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]))),
        floor=hall.open_floor,
        transponder_m=(5.01, 2.51),
        world=DockingWorld(blocks_wave=blocks_wave),
    )
    axis_m = 0.05 * (np.arange(200) + 0.5)
    cells_m = np.stack(np.meshgrid(axis_m, axis_m), axis=-1).reshape(-1, 2)
    return lambda: ground.arrivals(scatterers_m, cells_m)


def single_calls(rounds: int) -> list[str]:
    """Return rows of the seconds of single calls."""
    generator = np.random.Generator(np.random.Philox(1))
    four = listed(points_m=generator.random((4, 2)), cell_m=(1.0, 1.0))
    floor = sudoku(tile_m=TILE_M, seed=1, radius_m=RADIUS_M)
    tile = tilted(tile_m=TILE_M, angle_rad=0.22)
    angle_rad = np.radians(np.arange(360.0))
    times_s = in_turn(
        {
            "static error, square, r = 3 pitches": static_call(square(pitch_m=1.0), 3.0),
            "static error, 4 tags a cell, r = 3 pitches": static_call(four, 1.5),
            "static error, Sudoku floor (324 tags), r = 1 pitch": static_call(floor, TILE_M / 2.0),
            "static error, Sudoku floor, r = 3 pitches": static_call(floor, 1.5 * TILE_M),
            "B at 1 m, 360 directions, tilted tile": lambda: blind_probability(tile, RADIUS_M, 1.0, angle_rad),
            "B at 2 m, 360 directions, Sudoku floor": lambda: blind_probability(floor, RADIUS_M, 2.0, angle_rad),
            "direction errors, 40,000 cells, 20 scatterers": direction_call(blocks_wave=False),
            "direction errors, the same where walls and scatterers block": direction_call(blocks_wave=True),
        },
        rounds,
    )
    return [f"| {name} | {workload.median_and_range(taken_s)} |" for name, taken_s in times_s.items()]


def against_index(rounds: int, tags: int = 1_000_000, segments: int = 10_000) -> list[str]:
    """Return the row of segments against tags, beside a query of shapely's index.

    Raises
    ------
    RuntimeError
        If the two find other tags: then there is nothing to compare.
    """
    generator = np.random.Generator(np.random.Philox(2))
    side_m = math.sqrt(tags / DENSITY_PER_M2)
    tags_m, start_m = side_m * generator.random((tags, 2)), side_m * generator.random((segments, 2))
    angle_rad = 2.0 * math.pi * generator.random(segments)
    end_m = start_m + LENGTH_M * np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=1)
    grid, tree = grid_for_ways(tags_m), shapely.STRtree(shapely.points(tags_m))
    segment_m, lines = np.hstack([start_m, end_m]), shapely.linestrings(np.stack([start_m, end_m], axis=1))
    found = segment_sightings(segment_m, RADIUS_M, grid)
    expected = tree.query(lines, predicate="dwithin", distance=RADIUS_M)
    if not same_pairs(np.stack([found.way, found.tag]), expected):
        raise RuntimeError("our query and that of shapely find other tags")
    times_s = in_turn(
        {
            "ours": lambda: segment_sightings(segment_m, RADIUS_M, grid),
            "tree": lambda: tree.query(lines, predicate="dwithin", distance=RADIUS_M),
        },
        rounds,
    )
    ratio = workload.median_and_range(times_s["tree"] / times_s["ours"])
    return [f"| {segments:,} | {tags:,} | {len(found):,} | {ratio} |"]


def same_pairs(first: FloatArray, second: FloatArray) -> bool:
    """Return whether two lists of pairs, shape (2, n), hold the same."""
    return first.shape == second.shape and all(
        np.array_equal(one, other)
        for one, other in zip(first[:, np.lexsort(first)], second[:, np.lexsort(second)], strict=True)
    )


def against_twin(rounds: int, directions: int = 6, tile_count: int = 9) -> list[str]:
    """Return the row of gaps of a Sudoku floor, or of a tilted tile alone, beside their plain twin."""
    pattern = sudoku(tile_m=TILE_M, seed=1) if tile_count == 9 else tilted(tile_m=TILE_M, angle_rad=0.22)
    sight, angle_rad = one_antenna(pattern, RADIUS_M), np.linspace(0.1, 1.4, directions)
    times_s = in_turn(
        {
            "ours": lambda: gap_pieces(sight, angle_rad, LENGTH_M),
            "twin": lambda: gap_pieces_plain(sight, angle_rad, LENGTH_M),
        },
        rounds,
    )
    return [f"| {pattern.name} | {directions} | {workload.median_and_range(times_s['twin'] / times_s['ours'])} |"]


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("rounds", nargs="?", type=int, default=15)
    rounds = parser.parse_args().rounds
    workload.use_one_core()
    print(f"{workload.machine()}; {rounds} rounds\n")
    print("| call | seconds |", "| --- | --- |", sep="\n")
    print(*single_calls(rounds), sep="\n")
    head = "| segments of 1 m | tags | sightings | times as fast as shapely's STRtree (`dwithin`) |"
    print(f"\n{head}", "| --- | --- | --- | --- |", sep="\n")
    print(*against_index(rounds), sep="\n")
    print("\n| gaps of | directions | times as fast as the plain twin |", "| --- | --- | --- |", sep="\n")
    print(*against_twin(max(2, rounds // 4)), sep="\n")


if __name__ == "__main__":
    main()
