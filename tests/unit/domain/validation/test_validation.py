"""What does not fit a model is told in words for the person who wrote the document, at its place in the document."""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

import pytest
from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, RootModel, ValidationError, field_validator
from pydantic_core import PydanticCustomError

from app.domain.validation import document_of, findings_of
from app.domain.validation.finding import Finding


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class East(Part):
    east_m: float
    north_m: float


class Globe(Part):
    latitude_deg: Annotated[float, Field(ge=-90, le=90)]
    longitude_deg: float


class Circle(Part):
    type: Literal["circle"]
    center: East | Globe
    radius_m: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 1.0


class Path(Part):
    type: Literal["path"]
    points: Annotated[tuple[East | Globe, ...], Field(strict=False, min_length=1, max_length=2)]
    closed: bool = False


class Document(Part):
    task: Annotated[Circle | Path, Field(discriminator="type")] | None = None
    plan: Annotated[str, Field(min_length=1, max_length=3, pattern="^[a-z]*$")] | dict[str, int] | None = None
    name: Annotated[str, Field(min_length=1, max_length=3, pattern="^[a-z]*$")] = "a"
    count: Annotated[int, Field(gt=0, lt=2**53)] = 1
    insert: Literal["append", "prepend"] = "append"
    now: Literal[True] = True
    wind: Annotated[tuple[float, float] | None, Field(strict=False)] = None
    begin: Annotated[AwareDatetime | None, Field(strict=False)] = None
    ours: int = 0
    odd: int = 0

    @field_validator("ours")
    @classmethod
    def _no_seven(cls, value: int) -> int:
        if value == 7:
            raise PydanticCustomError("seven", "seven is taken", {"pointer": "/name"})
        if value == 8:
            raise ValueError("eight is not taken")
        return value


class Either(RootModel[Annotated[Circle | Path, Field(discriminator="type")]]):
    """A document that is a union as a whole."""


def found(model: type[BaseModel], text: str | bytes, noun: str = "field") -> list[Finding]:
    with pytest.raises(ValidationError) as raised:
        model.model_validate_json(text)
    return findings_of(raised.value, model, document_of(text), code_of="x.{}".format, noun=noun)


def told(document: Any, model: type[BaseModel] = Document) -> list[tuple[str, str, str]]:
    return [(one.pointer, one.message, one.hint) for one in found(model, json.dumps(document))]


LEFT = "remove it; known fields: "
ALL_BUT_NAME = f"{LEFT}{', '.join(name for name in Document.model_fields if name != 'name')}"
DATE = "a date and time such as 2026-01-31T12:00:00Z"
ZONED = "a date and time with UTC offset, such as 2026-01-31T12:00:00Z"
MISSING = ("the field 'east_m' is missing", "the field 'north_m' is missing")
OR_ELSE = "or specify latitude_deg and longitude_deg instead"


@pytest.mark.parametrize(
    ("document", "pointer", "message", "hint"),
    [
        ([], "", "the document must be an object, not a list", ""),
        ({"nam": "b"}, "/nam", "unknown field 'nam'", "did you mean 'name'?"),
        ({"nam": "b", "name": "b"}, "/nam", "unknown field 'nam'", ALL_BUT_NAME),
        ({"a/b~c": 1, "name": "b"}, "/a~1b~0c", "unknown field 'a/b~c'", ALL_BUT_NAME),
        ({"x" * 99: 1}, "/" + "x" * 99, f"unknown field '{'x' * 40}…'", f"{LEFT}{', '.join(Document.model_fields)}"),
        ({"name": 1}, "/name", "'name' must be a string, not 1", ""),
        ({"name": {}}, "/name", "'name' must be a string, not an object", ""),
        ({"name": ""}, "/name", "'name' must not be empty", ""),
        ({"name": "abcd"}, "/name", "'name' must have at most 3 characters", ""),
        ({"name": "A"}, "/name", "'name' must match ^[a-z]*$; 'A' does not", ""),
        ({"count": 0}, "/count", "'count' must be more than 0, not 0", ""),
        ({"count": 2**60}, "/count", f"'count' must be less than {2**53}, not {2**60}", ""),
        ({"count": 10**30}, "/count", f"'count' must be less than {2**53}, not such a large number", ""),
        ({"count": 1.5}, "/count", "'count' must be an integer, not 1.5", ""),
        ({"count": None}, "/count", "'count' must be an integer, not null", ""),
        ({"insert": "nix"}, "/insert", "'insert' must be 'append' or 'prepend', not 'nix'", ""),
        ({"now": False}, "/now", "'now' must be true, not false", ""),
        ({"wind": [1]}, "/wind/1", "'wind[1]' is missing", ""),
        ({"wind": [1, "a"]}, "/wind/1", "'wind[1]' must be a number, not 'a'", ""),
        ({"wind": [1, 2, 3]}, "/wind", "'wind' must have at most 2 entries", ""),
        ({"begin": "soon"}, "/begin", f"'begin' must be {DATE}, not 'soon'", ""),
        ({"begin": "2026-01-31T12:00:00"}, "/begin", f"'begin' must be {ZONED}, not '2026-01-31T12:00:00'", ""),
        ({"ours": 7}, "/name", "seven is taken", ""),
        ({"ours": 8}, "/ours", "eight is not taken", ""),
        ({"task": 5}, "/task", "'task' must be an object, not 5", ""),
        ({"task": {}}, "/task", "the field 'type' is missing", "known values: circle, path"),
        ({"task": {"type": "nix"}}, "/task", "unknown type 'nix'; known values: circle, path", ""),
        (
            {"task": {"type": "circl"}},
            "/task",
            "unknown type 'circl'; known values: circle, path",
            "did you mean 'circle'?",
        ),
        ({"task": {"type": 5}}, "/task", "unknown type '5'; known values: circle, path", ""),
        ({"task": {"type": "path", "points": []}}, "/task/points", "'points' must not be empty", ""),
        ({"plan": 5}, "/plan", "'plan' must be a string or an object, not 5", ""),
        ({"plan": ""}, "/plan", "'plan' must not be empty", ""),
        ({"plan": {"a": "b"}}, "/plan/a", "'a' must be an integer, not 'b'", ""),
    ],
)
def test_one_fault_is_one_sentence_at_its_place(document: Any, pointer: str, message: str, hint: str) -> None:
    assert told(document) == [(pointer, message, hint)]


