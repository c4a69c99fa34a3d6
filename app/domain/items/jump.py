"""Repeat a part of the plan."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from app.domain.items.base import CommandForm, Draft, Forms, Item, Leg, Param, command_draft
from app.domain.items.fields import WHOLE
from app.domain.mission import NAN, MavCmd


class Jump(Item):
    """Jump back to the item with this ID `repeats` times in total, then continue."""

    forms: ClassVar[Forms] = {
        MavCmd.DO_JUMP: CommandForm("jump", {"target": Param(1), "repeats": Param(2, whole=True)})
    }
    title: ClassVar[str] = "Jump"
    fresh: ClassVar[Mapping[str, object]] = {"repeats": 1}

    type: Literal["jump"]
    target: Annotated[str, Field(min_length=1, max_length=64)]
    repeats: Annotated[int, Field(ge=1, le=1000), WHOLE]

    def drafts(self, leg: Leg) -> tuple[Draft, ...]:
        return (command_draft(MavCmd.DO_JUMP, NAN, float(self.repeats), jump_to=self.target),)

    def jumps_to(self) -> str | None:
        return self.target
