"""What gripper and winch share."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from app.domain.items.base import Draft, Item, T, Way
from app.domain.items.drop_places import DEFAULT_DROP_HOLD_S, Consent, ConsentTimeoutS, HoldS
from app.domain.items.fields import RadiusM


class Drop(Item):
    """What gripper and winch share.

    `release_motion`: whether the vehicle stands or flies on while releasing. `mode`: `embedded` is an item of the
    mission, `supervised` is commanded by Waydrop during a hold of at most `hold_s`; null is the default of the vehicle
    type. `max_offset_m`: no release farther than this from the point. `mass_kg` is that of the parcel. `consent`
    "operator": a person is asked while the vehicle holds, and has `consent_timeout_s` (null: as long as the hold
    allows) to answer; no answer is a refusal.
    """

    stays: ClassVar[bool] = True
    needs_stop: ClassVar[bool] = True
    is_drop: ClassVar[bool] = True
    usually_supervised: ClassVar[bool] = False
    """Waydrop commands it where the vehicle can stand, unless the plan says otherwise."""

    release_motion: Literal["stopped", "moving"]
    mode: Literal["supervised", "embedded"] | None = None
    hold_s: HoldS = DEFAULT_DROP_HOLD_S
    max_offset_m: RadiusM | None = None
    mass_kg: Annotated[float, Field(gt=0, le=10_000)] | None = None
    consent: Consent = "none"
    consent_timeout_s: ConsentTimeoutS | None = None
    instance: Annotated[int, Field(ge=1, le=16)] = 1

    @property
    @abstractmethod
    def lets_go(self) -> bool:
        """A parcel goes: only such a drop has an outcome."""

    @property
    def takes_up(self) -> bool:
        """A parcel is taken: there is nothing to decide about it on the spot, and it is an item of the mission."""
        return False

    @abstractmethod
    def release_draft(self) -> Draft:
        """The command, as an item."""

    @abstractmethod
    def settle_s(self, gripper_s: float) -> float:
        """How long an embedded, stopped one takes, with a gripper that needs `gripper_s`."""

    def effort(self, way: Way[T]) -> T:
        return way.drop()
