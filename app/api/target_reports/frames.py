"""What the websocket of a target's reports carries: one JSON object in each text frame, one answer to each frame."""

from __future__ import annotations

from enum import IntEnum
from typing import Final, Literal

from pydantic import BaseModel

from app.api.offboard_models import StrictRequest
from app.api.socket_answers import FrameId, RefusedFrame
from app.api.targets import TargetView
from app.domain.moving_target.report import TargetReport


class ReportFrame(StrictRequest):
    """Where the target is, as it is said to POST /targets/{feed}. The feed is the path's."""

    type: Literal["report"]
    id: FrameId | None = None
    report: TargetReport


class ReportTakenFrame(BaseModel):
    """The report is taken: the target as it is known now."""

    type: Literal["taken"] = "taken"
    id: int | None = None
    target: TargetView


REPORTER_FRAMES: Final[tuple[type[BaseModel], ...]] = (ReportFrame,)
ANSWER_FRAMES: Final[tuple[type[BaseModel], ...]] = (ReportTakenFrame, RefusedFrame)


class ReportsCloseCode(IntEnum):
    """Why the service closed a websocket of reports."""

    GOING_AWAY = 1001
    DEFECT = 1011
    TRY_AGAIN = 1013
    UNAUTHORIZED = 4401
    ROLE = 4403
    TOO_SLOW = 4408


REPORTS_CLOSE_REASONS: Final[dict[ReportsCloseCode, str]] = {
    ReportsCloseCode.GOING_AWAY: "the service stops",
    ReportsCloseCode.DEFECT: "a defect of the service",
    ReportsCloseCode.TRY_AGAIN: "the token cannot be looked at now",
    ReportsCloseCode.UNAUTHORIZED: "a valid token is needed",
    ReportsCloseCode.ROLE: "the role dispatcher is needed",
    ReportsCloseCode.TOO_SLOW: "the answers are not read",
}
"""Told with the code, for people; at most 123 bytes (RFC 6455)."""
