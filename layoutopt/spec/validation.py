"""From what pydantic finds wrong with a table to faults with line, value and repair."""

from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from layoutopt.errors import did_you_mean
from layoutopt.spec.findings import Findings
from layoutopt.spec.layout_schema import KEY_PATTERN
from layoutopt.spec.lines import KeyPath
from layoutopt.spec.quantities import Unfit

Model = TypeVar("Model", bound=BaseModel)
_PROBLEMS = {
    "string_type": "this should be a text",
    "int_type": "this should be a whole number",
    "float_type": "this should be a number",
    "bool_type": "this should be true or false",
    "list_type": "this should be a list",
    "dict_type": "this should be a table",
    "model_type": "this should be a table",
    "string_pattern_mismatch": "this is no name for files and tables",
    "too_short": "the list has {actual_length} entries and needs {min_length}",
    "too_long": "the list has {actual_length} entries, more than {max_length}",
}
_REPAIRS = {
    "string_type": 'Write a text in quotes, such as "name".',
    "int_type": "Write a whole number, without a point.",
    "float_type": "Write a number such as 1.5.",
    "bool_type": "Write true or false.",
    "list_type": "Write a list in brackets: [ ... ].",
    "dict_type": "Write a table: { key = value }.",
    "model_type": "Write a table: { key = value }.",
    "too_short": "Give more entries.",
    "too_long": "Leave some out.",
    "string_pattern_mismatch": "Use 1 to 64 letters, digits, _ or -.",
}


def validated(model: type[Model], table: object, path: KeyPath, findings: Findings) -> Model | None:
    """Return a table of the spec, or note every fault in it and return ``None``."""
    try:
        return model.model_validate(table)
    except ValidationError as error:
        _note(error, model, path, findings)
        return None


def _note(error: ValidationError, model: type[BaseModel], path: KeyPath, findings: Findings) -> None:
    for detail in error.errors(include_url=False):
        where = (*path, *detail["loc"])
        cause = detail.get("ctx", {}).get("error")
        if isinstance(cause, Unfit):
            findings.add((*where, *cause.path), cause.problem, cause.repair)
        elif detail["type"] == "extra_forbidden":
            known = _keys(model, detail["loc"][:-1])
            findings.add(where, "unknown key", did_you_mean(str(detail["loc"][-1]), known))
        elif detail["type"] == "missing":
            findings.add(where, "this key is missing", f"Add {detail['loc'][-1]} = ...")
        elif detail.get("ctx", {}).get("pattern") == KEY_PATTERN:
            findings.add(
                where, "this is no key of a layout", "Leave it out, or take the file as layoutopt wrote it."
            )
        else:
            message = detail["msg"].removeprefix("Input ").removeprefix("String ")
            repair = _REPAIRS.get(detail["type"], f"Write a value that {_demanded(message)}.")
            ours = _PROBLEMS.get(detail["type"])
            findings.add(where, ours.format_map(detail.get("ctx", {})) if ours else f"this {message}", repair)


def _demanded(message: str) -> str:
    """Return what a value should be as what it is: ``"should have 2 items"`` becomes ``"has 2 items"``."""
    for demand, form in (("should be ", "is "), ("should have ", "has "), ("should match ", "matches ")):
        if message.startswith(demand):
            return form + message.removeprefix(demand)
    return f"is {message}"


def _keys(model: type[BaseModel], path: tuple[int | str, ...]) -> list[str]:
    """Return the keys that the table at a path within a model knows."""
    for part in path:
        if part in model.model_fields:
            inner = _table_in(model.model_fields[str(part)].annotation)
            model = inner if inner is not None else model
    return list(model.model_fields)


def _table_in(annotation: Any) -> type[BaseModel] | None:
    """Return the table class within an annotation such as ``list[ZoneTable] | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((found for part in get_args(annotation) if (found := _table_in(part))), None)
