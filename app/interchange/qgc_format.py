"""The structure of a QGroundControl .plan file, from its documentation and source (plan version 1)."""

from __future__ import annotations

from typing import Final

FILE_TYPE: Final = "Plan"
PLAN_VERSION: Final = 1
MISSION_VERSION: Final = 2
FENCE_VERSION: Final = 2
FENCE_PART_VERSION: Final = 1
RALLY_VERSION: Final = 2
ARDUPILOT: Final = 3
PX4: Final = 12
"""MAV_AUTOPILOT values."""

EXTRA: Final = "waydrop"
"""The key of Waydrop's objects in a .plan. QGroundControl ignores unknown keys."""
EXTRA_VERSION: Final = 1

PLAN_KEYS: Final = frozenset({"fileType", "geoFence", "groundStation", "mission", "rallyPoints", "version", EXTRA})
MISSION_KEYS: Final = frozenset(
    {"cruiseSpeed", "firmwareType", "globalPlanAltitudeMode", "hoverSpeed", "items", "plannedHomePosition"}
    | {"vehicleType", "version"}
)
ITEM_KEYS: Final = frozenset(
    {"AMSLAltAboveTerrain", "Altitude", "AltitudeMode", "autoContinue", "command", "doJumpId", "frame", "params"}
    | {"type", "MISSION_ITEM_ID", EXTRA}
)
LANDING_KEYS: Final = frozenset(
    {"altitudesAreRelative", "complexItemType", "landCoordinate", "landingApproachCoordinate", "loiterClockwise"}
    | {"loiterRadius", "stopTakingPhotos", "stopVideoPhotos", "type", "useLoiterToAlt", "valueSetIsDistance"}
    | {"version", "MISSION_ITEM_ID", "useDoChangeSpeed", "finalApproachSpeed"}
)
ALTITUDE_RELATIVE: Final = 1
ALTITUDE_ABSOLUTE: Final = 2
ALTITUDE_ABOVE_TERRAIN: Final = 3
"""AltitudeMode: 0 is mixed, 3 an AMSL altitude that was computed from a height above terrain, 4 the terrain frame."""
