"""The floor as it was built, beside the plan: which tags answer, where they are, and what does not fit."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum, unique
from typing import Final

import numpy as np

from layoutopt.commissioning.site_records import Scan, Survey
from layoutopt.commissioning.survey_fit import RigidFit, rigid_fit
from layoutopt.errors import Fault, InvalidInput
from layoutopt.identity import FloatArray, IntArray, read_only
from layoutopt.laying import named_places
from layoutopt.layout import EditKind, Layout, TagEdit, TagMap
from layoutopt.scenario import TruePlaces
from layoutopt.site import Site

DEFAULT_TOLERANCE_M: Final = 0.01
"""A tag beside its place by more than this is told; installers are asked for 5 mm."""
_SAME_M: Final = 1e-9
_OWN_FRAME: Final = 3.0
"""A survey is taken for one in another frame if a rigid motion brings its median error down by this factor."""
_MOST_NAMED: Final = 20


@unique
class Deviation(Enum):
    """What can be wrong with a tag."""

    MISSING = "missing"
    TWO_IDENTITIES = "two identities"
    DUPLICATE = "duplicate"
    SWAPPED = "swapped"
    MOVED = "moved"
    ELSEWHERE = "at another tag's place"
    BYTES_TURNED = "bytes turned"
    BYTES_UNCLEAR = "order of bytes unclear"
    CLASH = "identities clash"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing that does not fit the plan, with the tags it is about and what to do."""

    deviation: Deviation
    tag_ids: tuple[int, ...]
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class AsBuilt:
    """A floor as it was found.

    Attributes
    ----------
    tag_map
        All tags of the plan, with identities, measured places where there are any, and states ``"installed"``,
        ``"moved"``, ``"missing"`` or ``"unclear"`` (an identity that must be scanned again).
    planned_m, surveyed_m
        Places in the plan and as measured, both of shape (n, 2), m, in the frame ``map``; NaN where none was
        measured.
    scanned_m
        Where the tag stands whose identity was scanned at each number, shape (n, 2), m: beside ``surveyed_m`` it
        shows the exchanged tags.
    findings
        What does not fit, the most serious kinds first.
    frame
        The motion from the survey to the plan, fitted in any case; applied only if it was asked for.
    """

    tag_map: TagMap
    planned_m: FloatArray
    surveyed_m: FloatArray
    scanned_m: FloatArray
    findings: tuple[Finding, ...]
    frame: RigidFit | None

    def count(self, deviation: Deviation) -> int:
        """Return how many findings of a kind there are."""
        return sum(finding.deviation is deviation for finding in self.findings)


def as_built(
    tag_map: TagMap,
    scans: Sequence[Scan],
    survey: Survey | None,
    *,
    tolerance_m: float = DEFAULT_TOLERANCE_M,
    survey_sigma_m: float = 0.001,
    own_frame: bool = False,
    reach_m: float = 0.0,
) -> AsBuilt:
    """Return the floor as scans and survey show it.

    Tags whose surveyed places are each other's planned ones, in pairs or in rings of more, were exchanged: their
    identities and measurements change places, which the finding says. A scan alone cannot show this.

    Parameters
    ----------
    tag_map
        The tags as planned.
    survey
        Measured places, if any were.
    tolerance_m
        A tag farther than this from its place counts as moved.
    survey_sigma_m
        Standard deviation of a measured place, per axis.
    own_frame
        Whether the survey is in a frame of its own, which is then fitted to the plan.
    reach_m
        How far an antenna that takes several tags a scan reads: two tags of which it can have both in its field
        should not end in the same digit. Zero where no antenna takes several.

    Raises
    ------
    InvalidInput
        If scans or survey name tags that the layout does not have, or the survey is plainly in a frame of its own
        and this was not said.
    """
    rows = {tag_id: row for row, tag_id in enumerate(tag_map.ids.tolist())}
    _check_known(rows, scans, survey)
    findings: list[Finding] = []
    uids, unclear = _identities(tag_map, rows, scans, findings)
    surveyed_m = np.full((len(tag_map), 2), np.nan)
    scanned_m, frame = surveyed_m, None
    if survey is not None:
        index = np.array([rows[tag_id] for tag_id in survey.tag_id.tolist()], dtype=np.int64)
        frame = _frame(survey, tag_map.xy_m[index], tolerance_m, own_frame=own_frame)
        surveyed_m[index] = frame.applied(survey.xy_m) if own_frame and frame else survey.xy_m
        scanned_m = surveyed_m.copy()
        place = _places(tag_map, scanned_m, findings)
        surveyed_m[place] = scanned_m
        uids = _exchanged(uids, place)
        unclear[place] = unclear.copy()
    off_m = np.linalg.norm(surveyed_m - tag_map.xy_m, axis=1)
    status = np.full(len(tag_map), "installed", dtype=object)
    with np.errstate(invalid="ignore"):
        moved = off_m > tolerance_m
    for row in np.flatnonzero(moved).tolist():
        tag_id = int(tag_map.ids[row])
        text = f"tag {tag_id} is {1000.0 * off_m[row]:.1f} mm from its place"
        findings.append(Finding(deviation=Deviation.MOVED, tag_ids=(tag_id,), text=text))
    status[moved] = "moved"
    status[unclear] = "unclear"
    status[np.array([uid is None for uid in uids], dtype=np.bool_) & ~unclear] = "missing"
    measured = np.isfinite(off_m)
    xy_m = read_only(np.where(measured[:, None], surveyed_m, tag_map.xy_m))
    findings += _clashes(tag_map, xy_m, uids, reach_m)
    order = {deviation: number for number, deviation in enumerate(Deviation)}
    return AsBuilt(
        tag_map=replace(
            tag_map,
            xy_m=xy_m,
            sigma_m=np.where(measured, survey_sigma_m, tag_map.sigma_m),
            status=tuple(status.tolist()),
            uid=tuple(uids),
        ),
        planned_m=tag_map.xy_m,
        surveyed_m=surveyed_m,
        scanned_m=scanned_m,
        findings=tuple(sorted(findings, key=lambda finding: (order[finding.deviation], finding.tag_ids))),
        frame=frame,
    )


