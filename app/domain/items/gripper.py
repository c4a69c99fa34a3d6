"""Release or grab a parcel with the gripper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Final, Literal

from app.domain.items.base import CommandForm, Draft, Forms, Param, command_draft
from app.domain.items.drop import Drop
from app.domain.items.drop_places import Alternate, Target
from app.domain.mission import MavCmd

SETTLE_MARGIN_S: Final = 1.0
_ACTION: Final = {"release": 0.0, "grab": 1.0}
"""GRIPPER_ACTIONS."""


class Gripper(Drop):
    """Release or grab a parcel at the preceding position item (DO_GRIPPER).

    `alternate` is where Waydrop attempts a supervised release if it fails here. With `target`, the drop follows a
    moving target.
    """

    forms: ClassVar[Forms] = {
        MavCmd.DO_GRIPPER: CommandForm(
            "gripper",
            {
                "instance": Param(1, zero_is_none=True, whole=True),
                "action": Param(2, words={number: word for word, number in _ACTION.items()}),
            },
            fixed={"mode": "embedded"},
        )
    }
    usually_supervised: ClassVar[bool] = True
    title: ClassVar[str] = "Gripper"
    stem: ClassVar[str] = "drop"
    fresh: ClassVar[Mapping[str, object]] = {"action": "release"}

    type: Literal["gripper"]
    action: Literal["release", "grab"]
    alternate: Alternate | None = None
    target: Target | None = None

    @property
    def releases(self) -> bool:
        return self.action == "release"

    @property
    def grabs(self) -> bool:
        return self.action == "grab"

    def release_draft(self) -> Draft:
        """DO_GRIPPER (instance, action)."""
        return command_draft(MavCmd.DO_GRIPPER, float(self.instance), _ACTION[self.action])

    def settle_s(self, gripper_s: float) -> float:
        return gripper_s + SETTLE_MARGIN_S

    def other_place(self) -> Alternate | None:
        return self.alternate

    def followed(self) -> Target | None:
        return self.target
