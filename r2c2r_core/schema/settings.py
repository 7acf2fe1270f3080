"""Settings: dataclasses whose fields declare meaning and bounds, and their JSON documents."""

import dataclasses
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, TypeVar, get_type_hints

from r2c2r_core.errors import InputError
from r2c2r_core.tuning import Changes, Number, modules_with_numbers, params_of

if TYPE_CHECKING:  # stages declare settings without the cost of importing it
    from pydantic import BaseModel

_HINT = "see `r2c2r schema config`"
Settings = TypeVar("Settings")


def setting(default: Any, meaning: str, **bounds: float) -> Any:
    """A field of a settings dataclass: default, meaning with unit, and bounds (gt, ge, lt, le)."""
    return dataclasses.field(default=default, metadata={"description": meaning, **bounds})


def tuned_numbers(room: str) -> Any:
    """A field of a settings dataclass: changed tuned numbers of a package of the core."""
    meaning = 'an object: {"module": {"number": value}}, tuned numbers of the modules of this stage'
    return dataclasses.field(default_factory=dict, metadata={"description": meaning, "room": room})


def with_settings(defaults: Settings, document: Any, where: str) -> Settings:
    """The defaults updated by `document` at any depth; raises InputError naming the setting."""
    from r2c2r_core.schema.document import checked

    of: Any = type(defaults)
    return _replaced(defaults, checked(settings_model(of), document, where, InputError, hint=_HINT), where)


@cache
def settings_model(of: Any, *, with_numbers: bool = False) -> "type[BaseModel]":
    """Model of a settings dataclass in which everything is optional.

    `with_numbers` lists every tuned number, for publication; for reading, only the modules in the document are imported.
    """
    from pydantic import Field, create_model

    from r2c2r_core.schema.document import Document

    hints = get_type_hints(of)
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(of):
        hint = hints[field.name]
        rules: dict[str, Any] = dict(field.metadata)
        if (room := rules.pop("room", None)) is not None:
            kind: Any = _every_number(room) if with_numbers else Mapping[str, Any]
        elif isinstance(hint, type) and dataclasses.is_dataclass(hint):
            kind = settings_model(hint, with_numbers=with_numbers)
            rules.setdefault("description", f"an object: {(hint.__doc__ or '').strip()}")
        else:
            kind = _loose(hint)
        if hint is float:
            rules["allow_inf_nan"] = False
        if field.default_factory is dataclasses.MISSING:
            rules["default"] = field.default
        else:
            rules["default_factory"] = field.default_factory  # irrelevant: only given values are used
        fields[field.name] = (kind, Field(**rules))
    return create_model(of.__name__, __base__=Document, __doc__=of.__doc__, **fields)


def _loose(hint: Any) -> Any:
    """The type as read from JSON, which has lists instead of tuples."""
    from typing import Annotated, get_origin

    from pydantic import Strict

    return Annotated[hint, Strict(False)] if get_origin(hint) is tuple else hint


def _every_number(room: str) -> "type[BaseModel]":
    """Model of all tuned numbers of a package, by module."""
    from pydantic import Field, create_model

    from r2c2r_core.schema.document import Document

    modules: dict[str, Any] = {}
    for path in modules_with_numbers(room):
        of: Any = params_of(path)
        name = path.partition(".")[2]
        said = Field(default=None, description=f"an object: {(of.__doc__ or '').strip()}")
        title = f"{path.title().replace('.', '').replace('_', '')}Params"
        modules[name] = (create_model(title, __base__=settings_model(of), __doc__=of.__doc__), said)
    return create_model(f"{room.title()}Numbers", __base__=Document, __doc__=f"Tuned numbers of {room}, by module.", **modules)


def _changes(room: str, given: Mapping[str, Any], where: str) -> Changes:
    """The given numbers by module, each validated by its module's model."""
    return {name: _checked_numbers(f"{room}.{name}", values, where) for name, values in given.items()}


def _checked_numbers(path: str, given: Any, where: str) -> Mapping[str, Number]:
    from r2c2r_core.schema.document import checked

    room, _, name = path.partition(".")
    known = modules_with_numbers(room)
    if path not in known:
        names = ", ".join(path.partition(".")[2] for path in known)
        raise InputError(f"{where}: unknown key '{name[:60]}' in {room}.params", hint=f"expected {names}")
    of: Any = params_of(path)
    model = checked(settings_model(of), given, f"{where}: {room}.params.{name}", InputError, hint=_HINT)
    return {name: getattr(model, name) for name in sorted(model.model_fields_set)}


def _replaced(defaults: Settings, given: "BaseModel", where: str) -> Settings:
    changed: dict[str, Any] = {}
    rooms = {field.name: field.metadata.get("room") for field in dataclasses.fields(defaults)}  # type: ignore[arg-type]
    for name in given.model_fields_set:
        value, default = getattr(given, name), getattr(defaults, name)
        if (room := rooms[name]) is not None:
            value = _changes(room, value, where)
        changed[name] = _replaced(default, value, where) if dataclasses.is_dataclass(default) else value
    replaced: Settings = dataclasses.replace(defaults, **changed)  # type: ignore[type-var]
    return replaced
