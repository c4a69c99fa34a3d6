"""Orders as commands: DO_REPOSITION and DO_ORBIT. Their altitude is above sea level whatever the frame says."""

from __future__ import annotations

from typing import Final

from app.domain.commands import CommandRequest
from app.domain.geo import LocalProjection
from app.domain.mission import NAN, MavCmd
from app.domain.tasks.commanded import CircleAt, Order
from app.domain.tasks.origin import EkfOrigin

OWN_SPEED: Final = -1.0
CHANGE_MODE: Final = 1.0
"""MAV_DO_REPOSITION_FLAGS_CHANGE_MODE: to Hold, if it is in another mode."""
TIMEOUT_S: Final = 1.0
CIRCLE_HERE: Final = CommandRequest(
    MavCmd.DO_REPOSITION, (OWN_SPEED, CHANGE_MODE, NAN, NAN, NAN, NAN, NAN), timeout_s=TIMEOUT_S, attempts=1
)
"""Without a place PX4 circles where it is. The mode alone changes nothing: in Hold it flies on to the last place.

Sent once: whoever says it again must look first whether somebody else has the vehicle by now.
"""


def order_request(order: Order, origin: EkfOrigin) -> CommandRequest:
    """Sent once: a newer order is better than the same again."""
    ground = order.center if isinstance(order, CircleAt) else order.ground
    latitude, longitude = LocalProjection(origin.latitude_deg, origin.longitude_deg).to_global(ground[1], ground[0])
    altitude_m = origin.altitude_m + order.up_m
    if isinstance(order, CircleAt):
        command, params = MavCmd.DO_ORBIT, (order.radius_m, NAN, NAN, NAN)
    else:
        command, params = MavCmd.DO_REPOSITION, (OWN_SPEED, CHANGE_MODE, NAN, NAN)
    return CommandRequest(
        command,
        (*params, NAN, NAN, altitude_m),
        timeout_s=TIMEOUT_S,
        attempts=1,
        place=(round(latitude * 1e7), round(longitude * 1e7)),
    )
