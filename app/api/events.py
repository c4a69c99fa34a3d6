"""/events: the journal, paginated."""

from __future__ import annotations

from aiohttp import web

from app.api.bodies import Empty, json_answer
from app.api.models import EventsQuery, EventsView
from app.api.routing import API, Answer, AnyRoute, Call, Route, tagged
from app.api.services import JOURNAL
from app.services.access import Role


async def list_events(call: Call[EventsQuery, Empty]) -> web.Response:
    journal = call.request.app[JOURNAL]
    events = await journal.read(call.query.after, call.query.limit)
    return json_answer(EventsView(events=list(events), last_seq=journal.last_seq))


ROUTES: tuple[AnyRoute, ...] = tagged(
    "events",
    Route(
        method="GET",
        path=f"{API}/events",
        handler=list_events,
        summary="List events, in order",
        role=Role.VIEWER,
        query=EventsQuery,
        answers=(Answer(200, "A page of events", EventsView),),
        errors=("storage.failed",),
    ),
)
