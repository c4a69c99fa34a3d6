"""The flown items of each recorded mission do not depend on the order in which a vehicle's messages are handled.

MISSION_CURRENT and MISSION_ITEM_REACHED of real flights are fed again: each kind in its own order, but late by up to a
second, some repeated, some lost (never all of a run of repeats, which PX4 sends so that one arrives).
"""

from __future__ import annotations

import gzip
import json
import random
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import pytest

from app.domain.flight.progress import MissionProgress
from app.domain.mission import MavCmd, MavFrame, Mission, MissionItem
from app.vehicles.link_watch import ItemVisits
from tests.support.paths import DATA

TRACES = DATA / "traces"
KINDS: Final = {"MISSION_CURRENT": "current", "MISSION_ITEM_REACHED": "reached"}
DELAYS_S: Final = (0.0, 0.3, 0.6, 0.99)
SEEDS: Final = 50


@dataclass(frozen=True)
class Told:
    """One message of a flight, at recorded seconds."""

    at_s: float
    kind: str
    seq: int


@dataclass(frozen=True)
class Flight:
    """A mission and what was told while it was flown, `speed` times as fast as real time."""

    mission: Mission
    told: tuple[Told, ...]
    speed: float


def flights(path: Path) -> Iterator[Flight]:
    """Each mission that was flown in Mission mode, as it was uploaded last."""
    with gzip.open(path, "rt") as lines:
        header = json.loads(next(lines))
        rows = [json.loads(line) for line in lines if "MISSION_" in line or "HEARTBEAT" in line]
    items: dict[int, dict[str, Any]] = {}
    uploads: dict[int, dict[int, dict[str, Any]]] = {}
    told: dict[int, list[Told]] = {}
    mode, mission_id = "", 0
    for row in rows:
        name, fields = row.get("name"), row.get("f") or {}
        is_mission = fields.get("mission_type", 0) == 0
        if row["dir"] == "tx" and name == "MISSION_COUNT" and is_mission:
            items = {}
        elif row["dir"] == "tx" and name in {"MISSION_ITEM_INT", "MISSION_ITEM"} and is_mission:
            items[fields["seq"]] = fields
        elif row["dir"] != "rx" or row.get("link"):
            continue
        elif name == "MISSION_ACK" and fields["type"] == 0 and is_mission and fields.get("opaque_id"):
            uploads[fields["opaque_id"]] = dict(items)
        elif name == "HEARTBEAT":
            mode = str((row.get("x") or {}).get("mode") or mode)
        elif name in KINDS:
            mission_id = fields.get("mission_id") or mission_id
            ends = mission_id in told and fields["seq"] == max(uploads.get(mission_id, [0]))  # in Return mode, or Hold
            if mission_id and ("MISSION" in mode or ends):
                told.setdefault(mission_id, []).append(Told(row["t"], KINDS[name], fields["seq"]))
    for which, messages in told.items():
        if uploads.get(which) and any(one.kind == "reached" for one in messages):
            yield Flight(mission(uploads[which]), tuple(messages), float(header.get("speed_factor") or 1.0))


def mission(items: dict[int, dict[str, Any]]) -> Mission:
    """One plan item for each mission item."""
    known = set(MavCmd)
    commands = [MavCmd(items[seq]["command"]) if items[seq]["command"] in known else None for seq in sorted(items)]
    return Mission(
        items=tuple(
            MissionItem(
                seq, MavFrame.MISSION, command or MavCmd.NAV_WAYPOINT, param1=float(items[seq].get("param1") or 0.0)
            )
            for seq, command in enumerate(commands)
        ),
        plan_item_of={seq: f"item {seq}" for seq in range(len(commands))},
    )


def flown(flight: Flight, told: tuple[Told, ...], looks: random.Random | None = None) -> tuple[str, ...]:
    """The flown items; `looks`: now and then the vehicle's state is looked at, which shows the newest current item."""
    returns = flight.mission.items[-1].command is MavCmd.NAV_RETURN_TO_LAUNCH
    progress, visits, newest = MissionProgress.of(flight.mission), ItemVisits(), None
    for one in told:
        is_current = one.kind == "current"
        reached = visits.now_current(one.seq) if is_current else one.seq if visits.reached(one.seq, one.at_s) else None
        if reached is not None:
            progress = progress.begun(reached) if returns and reached == progress.last_seq else progress
            progress = progress.reached(reached)
        if is_current:
            newest = one.seq
            progress = progress.now_current(one.seq)
        if looks is not None and newest is not None and looks.random() < 0.5:
            progress = progress.now_current(newest)
    return progress.flown


def disturbed(flight: Flight, chance: random.Random) -> tuple[Told, ...]:
    """The same messages, late, repeated and lost."""
    received: list[Told] = []
    for kind in KINDS.values():
        last_s = 0.0
        for _, repeats in groupby((one for one in flight.told if one.kind == kind), key=lambda one: one.seq):
            every = list(repeats)
            for one in [one for one in every if chance.random() > 0.15] or every[-1:]:
                last_s = max(last_s + 1e-6, one.at_s + chance.choice(DELAYS_S) / flight.speed)
                received += [Told(last_s, kind, one.seq)] * (2 if chance.random() < 0.1 else 1)
    return tuple(sorted(received, key=lambda one: one.at_s))


RECORDED = [
    pytest.param(flight, id=f"{path.name.partition('.')[0]}-{n}")
    for path in sorted(TRACES.glob("*.jsonl.gz"))
    for n, flight in enumerate(flights(path))
]


def test_there_are_recorded_missions() -> None:
    assert len(RECORDED) >= 10, "the law below would hold of nothing"


@pytest.mark.parametrize("flight", RECORDED)
def test_flown_items_do_not_depend_on_the_order_of_messages(flight: Flight) -> None:
    expected = flown(flight, flight.told)
    assert expected
    for seed in range(SEEDS):
        chance = random.Random(seed)
        assert flown(flight, disturbed(flight, chance), chance) == expected, f"seed {seed}"
