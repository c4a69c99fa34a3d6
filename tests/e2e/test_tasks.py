"""A program flies tasks with the vehicle of a paused run, and the run goes on; or the program goes away: Hold."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import aiohttp

from tests.support.forked_service import ForkedService
from tests.support.offboard_client import paused_in_the_air, truth
from tests.support.offboard_flights import GAP_S, RETURNS, in_mode
from tests.support.paths import PLANS
from tests.support.reasons import words
from tests.support.service_process import Dispatcher, until
from tests.support.simulated import SimulatedFleet
from tests.support.task_flights import OFFBOARD, TASKS, renewed

CORNERS = [{"east_m": 0.0, "north_m": 30.0}, {"east_m": 10.0, "north_m": 30.0}, {"east_m": 10.0, "north_m": 20.0}]
QUEUE: list[dict[str, Any]] = [
    {"type": "goto", "point": {"east_m": 0.0, "north_m": 15.0}, "relative_altitude_m": 20.0, "gripper": "grab"},
    {"type": "circle", "center": {"east_m": 0.0, "north_m": 15.0}, "radius_m": -10.0, "duration_s": 2.0},
    {"type": "segment", "start": {"east_m": 0.0, "north_m": 10.0}, "end": {"east_m": 0.0, "north_m": 30.0}},
    {"type": "path", "points": CORNERS},
]


async def test_a_queue_is_flown_and_control_goes_back_to_the_plan_and_a_client_that_goes_away_is_hold(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    with (
        SimulatedFleet("quad", speed=4.0, params=RETURNS) as simulated,
        ForkedService(tmp_path, simulated.connections, WAYDROP_OFFBOARD_GAP_S=str(GAP_S)) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        run_id = await paused_in_the_air(dispatcher)
        async with renewed(dispatcher) as lease:
            for task in QUEUE:
                await dispatcher.post(TASKS, {"lease": lease, "task": task}, expect=201)
            assert (await dispatcher.get(TASKS))["report"]["task_list"] == [1, 2, 3, 4]
            await dispatcher.post(f"{OFFBOARD}/enter", {"lease": lease})
            await until(
                lambda: dispatcher.get(TASKS), lambda v: v["report"]["task_list"] == [0], "all tasks must end", 90
            )
        await dispatcher.until_run(run_id, lambda run: run["state"] == "flying", "the run must go on", 20)
        events = (await dispatcher.get("/events?after=0&limit=500"))["events"]
        said = [event["data"] for event in events if event["kind"].startswith("task.")]
        ends = [(data["change"], data["task_list"]) for data in said if data.get("change", "inserted") != "inserted"]
        assert ends == [("gripper_done", [2, 3, 4]), ("time_over", [3, 4]), ("reached", [4]), ("reached", [0])]
        assert [data["outcome"] for data in said if "outcome" in data] == ["sent", "done"]
        await dispatcher.post(f"/runs/{run_id}/pause")
        await dispatcher.until_run(run_id, lambda run: run["state"] == "paused", "it must pause", 20)
        async with renewed(dispatcher) as lease:
            await dispatcher.post(TASKS, {"lease": lease, "task": {**QUEUE[1], "duration_s": -1.0}}, expect=201)
            await dispatcher.post(f"{OFFBOARD}/enter", {"lease": lease})
            await in_mode(simulated, "OFFBOARD", "it must fly its task")
        await in_mode(simulated, "LOITER", "a client that renews nothing is Hold, not the vehicle's own failsafe")
        report = (await dispatcher.get(TASKS))["report"]
        assert (report["task_list"], report["state"]) == ([0], "idle")
        assert "not renewed" in words(report["reason"])


LEGS_M = (400.0, 200.0, -100.0, 200.0)
"""For 15 s of the machine's time: one that stands still for a while must not miss the path that is to be paused."""
WING_QUEUE: list[dict[str, Any]] = [
    {"type": "goto", "point": {"east_m": 0.0, "north_m": 350.0}, "relative_altitude_m": 50.0},
    {"type": "circle", "center": {"east_m": 0.0, "north_m": 350.0}, "radius_m": -60.0, "duration_s": 2.0},
    {"type": "path", "points": [{"east_m": 0.0, "north_m": north} for north in LEGS_M]},
]


