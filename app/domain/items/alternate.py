"""The other place for a parcel: where a supervised drop is made if it fails at its own."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field

from app.domain.consent import SHORTEST_QUESTION_S
from app.domain.items.fields import ItemId, Position, RadiusM, YawDeg

DEFAULT_DROP_HOLD_S: Final = 30.0
HoldS = Annotated[float, Field(gt=0, le=600)]
Consent = Literal["none", "operator"]
ConsentTimeoutS = Annotated[float, Field(ge=SHORTEST_QUESTION_S, le=600)]


class Alternate(Position):
    """Where the vehicle goes with the parcel if the drop fails and the parcel is surely still on board.

    It flies there straight, holds for at most `hold_s`, and a second supervised drop is made, with a record of its own
    under this `id` (`<drop>-alternate` if not given). The other fields mean what they mean for a drop.
    """

    id: ItemId = ""
    yaw_deg: YawDeg | None = None
    hold_s: HoldS = DEFAULT_DROP_HOLD_S
    max_offset_m: RadiusM | None = None
    consent: Consent = "none"
    consent_timeout_s: ConsentTimeoutS | None = None
