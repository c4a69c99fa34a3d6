"""The page, the command line, jobs and REST say the same of plans near the limits, for real simulated vehicles."""

from __future__ import annotations

import asyncio
import json
import re
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from playwright.async_api import expect
from typer.testing import CliRunner

from app.cli.main import app
from tests.support.dashboard import Dashboard
from tests.support.near_the_limits import PLANS, NearTheLimits
from tests.support.plan_pieces import Json, plan_json, waypoint

NAMES = ("takeoff to 3 m", "takeoff to 0 m", "no home, two kinds of altitude", "13 m/s", "a drop within 30 m")
"""A page costs seconds; tests/api/test_same_findings_everywhere.py asks the rest, and vehicles that these are not."""
VEHICLE_OF = {"multicopter": "v1", "fixed_wing": "v3"}


@pytest.mark.parametrize("near", [near for near in PLANS if near.name in NAMES], ids=str)
async def test_of_a_vehicle(idle_page: Dashboard, tmp_path: Path, near: NearTheLimits) -> None:
    document = {**near.document, "name": str(near)}
    vehicle = VEHICLE_OF[document["vehicle_type"]]
    rest = await _errors(idle_page, "/plan-checks", plan=document, vehicle=vehicle)
    expected = {near.never} if near.never else rest
    assert rest == expected <= {near.never, near.depends}

    await idle_page.write_plan(json.dumps(document))
    await expect(idle_page.page.get_by_role("heading", name=str(near))).to_be_visible()
    await idle_page.page.locator(".send").get_by_label("Vehicle").select_option(vehicle)
    result = idle_page.page.locator(".check-result")
    await expect(result).to_have_attribute("aria-busy", "false")
    await expect(result).to_contain_text(re.compile(r"\d errors?") if expected else "Can be flown")
    for code in expected:
        await expect(idle_page.page.get_by_text(code, exact=True).first).to_be_attached()

    file = tmp_path / "plan.json"
    file.write_text(json.dumps(document), encoding="utf-8")
    options = ["validate", str(file), "--vehicle", vehicle, "--server", idle_page.url, "--json"]
    checked = await asyncio.to_thread(CliRunner().invoke, app, options)
    assert _codes(json.loads(checked.stdout)["findings"]) == expected
    if not near.never:
        (candidate,) = (
            one
            for one in (await _post(idle_page, "/job-checks", plan=document, vehicle=vehicle))["candidates"]
            if one["vehicle_id"] == vehicle
        )
        assert expected <= {refusal["code"] for refusal in candidate["refusals"]}


async def test_without_a_vehicle_the_page_says_that_it_depends(idle_page: Dashboard) -> None:
    """There is no rover in the fleet, so none is chosen."""
    fast: Json = plan_json("rover", waypoint(30, 0, 0, speed_m_s=4), name="fast rover")
    await idle_page.write_plan(json.dumps(fast))
    await expect(idle_page.page.locator(".check-result")).to_have_text(re.compile("1 warning.*Depends on the vehicle"))
    note = idle_page.page.locator(".finding").filter(has_text="Depends on the vehicle: 4 m/s").first
    await expect(note).to_contain_text("Assumed: RO_SPEED_LIM")
    assert await _errors(idle_page, "/plan-checks", plan=fast) == set()


async def _errors(page: Dashboard, path: str, **body: Any) -> set[str]:
    return _codes((await _post(page, path, **body))["findings"])


async def _post(page: Dashboard, path: str, **body: Any) -> Any:
    async with aiohttp.ClientSession() as http, http.post(f"{page.url}/api/v1{path}", json=body) as answer:
        assert answer.status == 200, await answer.text()
        return await answer.json()


def _codes(findings: list[Any]) -> set[str]:
    return {found["code"] for found in findings if found["severity"] == "error"}