def metres_from(place: dict[str, Any], vehicle: dict[str, Any]) -> float:
    north, east = (vehicle[name] - place[name] for name in ("latitude_deg", "longitude_deg"))
    return 111_195.0 * math.hypot(north, east * math.cos(math.radians(place["latitude_deg"])))


async def fly_and_pause(dispatcher: Dispatcher, simulated: SimulatedFleet) -> None:
    """All of the queue, the path with a pause; control goes back."""
    async with renewed(dispatcher) as lease:
        for task in WING_QUEUE:
            await dispatcher.post(TASKS, {"lease": lease, "task": task}, expect=201)
        entered = await dispatcher.post(f"{OFFBOARD}/enter", {"lease": lease})
        assert (entered["offboard"]["control_method"], (await truth(simulated))["mode"]) == ("commands", "LOITER")
        queue = await until(
            lambda: dispatcher.get(TASKS), lambda v: v["report"]["task_list"] == [4], "the path must come", 90
        )
        assert queue["control_method"] == "commands"
        await dispatcher.post(f"{TASKS}/pause", {"lease": lease})
        offboard = (await dispatcher.get(OFFBOARD))["offboard"]
        assert (offboard["tasks"]["state"], offboard["command"]["command"]) == ("paused", "DO_REPOSITION")
        await dispatcher.post(f"{TASKS}/resume", {"lease": lease})
        await until(lambda: dispatcher.get(TASKS), lambda v: v["report"]["task_list"] == [0], "the path must end", 90)


async def entered_with_a_circle(dispatcher: Dispatcher, lease: str) -> None:
    """Without an end, wherever the wing is."""
    await dispatcher.post(TASKS, {"lease": lease, "task": {**WING_QUEUE[1], "duration_s": -1.0}}, expect=201)
    await dispatcher.post(f"{OFFBOARD}/enter", {"lease": lease})


async def test_a_plane_whose_firmware_follows_no_path_point_is_flown_by_commands_in_hold(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    plan = {k: v for k, v in json.loads((PLANS / "fixed-wing-pass.json").read_text()).items() if k != "geofence"}
    with (
        SimulatedFleet("plane", speed=4.0, firmware="px4-1.14") as simulated,
        ForkedService(tmp_path, simulated.connections, WAYDROP_OFFBOARD_GAP_S=str(GAP_S)) as service,
    ):
        dispatcher = Dispatcher(http, service.url)
        run_id = await paused_in_the_air(dispatcher, plan)
        await fly_and_pause(dispatcher, simulated)
        await dispatcher.until_run(run_id, lambda run: run["state"] == "flying", "the run must go on", 20)
        await dispatcher.post(f"/runs/{run_id}/pause")
        await dispatcher.until_run(run_id, lambda run: run["state"] == "paused", "it must pause", 20)
        async with renewed(dispatcher) as lease:
            await entered_with_a_circle(dispatcher, lease)
            await dispatcher.post(f"/runs/{run_id}/pause")
        ended = await until(
            lambda: dispatcher.get(OFFBOARD),
            lambda v: v["offboard"]["command"]["result"] == "ACCEPTED",
            "somebody else's Hold ends it, though the mode is the same",
            20,
        )
        assert (ended["offboard"]["lease"], ended["offboard"]["command"]["latitude_deg"]) == (None, None), ended
        async with renewed(dispatcher) as lease:
            await entered_with_a_circle(dispatcher, lease)
            ordered = await until(
                lambda: dispatcher.get(OFFBOARD),
                lambda v: (v["offboard"]["command"] or {}).get("latitude_deg") is not None,
                "the circle is flown",
                30,
            )
            service.kill()
        place = ordered["offboard"]["command"]
        there = "it goes to where it was last sent, and round it"
        circles = await until(lambda: truth(simulated), lambda v: metres_from(place, v) < 100.0, there, 60)
        assert circles["mode"] == "LOITER", "and circles there in Hold: no failsafe is needed"
