"""TypeScript declarations of the API: `python -m app.openapi_types > static/js/api-types.d.ts`.

Generated from the app's OpenAPI document; a test regenerates and compares.
"""

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

HEADER = "// Generated from the app's OpenAPI document by `python -m app.openapi_types`. Do not edit.\n"


def declarations(document: dict[str, Any]) -> str:
    """All schemas as exported types, then one table of operations with their parameters, body and answer."""
    found = document["components"]["schemas"]
    skipped = ("HTTPValidationError", "ValidationError")
    shapes = [_declaration(name, schema) for name, schema in sorted(found.items()) if name not in skipped]
    return HEADER + "\n" + "\n".join(shapes) + "\n" + _operations(document)


def app_document() -> dict[str, Any]:
    """The app's current OpenAPI document."""
    from app.main import create_app
    from app.settings import Settings

    with tempfile.TemporaryDirectory() as folder:
        document: dict[str, Any] = create_app(Settings(data_dir=Path(folder))).openapi()
        return document


def _declaration(name: str, schema: dict[str, Any]) -> str:
    lines = [f"/** {_one_line(schema['description'])} */"] if schema.get("description") else []
    if schema.get("type") != "object":
        return "\n".join([*lines, f"export type {_shape_name(name)} = {_type(schema)};", ""])
    required = set(schema.get("required", ()))
    fields = [_field(key, value, key in required) for key, value in schema.get("properties", {}).items()]
    return "\n".join([*lines, f"export interface {_shape_name(name)} {{", *fields, "}", ""])


def _field(name: str, schema: dict[str, Any], required: bool) -> str:
    return f"  {_key(name)}{'' if required else '?'}: {_type(schema)};"


def _operations(document: dict[str, Any]) -> str:
    lines = ["/** Every endpoint by its name. */", "export interface Operations {"]
    for path, methods in sorted(document["paths"].items()):
        for method, operation in sorted(methods.items()):
            lines.append(f"  /** {method.upper()} {path} */")
            parts = [f"parameters: {_parameters(operation)}", f"body: {_body(operation)}", f"answer: {_answer(operation)}"]
            lines.append(f"  {_key(operation['operationId'])}: {{ {'; '.join(parts)} }};")
    return "\n".join([*lines, "}", ""])


def _parameters(operation: dict[str, Any]) -> str:
    given = [p for p in operation.get("parameters", ()) if p["in"] in ("path", "query")]
    fields = [f"{_key(p['name'])}{'' if p.get('required') else '?'}: {_type(p['schema'])}" for p in given]
    return f"{{ {'; '.join(fields)} }}" if fields else "Record<string, never>"


def _body(operation: dict[str, Any]) -> str:
    content = operation.get("requestBody", {}).get("content", {})
    return _type(content["application/json"]["schema"]) if "application/json" in content else "undefined"


def _answer(operation: dict[str, Any]) -> str:
    for status, answer in sorted(operation["responses"].items()):
        if status.startswith("2"):
            content = answer.get("content", {})
            return _type(content["application/json"]["schema"]) if "application/json" in content else "unknown"
    return "unknown"


def _type(schema: dict[str, Any]) -> str:
    """TypeScript type of a JSON schema."""
    if "$ref" in schema:
        return _shape_name(str(schema["$ref"]).rsplit("/", 1)[-1])
    for union in ("anyOf", "oneOf"):
        if union in schema:
            return " | ".join(dict.fromkeys(_type(option) for option in schema[union]))
    if "const" in schema:
        return json.dumps(schema["const"])
    if "enum" in schema:
        return " | ".join(json.dumps(value) for value in schema["enum"])
    kind = schema.get("type")
    if kind == "array":
        return _array(schema)
    if kind == "object":
        values = schema.get("additionalProperties")
        return f"Record<string, {_type(values) if isinstance(values, dict) else 'unknown'}>"
    return {"string": "string", "integer": "number", "number": "number", "boolean": "boolean", "null": "null"}.get(
        str(kind), "unknown"
    )


def _array(schema: dict[str, Any]) -> str:
    if "prefixItems" in schema:
        return f"[{', '.join(_type(item) for item in schema['prefixItems'])}]"
    inner = _type(schema.get("items", {}))
    return f"({inner})[]" if " | " in inner else f"{inner}[]"


def _key(name: str) -> str:
    return name if name.isidentifier() else json.dumps(name)


def _shape_name(name: str) -> str:
    """Type name of a schema; one with defaults has separate input and output shapes: `Front-Input`, `Front-Output`."""
    return name.replace("-", "")


def _one_line(text: str) -> str:
    return " ".join(text.split()).replace("*/", "* /")


if __name__ == "__main__":
    sys.stdout.write(declarations(app_document()))