CENTER = "/task/center"


@pytest.mark.parametrize(
    ("center", "findings"),
    [
        (5, [("", "'center' must be an object, not 5", "")]),
        ({"latitude_deg": 47}, [("/longitude_deg", "the field 'longitude_deg' is missing", "")]),
        (
            {"latitude_deg": 97, "longitude_deg": 8},
            [("/latitude_deg", "'latitude_deg' must be at most 90, not 97", "")],
        ),
        ({"east_m": 1, "north_m": None}, [("/north_m", "'north_m' must be a number, not null", "")]),
        (
            {"latitude": 47, "longitude_deg": 8},
            [
                ("/latitude_deg", "the field 'latitude_deg' is missing", ""),
                ("/latitude", "unknown field 'latitude'", "did you mean 'latitude_deg'?"),
            ],
        ),
        (
            {"latitude": 47},
            [
                ("/latitude_deg", "the field 'latitude_deg' is missing", "or specify east_m and north_m instead"),
                ("/longitude_deg", "the field 'longitude_deg' is missing", "or specify east_m and north_m instead"),
                ("/latitude", "unknown field 'latitude'", "did you mean 'latitude_deg'?"),
            ],
        ),
        (
            {"east_m": 1, "nord_m": 2},
            [("/north_m", MISSING[1], ""), ("/nord_m", "unknown field 'nord_m'", "did you mean 'north_m'?")],
        ),
        ({}, [("/east_m", MISSING[0], OR_ELSE), ("/north_m", MISSING[1], OR_ELSE)]),
    ],
)
def test_of_a_union_without_a_tag_only_the_nearest_branch_is_told(
    center: Any, findings: list[tuple[str, str, str]]
) -> None:
    there = {"task": {"type": "circle", "center": center}}
    assert told(there) == [(CENTER + pointer, message, hint) for pointer, message, hint in findings]


def test_each_entry_of_a_list_has_a_nearest_branch_of_its_own_and_the_list_is_not_called_empty() -> None:
    points = [{"east_m": "a", "north_m": 1}, {"latitude_deg": 1, "longitude_deg": "b"}]
    assert told({"task": {"type": "path", "points": points}}) == [
        ("/task/points/0/east_m", "'east_m' must be a number, not 'a'", ""),
        ("/task/points/1/longitude_deg", "'longitude_deg' must be a number, not 'b'", ""),
    ]


def test_a_key_that_is_named_like_a_branch_is_not_taken_for_one() -> None:
    document = {"type": "circle", "circle": {"center": 1}, "center": {"East": {"east_m": 1}, "east_m": 1}}
    assert [pointer for pointer, _, _ in told(document, Either)] == ["/center/north_m", "/center/East", "/circle"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "invalid JSON: it ends in the middle of a value at line 1 column 0"),
        ('{"name": "a"', "invalid JSON: it ends in the middle of an object at line 1 column 12"),
        ("name=a", "invalid JSON: expected ident at line 1 column 2"),
        ("[" * 300, "invalid JSON: it is nested too deeply at line 1 column 202"),
        (b"\xff", "invalid JSON: expected value at line 1 column 1"),
    ],
)
def test_what_is_no_json_says_where_it_breaks_off(text: str | bytes, message: str) -> None:
    assert [(one.code, one.pointer, one.message) for one in found(Document, text)] == [("x.json_invalid", "", message)]


def test_a_number_that_is_none_is_told_as_it_was_written() -> None:
    text = '{"type": "circle", "center": {"east_m": 1, "north_m": 1}, "radius_m": NaN}'
    assert [one.message for one in found(Either, text)] == ["'radius_m' must be a finite number, not NaN"]


def test_the_code_is_made_of_the_kind_and_a_field_is_called_as_the_document_calls_it() -> None:
    (finding,) = found(Document, '{"nix": 1}', noun="query parameter")
    assert (finding.code, finding.message) == ("x.extra_forbidden", "unknown query parameter 'nix'")


def test_a_document_with_a_fault_in_every_byte_is_told_a_hundred() -> None:
    assert len(found(Document, json.dumps({f"x{number}": 1 for number in range(5000)}))) == 100
