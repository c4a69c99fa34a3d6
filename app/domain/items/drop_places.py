"""Where a drop may take place instead: an alternate site, or a target that moves."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field

from app.domain.drop.consent import SHORTEST_QUESTION_S
from app.domain.items.fields import ItemId, PlanModel, Point, Position, RadiusM, YawDeg

# The other place for a parcel: where a supervised drop is made if it fails at its own.


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


# A delivery target that moves, such as a ship: which feed says where it is, and how far the drop may follow it.


FEED_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"
FeedId = Annotated[
    str, Field(min_length=1, max_length=64, pattern=FEED_PATTERN, description="the feed that reports the target")
]


class Target(PlanModel):
    """The drop's waypoint follows a target, in flight, and no farther than `max_move_m` from the planned point.

    A target faster than `max_speed_m_s` is neither followed nor dropped at. `planned` null: the waypoint's own place
    is the planned point. In a plan that Waydrop made by moving the waypoint it is the place that was planned first.
    """

    feed: FeedId
    max_move_m: Annotated[float, Field(gt=0, le=5000, allow_inf_nan=False)]
    max_speed_m_s: Annotated[float, Field(gt=0, le=30, allow_inf_nan=False)]
    planned: Point | None = None
