"""Base of gripper and winch items."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from app.domain.items.base import Draft, Item, Predictor, T
from app.domain.items.drop_places import DEFAULT_DROP_HOLD_S, Consent, ConsentTimeoutS, HoldS
from app.domain.items.fields import WHOLE, RadiusM


class Drop(Item):
    """Base of gripper and winch items.

    `release_motion`: whether the vehicle is stopped or moving at the release. `mode`: `embedded` is a mission item,
    `supervised` is commanded by Waydrop during a hold of at most `hold_s`; null uses the default of the vehicle type.
    `max_offset_m`: maximum distance from the point at the release. `mass_kg` is the mass of the parcel. `consent`
    "operator": an operator must consent while the vehicle holds, within `consent_timeout_s` (null: as long as the hold
    allows). No answer counts as a refusal.
    """

    stays: ClassVar[bool] = True
    needs_stop: ClassVar[bool] = True
    is_drop: ClassVar[bool] = True
    usually_supervised: ClassVar[bool] = False
    """Waydrop commands it where the vehicle can stop, unless the plan specifies otherwise."""

    release_motion: Literal["stopped", "moving"]
    mode: Literal["supervised", "embedded"] | None = None
    hold_s: HoldS = DEFAULT_DROP_HOLD_S
    max_offset_m: RadiusM | None = None
    mass_kg: Annotated[float, Field(gt=0, le=10_000)] | None = None
    consent: Consent = "none"
    consent_timeout_s: ConsentTimeoutS | None = None
    instance: Annotated[int, Field(ge=1, le=16), WHOLE] = 1

    @property
    @abstractmethod
    def releases(self) -> bool:
        """Whether a parcel is released. Only such a drop has an outcome."""

    @property
    def grabs(self) -> bool:
        """Whether a parcel is grabbed. A grab is always a mission item."""
        return False

    @abstractmethod
    def release_draft(self) -> Draft:
        """Return the command as a mission item."""

    @abstractmethod
    def settle_s(self, gripper_s: float) -> float:
        """Return the duration of an embedded, stopped drop, for a gripper that needs `gripper_s`."""

    def effort(self, predictor: Predictor[T]) -> T:
        return predictor.drop()
