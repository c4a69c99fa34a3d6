"""How texts and times stand on the sheet."""

from __future__ import annotations

from datetime import UTC, datetime
from html import escape


def typed(text: str) -> str:
    """Text that may come from outside: whichever way it turns the writing, what is around it stays as it is."""
    return f"<bdi>{escape(text)}</bdi>"


def shown_time(seconds: float | None, *, clock_only: bool = False) -> str | None:
    if seconds is None:
        return None
    moment = datetime.fromtimestamp(seconds, UTC)
    return moment.strftime("%H:%M:%S" if clock_only else "%Y-%m-%d %H:%M:%S UTC")
