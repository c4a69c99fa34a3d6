"""Plans whose vehicles wait long at a drop: a busy machine may need many seconds to see them wait, and to command."""

from __future__ import annotations

from typing import Any, Final

HOLD_S: Final = 120.0
"""Of vehicle time, half a minute at the tests' speed. A release ends the hold at once, so a flight takes no longer."""


def patient(plan: Any) -> Any:
    """The plan with long holds where its vehicle stops and Waydrop commands a gripper."""
    for item in plan["items"]:
        is_stopped = item["type"] == "gripper" and item["release_motion"] == "stopped"
        if is_stopped and item.get("mode") in (None, "supervised"):
            item["hold_s"] = HOLD_S
    return plan
