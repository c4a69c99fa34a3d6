"""/events: the journal, paginated."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from app.api.bodies import Empty, json_answer
from app.api.models import EventsQuery, EventsView
from app.api.routing import Answer, Call, Routes
from app.services.access import Role

ROUTES: Final = Routes("events")


@ROUTES.route("GET", "/events", Role.VIEWER, Answer(200, "A page of events", EventsView), errors=("storage.failed",))
async def list_events(call: Call[EventsQuery, Empty]) -> web.Response:
    """List events, in order."""
    journal = call.services.journal
    events = await journal.read(call.query.after, call.query.limit)
    return json_answer(EventsView(events=list(events), last_seq=journal.last_seq))
