"""A geofence on board, as a download returns it."""

from __future__ import annotations

from app.domain.geo import LocalProjection
from app.domain.mission import MavCmd, MavFrame, MissionItem, MissionType

MIDDLE = LocalProjection(47.397742, 8.545594)


def square(half_m: float = 50.0, kind: str = "INCLUSION") -> tuple[MissionItem, ...]:
    """A square around the home of the tests' vehicles."""
    corners = [MIDDLE.to_global(east * half_m, north * half_m) for east, north in ((-1, -1), (-1, 1), (1, 1), (1, -1))]
    return tuple(
        MissionItem(
            seq, MavFrame.GLOBAL_RELATIVE_ALT_INT, MavCmd[f"NAV_FENCE_POLYGON_VERTEX_{kind}"], 4.0, 0.0, 0.0, 0.0,
            x=round(latitude * 1e7), y=round(longitude * 1e7), mission_type=MissionType.FENCE,
        )
        for seq, (latitude, longitude) in enumerate(corners)
    )  # fmt: skip
