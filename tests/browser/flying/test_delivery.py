"""A delivery from the page: paste, upload, start, watch the drop; with a reload and with a killed service under way."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Final

from playwright.async_api import Route, expect

from tests.support.accessibility import PHONE, violations
from tests.support.dashboard import CLINIC_RUN, FLIGHT_MS, HOLD_MS, SERVICE_LOST, Dashboard, waiting_run
from tests.support.paths import ROOT
from tests.support.service_process import ServiceProcess, until

VEHICLES = 3

HISTORY = 200
"""Events that a new page asks for (web/src/store/world.ts)."""
UNDER_WAY = ("starting", "flying", "at_drop", "returning")


async def test_a_delivery_flies_from_the_page_over_a_reload_until_the_drop_is_released_and_proven(
    flying_page: Dashboard, tmp_path: Path
) -> None:
    await flying_page.upload(CLINIC_RUN, "v1")
    assert await flying_page.tap("Start v1") == "Hold to start v1"  # too short to be meant
    await flying_page.until_state("uploaded")

    scale = flying_page.page.locator(".map-scale")
    while not (await scale.inner_text()).endswith("km"):
        await flying_page.button("Zoom out").click()
    await flying_page.hold("Start v1")
    await flying_page.until_state(*UNDER_WAY, "landed", "completed")  # a busy machine may miss the first of them
    await expect(scale).to_have_text(re.compile(r"^\d+ m$"))  # the flight is brought into view
    await shows_the_same_after_a_reload(flying_page)
    card = flying_page.page.get_by_role("article", name="Drop drop")
    await expect(card.locator(".badge")).to_have_text("Released", timeout=FLIGHT_MS)
    evidence = dict(zip(("commanded", "acknowledged", "output", "sensed"), await card.locator("li").all(), strict=True))
    for name in ("commanded", "acknowledged", "output"):
        await expect(evidence[name].locator("time")).to_be_visible()
    await expect(evidence["sensed"]).to_contain_text("no sensor report")  # PX4's grippers have none

    await flying_page.until_state("completed")
    await tells_the_run_on_one_screen(flying_page)
    await expect(flying_page.page.locator(".plan-item.done")).to_have_count(5)
    await expect(flying_page.page.locator(".steps .done")).to_have_count(5)

    async with flying_page.page.expect_download() as saving:
        await flying_page.button("Save delivery report").click()
    saved = await saving.value
    assert saved.suggested_filename.startswith("delivery-report-run-")
    await saved.save_as(tmp_path / "report.html")
    sheet = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert '<p class="outcome">released</p>' in sheet
    shown = await flying_page.page.context.new_page()
    await shown.goto((tmp_path / "report.html").as_uri())
    assert await violations(shown, "the delivery report") == []
    await shown.close()
    await attach_a_photo_and_what_is_none(flying_page, tmp_path)


FEED_LINES: Final = (
    r"“Clinic run” was uploaded to v1\.",
    r"v1 started “Clinic run”\.",
    r"v1 took off( in \d+ s)?\.",
    r"v1 reached “corner”( in \d+ s)?\.",
    r"v1 reached “clinic”( in \d+ s)?\.",
    r"v1 released “drop”: acknowledged, and the output moved\.",
    r"v1 returned to launch( in \d min \d\d s)?\.",
    r"v1 completed “Clinic run” in .* s\.",
)
"""Without a time where a busy simulator was silent as the item ended."""
OF_THE_LINK = '[data-event-group^="link "]'
"""A busy simulator may lose its link meanwhile: these lines are no part of the story."""
FITS = f"""rows => [...rows.querySelectorAll('{OF_THE_LINK}')]
  .reduce((height, line) => height - line.offsetHeight, rows.scrollHeight) <= rows.clientHeight"""


async def tells_the_run_on_one_screen(board: Dashboard) -> None:
    """A line for each matter, none of them out of sight; and behind the lines each event of the run, once."""
    await board.filter_events("Of the selected run")
    lines = board.page.locator(".event-group")
    story = board.page.locator(f".event-group:not({OF_THE_LINK})")
    await expect(story).to_have_text([re.compile(one) for one in reversed(FEED_LINES)])
    rows = board.page.locator(".feed .rows")
    assert await rows.evaluate(FITS), "the story must fit 1440 x 900"
    panel = board.page.locator("#panel")
    await expect(panel.get_by_text("Total")).to_be_visible()
    assert await panel.evaluate("panel => panel.scrollHeight <= panel.clientHeight"), "the run's panel must fit, too"
    for count in await lines.locator(".event-group-count").all():
        await count.click()
    behind = await board.shown_seqs()
    newest = max(await board.feed_seqs())
    answer = await board.page.request.get(f"{board.url}/api/v1/events?after={max(0, newest - 500)}&limit=500")
    told = [one["seq"] for one in (await answer.json())["events"] if one["run_id"] == await board.run_id()]
    assert told
    assert set(told) <= set(behind)
    assert len(behind) == len(set(behind))
    await board.filter_events("Highlights")


async def attach_a_photo_and_what_is_none(board: Dashboard, folder: Path) -> None:
    """A photo is shown in the drop's card, small and large; what is refused is said in words."""
    board.tolerated = ("status of 4",)  # Chromium writes each refused request into its console
    no_picture, no_file = folder / "door.png", folder / "door.txt"
    no_picture.write_text("no picture")
    no_file.write_text("no picture")
    async with board.page.expect_file_chooser() as choosing:
        await board.button("Attach a photo, signature or PDF to drop").click()
    await (await choosing.value).set_files([ROOT / "docs" / "images" / "page.png", no_picture, no_file])
    attached = board.page.get_by_role("group", name="Attachments of drop")
    await expect(attached.get_by_role("alert")).to_have_count(2)
    await expect(attached).to_contain_text("“door.png” was not attached.")
    await expect(attached).to_contain_text("“door.txt” is not a JPEG, PNG or PDF")
    await expect(attached.locator("img")).to_have_count(1)
    await attached.get_by_role("button", name="Show page.png").click()
    await expect(board.page.get_by_role("dialog", name="page.png").get_by_role("img")).to_be_visible()
    found = await violations(board.page, "a photo")
    await board.page.keyboard.press("Escape")
    await expect(board.page.get_by_role("dialog")).to_have_count(0)
    await board.page.set_viewport_size(PHONE)
    await board.page.get_by_role("navigation", name="Views").get_by_role("button", name="Run").click()
    assert found + await violations(board.page, "a delivered run") == []


