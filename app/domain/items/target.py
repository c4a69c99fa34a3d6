"""A delivery target that moves, such as a ship: which feed says where it is, and how far the drop may follow it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from app.domain.items.fields import PlanModel, Point

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
