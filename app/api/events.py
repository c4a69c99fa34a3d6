"""/events: the journal, paginated."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from app.api.bodies import Empty, json_answer
from app.api.models import EventsQuery, EventsView
from app.api.routing import Answer, Call, Routes
from app.services.access import Role
from app.services.journal import first_seq, kept_after, kept_page, of_another_journal

ROUTES: Final = Routes("events")


@ROUTES.route(
    "GET",
    "/events",
    Role.VIEWER,
    Answer(200, "A page of events", EventsView),
    errors=("input.invalid", "events.pruned", "storage.failed"),
)
async def list_events(call: Call[EventsQuery, Empty]) -> web.Response:
    """List events, in order. Without `after`, from the oldest one that is kept."""
    journal = call.services.journal
    if not await journal.has(call.query.after):
        raise of_another_journal(journal, call.query.after)
    after = kept_after(journal, call.query.after)
    events = await kept_page(journal, after, call.query.limit)
    return json_answer(EventsView(events=list(events), first_seq=first_seq(journal), last_seq=journal.last_seq))
