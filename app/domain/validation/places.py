"""Locates pydantic errors in a document, with the help of the model's JSON Schema.

pydantic inserts the tag or class of a union branch into its locations. A key may have the same name, so only the schema
distinguishes them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, NamedTuple

from pydantic import BaseModel

Path = tuple[str | int, ...]
Schema = Mapping[str, Any]
_WORD: Final = re.compile(r"\w+")


class Form(NamedTuple):
    """The branch `label` of a union without a discriminator, at `union` in pydantic's location and at `path`."""

    union: Path
    path: Path
    label: str


@dataclass(frozen=True, slots=True)
class JsonLocation:
    """A location in the document. `path` has only keys and indexes of the document.

    `fields` are the known fields of the surrounding object, `tags` the discriminator values of a union at the location;
    empty if there are none. `forms` are the undiscriminated union branches on the way, outermost first.
    """

    path: Path
    fields: tuple[str, ...]
    tags: tuple[str, ...]
    forms: tuple[Form, ...]


class Places:
    """The locations in one kind of document."""

    def __init__(self, schema: Schema) -> None:
        self._schema = schema
        self._definitions: Mapping[str, Schema] = schema.get("$defs", {})

    def find(self, location: Path) -> JsonLocation:
        """Convert a pydantic location."""
        path: Path = ()
        forms: list[Form] = []
        around: Schema = {}
        node = self._resolved(self._schema)
        for number, part in enumerate(location):
            branches = _branches(node)
            if branches:
                if "discriminator" not in node:
                    forms.append(Form(location[:number], path, str(part)))
                node = self._resolved(_branch(node, branches, str(part)))
            else:
                path, around = (*path, part), node
                node = self._resolved(_below(node, part))
        tags = tuple(node.get("discriminator", {}).get("mapping", ()))
        return JsonLocation(path, tuple(around.get("properties", ())), tags, tuple(forms))

    def _resolved(self, node: Schema) -> Schema:
        """Resolve references and strip null, which pydantic omits from its locations."""
        while True:
            branches = [branch for branch in _branches(node) if branch.get("type") != "null"]
            if "$ref" in node:
                node = self._definitions.get(_name_of(node), {})
            elif len(branches) == 1:
                node = branches[0]
            else:
                return {**node, "anyOf": branches} if "anyOf" in node else node


@cache
def places_of(model: type[BaseModel]) -> Places:
    """Return the locations of a model."""
    return Places(model.model_json_schema(mode="validation"))


def _branches(node: Schema) -> list[Schema]:
    found: list[Schema] = node.get("anyOf") or node.get("oneOf") or []
    return found


def _branch(node: Schema, branches: list[Schema], label: str) -> Schema:
    tagged = node.get("discriminator", {}).get("mapping", {})
    if label in tagged:
        return {"$ref": tagged[label]}
    words = _WORD.findall(label)  # pydantic names a model with validators function-after[its_validator(), Model]
    return next((branch for branch in branches if "$ref" in branch and _name_of(branch) in words), {})


def _below(node: Schema, part: str | int) -> Schema:
    if isinstance(part, int):
        given = node.get("prefixItems", [])
        found = given[part] if part < len(given) else node.get("items")
    else:
        found = node.get("properties", {}).get(part) or node.get("additionalProperties")
    return found if isinstance(found, Mapping) else {}


def _name_of(node: Schema) -> str:
    return str(node["$ref"]).rpartition("/")[2]


WANTED: Final[Mapping[str, str]] = {
    **dict.fromkeys(("string_type", "string_sub_type"), "a string"),
    "string_unicode": "Unicode text",
    **dict.fromkeys(("bool_type", "bool_parsing"), "true or false"),
    **dict.fromkeys(("int_type", "int_parsing", "int_from_float"), "an integer"),
    "int_parsing_size": "a smaller number",
    **dict.fromkeys(("float_type", "float_parsing"), "a number"),
    "finite_number": "a finite number",
    **dict.fromkeys(("dict_type", "model_type", "model_attributes_type", "mapping_type"), "an object"),
    **dict.fromkeys(("list_type", "tuple_type", "set_type", "frozen_set_type"), "a list"),
    **dict.fromkeys(
        ("datetime_type", "datetime_parsing", "datetime_from_date_parsing", "datetime_object_invalid"),
        "a date and time such as 2026-01-31T12:00:00Z",
    ),
    "timezone_aware": "a date and time with UTC offset, such as 2026-01-31T12:00:00Z",
}
"""Error types of pydantic that report a wrong kind of value, with the expected kind."""


@dataclass(frozen=True, slots=True)
class Fault:
    """`kind` is pydantic's error type, `sentence` its message, `context` its parameters.

    `wanted`: the expected kinds of value, if the value is of another kind. `instead`: fields of another union branch
    that could be specified instead of the missing ones.
    """

    kind: str
    sentence: str
    context: Mapping[str, Any]
    place: JsonLocation
    wanted: tuple[str, ...] = ()
    instead: tuple[str, ...] = ()
