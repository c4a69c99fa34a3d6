"""How well tasks are flown: metres beside the course, of the vehicle's true place, by task and wind.

Usage: python -m bench.task_tracking [--winds 0,5] [--speed 5]

A simulated multicopter at real time flies a circle, a segment and a path from the task queue. The first metres of
each, where it joins the course, and the corners of the path are left out. Exit status 1 if it was ever farther beside
than 1 m without wind, or 2 m with it.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import aiohttp

from app.domain.tasks.admission import course_of
from app.domain.tasks.course import Course, Ground, LegsCourse
from app.domain.tasks.forms import TaskDocument
from app.domain.tasks.origin import EkfOrigin
from tests.e2e.by_hand import truth
from tests.e2e.test_tasks import OFFBOARD, TASKS, renewed
from tests.service import Dispatcher, ServiceProcess, until
from tests.simulated import SimulatedFleet

PLAN: Final = Path(__file__).parents[1] / "plans" / "clinic-run.json"
MOST_M: Final = {False: 1.0, True: 2.0}
"""Without wind, with wind."""
JOINED_M: Final = 0.5
CORNER_M: Final = 6.0
WAY: Final = [{"east_m": 0.0, "north_m": 80.0}, {"east_m": 50.0, "north_m": 80.0}, {"east_m": 50.0, "north_m": 20.0}]
PATTERNS: Final[dict[str, dict[str, Any]]] = {
    "circle": {"center": {"east_m": 0.0, "north_m": 40.0}, "radius_m": 20.0, "duration_s": 40.0},
    "segment": {"start": {"east_m": 0.0, "north_m": 0.0}, "end": {"east_m": 0.0, "north_m": 80.0}},
    "path": {"points": WAY},
}


async def flown(dispatcher: Dispatcher, fleet: SimulatedFleet, lease: str, kind: str, speed: float) -> list[float]:
    """Metres beside the course, 20 looks a second, from where it was joined on."""
    document = {"type": kind, "speed_m_s": speed, "relative_altitude_m": 30.0, **PATTERNS[kind]}
    queued = await dispatcher.post(TASKS, {"lease": lease, "task": document, "when_empty": "wait"}, expect=201)
    origin = EkfOrigin(**queued["queue"]["origin"], home_up_m=0.0)
    course, leg = course_of(TaskDocument.model_validate(document).root, origin, 0.0), 0
    if (await dispatcher.get(OFFBOARD))["offboard"]["state"] == "leased":
        await dispatcher.post(f"{OFFBOARD}/enter", {"lease": lease})
    beside: list[float] = []
    while (await dispatcher.get(TASKS))["report"]["current_id"] == queued["task_id"]:
        vehicle = await truth(fleet)
        here = origin.place(vehicle["latitude_deg"], vehicle["longitude_deg"])
        reference = course.reference(here, leg)
        leg = reference.leg
        if not is_at_corner(course, here) and (beside or abs(reference.cross_m) < JOINED_M):
            beside.append(abs(reference.cross_m))
        await asyncio.sleep(0.05)
    return beside


def is_at_corner(course: Course, here: Ground) -> bool:
    """Near a point of a path, where there are two courses at once."""
    return isinstance(course, LegsCourse) and min(math.dist(here, point) for point in course.points) < CORNER_M


async def main(winds: Sequence[float], speed: float) -> int:
    """All winds; the exit status."""
    late = 0
    with (
        tempfile.TemporaryDirectory() as folder,
        SimulatedFleet("quad", params="COM_OBL_RC_ACT=5") as fleet,
        ServiceProcess(Path(folder), fleet.connections) as service,
    ):
        async with aiohttp.ClientSession(timeout=aiohttp.ClientTimeout(total=60)) as http:
            dispatcher = Dispatcher(http, service.url)
            await dispatcher.until_vehicles(1)
            plan = {name: part for name, part in json.loads(PLAN.read_text()).items() if name != "geofence"}
            run_id = await dispatcher.fly(plan, "v1")
            await until(lambda: truth(fleet), lambda v: v["height_m"] > 12.0, "it must climb", 60)
            await dispatcher.post(f"/runs/{run_id}/pause")
            await dispatcher.until_run(run_id, lambda run: run["state"] == "paused", "it must pause", 30)
            async with renewed(dispatcher) as lease:
                for wind in winds:
                    fleet.control("wind", [0.0, wind])
                    for kind in PATTERNS:
                        beside = sorted(await flown(dispatcher, fleet, lease, kind, speed))
                        late += beside[-1] > MOST_M[wind > 0.0]
                        sys.stdout.write(
                            f"wind {wind:3.0f} m/s  {kind:8} at {speed:g} m/s  n {len(beside):4}  "
                            f"p50 {beside[len(beside) // 2]:.2f}  max {beside[-1]:.2f} m beside the course\n"
                        )
                        sys.stdout.flush()
    return 1 if late else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--winds", default="0,5")
    parser.add_argument("--speed", type=float, default=5.0)
    given = parser.parse_args()
    sys.exit(asyncio.run(main([float(wind) for wind in given.winds.split(",")], given.speed)))
