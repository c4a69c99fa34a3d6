"""The journal over REST."""

from __future__ import annotations

from app.domain.events.vehicle import VehicleStatusText
from tests.support.service_in_process import Service


async def test_events_come_in_pages_each_once(service: Service) -> None:
    journal = service.services.journal
    await journal.record(
        *(journal.new_event(VehicleStatusText(severity="info", text=str(n)), vehicle_id="v1") for n in range(25))
    )
    seen: list[int] = []
    while True:
        status, _, page = await service.call("GET", f"/api/v1/events?limit=10&after={seen[-1] if seen else 0}")
        assert (status, page["last_seq"]) == (200, journal.last_seq)
        if not page["events"]:
            break
        seen += [event["seq"] for event in page["events"]]
    assert seen == list(range(1, journal.last_seq + 1))


async def test_a_query_that_cannot_be_used_is_400_and_says_what_can(service: Service) -> None:
    for query in ("after=x", "after=-1", "limit=0", "limit=501", "limit=", "colour=red", "after=1&after=2"):
        status, _, problem = await service.call("GET", f"/api/v1/events?{query}")
        assert (status, problem["code"]) == (400, "request.query_invalid"), query


async def test_an_after_of_another_journal_is_refused(service: Service) -> None:
    newest = service.services.journal.last_seq
    status, _, problem = await service.call("GET", f"/api/v1/events?after={newest + 1}")
    assert (status, problem["code"], problem["last_seq"]) == (422, "input.invalid", newest)
    status, _, page = await service.call("GET", f"/api/v1/events?after={newest}")
    assert (status, page["events"]) == (200, [])
