"""Both sides' shared view of a flight: values that change, with the time of each change."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from app.simulator.compare.heard import Heard


@dataclass(frozen=True, slots=True)
class Stand:
    """A value that a message showed from `t_s` on, `count` times in a row."""

    t_s: float
    value: str
    count: int


def stands(messages: Iterable[Heard], value: Callable[[Heard], str | None]) -> list[Stand]:
    """The values in order, repetitions counted; None from `value` leaves a message out."""
    return list(_stands(messages, value))


def _stands(messages: Iterable[Heard], value: Callable[[Heard], str | None]) -> Iterator[Stand]:
    current: Stand | None = None
    for message in messages:
        shown = value(message)
        if shown is None:
            continue
        if current is not None and current.value == shown:
            current = Stand(current.t_s, shown, current.count + 1)
            continue
        if current is not None:
            yield current
        current = Stand(message.t_s, shown, 1)
    if current is not None:
        yield current
