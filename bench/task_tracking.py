"""How well tasks are flown: metres beside the course, of the vehicle's true place, by task and wind.

Usage: python -m bench.task_tracking [--vehicle quad|plane] [--winds 0,5] [--speed 5]

A simulated multicopter, by setpoints, or a plane on PX4 v1.14, by commands, flies a circle, a segment and a path from
the task queue at real time, the multicopter then a goto: how far from its place it rests. The first metres of each,
where it joins the course, and the corners of the path are left out. Exit status 1 if 5 % of the looks were farther
beside, without wind, than 0.5 m on the circle and 0.7 m on the legs, or the multicopter ended a goto farther away than
0.5 m; or if it was ever farther beside: the multicopter than 1 m without wind or 2 m with it, the plane than 5 m.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import aiohttp

from app.domain.offboard.tasks.admission import course_of
from app.domain.offboard.tasks.course import Course, EkfOrigin, Ground, LegsCourse
from bench.table import print_line
from tests.support.offboard_client import truth
from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, ServiceProcess, until
from tests.support.simulated import SimulatedFleet
from tests.support.task_examples import task_of
from tests.support.task_flights import OFFBOARD, TASKS, renewed

RESTS_S: Final = 8.0


@dataclass(frozen=True)
class Subject:
    """A vehicle, what it flies, and how far beside it may be without wind and with it."""

    airframe: str
    firmware: str
    plan: str
    most_m: tuple[float, float]
    patterns: dict[str, dict[str, Any]]
    altitude_m: float
    joined_m: dict[str, float]
    """So near it counts as having joined the course."""
    corner_m: float
    """Near a point of a path there are two courses at once."""
    p95_m: dict[str, float]
    """Without wind."""


def local(*points: tuple[float, float]) -> list[dict[str, float]]:
    """North, east."""
    return [{"north_m": north, "east_m": east} for north, east in points]


def patterns(long_m: float, ends_m: tuple[float, float], radius_m: float, seconds: float) -> dict[str, dict[str, Any]]:
    """The same three, as large as the vehicle needs; the segment from and to `ends_m` north."""
    middle, origin, end = local((long_m / 2.0, 0.0), (ends_m[0], 0.0), (ends_m[1], 0.0))
    return {
        "circle": {"center": middle, "radius_m": radius_m, "duration_s": seconds},
        "segment": {"start": origin, "end": end},
        "path": {"points": local((long_m, 0.0), (long_m, long_m * 0.7), (long_m * 0.25, long_m * 0.7))},
    }


NEAR: Final = {"circle": 0.5, "segment": 0.5, "path": 0.5}
NEAR_WING: Final = {"circle": 3.0, "segment": 1.0, "path": 1.0}
SUBJECTS: Final = {
    "quad": Subject(
        "quad",
        "px4-main",
        "clinic-run.json",
        (1.0, 2.0),
        patterns(80.0, (0.0, 80.0), 20.0, 40.0),
        30.0,
        NEAR,
        6.0,
        {"circle": 0.5, "segment": 0.7, "path": 0.7, "goto": 0.5},
    ),
    "plane": Subject(
        "plane",
        "px4-1.14",
        "fixed-wing-pass.json",
        (5.0, 5.0),
        patterns(600.0, (-400.0, 700.0), 80.0, 70.0),
        50.0,
        NEAR_WING,
        120.0,
        dict.fromkeys(NEAR_WING, 5.0),
    ),
}


async def put(
    dispatcher: Dispatcher, lease: str, subject: Subject, task: dict[str, Any], speed: float
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Queue a task, and enter before the first; the answer, and the task's document."""
    document = {"speed_m_s": speed, "relative_altitude_m": subject.altitude_m, **task}
    queued = await dispatcher.post(TASKS, {"lease": lease, "task": document, "when_empty": "wait"}, expect=201)
    if (await dispatcher.get(OFFBOARD))["offboard"]["state"] == "leased":
        await dispatcher.post(f"{OFFBOARD}/enter", {"lease": lease})
    return queued, document


async def rests_from(
    dispatcher: Dispatcher, fleet: SimulatedFleet, lease: str, subject: Subject, speed: float
) -> float:
    """Metres from a goto's place, once the task is over and the vehicle stands."""
    place = (20.0, 20.0)
    queued, _ = await put(dispatcher, lease, subject, {"type": "goto", "point": local(place)[0]}, speed)
    origin = EkfOrigin(**queued["queue"]["origin"])
    await until(lambda: dispatcher.get(TASKS), lambda queue: not queue["tasks"], "the goto must end", 90)
    await asyncio.sleep(RESTS_S)
    vehicle = await truth(fleet)
    return math.dist(origin.place(vehicle["latitude_deg"], vehicle["longitude_deg"]), place)


