"""Other positions of a drop: an alternate, or a moving target."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field

from app.domain.drop.consent import SHORTEST_QUESTION_S
from app.domain.items.fields import NULL_REFUSED, ItemId, PlanModel, Point, Position, RadiusM, YawDeg

DEFAULT_DROP_HOLD_S: Final = 30.0
HoldS = Annotated[float, Field(gt=0, le=600)]
Consent = Annotated[Literal["none", "operator"], NULL_REFUSED]
ConsentTimeoutS = Annotated[float, Field(ge=SHORTEST_QUESTION_S, le=600)]


class Alternate(Position):
    """Where the vehicle takes the parcel if the drop fails and the parcel is certainly still on board.

    The vehicle flies there directly, holds for at most `hold_s`, and attempts a second supervised drop, which has a
    record of its own under this `id` (default: `<drop>-alternate`). The other fields have the same meaning as in a
    drop.
    """

    id: ItemId = ""
    yaw_deg: YawDeg | None = None
    hold_s: HoldS = DEFAULT_DROP_HOLD_S
    max_offset_m: RadiusM | None = None
    consent: Consent = "none"
    consent_timeout_s: ConsentTimeoutS | None = None


FEED_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"
FeedId = Annotated[
    str,
    Field(min_length=1, max_length=64, pattern=FEED_PATTERN, description="name of the feed that reports the target"),
]


class Target(PlanModel):
    """The drop's waypoint follows a target in flight, by at most `max_move_m` from the planned point.

    Waydrop neither follows a target faster than `max_speed_m_s` nor releases at it. `planned` null: the waypoint is the
    planned point. In a plan that Waydrop derived by moving the waypoint, it is the original planned point.
    """

    feed: FeedId
    max_move_m: Annotated[float, Field(gt=0, le=5000, allow_inf_nan=False)]
    max_speed_m_s: Annotated[float, Field(gt=0, le=30, allow_inf_nan=False)]
    planned: Point | None = None
