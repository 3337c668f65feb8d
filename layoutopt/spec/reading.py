"""Reads a spec: every fault of the file, of what it names and of what does not fit together, at once."""

import os
from pathlib import Path
from typing import Final

from layoutopt.errors import InvalidInput, did_you_mean
from layoutopt.layout import PLAIN_TAG, ReaderProfile
from layoutopt.prices import (
    DEFAULT_LIST,
    READER_ITEMS,
    TAG_ITEMS,
    PriceList,
    default_names,
    default_prices,
    read_prices,
)
from layoutopt.readers.inventory import HOST_S, TAGS_IN_VIEW, scan_period_s
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.robot import Robot
from layoutopt.scenario import Faults, Judgement
from layoutopt.site import Site
from layoutopt.space import DesignSpace
from layoutopt.spec.building import PlacementSettings, Spec, StudySettings
from layoutopt.spec.finder_building import (
    check_estimator,
    docking_of,
    equipped_space,
    hopping_notes,
    near_field_notes,
    tracking_of,
)
from layoutopt.spec.finder_schema import DockingTable, TrackingTable
from layoutopt.spec.finders import DockingSettings, TrackingSettings
from layoutopt.spec.findings import Findings
from layoutopt.spec.goals import Search, goals_of, limits_of
from layoutopt.spec.lines import KeyPath
from layoutopt.spec.placement_building import placement_of
from layoutopt.spec.price_table import price_list_of
from layoutopt.spec.quantities import in_si
from layoutopt.spec.schema import (
    SCHEMA,
    FaultsTable,
    GoalTable,
    PartsTable,
    PlacementTable,
    ProfileTable,
    RobotsTable,
    SiteTable,
    SpaceTable,
    StudyTable,
    ToleranceTable,
)
from layoutopt.spec.site_building import robot_fits, robot_of, routes_of, site_of
from layoutopt.spec.source import Source, read_source
from layoutopt.spec.space_building import SpaceBuilder
from layoutopt.spec.validation import Model, validated
from layoutopt.tolerance import Tolerance
from layoutopt.units import Dimension

TABLES: Final = (
    "schema",
    "seed",
    "site",
    "robots",
    "parts",
    "space",
    "goal",
    "study",
    "placement",
    "tracking",
    "docking",
    "layout",
)
LARGEST_SEED: Final = 2**63 - 1
LARGEST_STEP_COUNT: Final = 1_000_000
_TOLERANCES: Final[dict[str, Dimension]] = {
    "placement": "length",
    "dead_tags": "share",
    "missed_reads": "share",
    "antenna_height": "length",
}


def read_spec(path: str | os.PathLike[str]) -> Spec:
    """Return the question that a spec file asks.

    Raises
    ------
    InvalidInput
        With every fault that was found in the spec, its plan and its prices.
    """
    return spec_of(read_source(path))


def spec_of(source: Source) -> Spec:
    """Return the question of a spec that was read as TOML; a ``[layout]`` table is left to others.

    Raises
    ------
    InvalidInput
        As `read_spec`.
    """
    findings = Findings(str(source.path), source.text, source.document)
    spec = _SpecReader(source, findings).spec()
    findings.raise_any()
    if spec is None:
        raise InvalidInput.at(findings.file, "the spec cannot be read", "Compare with `layoutopt new`.")
    return spec


