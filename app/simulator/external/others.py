"""What a vehicle may carry besides gripper and winch. A camera takes a picture on command, and reports it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Final

from app.simulator.dialect import Message, mavlink
from app.simulator.external.component import Answer, Mount, Params4, PayloadComponent
from app.simulator.wire import Cmd, Result

CAMERA_COMPONENT = 100
"""MAV_COMP_ID_CAMERA."""
MAV_TYPE_CAMERA = 30
CAPTURED = 1


class Camera:
    """Hears the shot of PX4's navigator (DO_DIGICAM_CONTROL) and takes a picture at once."""

    component_id = CAMERA_COMPONENT
    mav_type = MAV_TYPE_CAMERA
    command = int(Cmd.DO_DIGICAM_CONTROL)

    def __init__(self, mount: Mount) -> None:
        self._mount = mount
        self._taken = 0

    def execute(self, params: Params4, answer: Answer) -> None:
        """One picture, straight down from where the vehicle is."""
        answer(Result.ACCEPTED)
        self._taken += 1
        self._mount.radio.broadcast(self._captured(), CAMERA_COMPONENT)

    def step(self) -> None:
        """It takes no time."""

    def status(self) -> Message | None:
        """Nothing but its heartbeat."""
        return None

    def _captured(self) -> Message:
        mount, body = self._mount, self._mount.state.body
        latitude_deg, longitude_deg = mount.frame.to_global(body.north_m, body.east_m)
        above_mm, amsl_mm = round(body.up_m * 1e3), round((mount.frame.altitude_m + body.up_m) * 1e3)
        return mavlink.MAVLink_camera_image_captured_message(
            time_boot_ms=round(mount.clock.now_s * 1e3),
            time_utc=0,
            camera_id=0,
            lat=round(latitude_deg * 1e7),
            lon=round(longitude_deg * 1e7),
            alt=amsl_mm,
            relative_alt=above_mm,
            q=[math.cos(body.yaw_rad / 2), 0.0, 0.0, math.sin(body.yaw_rad / 2)],
            image_index=self._taken,
            capture_result=CAPTURED,
            file_url=f"mavlinkftp:/DCIM/{self._taken:04d}.jpg".encode(),
        )


OTHERS: Final[Mapping[str, Callable[[Mount], PayloadComponent]]] = {"camera": Camera}
"""By its key in --fleet."""
