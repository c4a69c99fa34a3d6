"""What PX4 does by itself when the stream of setpoints stops, by its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from app.domain.setpoint.audit import AuditEntry

LOSS_ACTIONS: Final[Mapping[int, str]] = {
    0: "position mode",
    1: "altitude mode",
    2: "stabilized mode",
    3: "return",
    4: "land",
    5: "hold",
    6: "terminate",
    7: "disarm",
}
"""COM_OBL_RC_ACT."""
SAFE_ACTIONS: Final = frozenset({3, 4, 5})
NEEDS_STICKS: Final = frozenset({0, 1, 2})
AUDITED: Final = (
    "COM_OBL_RC_ACT",
    "COM_OF_LOSS_T",
    "COM_RC_IN_MODE",
    "COM_RC_OVERRIDE",
    "COM_RC_STICK_OV",
    "COM_RCL_EXCEPT",
    "NAV_DLL_ACT",
)
AUDITED_COMMANDED: Final = ("NAV_LOITER_RAD", "COM_RC_IN_MODE", "COM_RC_OVERRIDE", "NAV_DLL_ACT")
"""Of a wing that is flown by commands: there is no stream that could be lost."""
LONGEST_LOSS_S: Final = 2.0


def commanded_entry(name: str, value: float | int | None, _sticks_held: bool) -> AuditEntry:
    """For a wing that is flown by commands, in Hold: nothing blocks, for what it falls back to is the mode it is in."""
    if name == "NAV_LOITER_RAD" and value is not None:
        return AuditEntry(name, value, False, "metres: without us it circles so at the place it was last sent to")
    if name == "COM_RC_OVERRIDE" and value is not None:
        word = "sticks take over in Hold" if int(value) & 1 else "sticks take over by a mode switch alone"
        return AuditEntry(name, value, False, f"bit 0: {word}")
    return entry(name, value, False)


def entry(name: str, value: float | int | None, sticks_held: bool) -> AuditEntry:
    """For a vehicle that follows a stream."""
    if name == "COM_OBL_RC_ACT":
        return _loss_action(value, sticks_held=sticks_held)
    if name == "COM_OF_LOSS_T":
        slow = value is None or value > LONGEST_LOSS_S
        return AuditEntry(name, value, False, "seconds after the last setpoint" + (": that is long" if slow else ""))
    meanings = {
        "COM_RC_IN_MODE": "4: no sticks are listened to" if value == 4 else "sticks are listened to",
        "COM_RC_OVERRIDE": "bit 1: sticks take over in offboard mode"
        if int(value or 0) & 2
        else "sticks take over by a mode switch alone",
        "COM_RC_STICK_OV": "stick movement in per cent that counts",
        "COM_RCL_EXCEPT": "bit 2: loss of RC is ignored in offboard mode"
        if int(value or 0) & 4
        else "loss of RC counts in offboard mode too",
        "NAV_DLL_ACT": "0: a lost ground station is ignored" if value == 0 else "acts on a lost ground station",
    }
    return AuditEntry(name, value, False, "not answered" if value is None else meanings[name])


def _loss_action(value: float | int | None, *, sticks_held: bool) -> AuditEntry:
    name = "COM_OBL_RC_ACT"
    if value is None:
        return AuditEntry(name, None, True, "not answered: what a lost stream does is not known")
    action = int(value)
    word = LOSS_ACTIONS.get(action, "not a known action")
    if action in SAFE_ACTIONS:
        return AuditEntry(name, action, False, f"a lost stream makes it {word}")
    if action in NEEDS_STICKS and sticks_held:
        return AuditEntry(name, action, False, f"a lost stream gives it to the sticks: {word}")
    why = "which needs somebody at the sticks" if action in NEEDS_STICKS else "which is no way to end a flight"
    return AuditEntry(name, action, True, f"a lost stream means {word}, {why}: set it to 3, 4 or 5")
