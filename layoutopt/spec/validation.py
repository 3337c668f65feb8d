"""From what pydantic finds wrong with a table to faults with line, value and repair."""

from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from layoutopt.errors import did_you_mean
from layoutopt.spec.findings import Findings
from layoutopt.spec.lines import KeyPath
from layoutopt.spec.quantities import Unfit

Model = TypeVar("Model", bound=BaseModel)
_REPAIRS = {
    "string_type": 'Write a text in quotes, such as "name".',
    "int_type": "Write a whole number, without a point.",
    "float_type": "Write a number such as 1.5.",
    "bool_type": "Write true or false.",
    "list_type": "Write a list in brackets: [ ... ].",
    "dict_type": "Write a table: { key = value }.",
    "model_type": "Write a table: { key = value }.",
    "too_short": "Give at least one entry.",
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
        else:
            message = detail["msg"].removeprefix("Input ").removeprefix("String ")
            repair = _REPAIRS.get(detail["type"], f"Write a value that {_demanded(message)}.")
            findings.add(where, f"this {message}", repair)


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
