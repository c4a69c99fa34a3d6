"""Work is made on the page: jobs queued and put in order, plans found and copied, and one next thing to do."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import Any

from playwright.async_api import TimeoutError as PageTimeout
from playwright.async_api import expect

from tests.support.accessibility import violations
from tests.support.dashboard import CLINIC_RUN, Dashboard
from tests.support.scheduled_jobs import IN_YEARS
from tests.support.service_process import until

FIXED_WING = "v3"
CLEAR_MS = 2_000
PATIENCE_S = 60.0


def named(name: str) -> str:
    """The clinic run under another name."""
    return json.dumps({**json.loads(CLINIC_RUN), "name": name})


async def call(board: Dashboard, method: str, path: str, body: Any = None) -> Any:
    """One request of the API, as JSON."""
    answer = await board.page.request.fetch(f"{board.url}/api/v1{path}", method=method, data=body)
    assert answer.ok, await answer.text()
    return await answer.json()


async def cancel(board: Dashboard, *jobs: str) -> None:
    """Leave nothing for the next test."""
    for job in jobs:
        await call(board, "POST", f"/jobs/{job}/cancel", {})


async def test_a_plan_is_queued_for_any_vehicle_whichever_is_selected(idle_page: Dashboard) -> None:
    board, page = idle_page, idle_page.page
    await board.vehicle(FIXED_WING).click()
    await board.write_plan(CLINIC_RUN)
    await expect(page.locator(".check-result").get_by_text("error")).to_be_visible()
    await expect(board.button(f"Upload to {FIXED_WING}")).to_be_disabled()
    await page.get_by_label("Wind from, degrees").fill("270")
    await page.get_by_label("Wind speed").fill("3")
    await page.get_by_text("Queue as a job").click()
    form = page.get_by_role("form", name="Queue as a job")
    await form.get_by_label("Priority").fill("high")
    await expect(form.get_by_text("Enter a whole number")).to_be_visible()
    await expect(form.get_by_role("button", name="Queue job")).to_be_disabled()
    await form.get_by_label("Priority").fill("-7")
    await form.get_by_label("Latest start").fill(IN_YEARS.removesuffix(":00Z"))
    await form.get_by_label("Flown by").select_option(FIXED_WING)
    await expect(form.get_by_role("status")).to_contain_text("No vehicle can fly this job as it is")
    await form.get_by_label("Flown by").select_option("any")
    await expect(form.get_by_role("status")).to_contain_text("would take this job now")
    assert await violations(page, "a plan to be queued") == []
    async with page.expect_response("**/api/v1/jobs") as answered:
        await form.get_by_role("button", name="Queue job").click()
    job = await (await answered.value).json()
    assert (job["priority"], job["selector"]["vehicle"], job["auto_start"]) == (-7, "any", False), job
    assert job["wind"]["given"]
    assert job["deadline"] > job["created_at"]
    card = page.locator(f'.job[data-job="{job["id"]}"]')
    await expect(card).to_contain_text("Clinic run")
    await expect(page.get_by_role("tab", name="Jobs")).to_have_attribute("aria-selected", "true")
    await cancel(board, job["id"])
    await expect(card).to_have_attribute("data-state", "cancelled")


async def test_waiting_jobs_are_put_in_order_by_drag_and_by_keyboard(idle_page: Dashboard) -> None:
    board, page = idle_page, idle_page.page
    await call(board, "POST", "/job-queues/v2/stop", {})
    made = [
        (await call(board, "POST", "/jobs", {"plan": json.loads(named(name)), "vehicle": "v2"}))["id"] for name in "ABC"
    ]
    await page.get_by_role("tab", name="Jobs").click()
    await board.until_next("Resume the jobs of v2")
    waiting = page.get_by_role("region", name="Queue").locator(".job")

    async def until_order(*names: str) -> None:
        await expect(waiting.locator(".job-head b")).to_have_text(list(names))
        queued = (await call(board, "GET", "/job-queues"))["waiting"]
        assert [job["plan_name"] for job in queued if job["id"] in made] == list(names)

    await until_order("A", "B", "C")
    await waiting.nth(2).locator(".job-head").drag_to(waiting.nth(0))
    await until_order("C", "A", "B")
    await waiting.nth(0).locator(".job-head").drag_to(waiting.nth(1))
    await until_order("A", "C", "B")
    await waiting.nth(0).locator(".job-head").press("Enter")
    await board.button("Move down: “A”").press("Enter")
    await until_order("C", "A", "B")
    await board.button("Move down: “A”").press("Space")
    await until_order("C", "B", "A")
    await expect(board.button("Move down: “A”")).to_be_disabled()
    assert await violations(page, "jobs that can be moved") == []
    await cancel(board, *made)
    await board.hold("Resume the jobs of v2")
    await board.until_next("Queue another plan")


async def test_the_library_finds_duplicates_and_renames_stored_plans(idle_page: Dashboard) -> None:
    board, page = idle_page, idle_page.page
    for name in ("Harbour run", "Clinic again"):
        await call(board, "POST", "/plans", json.loads(named(name)))
    await page.get_by_role("tab", name="Plan").click()
    await board.button("Plan library").click()
    library = page.get_by_role("region", name="Plan library")
    await library.get_by_label("Search").fill("harbour multi")
    await expect(library.locator("li b")).to_have_text(["Harbour run"])
    await board.button("Duplicate “Harbour run”").click()
    await expect(library.locator("li b")).to_have_text(["Harbour run (copy)", "Harbour run"])
    await board.button("Rename “Harbour run (copy)”").click()
    await library.get_by_label("New name").fill("Harbour by night")
    assert await violations(page, "a plan that is renamed") == []
    await library.get_by_label("New name").press("Enter")
    await expect(library.locator("li b").first).to_have_text("Harbour by night")
    await library.locator("li b").first.click()
    await expect(page.get_by_role("heading", name="Harbour by night")).to_be_visible()
    await expect(library).to_have_count(0)


async def set_and_clear_a_fault(board: Dashboard) -> None:
    """The simulator of a busy machine may be silent for longer than the service waits (504): then again."""
    board.tolerated = ("status of 504",)  # Chromium writes it into its console

    async def set_wind() -> int:
        body = {"vehicle": "v4", "fault": "wind", "value": [1, 0]}
        return (await board.page.request.post(f"{board.url}/api/v1/simulator/faults", data=body)).status

    async def clear() -> bool:
        with suppress(PageTimeout):  # what was pressed before has cleared it meanwhile
            await board.button("Clear all faults").click(timeout=CLEAR_MS)
        return await board.button("Plan a flight").is_visible()

    assert await until(set_wind, lambda status: status != 504, "the simulator must answer", PATIENCE_S) == 200
    await board.until_next("Clear all faults")
    await until(clear, lambda is_clear: is_clear, "it must be cleared", PATIENCE_S)
    await board.until_next("Plan a flight")


async def test_each_view_has_one_next_thing_to_do(idle_page: Dashboard) -> None:
    board, page = idle_page, idle_page.page
    for tab, words in (
        ("Plan", "New plan"),
        ("Manual control", "Select v1"),
        ("Simulator", "Plan a flight"),
    ):
        await page.get_by_role("tab", name=tab, exact=True).click()
        await board.until_next(words)
    await set_and_clear_a_fault(board)
    await board.button("Plan a flight").click()
    await board.fill_plan(CLINIC_RUN)
    await board.until_next("Upload to v1")
    await page.get_by_role("tab", name="Manual control").click()
    await board.until_next("Take the lease of v1")
