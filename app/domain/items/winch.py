"""Lower a parcel with the winch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from app.domain.items.base import CommandForm, Draft, Forms, Param, command_draft, or_nan
from app.domain.items.drop import Drop
from app.domain.mission import MavCmd

_ACTIONS: Final = (
    *("relax", "length", "rate", "lock", "deliver", "hold"),
    *("retract", "load_line", "abandon_line", "load_payload"),
)
"""WINCH_ACTIONS, from 0."""
_LETS_GO: Final = frozenset({"deliver", "abandon_line", "relax", "length", "rate"})


class Winch(Drop):
    """Lower a parcel at the preceding position item (DO_WINCH). `length_m` and `rate_m_s` as the action requires."""

    forms: ClassVar[Forms] = {
        MavCmd.DO_WINCH: CommandForm(
            "winch",
            {
                "instance": Param(1, zero_is_none=True, whole=True),
                "action": Param(2, words={float(number): word for number, word in enumerate(_ACTIONS)}),
                "length_m": Param(3),
                "rate_m_s": Param(4),
            },
            fixed={"mode": "embedded"},
        )
    }
    title: ClassVar[str] = "Winch"
    fresh: ClassVar[Mapping[str, object]] = {"action": "deliver"}

    type: Literal["winch"]
    action: Literal[
        "relax", "length", "rate", "lock", "deliver", "hold", "retract", "load_line", "abandon_line", "load_payload"
    ]
    length_m: Annotated[float, Field(ge=-1000, le=1000)] | None = None
    rate_m_s: Annotated[float, Field(ge=-20, le=20)] | None = None

    @model_validator(mode="after")
    def _needs_of_action(self) -> Self:
        if self.action == "length" and self.length_m is None:
            raise PydanticCustomError("winch_length", "the winch action length requires length_m")
        if self.action == "rate" and self.rate_m_s is None:
            raise PydanticCustomError("winch_rate", "the winch action rate requires rate_m_s")
        return self

    @property
    def releases(self) -> bool:
        return self.action in _LETS_GO

    def release_draft(self) -> Draft:
        """DO_WINCH (instance, action, length, rate)."""
        action = float(_ACTIONS.index(self.action))
        return command_draft(
            MavCmd.DO_WINCH, float(self.instance), action, or_nan(self.length_m), or_nan(self.rate_m_s)
        )

    def settle_s(self, gripper_s: float) -> float:
        """The maximum duration of the winch action."""
        return self.hold_s