async def flown(
    dispatcher: Dispatcher, fleet: SimulatedFleet, lease: str, subject: Subject, kind: str, speed: float
) -> list[float]:
    """Metres beside the course, 20 looks a second, from where it was joined on."""
    queued, document = await put(dispatcher, lease, subject, {"type": kind, **subject.patterns[kind]}, speed)
    origin = EkfOrigin(**queued["queue"]["origin"])
    course = course_of(task_of(document), origin, 0.0)
    beside: list[float] = []
    while (queue := await dispatcher.get(TASKS))["report"]["current_id"] == queued["task_id"]:
        vehicle = await truth(fleet)
        here = origin.place(vehicle["latitude_deg"], vehicle["longitude_deg"])
        leg = queue["tasks"][0]["leg"]
        reference = course.reference(here, leg)
        if not is_at_corner(course, here, subject) and (beside or abs(reference.cross_m) < subject.joined_m[kind]):
            beside.append(abs(reference.cross_m))
        await asyncio.sleep(0.05)
    return beside


def is_at_corner(course: Course, here: Ground, subject: Subject) -> bool:
    """Near a point of a path."""
    return (
        isinstance(course, LegsCourse)
        and len(course.points) > 2
        and min(math.dist(here, point) for point in course.points) < subject.corner_m
    )


async def measured(
    dispatcher: Dispatcher, fleet: SimulatedFleet, lease: str, subject: Subject, speed: float, wind: float
) -> int:
    """All tasks in one wind; how many were too far off."""
    late = 0
    name = f"{subject.airframe}  wind {wind:3.0f} m/s"
    for kind in subject.patterns:
        beside = sorted(await flown(dispatcher, fleet, lease, subject, kind, speed))
        if not beside:
            sys.exit(f"{name}: it never joined the {kind}")
        p50, p95 = beside[len(beside) // 2], beside[int(len(beside) * 0.95)]
        late += beside[-1] > subject.most_m[wind > 0.0] or (wind == 0.0 and p95 > subject.p95_m[kind])
        found = f"p50 {p50:.2f}  p95 {p95:.2f}  max {beside[-1]:.2f} m beside the course"
        print_line(f"{name}  {kind:8} n {len(beside):4}  {found}")
    if most_m := subject.p95_m.get("goto"):
        away_m = await rests_from(dispatcher, fleet, lease, subject, speed)
        late += away_m > most_m
        print_line(f"{name}  goto     ends {away_m:.2f} m from its place")
    return late


async def main(subject: Subject, winds: Sequence[float], speed: float) -> int:
    """All winds; the exit status."""
    late = 0
    with (
        tempfile.TemporaryDirectory() as folder,
        SimulatedFleet(subject.airframe, params="COM_OBL_RC_ACT=5", firmware=subject.firmware) as fleet,
        ServiceProcess(Path(folder), fleet.connections, WAYDROP_OFFBOARD_GAP_S="2.5") as service,
    ):
        async with aiohttp.ClientSession(timeout=aiohttp.ClientTimeout(total=60)) as http:
            dispatcher = Dispatcher(http, service.url)
            await dispatcher.until_vehicles(1)
            plan = {
                name: part
                for name, part in json.loads((PLANS / subject.plan).read_text()).items()
                if name != "geofence"
            }
            run_id = await dispatcher.fly(plan, "v1")
            await until(lambda: truth(fleet), lambda v: v["height_m"] > 12.0, "it must climb", 60)
            await dispatcher.post(f"/runs/{run_id}/pause")
            await dispatcher.until_run(run_id, lambda run: run["state"] == "paused", "it must pause", 30)
            async with renewed(dispatcher) as lease:
                for wind in winds:
                    fleet.control("wind", [0.0, wind])
                    late += await measured(dispatcher, fleet, lease, subject, speed, wind)
    return 1 if late else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vehicle", choices=SUBJECTS, default="quad")
    parser.add_argument("--winds", default="0,5")
    parser.add_argument("--speed", type=float, default=5.0)
    given = parser.parse_args()
    winds = [float(wind) for wind in given.winds.split(",")]
    sys.exit(asyncio.run(main(SUBJECTS[given.vehicle], winds, given.speed)))