async def shows_the_same_after_a_reload(flying_page: Dashboard) -> None:
    """The run that was shown, and its past without a gap, as far back as a new page asks for."""
    run_id, newest = await flying_page.run_id(), (await flying_page.feed_seqs())[0]
    await flying_page.page.reload()
    await flying_page.until_live()
    assert await flying_page.run_id() == run_id
    await until(flying_page.feed_seqs, lambda seqs: newest in seqs, "what is older must be read", 30)
    answer = await flying_page.page.request.get(f"{flying_page.url}/api/v1/events?limit=1")
    last_seq = (await answer.json())["last_seq"]  # not the feed's newest, which may still be reading what is older
    seqs = await flying_page.feed_seqs()
    assert seqs == list(range(seqs[0], seqs[-1] - 1, -1))
    assert seqs[-1] <= max(1, last_seq - HISTORY + 1)


async def test_a_run_is_started_told_to_skip_and_ended_by_keyboard_alone(flying_page: Dashboard) -> None:
    await flying_page.upload(run_that_waits_twice(), "v2")
    keyboard = flying_page.page.keyboard
    await flying_page.button("Start v2").focus()
    await keyboard.down("Space")
    await flying_page.until_state("starting", "flying", "at_drop")
    await keyboard.up("Space")
    await expect(flying_page.button("Return v2")).to_be_visible(timeout=FLIGHT_MS)
    await skip_to_the_end(flying_page)
    await flying_page.button("Land v2").focus()
    await keyboard.down("Enter")
    await flying_page.until_state("landed", "completed", "aborted", "failed")
    await keyboard.up("Enter")


