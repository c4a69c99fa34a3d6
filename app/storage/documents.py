"""JSON text in and out of columns."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from app.domain.errors import InvalidInputError, StorageError

M = TypeVar("M", bound=BaseModel)

_ENCODER = json.JSONEncoder(allow_nan=False, separators=(",", ":"), ensure_ascii=False)


def to_json(what: str, value: Mapping[str, Any]) -> str:
    """`value` as compact JSON.

    Raises:
        InvalidInputError: it holds something that JSON has not (NaN, infinity, an object); nothing is stored then.
    """
    try:
        return _ENCODER.encode(value)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{what} cannot be stored: {error}") from error


def from_json(model: type[M], what: str, text: str) -> M:
    """The model stored as `text`. Raises StorageError if it does not fit the model any more."""
    try:
        return model.model_validate_json(text)
    except ValidationError as error:
        raise unreadable(what) from error


def object_from_json(what: str, text: str) -> dict[str, Any]:
    """The JSON object stored as `text`. Raises StorageError if it is none."""
    try:
        value = json.loads(text)
    except json.JSONDecodeError as error:
        raise unreadable(what) from error
    if not isinstance(value, dict):
        raise unreadable(what)
    return value


def unreadable(what: str) -> StorageError:
    """The error for a row that is there but means nothing to this version."""
    return StorageError(f"{what} cannot be read", hint="it was written by another version, or changed by hand")
