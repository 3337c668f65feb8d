"""What a replayed drive tells of robot and readers, as values of a spec."""

import dataclasses
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import tomli_w

from layoutopt.atomic_file import replacing
from layoutopt.commissioning.estimated import Fitted
from layoutopt.commissioning.evidence_fit import fit_scale
from layoutopt.commissioning.motion_fit import MotionFit, fit_motion
from layoutopt.commissioning.read_fit import ReadFit, fit_reads
from layoutopt.commissioning.replay import Replay
from layoutopt.scenario import Faults
from layoutopt.spec.building import Spec
from layoutopt.spec.writing import document_of
from layoutopt.units import parse_quantity

FEWEST_TAGS: Final = 20
"""Tags tried below which a share of dead ones is told but not written."""

FEWEST_READS: Final = 100
"""Reads below which no share of wrong identities is given."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """How a fitted number stands in a spec: table, key, unit, factor to the unit, and the most it may be (SI)."""

    table: str
    key: str
    unit: str
    factor: float
    most: float


VALUES: Final[Mapping[str, Value]] = {
    "translation_share": Value(table="odometry", key="translation", unit="%", factor=100.0, most=1.0),
    "rotation_rad_per_m": Value(
        table="odometry", key="rotation", unit="deg/m", factor=math.degrees(1.0), most=100.0
    ),
    "translation_m_per_sqrt_s": Value(
        table="odometry", key="translation_after_1s", unit="mm", factor=1000.0, most=1e5
    ),
    "rotation_rad_per_sqrt_s": Value(
        table="odometry", key="rotation_after_1s", unit="deg", factor=math.degrees(1.0), most=math.pi
    ),
    "lateral_share": Value(table="odometry", key="lateral", unit="%", factor=100.0, most=1.0),
    "missed_read_share": Value(table="faults", key="missed_read_share", unit="%", factor=100.0, most=1.0),
    "tag_placement_sigma_m": Value(table="faults", key="tag_placement_sigma", unit="mm", factor=1000.0, most=1e5),
    "dead_tag_share": Value(table="faults", key="dead_tag_share", unit="%", factor=100.0, most=1.0),
    "wrong_identity_share": Value(table="faults", key="wrong_identity_share", unit="%", factor=100.0, most=1.0),
}
"""Every fitted number, by the name of the field that it fills."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveFit:
    """Noise of odometry and behaviour of readers, fitted from one drive."""

    motion: MotionFit
    reads: ReadFit

    @property
    def written(self) -> Mapping[str, Fitted]:
        """The numbers that go into a spec, by the names of `VALUES`."""
        reads = self.reads
        dead = reads.dead if reads.dead is not None and reads.dead.count >= FEWEST_TAGS else None
        wrong = reads.wrong if reads.wrong is not None and reads.wrong.count >= FEWEST_READS else None
        found = {
            **self.motion.terms,
            "missed_read_share": reads.missed,
            "tag_placement_sigma_m": reads.placement_sigma_m,
            "dead_tag_share": dead,
            "wrong_identity_share": wrong,
        }
        return {
            name: fitted
            for name, fitted in found.items()
            if fitted is not None and 0.0 <= fitted.value <= VALUES[name].most
        }

    @property
    def notes(self) -> tuple[str, ...]:
        """What was not fitted and why, one sentence each."""
        notes = [*self.motion.notes, *self.reads.notes]
        if self.reads.dead is not None and self.reads.dead.count < FEWEST_TAGS:
            notes.append(
                f"the share of dead tags is not fitted: {self.reads.dead.count} tags were often in a disc, and "
                f"{FEWEST_TAGS} are needed"
            )
        return tuple(notes)

    def spec(self, spec: Spec) -> Spec:
        """Return the spec with the fitted numbers, to four digits, in place of those that were assumed.

        A robot that fuses its gyro logs the fused turn: its fitted rotation holds the gyro, which is then not
        fused again.
        """
        values: dict[str, Any] = {
            name: _rounded(fitted.value, VALUES[name]) for name, fitted in self.written.items()
        }
        faults = {field.name for field in dataclasses.fields(Faults)}
        odometry = {name: value for name, value in values.items() if name not in faults}
        robot = dataclasses.replace(
            spec.robot,
            odometry=dataclasses.replace(spec.robot.odometry, **odometry),
            gyro_fitted=spec.robot.gyro_fitted and "rotation_rad_per_m" not in odometry,
        )
        design = dataclasses.replace(
            spec.study.design_faults, **{name: value for name, value in values.items() if name in faults}
        )
        return dataclasses.replace(spec, robot=robot, study=dataclasses.replace(spec.study, design_faults=design))


def fit_drive(replayed: Replay) -> DriveFit:
    """Return what a replayed drive tells: against the truth where there is one, else as far as that goes."""
    reads = fit_reads(replayed)
    if replayed.with_truth:
        return DriveFit(motion=fit_motion(replayed.log, replayed.spec.robot.odometry), reads=reads)
    assumed = replayed.spec.study.design_faults.missed_read_share
    missed = assumed if reads.missed is None else reads.missed.value
    return DriveFit(motion=fit_scale(replayed, missed), reads=reads)


def write_fitted(replayed: Replay, fit: DriveFit, path: Path) -> None:
    """Write the fitted values as tables of a spec, each with its standard error, interval and count."""
    document = document_of(fit.spec(replayed.spec))
    tables = {"odometry": document["robots"]["odometry"], "faults": document["study"]["design_faults"]}
    reference = "its true path" if replayed.with_truth else "the estimated path and the reads alone"
    lines = [
        f"# Fitted by `layoutopt replay` from {_comment(Path(replayed.log.file).name)}, against {reference};",
        f"# estimator {replayed.estimator.name}, seed {replayed.seed}, layout {replayed.layout.short_key}.",
        "# To be put into a spec in place of its [robots] odometry and its [study.design_faults].",
        *(f"# {_comment(note)}" for note in fit.notes),
    ]
    for table, title in (("odometry", "[robots.odometry]"), ("faults", "[study.design_faults]")):
        names = {VALUES[name].key: name for name in fit.written if VALUES[name].table == table}
        lines += ["", title]
        for key, value in tables[table].items():
            said = fitted_text(names[key], fit.written[names[key]]) if key in names else "as in the layout file"
            lines.append(f"{key} = {_toml(value)}  # {said}")
    with replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def fitted_text(name: str, fitted: Fitted) -> str:
    """Return a fitted number in words: value, standard error, interval and what it comes from."""
    value = VALUES[name]
    number, se, low, high = (
        f"{part * value.factor:.3g}" for part in (fitted.value, fitted.se, fitted.low, fitted.high)
    )
    error = "" if math.isnan(fitted.se) or fitted.se == 0.0 else f" ± {se}"
    return f"{number}{error} {value.unit}, 95 %: {low} to {high}, from {fitted.count} {fitted.of}"


def _rounded(number: float, value: Value) -> float:
    return parse_quantity(f"{number * value.factor:.4g} {value.unit}", _dimension(value.unit))


def _dimension(unit: str) -> Any:
    return {"%": "share", "mm": "length", "deg": "angle", "deg/m": "angle_per_length"}[unit]


def _toml(value: Any) -> str:
    """Return a value as TOML on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    return tomli_w.dumps({"x": value}).partition("=")[2].strip()


def _comment(text: str) -> str:
    """Return a text that cannot end a comment."""
    return re.sub(r"[\x00-\x1f\x7f]", "?", text)
