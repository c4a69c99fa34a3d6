"""A gripper that no output moves: checked, flown and told as what it is (recording 29)."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import aiohttp

from tests.support.forked_service import ForkedService
from tests.support.paths import PLANS, ROOT
from tests.support.patient_drops import patient
from tests.support.service_process import Dispatcher
from tests.support.simulated import SimulatedFleet

WAYDROP = Path(sys.executable).with_name("waydrop")


async def waydrop(*arguments: str) -> tuple[int, str]:
    return await asyncio.to_thread(_waydrop, arguments)


def _waydrop(arguments: tuple[str, ...]) -> tuple[int, str]:
    done = subprocess.run([WAYDROP, *arguments], cwd=ROOT, capture_output=True, text=True, timeout=480, check=False)
    return done.returncode, done.stdout + done.stderr


async def test_a_gripper_without_an_output_is_warned_of_and_never_told_as_plainly_delivered(
    tmp_path: Path, http: aiohttp.ClientSession
) -> None:
    plan = tmp_path / "plan.json"
    plan.write_text(json.dumps(patient(json.loads((PLANS / "clinic-run.json").read_text()))))
    with (
        SimulatedFleet("quad", speed=4.0, params="PWM_MAIN_FUNC5=0") as fleet,
        ForkedService(tmp_path, fleet.connections) as service,
    ):
        await Dispatcher(http, service.url).until_vehicles(1, 180.0)
        to = ("--vehicle", "v1", "--server", service.url)
        status, said = await waydrop("validate", str(plan), *to)
        assert (status, "gripper.no_output" in said) == (0, True), said
        status, said = await waydrop("fly", str(plan), *to, "--certainty", "sensed", "--json")
        last: dict[str, Any] = json.loads(said.strip().splitlines()[-1])
        assert (status, last["achieved"]) == (1, False)
        assert "no movement of an output was observed" in last["reasons"][0]
        drop = last["run"]["drops"][0]
        assert (drop["outcome"], drop["certainty"]) == ("released", "acknowledged")
        assert drop["output_evidence"] == "not_assigned"
        async with http.get(f"{service.url}/api/v1/runs/{last['run']['id']}/delivery-report.html") as sheet:
            assert "by acknowledgement only: no movement of the output was observed" in await sheet.text()
