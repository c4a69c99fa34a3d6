"""The course of a flight: mission items, mission_state, landed_state, vtol_state, mode and arming, and their times."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from app.simulator.compare.heard import Dialogue, Heard
from app.simulator.compare.judging.alignment import align, late
from app.simulator.compare.judging.verdict import Verdict
from app.simulator.compare.sides import stands

ARMED = 128
AUTOPILOT_PX4 = 12
CURRENT_PERIOD_S = 1.02
"""As recorded: 1.01 to 1.02 s from one MISSION_CURRENT to the next."""


@dataclass(frozen=True, slots=True)
class _Aspect:
    name: str
    message: str
    period_s: float
    value: Callable[[Heard], str | None]


def _field(field: str) -> Callable[[Heard], str | None]:
    return lambda heard: str(heard.fields[field])


def _plan(heard: Heard) -> str:
    fields = heard.fields
    ids = f"{fields['mission_id']}, fence {fields['fence_id']}, rally {fields['rally_points_id']}"
    return f"{fields['total']} items, id {ids}"


def _mode(heard: Heard) -> str | None:
    fields = heard.fields
    if fields["autopilot"] != AUTOPILOT_PX4:
        return None  # of another ground station, forwarded
    mode = fields["custom_mode"]
    return f"mode {mode >> 16 & 0xFF}.{mode >> 24}{' armed' if fields['base_mode'] & ARMED else ''}"


ASPECTS = (
    _Aspect("mission items reached", "MISSION_ITEM_REACHED", 1.0, _field("seq")),
    _Aspect("current mission item", "MISSION_CURRENT", CURRENT_PERIOD_S, _field("seq")),
    _Aspect("mission_state", "MISSION_CURRENT", CURRENT_PERIOD_S, _field("mission_state")),
    _Aspect("stored mission", "MISSION_CURRENT", CURRENT_PERIOD_S, _plan),
    _Aspect("mission_mode", "MISSION_CURRENT", CURRENT_PERIOD_S, _field("mission_mode")),
    _Aspect("landed_state", "EXTENDED_SYS_STATE", 0.2, _field("landed_state")),
    _Aspect("vtol_state", "EXTENDED_SYS_STATE", 0.2, _field("vtol_state")),
    _Aspect("mode and arming", "HEARTBEAT", 1.0, _mode),
)


def judge_progress(recorded: Dialogue, simulated: Dialogue) -> Iterator[Verdict]:
    """One verdict for each aspect on the order of values, one on their times."""
    acts = (recorded.acts_s(), simulated.acts_s())
    for aspect in ASPECTS:
        ours = stands(recorded.broadcast(aspect.message), aspect.value)
        theirs = stands(simulated.broadcast(aspect.message), aspect.value)
        if not ours and not theirs:
            continue
        alignment = align(ours, theirs)
        yield Verdict(aspect.name, len(ours), alignment.differences)
        yield Verdict(f"{aspect.name}: times", len(alignment.pairs), tuple(late(alignment, aspect.period_s, acts)))
