"""A fence breached in flight: what counts as a breach, what GF_ACTION does, and who can take over."""

from __future__ import annotations

from app.simulator.mission.geofence import POLYGON_INCLUSION
from app.simulator.params import Value
from tests.support.simulated_vehicle import GroundStation, Plan, takeoff, waypoint

FENCE, BORDER_M, UP_M = 1, 40.0, 15.0


def polygon(command: int, south_m: float, north_m: float) -> list[Plan]:
    corners = ((south_m, -60.0), (north_m, -60.0), (north_m, 60.0), (south_m, 60.0))
    return [Plan(command, north, east, params=(4.0, 0.0, 0.0, 0.0)) for north, east in corners]


INCLUSION = polygon(POLYGON_INCLUSION, -60.0, BORDER_M)


def northwards(fence: list[Plan], airframe: str = "quad", firmware: str = "px4-main", **params: Value) -> GroundStation:
    """Holding south of the border at 15 m, with the fence in force; nothing was breached yet."""
    gcs = GroundStation(airframe, firmware=firmware, params={"GF_ACTION": 2, "MIS_TKO_LAND_REQ": 0, **params})
    assert gcs.upload(fence, FENCE) == 0
    gcs.fly(1.0)
    gcs.start([takeoff(UP_M), waypoint(15.0, 0.0, UP_M, 600.0, 2.0)])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 13.0)
    assert not gcs.vehicle.state.status.fence_breached
    return gcs
