from pathlib import Path

from app.openapi_types import app_document, declarations

STATIC = Path(__file__).parents[2] / "static"


def test_the_committed_typescript_types_match_the_api() -> None:
    committed = (STATIC / "js" / "api-types.d.ts").read_text()
    hint = "run: python -m app.openapi_types > static/js/api-types.d.ts"
    assert committed == declarations(app_document()), hint


def test_unions_arrays_and_objects_are_converted_to_typescript() -> None:
    shape = {
        "type": "object",
        "required": ["a", "b"],
        "properties": {
            "a": {"anyOf": [{"type": "integer"}, {"type": "null"}]},
            "b": {"type": "array", "items": {"anyOf": [{"type": "string"}, {"$ref": "#/components/schemas/X"}]}},
            "c": {"type": "object", "additionalProperties": {"type": "number"}},
            "d": {"enum": ["x", "y"], "type": "string"},
            "e": {"type": "array", "prefixItems": [{"type": "number"}, {"type": "number"}]},
        },
    }
    written = declarations({"components": {"schemas": {"T": shape}}, "paths": {}})
    for line in (
        "a: number | null;",
        "b: (string | X)[];",
        "c?: Record<string, number>;",
        'd?: "x" | "y";',
        "e?: [number, number];",
    ):
        assert line in written
