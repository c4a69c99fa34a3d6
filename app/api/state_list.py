"""States in a query, comma separated: `flying,at_drop`."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

from pydantic import AfterValidator

MAX_SHOWN_CHARS: Final = 40


def only_states_of(states: type[StrEnum]) -> AfterValidator:
    """Refuses a name that is no state of these."""
    known = [state.value for state in states]

    def check(value: str) -> str:
        unknown = next((part for part in value.split(",") if part not in known), None)
        if unknown is not None:
            raise ValueError(f"there is no state {unknown[:MAX_SHOWN_CHARS]!r}; known: {', '.join(known)}")
        return value

    return AfterValidator(check)
