"""One thing that pydantic found, at its place in the document."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from app.domain.validation.places import Place

WANTED: Final[Mapping[str, str]] = {
    **dict.fromkeys(("string_type", "string_sub_type"), "a string"),
    "string_unicode": "Unicode text",
    **dict.fromkeys(("bool_type", "bool_parsing"), "true or false"),
    **dict.fromkeys(("int_type", "int_parsing", "int_from_float"), "a whole number"),
    "int_parsing_size": "a smaller number",
    **dict.fromkeys(("float_type", "float_parsing"), "a number"),
    "finite_number": "a finite number",
    **dict.fromkeys(("dict_type", "model_type", "model_attributes_type", "mapping_type"), "an object"),
    **dict.fromkeys(("list_type", "tuple_type", "set_type", "frozen_set_type"), "a list"),
    **dict.fromkeys(
        ("datetime_type", "datetime_parsing", "datetime_from_date_parsing", "datetime_object_invalid"),
        "a date and time such as 2026-01-31T12:00:00Z",
    ),
    "timezone_aware": "a date and time with its zone, such as 2026-01-31T12:00:00Z",
}
"""pydantic's errors that say: this is of another kind. Each with the kind that is wanted."""


@dataclass(frozen=True, slots=True)
class Fault:
    """`kind` is pydantic's type of the error; `sentence` what it says itself, `context` what it knows.

    `wanted`: the kinds of value that would do, if the value is of none of them. `instead`: fields of the other branches
    of the union, if those would do as well as the ones that are missing.
    """

    kind: str
    sentence: str
    context: Mapping[str, Any]
    place: Place
    wanted: tuple[str, ...] = ()
    instead: tuple[str, ...] = ()