def corrected(layout: Layout, site: Site, found: AsBuilt) -> Layout:
    """Return the layout with every tag where it was found, and without those that are missing.

    A tag whose identity is unclear answers and lies where it lies: it stays, to be scanned again.
    """
    from_m, to_m = named_places(layout.floor_tags, site)[found.tag_map.ids - 1], found.tag_map.xy_m
    missing = np.array([status == "missing" for status in found.tag_map.status], dtype=np.bool_)
    changed = missing | (np.abs(to_m - from_m).max(axis=1) > _SAME_M)
    kept = (EditKind.ADDED, EditKind.DROPPED)
    edits = [edit for edit in layout.floor_tags.edits if edit.kind in kept]
    for gone, x0_m, y0_m, x1_m, y1_m in zip(
        missing[changed].tolist(), *from_m[changed].T.tolist(), *to_m[changed].T.tolist(), strict=True
    ):
        if gone:
            edits.append(TagEdit(kind=EditKind.DROPPED, from_m=(x0_m, y0_m)))
        else:
            edits.append(TagEdit(kind=EditKind.MOVED, from_m=(x0_m, y0_m), to_m=(x1_m, y1_m)))
    return layout.replace(floor_tags=replace(layout.floor_tags, edits=tuple(edits)))


def true_places(found: AsBuilt) -> TruePlaces:
    """Return where the tags are for a robot that still has the map of the plan, and the scanned identities."""
    measured = np.isfinite(found.scanned_m[:, 0])
    silent = [status == "missing" for status in found.tag_map.status]
    return TruePlaces(
        tag_id=found.tag_map.ids[measured], xy_m=found.scanned_m[measured], silent=found.tag_map.ids[silent]
    )


def _check_known(rows: Mapping[int, int], scans: Sequence[Scan], survey: Survey | None) -> None:
    unknown = [("scans", scan.tag_id, f" (line {scan.line})") for scan in scans if scan.tag_id not in rows]
    if survey is not None:
        unknown += [("survey", tag_id, "") for tag_id in survey.tag_id.tolist() if tag_id not in rows]
    if unknown:
        repair = "Take the layout file from which the floor was built, and its tags.csv."
        raise InvalidInput(
            [
                Fault(place=place, problem=f"the layout has no tag {tag_id}{line}", repair=repair)
                for place, tag_id, line in unknown[:_MOST_NAMED]
            ]
        )


