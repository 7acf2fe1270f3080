"""`r2c2r schema`."""

import argparse
import json
from typing import TYPE_CHECKING

from r2c2r_core.commands.options import Parsers, add_command

if TYPE_CHECKING:
    from pydantic import BaseModel

NAMES = ("prompts", "overrides", "config", "manifest")


def add(parsers: Parsers) -> None:
    """The command and its options."""
    add_command(parsers, "schema", schema).add_argument("document", choices=NAMES, help="file whose JSON Schema is printed")


def schema(options: argparse.Namespace) -> int:
    """Print the JSON Schema of a file that r2c2r reads or writes."""
    print(schema_text(options.document), end="")
    return 0


def schema_text(name: str) -> str:
    """JSON Schema (draft 2020-12) of the document, as it is kept in docs/schemas/."""
    address = "https://json-schema.org/draft/2020-12/schema"
    return json.dumps({"$schema": address, **document_of(name).model_json_schema()}, indent=1, ensure_ascii=False) + "\n"


def document_of(name: str) -> "type[BaseModel]":
    """The model of a document."""
    from r2c2r_core.config import ReconstructConfig
    from r2c2r_core.schema.manifest import Manifest
    from r2c2r_core.schema.overrides import OverridesFile
    from r2c2r_core.schema.prompts import PromptsFile
    from r2c2r_core.schema.settings import settings_model

    models: dict[str, type[BaseModel]] = {
        "prompts": PromptsFile,
        "overrides": OverridesFile,
        "config": settings_model(ReconstructConfig, with_numbers=True),
        "manifest": Manifest,
    }
    return models[name]
