"""Wait."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from app.domain.items.base import CommandForm, Draft, Forms, Item, Leg, Param, Predictor, T, command_draft
from app.domain.mission import MavCmd


def delay_draft(duration_s: float) -> Draft:
    """NAV_DELAY for a duration. -1 disables the time of day."""
    return command_draft(MavCmd.NAV_DELAY, duration_s, -1.0, -1.0, -1.0)


class Delay(Item):
    """Wait at the current position (NAV_DELAY). The only way to stop a rover."""

    forms: ClassVar[Forms] = {
        MavCmd.NAV_DELAY: CommandForm("delay", {"duration_s": Param(1)}, neutral={2: (-1.0,), 3: (-1.0,), 4: (-1.0,)})
    }
    stays: ClassVar[bool] = True
    is_preparation: ClassVar[bool] = True
    needs_stop: ClassVar[bool] = True
    waits: ClassVar[bool] = True
    title: ClassVar[str] = "Wait"
    fresh: ClassVar[Mapping[str, object]] = {"duration_s": 5}

    type: Literal["delay"]
    duration_s: Annotated[float, Field(gt=0, le=86_400)]

    def drafts(self, leg: Leg) -> tuple[Draft, ...]:
        return (delay_draft(self.duration_s),)

    def effort(self, predictor: Predictor[T]) -> T:
        return predictor.wait(self.duration_s)
