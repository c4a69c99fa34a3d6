"""Take a picture."""

from __future__ import annotations

from typing import ClassVar, Literal

from app.domain.items.base import CommandForm, Draft, Forms, Item, Leg, command_draft
from app.domain.mission import MavCmd


class Photo(Item):
    """Take one picture at the preceding position item (IMAGE_START_CAPTURE), with all cameras.

    The camera's report (CAMERA_IMAGE_CAPTURED) becomes evidence of the nearest drop.
    """

    forms: ClassVar[Forms] = {MavCmd.IMAGE_START_CAPTURE: CommandForm("photo", {}, neutral={3: (1.0,)})}
    stays: ClassVar[bool] = True
    needs_stop: ClassVar[bool] = True
    title: ClassVar[str] = "Photo"

    type: Literal["photo"]

    def drafts(self, leg: Leg) -> tuple[Draft, ...]:
        every_camera, no_interval, one, number = 0.0, 0.0, 1.0, 0.0
        return (command_draft(MavCmd.IMAGE_START_CAPTURE, every_camera, no_interval, one, number),)
