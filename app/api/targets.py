"""/targets: where moving delivery targets are."""

from __future__ import annotations

import re
from typing import Final

from aiohttp import web
from pydantic import BaseModel

from app.api.bodies import NO_BODY, Empty, json_answer, json_body
from app.api.routing import API, Answer, AnyRoute, Call, NoQuery, Route
from app.api.services import TARGETS
from app.domain.errors import InvalidInputError
from app.domain.items.drop_places import FEED_PATTERN
from app.domain.targets import TargetFix, TargetReport
from app.services.access import Role

_FEED: Final = re.compile(FEED_PATTERN)
_LONGEST: Final = 64


class TargetView(BaseModel):
    """A target's newest report. `age_s` is how old it is; a stale one is neither followed nor dropped at."""

    feed: str
    report: TargetReport
    age_s: float
    stale: bool

    @classmethod
    def of(cls, fix: TargetFix) -> TargetView:
        """What is known of a target now."""
        return cls(feed=fix.feed, report=fix.report, age_s=fix.age_s, stale=fix.is_stale)


def require_feed(name: str) -> str:
    """The name of a feed, as it is. Raises InvalidInputError if it is none."""
    if len(name) > _LONGEST or _FEED.fullmatch(name) is None:
        raise InvalidInputError("this is no name of a feed", hint="1 to 64 letters, digits, dots, dashes, underscores")
    return name


class TargetsView(BaseModel):
    """All targets that have reported since Waydrop started, by feed."""

    targets: list[TargetView]


async def list_targets(call: Call[NoQuery, Empty]) -> web.Response:
    """GET /targets."""
    return json_answer(TargetsView(targets=[TargetView.of(fix) for fix in call.request.app[TARGETS].all()]))


async def report_target(call: Call[NoQuery, TargetReport]) -> web.Response:
    """POST /targets/{feed}."""
    feed = require_feed(call.path_value("feed"))
    return json_answer(TargetView.of(call.request.app[TARGETS].report(feed, call.body)))


async def get_target(call: Call[NoQuery, Empty]) -> web.Response:
    """GET /targets/{feed}."""
    return json_answer(TargetView.of(call.request.app[TARGETS].fix(call.path_value("feed"))))


ROUTES: tuple[AnyRoute, ...] = (
    Route(
        method="GET",
        path=f"{API}/targets",
        handler=list_targets,
        summary="List moving targets",
        tag="targets",
        role=Role.VIEWER,
        query=NoQuery,
        body=NO_BODY,
        answers=(Answer(200, "The targets; none is no error", TargetsView),),
    ),
    Route(
        method="POST",
        path=f"{API}/targets/{{feed}}",
        handler=report_target,
        summary="Report the position of a moving target, at about 1 Hz",
        tag="targets",
        role=Role.DISPATCHER,
        query=NoQuery,
        body=json_body(TargetReport),
        answers=(Answer(200, "The report as it is known now", TargetView),),
        errors=("input.invalid", "state.conflict"),
    ),
    Route(
        method="GET",
        path=f"{API}/targets/{{feed}}",
        handler=get_target,
        summary="Get a moving target",
        tag="targets",
        role=Role.VIEWER,
        query=NoQuery,
        body=NO_BODY,
        answers=(Answer(200, "Its newest report", TargetView),),
        errors=("resource.not_found",),
    ),
)
