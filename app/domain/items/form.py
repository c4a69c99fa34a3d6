"""How a MAV_CMD is a plan item: which parameter is which field. Read both ways: in and out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final


@dataclass(frozen=True, slots=True)
class Param:
    """A parameter that is a field. `words` are the values of an enum; `zero_is_none`: 0 means "not given" as null does.

    `whole`: the field is an integer.
    """

    number: int
    words: Mapping[float, str] | None = None
    zero_is_none: bool = False
    whole: bool = False

    def written(self, value: Any) -> float | None:
        """The parameter for a field's value."""
        if value is None:
            return 0.0 if self.zero_is_none else None
        if self.words is not None:
            return next(number for number, word in self.words.items() if word == value)
        return float(value)


@dataclass(frozen=True, slots=True)
class CommandForm:
    """A command. `positioned`: param5 to param7 are a place. `fixed` are fields that the command itself says.

    `neutral` are values of other parameters that mean nothing, besides 0 and null; the first is what is written.
    """

    type: str
    params: Mapping[str, Param]
    positioned: bool = False
    fixed: Mapping[str, Any] = field(default_factory=dict)
    neutral: Mapping[int, tuple[float, ...]] = field(default_factory=dict)

    def used(self) -> frozenset[int]:
        """The numbers of the parameters that are fields."""
        place = {5, 6, 7} if self.positioned else set()
        return frozenset({param.number for param in self.params.values()} | place)


Forms = Mapping[int, CommandForm]
"""By MAV_CMD."""
YAW: Final = Param(4)
