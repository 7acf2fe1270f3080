"""Validation of a JSON document against its model; the first error becomes one line: place, found, expected."""

from collections.abc import Iterator, Mapping
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator
from pydantic_core import ErrorDetails, PydanticCustomError

from r2c2r_core.errors import InputError

_SHOWN = 60  # maximum characters of a shown value


class Document(BaseModel):
    """Values have the type they are said to have, and a key that nobody knows is a mistake, not a wish."""

    model_config = ConfigDict(extra="forbid", strict=True, json_schema_serialization_defaults_required=True)

    @model_validator(mode="before")
    @classmethod
    def _known(cls, value: Any) -> Any:
        known = [field.alias or name for name, field in cls.model_fields.items()]
        if isinstance(value, dict) and (unknown := sorted(str(key) for key in value.keys() - set(known))):
            raise PydanticCustomError("unknown_key", "unknown key '{key}'", {"key": unknown[0], "known": known})
        return value


AnyDocument = TypeVar("AnyDocument", bound=BaseModel)


def checked(model: type[AnyDocument], document: Any, where: str, failure: type[InputError], *, hint: str) -> AnyDocument:
    """The validated document; `where` names it. Raises `failure`, with `hint` unless the model gives its own."""
    try:
        return model.model_validate(document)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        found, expected = _said(model, document, first)
        raise failure(f"{where}: {found}", hint=expected or hint) from error


def _said(model: type[BaseModel], document: Any, error: ErrorDetails) -> tuple[str, str]:
    """The two parts of an error line: place and value found, and value expected."""
    place, context = _place(document, error["loc"]), error.get("ctx", {})
    if error["type"] == "unknown_key":
        return f"unknown key '{context['key'][:_SHOWN]}' in {place}", f"expected {', '.join(context['known'])}"
    if error["type"] == "missing":
        return f"{place} lacks '{error['loc'][-1]}'", _expected(model, error["loc"])
    if error["type"] == "value_error":  # a custom rule, with its own message
        return f"{place}: {context['error']}", _expected(model, error["loc"])
    rule = error["msg"].removeprefix("Input should ").removeprefix("be ")
    return f"{place} is {_brief(error['input'])}", _expected(model, error["loc"]) + f" ({rule})"


def _place(document: Any, path: tuple[int | str, ...]) -> str:
    """Path such as `objects.drawer_1.points[2].x`, with named list entries by name; branches of a union are omitted."""
    place, at = "", document
    for step in path:
        if isinstance(at, Mapping) and step in at:
            place, at = f"{place}.{step}" if place else str(step), at[step]
        elif isinstance(at, list) and isinstance(step, int) and step < len(at):
            at = at[step]
            name = at.get("name") if isinstance(at, Mapping) else None
            place += f".{name}" if isinstance(name, str) and name.isidentifier() else f"[{step}]"
    return place[-200:] or "the document"


def _expected(model: type[BaseModel], path: tuple[int | str, ...]) -> str:
    """The expected value: description of the last field on the path."""
    said, at = "", model
    for step in path:
        if isinstance(step, str) and (field := at.model_fields.get(step)) is not None:
            said = field.description or ""
            at = next(_models_in(field.annotation), at)
    return f"expected {said}" if said else ""


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _models_in(inner)


def _brief(value: Any) -> str:
    kinds = {dict: "an object", list: "a list", type(None): "null"}
    if isinstance(value, dict | list) and len(repr(value)) > _SHOWN:
        return f"{kinds[type(value)]} of {len(value)}"
    text = "null" if value is None else repr(value)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…"
