"""The autopilot's storage of missions: two slots, one active; fence and rally beside them. Survives a reboot."""

from __future__ import annotations

from dataclasses import dataclass, field

from app.simulator.mission.item import Item, checksum
from app.simulator.wire import MissionType

LIMITS = {MissionType.MISSION: 10_000, MissionType.FENCE: 64, MissionType.RALLY: 32}
"""SITL's limits; other boards have less."""


@dataclass(frozen=True, slots=True)
class Plan:
    """A stored list and its id (CRC-32 of the content, 0 when empty)."""

    items: tuple[Item, ...] = ()
    plan_id: int = 0

    def __len__(self) -> int:
        return len(self.items)


def plan_of(items: list[Item]) -> Plan:
    """A plan with its id. PX4 computes the id while the items come in; the result is the same."""
    plan_id = 0
    for item in items:
        plan_id = checksum(item, plan_id)
    return Plan(tuple(items), plan_id)


@dataclass(slots=True)
class MissionStore:
    """`mission_serial` and `fence_serial` count changes: the navigator compares them to see that something is new."""

    slots: list[Plan] = field(default_factory=lambda: [Plan(), Plan()])
    active_slot: int = 0
    fence: Plan = field(default_factory=Plan)
    rally: Plan = field(default_factory=Plan)
    current_seq: int = 0
    """The item the next start begins with; written by uploads, set-current and the mission mode."""
    mission_serial: int = 0
    fence_serial: int = 0

    @property
    def mission(self) -> Plan:
        return self.slots[self.active_slot]

    def plan(self, mission_type: int) -> Plan:
        """The list of one type; an unknown type is empty, as PX4 says on download."""
        if mission_type == MissionType.MISSION:
            return self.mission
        if mission_type == MissionType.FENCE:
            return self.fence
        return self.rally if mission_type == MissionType.RALLY else Plan()

    def commit(self, mission_type: int, plan: Plan, start_seq: int = 0) -> None:
        """An upload's last item has come (or a clear: an empty plan)."""
        if mission_type == MissionType.FENCE:
            self.fence = plan
            self.fence_serial += 1
        elif mission_type == MissionType.RALLY:
            self.rally = plan
        else:
            inactive = 1 - self.active_slot
            self.slots[inactive] = plan
            self.active_slot = inactive
            self.current_seq = start_seq
            self.mission_serial += 1

    def clear(self, mission_type: int) -> None:
        for one in MissionType.MISSION, MissionType.FENCE, MissionType.RALLY:
            if mission_type in (one, MissionType.ALL):
                self.commit(one, Plan())