class _SpecReader:
    """Reads table after table: a table with a fault of its own holds up only the checks that need it."""

    def __init__(self, source: Source, findings: Findings) -> None:
        self.source = source
        self.document = source.document
        self.findings = findings

    def spec(self) -> Spec | None:
        """Return the spec, ``None`` after a fault."""
        self._refuse_unknown_tables()
        seed = self._seed()
        tables = (self._table("site", SiteTable), self._table("robots", RobotsTable))
        parts = self._table("parts", PartsTable)
        tag_part = parts.tag if parts else PLAIN_TAG
        site, floor = (
            site_of(tables[0], self.source.folder, self.findings, tag_part) if tables[0] else (None, None)
        )
        notes = () if floor is None else floor.notes
        robot = robot_of(tables[1], self.findings) if tables[1] else None
        routes = routes_of(tables[1], self.findings) if tables[1] else None
        if site is not None and robot is not None and routes is not None:
            notes += robot_fits(site, robot, routes, self.findings)
        prices = self._prices(parts) if parts else None
        space, left_out = self._space(parts, prices, site, robot)
        study = self._study()
        kidnapped = study is not None and study.design_faults.kidnapped_at_s is not None
        search = Search(estimator=study.validate_with[0], kidnapped=kidnapped) if study else None
        tracking, docking = self._tracking(site, robot), self._docking(site)
        if space is not None and prices is not None and tracking is not None and docking is not None:
            space = equipped_space(space, tracking, docking, prices, self.findings)
        placement = self._placement(site, space)
        goal = self._table("goal", GoalTable)
        goals = goals_of(goal, site, search, self.findings) if goal else ()
        limits = limits_of(goal, site, search, self.findings) if goal else ()
        if parts is None or goal is None or tables[1] is None or self.findings.count:
            return None
        if site is None or robot is None or routes is None or prices is None:
            return None
        if space is None or study is None or placement is None or tracking is None or docking is None:
            return None
        return Spec(
            seed=seed,
            site=site,
            robot=robot,
            robot_count=tables[1].count,
            routes=routes,
            prices=prices,
            reader_part=parts.reader,
            space=space,
            goals=goals,
            own_limits=limits,
            target_error_m=None if goal.target_error is None else in_si(goal.target_error, "length"),
            budget_eur=None if goal.budget is None else in_si(goal.budget, "price"),
            study=study,
            placement=placement,
            tracking=tracking,
            docking=docking,
            rooms=() if floor is None else floor.rooms,
            notes=(*notes, *left_out, *hopping_notes(tracking), *near_field_notes(docking)),
        )

    def _refuse_unknown_tables(self) -> None:
        for key in self.document:
            if key not in TABLES:
                self.findings.add((key,), "unknown key", did_you_mean(key, TABLES))
        if self.document.get("schema", SCHEMA) != SCHEMA:
            self.findings.add(("schema",), f"this layoutopt reads schema {SCHEMA}", f"Write schema = {SCHEMA}.")

    def _seed(self) -> int:
        seed = self.document.get("seed", 0)
        if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed <= LARGEST_SEED:
            self.findings.add(("seed",), "a seed is a whole number from 0", "Write seed = 7.")
            return 0
        return seed

    def _table(self, name: str, model: type[Model]) -> Model | None:
        return validated(model, self.document.get(name, {}), (name,), self.findings)

    def _prices(self, parts: PartsTable) -> PriceList | None:
        """Return the price list: inline, one that comes with layoutopt, or a file beside the spec."""
        findings, path = self.findings, ("parts", "prices")
        for key, value, known in (("tag", parts.tag, TAG_ITEMS), ("reader", parts.reader, READER_ITEMS)):
            if value not in known:
                findings.add(
                    ("parts", key), f"no {key} of that name in any price list", did_you_mean(value, known)
                )
        if parts.price_list is not None:
            if parts.prices is not None:
                findings.add(path, "there is a [parts.price_list] too", "Keep one of the two.")
            return price_list_of(parts.price_list, ("parts", "price_list"), findings)
        name = parts.prices or DEFAULT_LIST
        try:
            if name in default_names() or not (name.endswith(".toml") or Path(name).parent != Path()):
                return default_prices(name, place="parts.prices")
            return read_prices(self.source.folder / name, place="parts.prices")
        except InvalidInput as error:
            findings.take(error, path)
            return None

    def _space(
        self, parts: PartsTable | None, prices: PriceList | None, site: Site | None, robot: Robot | None
    ) -> tuple[DesignSpace | None, tuple[str, ...]]:
        table = self._table("space", SpaceTable)
        if table is None or parts is None or prices is None or parts.tag not in TAG_ITEMS:
            return None, ()
        builder = SpaceBuilder(
            table=table,
            profile=profile_of(parts.reader_profile),
            tag_part=parts.tag,
            tag_size_m=prices.items[parts.tag].size_m or (0.0, 0.0),
            site=site,
            robot=robot,
            findings=self.findings,
        )
        space = builder.space()
        return space, tuple(builder.notes)

    def _placement(self, site: Site | None, space: DesignSpace | None) -> PlacementSettings | None:
        """Return the question of the study of single tags, ``None`` after a fault."""
        table = self._table("placement", PlacementTable)
        if table is None or site is None or space is None:
            return None
        written = frozenset(self.document.get("placement", {}))
        return placement_of(table, written, site, space, self.findings)

    def _tracking(self, site: Site | None, robot: Robot | None) -> TrackingSettings | None:
        """Return the question of tracking, ``None`` after a fault."""
        table = self._table("tracking", TrackingTable)
        if table is None or site is None or robot is None:
            return None
        try:
            return tracking_of(
                table, fitted="tracking" in self.document, site=site, robot=robot, findings=self.findings
            )
        except InvalidInput:
            # The robot fits nowhere, so it has no place to stand either; `robot_fits` has said so.
            return None

    def _docking(self, site: Site | None) -> DockingSettings | None:
        """Return the question of docking, ``None`` after a fault."""
        table = self._table("docking", DockingTable)
        if table is None or site is None:
            return None
        return docking_of(table, fitted="docking" in self.document, site=site, findings=self.findings)

    def _study(self) -> StudySettings | None:
        """Return effort and trials, ``None`` after a fault."""
        table = self._table("study", StudyTable)
        if table is None:
            return None
        before, path = self.findings.count, ("study", "validate_with")
        if not table.validate_with:
            self.findings.add(path, "the list is empty, so nothing turns reads into places", 'Write ["mcl"].')
        for number, name in enumerate(table.validate_with):
            if name in table.validate_with[:number]:
                self.findings.add((*path, number), "this estimator stands twice", "Remove one of them.")
            else:
                check_estimator(name, "robot", (*path, number), self.findings)
        step_s, duration_s = in_si(table.step, "time"), in_si(table.duration, "time")
        settle_s = Judgement().settle_s
        if duration_s <= settle_s + step_s or duration_s / step_s > LARGEST_STEP_COUNT:
            self.findings.add(
                ("study", "duration"),
                f"a trial would have {duration_s / step_s:g} steps; those after {settle_s:g} s are judged",
                f"Give more than {settle_s:g} s and at most {LARGEST_STEP_COUNT} steps, such as 60 s of 50 ms.",
            )
        for name in ("design_faults", "held_out_faults"):
            faults = _faults(getattr(table, name))
            self._faults_fit(faults, ("study", name), duration_s, table.start_known)
        tolerance = self._tolerance(table.tolerance)
        if tolerance is None or self.findings.count > before:
            return None
        return StudySettings(
            search_trials=table.search_trials,
            validation_trials=table.validation_trials,
            validate_with=tuple(table.validate_with),
            alternatives=table.alternatives,
            least_difference=in_si(table.least_difference, "share"),
            alternative_tolerance=in_si(table.alternative_tolerance, "share"),
            particles=table.particles,
            step_s=step_s,
            duration_s=duration_s,
            start_known=table.start_known,
            start_sigma_m=in_si(table.start_uncertainty.position, "length"),
            start_sigma_rad=in_si(table.start_uncertainty.heading, "angle"),
            design_faults=_faults(table.design_faults),
            held_out_faults=_faults(table.held_out_faults),
            tolerance=tolerance,
        )

    def _tolerance(self, table: ToleranceTable) -> Tolerance | None:
        """Return the ranges of the installation, ``None`` after a fault."""
        ranges: dict[str, tuple[float, float]] = {}
        for key, dimension in _TOLERANCES.items():
            low, high = (in_si(value, dimension) for value in getattr(table, key))
            ranges[key] = low, high
            if low > high:
                self.findings.add(
                    ("study", "tolerance", key), "a tolerance goes from low to high", "Exchange the two values."
                )
        if any(low > high for low, high in ranges.values()):
            return None
        return Tolerance(
            placement_m=ranges["placement"],
            dead_tags=ranges["dead_tags"],
            missed_reads=ranges["missed_reads"],
            antenna_height_m=ranges["antenna_height"],
            combine=table.combine,
            quantile=table.quantile,
        )

    def _faults_fit(self, faults: Faults, path: KeyPath, duration_s: float, start_known: bool) -> None:
        """Note faults that could never show, because something else keeps them from happening."""
        if not start_known and any(faults.start_offset):
            self.findings.add(
                (*path, "start_offset"),
                "the start is not known (start_known = false), so it cannot be told wrongly",
                "Leave the offset out, or write start_known = true.",
            )
        if (faults.slips_per_m > 0.0) != (faults.slip_sigma_m > 0.0):
            given, missing = ("slips_per_m", "slip_sigma") if faults.slips_per_m else ("slip_sigma", "slips_per_m")
            self.findings.add(
                (*path, given),
                f"wheels do not slip as long as {missing} is zero",
                'Write slips_per_m = 0.2 and slip_sigma = "10 mm", or neither.',
            )
        if faults.kidnapped_at_s is not None and faults.kidnapped_at_s >= duration_s:
            self.findings.add(
                (*path, "kidnapped_at"),
                f"a drive is over after {duration_s:g} s",
                "Give a time within study.duration.",
            )


