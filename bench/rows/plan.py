"""A plan of 990 items: parsed, checked with its prediction, and compiled; the floor is pydantic's parse of its JSON."""

from __future__ import annotations

import gc
import json
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, Final

from app.domain.plan import Plan, parse_plan
from app.domain.rules import checked
from app.domain.vehicle.state import VehicleProfile, VehicleType
from bench.row import Goal, Pair, Round, Row, Scale

ITEMS: Final = 990
HOME: Final = {"latitude_deg": 47.397742, "longitude_deg": 8.545594, "absolute_altitude_m": 488.0}
COLUMNS: Final = 30
STEP_DEG: Final = 0.0005


def survey(items: int) -> dict[str, Any]:
    """A plan of waypoints to and fro, row after row; every tenth is held at."""
    places: list[dict[str, Any]] = []
    for number in range(items - 2):
        row, column = divmod(number, COLUMNS)
        place = {
            "type": "waypoint",
            "id": f"point-{number}",
            "latitude_deg": HOME["latitude_deg"] + STEP_DEG * (row + 1),
            "longitude_deg": HOME["longitude_deg"] + STEP_DEG * (column if row % 2 == 0 else COLUMNS - 1 - column),
            "relative_altitude_m": 40.0,
        }
        places.append(place | ({"hold_s": 2.0} if number % 10 == 9 else {}))
    takeoff = {"type": "takeoff", "relative_altitude_m": 30.0}
    return {
        "version": 1,
        "name": f"survey of {items} items",
        "vehicle_type": "multicopter",
        "home": HOME,
        "items": [takeoff, *places, {"type": "return_to_launch"}],
    }


def cpu_ms(work: Callable[[], object]) -> float:
    """CPU time of this thread: other processes do not lengthen it."""
    begun_s = time.thread_time()
    work()
    return (time.thread_time() - begun_s) * 1e3


def checking(raw: bytes) -> Callable[[], None]:
    """All that is done with a plan before its upload."""
    facts = VehicleProfile(VehicleType.MULTICOPTER, max_mission_items=2 * ITEMS)

    def work() -> None:
        drafted = checked(parse_plan(raw), facts).drafted
        assert drafted is not None, "the plan has a mission"
        drafted.mission()

    return work


@asynccontextmanager
async def prepared(scale: Scale) -> AsyncIterator[Round]:
    """The same document for both."""
    raw = json.dumps(survey(ITEMS)).encode()
    ours = checking(raw)

    async def measure() -> Pair:
        return Pair(cpu_ms(ours), cpu_ms(lambda: Plan.model_validate_json(raw)))

    await measure()  # what is imported, made and kept at the first call
    gc.freeze()  # as the service does when it has started
    yield measure


ROWS: Final = (
    Row(
        name="plan",
        title="plan of 990 items: parse, check, predict, compile",
        floor="pydantic-core's parse of the same JSON",
        unit="ms CPU",
        goal=Goal(15.0, "at most"),
        prepare=prepared,
        limited_by="Python's own speed: geometry and times of each leg",
        rounds=15,
        long_rounds=60,
    ),
)
