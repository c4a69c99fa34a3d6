"""/targets: positions of moving delivery targets."""

from __future__ import annotations

import re
from typing import Final

from aiohttp import web
from pydantic import BaseModel

from app.api.bodies import Empty, json_answer
from app.api.routing import Answer, Call, NoQuery, Routes
from app.domain.errors import InvalidInputError
from app.domain.items.drop_places import FEED_PATTERN
from app.domain.targets import TargetFix, TargetReport
from app.services.access import Role

ROUTES: Final = Routes("targets")

_FEED: Final = re.compile(FEED_PATTERN)
_LONGEST: Final = 64


class TargetView(BaseModel):
    """The newest report of a target, `age_s` old. A stale target is not followed, and nothing is released at it."""

    feed: str
    report: TargetReport
    age_s: float
    stale: bool

    @classmethod
    def of(cls, fix: TargetFix) -> TargetView:
        """Convert from the service."""
        return cls(feed=fix.feed, report=fix.report, age_s=fix.age_s, stale=fix.is_stale)


def require_feed(name: str) -> str:
    """Validate the name of a feed. Raises InvalidInputError."""
    if len(name) > _LONGEST or _FEED.fullmatch(name) is None:
        raise InvalidInputError("invalid feed name", hint="use 1 to 64 letters, digits, dots, dashes and underscores")
    return name


class TargetsView(BaseModel):
    """All targets reported since Waydrop started, by feed."""

    targets: list[TargetView]


@ROUTES.route("GET", "/targets", Role.VIEWER, Answer(200, "The targets, possibly none", TargetsView))
async def list_targets(call: Call[NoQuery, Empty]) -> web.Response:
    """List moving targets."""
    return json_answer(TargetsView(targets=[TargetView.of(fix) for fix in call.services.targets.all()]))


@ROUTES.route(
    "POST",
    "/targets/{feed}",
    Role.DISPATCHER,
    Answer(200, "The report as stored", TargetView),
    errors=("input.invalid", "state.conflict"),
    is_audited=False,
)
async def report_target(call: Call[NoQuery, TargetReport]) -> web.Response:
    """Report the position of a moving target, about once per second."""
    feed = require_feed(call.path_value("feed"))
    return json_answer(TargetView.of(await call.services.targets.accept(feed, call.body)))


@ROUTES.route(
    "GET",
    "/targets/{feed}",
    Role.VIEWER,
    Answer(200, "The newest report of the target", TargetView),
    errors=("resource.not_found",),
)
async def get_target(call: Call[NoQuery, Empty]) -> web.Response:
    """Get a moving target."""
    return json_answer(TargetView.of(call.services.targets.fix(call.path_value("feed"))))