def profile_of(table: ProfileTable) -> ReaderProfile:
    """Return the reader profile of a table; a protocol gives its scan period."""
    if table.protocol is not None:
        period_s = scan_period_s(
            tags_per_scan=table.tags_per_scan,
            tags_in_view=table.tags_in_view or (1 if table.tags_per_scan == "one" else TAGS_IN_VIEW),
            host_s=HOST_S if table.host_time is None else in_si(table.host_time, "time"),
        )
    else:
        period_s = COMMERCIAL.scan_period_s if table.scan_period is None else in_si(table.scan_period, "time")
    return ReaderProfile(
        name=table.name,
        scan_period_s=period_s,
        tags_per_scan=table.tags_per_scan,
        spacing_sides=table.spacing_sides,
        simultaneous_spacing_sides=table.simultaneous_spacing_sides,
    )


def _faults(table: FaultsTable) -> Faults:
    x_m, y_m = (in_si(value, "length") for value in table.tag_offset)
    start = table.start_offset
    return Faults(
        tag_placement_sigma_m=in_si(table.tag_placement_sigma, "length"),
        tag_offset_m=(x_m, y_m),
        dead_tag_share=in_si(table.dead_tag_share, "share"),
        missed_read_share=in_si(table.missed_read_share, "share"),
        wrong_identity_share=in_si(table.wrong_identity_share, "share"),
        antenna_height_error_m=in_si(table.antenna_height_error, "length"),
        read_edge_m=in_si(table.read_edge, "length"),
        clock_error_s=in_si(table.clock_error, "time"),
        slips_per_m=table.slips_per_m,
        slip_sigma_m=in_si(table.slip_sigma, "length"),
        asynchronous=table.asynchronous,
        start_offset=(in_si(start.x, "length"), in_si(start.y, "length"), in_si(start.heading, "angle")),
        kidnapped_at_s=None if table.kidnapped_at is None else in_si(table.kidnapped_at, "time"),
    )
