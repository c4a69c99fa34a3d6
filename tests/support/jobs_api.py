"""Jobs over REST: queued, given to a vehicle that can, flown one after the other, cancelled, expired, moved."""

from __future__ import annotations

from tests.support.service_in_process import Service


async def stop(service: Service, vehicle_id: str | None = None) -> None:
    """Let a vehicle's queue stand, so that jobs wait."""
    assert (await service.call("POST", f"/api/v1/job-queues/{vehicle_id or service.v1}/stop"))[0] == 200