def run_that_waits_twice() -> str:
    """Before its drop and after it: neither the drop nor the landing comes before a busy machine commands it."""
    plan = json.loads(waiting_run())
    *items, home = plan["items"]
    plan["items"] = [*items, {**items[1], "id": "end"}, home]
    return json.dumps(plan)


async def skip_to_the_end(board: Dashboard) -> None:
    """First it is refused, which is said in words; then the vehicle flies on with the last point."""
    board.tolerated = ("status of 409",)  # Chromium writes each refused request into its console
    skip = board.page.get_by_role("region", name="Skip items of v2")
    await skip.get_by_label("Skip to an item").select_option("end", timeout=FLIGHT_MS)
    await expect(skip).to_contain_text("Skips these drops: drop.")

    async def refuse(route: Route) -> None:
        problem = {"title": "The vehicle has to hold first", "detail": "the drop is near", "code": "run.hold_required"}
        await route.fulfill(status=409, content_type="application/problem+json", body=json.dumps(problem))

    await board.page.route("**/mission", refuse)
    await hold_by_keyboard(board, "Skip to end with v2")
    await expect(skip.get_by_role("alert")).to_contain_text("The drop is near")
    await board.page.unroute("**/mission")
    await hold_by_keyboard(board, "Skip to end with v2")
    await board.filter_events("All events")
    changed = board.page.locator('.event[data-kind="run.mission_changed"]').first  # the newest of the whole service
    await expect(changed).to_contain_text("continues at “end”")
    await expect(skip.get_by_role("alert")).to_have_count(0)


async def hold_by_keyboard(board: Dashboard, name: str) -> None:
    """Until it was long enough; letting go counts then, however late it is seen."""
    button = board.button(name)
    await button.focus()
    await button.press("Enter", delay=HOLD_MS)


async def test_a_service_killed_and_restarted_under_the_page_is_caught_up_with(
    flying_page: Dashboard, flying_service: ServiceProcess
) -> None:
    flying_page.tolerated = SERVICE_LOST
    await flying_page.upload(waiting_run(hold_s=120), "v3")
    run_id, before = await flying_page.run_id(), await flying_page.feed_seqs()
    await flying_page.hold("Start v3")
    await flying_page.until_state("flying", "at_drop", "returning")

    flying_service.kill()
    try:
        lost = flying_page.page.locator(".connection.lost")
        await expect(lost).to_contain_text("No connection, data is")
        await expect(flying_page.button("Land v3")).to_be_disabled()
        await told_within_a_telephone(flying_page)
    finally:
        flying_service.start()

    await flying_page.until_live()
    assert await flying_page.run_id() == run_id
    # aborted: its drop's hold was over before the service was back
    await flying_page.until_state("completed", "aborted")
    await expect(flying_page.page.locator(".drop-card .badge")).not_to_have_text("Pending")
    seqs = await flying_page.feed_seqs()
    assert seqs == list(range(seqs[0], before[-1] - 1, -1)), "every event since the page was opened once, in order"
    started = flying_page.page.locator('.event[data-kind="service.started"]')
    assert int(await started.first.get_attribute("data-seq") or 0) > before[0]


async def told_within_a_telephone(board: Dashboard) -> None:
    """What is said of the connection pushes nothing off the screen."""
    before = board.page.viewport_size
    assert before is not None
    await board.page.set_viewport_size(PHONE)
    last = await board.page.get_by_role("button", name="theme").bounding_box()
    assert last is not None
    assert last["x"] + last["width"] <= PHONE["width"]
    await board.page.set_viewport_size(before)
