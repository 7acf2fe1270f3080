"""Settings: dataclasses whose fields say what they mean and what they may be, and the JSON that sets them."""

import dataclasses
from functools import cache
from typing import TYPE_CHECKING, Any, TypeVar, get_type_hints

from r2c2r_core.errors import InputError

if TYPE_CHECKING:  # stages declare settings without paying for its import
    from pydantic import BaseModel

_HINT = "see `r2c2r schema config`"
Settings = TypeVar("Settings")


def setting(default: Any, meaning: str, **bounds: float) -> Any:
    """A field of a dataclass of settings: its default, its meaning with its unit, and bounds (gt, ge, lt, le)."""
    return dataclasses.field(default=default, metadata={"description": meaning, **bounds})


def with_settings(defaults: Settings, document: Any, where: str) -> Settings:
    """The defaults with what `document` sets, at any depth; raises InputError naming the setting."""
    from r2c2r_core.schema.document import checked

    of: Any = type(defaults)
    return _replaced(defaults, checked(settings_model(of), document, where, InputError, hint=_HINT))


@cache
def settings_model(of: Any) -> "type[BaseModel]":
    """A dataclass of settings as a document in which everything may be left out."""
    from pydantic import Field, create_model

    from r2c2r_core.schema.document import Document

    hints = get_type_hints(of)
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(of):
        hint = hints[field.name]
        rules: dict[str, Any] = dict(field.metadata)
        if isinstance(hint, type) and dataclasses.is_dataclass(hint):
            kind: Any = settings_model(hint)
            rules.setdefault("description", f"an object: {(hint.__doc__ or '').strip()}")
        else:
            kind = _loose(hint)
        if hint is float:
            rules["allow_inf_nan"] = False
        if field.default_factory is dataclasses.MISSING:
            rules["default"] = field.default
        else:
            rules["default_factory"] = field.default_factory  # of no interest: only what is given is taken over
        fields[field.name] = (kind, Field(**rules))
    return create_model(of.__name__, __base__=Document, __doc__=of.__doc__, **fields)


def _loose(hint: Any) -> Any:
    """The type, as JSON writes it: it has lists, no tuples."""
    from typing import Annotated, get_origin

    from pydantic import Strict

    return Annotated[hint, Strict(False)] if get_origin(hint) is tuple else hint


def _replaced(defaults: Settings, given: "BaseModel") -> Settings:
    changed: dict[str, Any] = {}
    for name in given.model_fields_set:
        value, default = getattr(given, name), getattr(defaults, name)
        changed[name] = _replaced(default, value) if dataclasses.is_dataclass(default) else value
    replaced: Settings = dataclasses.replace(defaults, **changed)  # type: ignore[type-var]
    return replaced
