"""Reasons in tests: of JSON as the API gives it, and made up where only that there is one matters."""

from __future__ import annotations

from app.domain.reasons import Reason, describe


def words(reason: dict[str, object] | None) -> str:
    """The sentence of a reason in JSON; empty for null."""
    return describe(None if reason is None else Reason.model_validate(reason))


def some(detail: str = "because") -> Reason:
    """A reason whose words are these."""
    return Reason.of_error("test", detail)
