"""All moving targets over REST, for whoever may look."""

from __future__ import annotations

import time

from app.services.access import Role
from tests.support.service_in_process import Service


async def test_all_targets_are_listed_with_their_age_and_none_is_no_error(service: Service) -> None:
    assert (await service.call("GET", "/api/v1/targets"))[2] == {"targets": []}
    place = {"latitude_deg": 47.398641, "longitude_deg": 8.546656, "north_m_s": 0.0, "east_m_s": 1.5}
    for feed in ("ship-2", "ship-1"):
        report = {**place, "time": time.time() - 6.0}
        assert (await service.call("POST", f"/api/v1/targets/{feed}", json=report))[0] == 200
    status, _, listed = await service.call("GET", "/api/v1/targets", headers=await service.token(Role.VIEWER))
    assert (status, [one["feed"] for one in listed["targets"]]) == (200, ["ship-1", "ship-2"])
    assert all(one["age_s"] >= 6.0 and one["stale"] for one in listed["targets"])
