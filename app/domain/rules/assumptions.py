"""What a finding rests on: the facts that were asked for and not known while its rule was looking."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

Value = TypeVar("Value")


class Assumptions:
    """Collects the names of assumed facts from one `clear` to the next."""

    def __init__(self) -> None:
        self._names: set[str] = set()

    def add(self, name: str) -> None:
        """This fact was asked for and is not known."""
        self._names.add(name)

    def clear(self) -> None:
        """What comes now rests on nothing yet."""
        self._names.clear()

    @property
    def names(self) -> tuple[str, ...]:
        """In alphabetical order."""
        return tuple(sorted(self._names))

    def remembered(self, make: Callable[[], Value]) -> Callable[[], Value]:
        """`make` as a function that is called once; whoever asks for its value rests on what the value rests on."""
        kept: list[tuple[Value, tuple[str, ...]]] = []

        def value() -> Value:
            if not kept:
                before, self._names = self._names, set()
                made = make()
                kept.append((made, self.names))
                self._names = before
            made, names = kept[0]
            self._names.update(names)
            return made

        return value