def _identities(
    tag_map: TagMap, rows: Mapping[int, int], scans: Sequence[Scan], findings: list[Finding]
) -> tuple[list[str | None], np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """Return the identity of each tag and whether it must be scanned again; note what does not fit."""
    answered: dict[int, dict[str, int]] = defaultdict(dict)
    owners: dict[str, dict[int, None]] = defaultdict(dict)
    turned: set[int] = set()
    ambiguous: set[int] = set()
    for scan in scans:
        answered[scan.tag_id].setdefault(scan.identity.uid, scan.line)
        owners[scan.identity.uid][scan.tag_id] = None
        if scan.identity.turned:
            turned.add(scan.tag_id)
        if scan.identity.ambiguous:
            ambiguous.add(scan.tag_id)
    uids: list[str | None] = [None] * len(tag_map)
    unclear = np.zeros(len(tag_map), dtype=np.bool_)
    for tag_id, lines in answered.items():
        if len(lines) > 1:
            unclear[rows[tag_id]] = True
            told = " and ".join(f"{uid} (line {line})" for uid, line in lines.items())
            text = f"tag {tag_id} answered as {told}; scan it again, alone"
            findings.append(Finding(deviation=Deviation.TWO_IDENTITIES, tag_ids=(tag_id,), text=text))
        else:
            uids[rows[tag_id]] = next(iter(lines))
    for uid, tags in owners.items():
        if len(tags) > 1:
            ids = tuple(sorted(tags))
            for tag_id in ids:
                unclear[rows[tag_id]], uids[rows[tag_id]] = True, None
            text = f"{uid} answered at tags {_listed(ids)}; scan them again, one was read for another"
            findings.append(Finding(deviation=Deviation.DUPLICATE, tag_ids=ids, text=text))
    for tag_id in tag_map.ids.tolist():
        if tag_id not in answered:
            text = f"tag {tag_id} was not scanned: it is missing, dead, or was passed over"
            findings.append(Finding(deviation=Deviation.MISSING, tag_ids=(tag_id,), text=text))
    if turned:
        ids = tuple(sorted(turned))
        text = f"{len(ids)} identities came with the last byte first and were turned: tags {_listed(ids)}"
        findings.append(Finding(deviation=Deviation.BYTES_TURNED, tag_ids=ids, text=text))
    if ambiguous:
        ids = tuple(sorted(ambiguous))
        text = f"{len(ids)} identities have E0 at both ends and were taken first byte first: tags {_listed(ids)}"
        findings.append(Finding(deviation=Deviation.BYTES_UNCLEAR, tag_ids=ids, text=text))
    return uids, unclear


def _frame(survey: Survey, planned_m: FloatArray, tolerance_m: float, *, own_frame: bool) -> RigidFit | None:
    try:
        fit = rigid_fit(survey.xy_m, planned_m)
    except ValueError as error:
        if own_frame:
            raise InvalidInput.at("survey", str(error), "Measure more tags.") from None
        return None
    before_m = float(np.median(np.linalg.norm(survey.xy_m - planned_m, axis=1)))
    after_m = float(np.median(np.linalg.norm(fit.applied(survey.xy_m) - planned_m, axis=1)))
    if not own_frame and before_m > tolerance_m and before_m > _OWN_FRAME * after_m:
        x_m, y_m = fit.shift_m
        problem = (
            f"half of the tags are over {1000.0 * before_m:.0f} mm from their places, and {1000.0 * after_m:.1f} "
            f"mm after a turn by {np.degrees(fit.angle_rad):.3f} deg and a shift by ({x_m:.3f}, {y_m:.3f}) m"
        )
        raise InvalidInput.at("survey", problem, "If it is in a frame of its own, say so: --own-frame.")
    return fit


def _places(tag_map: TagMap, surveyed_m: FloatArray, findings: list[Finding]) -> IntArray:
    """Return for each tag the row of the place at which it stands; its own, unless tags were exchanged."""
    from scipy.spatial import cKDTree

    measured = np.flatnonzero(np.isfinite(surveyed_m[:, 0]))
    place = np.arange(len(tag_map))
    if not len(measured):
        return place
    _, nearest = cKDTree(tag_map.xy_m).query(surveyed_m[measured])
    at = dict(zip(measured.tolist(), np.asarray(nearest).tolist(), strict=True))
    seen: set[int] = set()
    for start in at:
        ring, last = {start: None}, start
        while last not in seen and last in at and at[last] not in ring:
            last = at[last]
            ring[last] = None
        seen.update(ring)
        if len(ring) > 1 and at.get(last) == start:
            for row in ring:
                place[row] = at[row]
            ids = tuple(sorted(int(tag_map.ids[row]) for row in ring))
            text = f"tags {_listed(ids)} stand at each other's places; their identities were exchanged in the map"
            findings.append(Finding(deviation=Deviation.SWAPPED, tag_ids=ids, text=text))
    for row, other in at.items():
        if other != row and place[row] == row:
            ids = (int(tag_map.ids[row]), int(tag_map.ids[other]))
            text = f"tag {ids[0]} stands nearer to the place of tag {ids[1]} than to its own"
            findings.append(Finding(deviation=Deviation.ELSEWHERE, tag_ids=ids, text=text))
    return place


def _clashes(tag_map: TagMap, xy_m: FloatArray, uids: Sequence[str | None], reach_m: float) -> list[Finding]:
    """Return the pairs of tags that collide in every first round of an inventory.

    The last four bits of an identity choose the slot of 16 in which a tag answers (ISO/IEC 15693-3, inventory
    without a mask), so two tags with the same last digit never both answer in it.
    """
    from scipy.spatial import cKDTree

    if reach_m <= 0.0:
        return []
    pairs = cKDTree(xy_m).query_pairs(2.0 * reach_m, output_type="ndarray")
    found = []
    for first, second in sorted(map(tuple, pairs.tolist())):
        one, other = uids[first], uids[second]
        if one and other and one[-1] == other[-1]:
            ids = (int(tag_map.ids[first]), int(tag_map.ids[second]))
            text = (
                f"tags {ids[0]} and {ids[1]} can be in one field and both identities end in {one[-1]}: reading "
                "both takes a second round; another label at one of them would not"
            )
            found.append(Finding(deviation=Deviation.CLASH, tag_ids=ids, text=text))
    return found


def _exchanged(uids: Sequence[str | None], place: IntArray) -> list[str | None]:
    moved: list[str | None] = [None] * len(uids)
    for row, target in enumerate(place.tolist()):
        moved[target] = uids[row]
    return moved


def _listed(ids: Sequence[int]) -> str:
    named = ", ".join(str(tag_id) for tag_id in ids[:_MOST_NAMED])
    return named if len(ids) <= _MOST_NAMED else f"{named} and {len(ids) - _MOST_NAMED} more"
