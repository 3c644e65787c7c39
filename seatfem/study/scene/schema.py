"""The JSON schema of scenes, by which editors complete and check them (`#:schema seatfem.schema.json`)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from seatfem.fields import ReadQuantity, kind_of, read_number, read_temperature
from seatfem.structures.kinds import kinds_of
from seatfem.study.scene.models import Scene
from seatfem.study.scene.stopper import Stopper
from seatfem.units import DIMENSIONS

SCHEMA_FILE: Final = "seatfem.schema.json"
_NOT_FOR_EDITORS: Final = ("title", "ge", "gt", "le", "lt")
"""Keywords of pydantic's that editors have no use for."""


class _AsWritten(GenerateJsonSchema):
    """Generator of schemas of values as a file has them: quantities are text, tables with a short form text, too."""

    def function_before_schema(self, schema: core_schema.BeforeValidatorFunctionSchema) -> JsonSchemaValue:
        function: Any = schema["function"]["function"]
        if isinstance(function, ReadQuantity):
            return {"type": "string", "examples": [DIMENSIONS[function.dimension].example]}
        if function is read_temperature:
            return {"type": "string", "examples": ["20 degC"]}
        if function is read_number:
            return {"type": ["number", "string"], "examples": [0.1, "10 %"]}
        inner = super().function_before_schema(schema)
        if inner.get("type") in ("object", ["object", "string"]) and "allOf" not in inner:
            return {**inner, "type": ["object", "string"]}
        return {"anyOf": [inner, {"type": ["string", "array"]}]}

    def tagged_union_schema(self, schema: core_schema.TaggedUnionSchema) -> JsonSchemaValue:
        """Return a union's schema by its kind, where one is written; a name of several is checked against any."""
        kinds = {str(name): self.generate_inner(each) for name, each in schema["choices"].items()}
        if not isinstance(schema["discriminator"], str):
            return {"anyOf": list(kinds.values())}
        also = {kind_of(each): each.also for each in kinds_of()}
        rules = []
        for name in kinds:
            meant = [kinds[name], *(kinds[other] for other in kinds if name in also.get(other, ()))]
            condition = {"properties": {"kind": {"const": name}}, "required": ["kind"]}
            rules.append({"if": condition, "then": {"anyOf": meant}})
        return {"type": ["object", "string"], "properties": {"kind": {"enum": list(kinds)}}, "allOf": rules}


def scene_schema() -> dict[str, Any]:
    """Return the schema of a scene file, JSON Schema draft 2020-12.

    Editors check the names of keys, options and kinds of values by it; what is missing, units, ranges and what depends
    on several keys are checked by the program alone. A [stopper] is checked for nothing: its keys are those of a body.
    """
    schema = schema_of(Scene, "seatfem scene")
    for name, table in schema["$defs"].items():
        schema["$defs"][name] = {**table, "additionalProperties": True} if name == Stopper.__name__ else table
    for table in kinds_of():
        if table.also and table.__name__ in schema["$defs"]:
            schema["$defs"][table.__name__]["properties"]["kind"] = {"enum": [kind_of(table), *table.also]}
    return schema


def schema_of(table: type[BaseModel], title: str) -> dict[str, Any]:
    """Return the schema of a file that holds ``table``, as its values are written there."""
    schema = _as_in_a_file(table.model_json_schema(schema_generator=_AsWritten))
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title, **schema}


def schema_text(schema: Mapping[str, Any]) -> str:
    """Return a schema as JSON."""
    return json.dumps(schema, separators=(",", ":")) + "\n"


def _as_in_a_file(value: Any, *, keys: bool = False) -> Any:
    """Return the schema without null, which TOML has not, what only pydantic reads, and what tables require, which
    their short forms leave out; ``keys``: the names in this mapping are the file's own."""
    if isinstance(value, list):
        return [_as_in_a_file(each) for each in value if each != {"type": "null"}]
    if not isinstance(value, Mapping):
        return value
    dropped = (*_NOT_FOR_EDITORS, *(["required"] if "additionalProperties" in value else []))
    kept = {
        key: each for key, each in value.items() if keys or not (key in dropped or (key, each) == ("default", None))
    }
    return {key: _as_in_a_file(each, keys=key in ("properties", "$defs")) for key, each in kept.items()}
