"""A cluster is used as a single Waydrop is: through any API node, for the vehicles of all sites."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import aiohttp

from tests.support.cluster_process import Cluster
from tests.support.cluster_runs import FLIGHT_S, until_run
from tests.support.forked_service import ForkedService
from tests.support.paths import PLANS
from tests.support.scheduled_jobs import IN_YEARS
from tests.support.service_process import Dispatcher, ServiceProcess, until
from tests.support.simulated import SimulatedFleet
from tests.support.whole_cluster import events_of, require_whole

PLAN = json.loads((PLANS / "clinic-run.json").read_text())
for _item in PLAN["items"]:
    if _item["type"] == "gripper":
        _item["hold_s"] = 600.0  # on a busy machine a restart may take long; a release ends the hold at once
SOON_S = 120.0


async def refusal(http: aiohttp.ClientSession, url: str) -> str:
    """The code with which a POST is refused; empty if it is accepted."""
    async with http.post(url, json={}) as answer:
        return "" if answer.ok else str((await answer.json())["code"])


async def until_refused(http: aiohttp.ClientSession, url: str, code: str) -> None:
    """Post until it is refused with this code. What was on its way when a part died may still have gone to it."""
    await until(lambda: refusal(http, url), lambda found: found == code, f"it must be refused with {code}", SOON_S)


async def test_the_stream_of_a_node_is_followed_by_its_position_and_has_telemetry_of_all_sites(
    cluster: Cluster, http: aiohttp.ClientSession
) -> None:
    node = cluster.nodes[1]
    await Dispatcher(http, node.url).until_vehicles(2, within_s=SOON_S)
    async with asyncio.timeout(SOON_S), http.ws_connect(f"{node.url}/api/v1/stream?after=0") as socket:
        hello = json.loads((await socket.receive()).data)
        assert hello["gateway"].startswith("cluster-")
        seen: list[int] = []
        telemetry: set[str] = set()
        while len(seen) < hello["seq"] or not telemetry >= {"north-v1", "south-v1"}:
            frame = json.loads((await socket.receive()).data)
            if frame["type"] == "event":
                seen.append(frame["event"]["position"])
            elif frame["type"] == "telemetry":
                telemetry |= set(frame["vehicles"])
    assert seen == list(range(1, len(seen) + 1))
    other = f"{node.url}/api/v1/stream?after=1&gateway=gw-other"
    async with asyncio.timeout(SOON_S), http.ws_connect(other) as socket:
        assert (await socket.receive()).data == 4409, "an `after` of another stream is refused"


async def test_offboard_control_and_tasks_are_at_the_vehicle_s_gateway(
    cluster: Cluster, http: aiohttp.ClientSession
) -> None:
    node, gateway = cluster.nodes[0], cluster.gateways["south"]
    await Dispatcher(http, node.url).until_vehicles(2, within_s=SOON_S)
    for path in ("offboard", "tasks"):
        async with http.get(f"{node.url}/api/v1/vehicles/south-v1/{path}") as answer:
            problem = await answer.json()
            found = (answer.status, problem["code"], problem["gateway_url"])
            assert found == (421, "gateway.elsewhere", gateway.url)
        async with http.get(f"{gateway.url}/api/v1/vehicles/south-v1/{path}") as answer:
            assert answer.status == 200
    simulator = await Dispatcher(http, node.url).get("/simulator")
    assert not simulator["available"]
    assert gateway.url in simulator["reason"]
    async with http.put(f"{node.url}/api/v1/simulator/speed", json={"speed": 2.0}) as answer:
        problem = await answer.json()
        assert (answer.status, problem["code"]) == (404, "simulator.not_running")
        assert gateway.url in problem["gateway_urls"]


async def test_jobs_and_webhooks_work_through_every_node(cluster: Cluster, http: aiohttp.ClientSession) -> None:
    one, other = (Dispatcher(http, node.url) for node in cluster.nodes)
    for node in (one, other):
        await node.until_vehicles(2, within_s=SOON_S)
    plan, never = await one.post("/plans", PLAN), IN_YEARS
    anybody = await one.post("/jobs", {"plan": plan["id"], "not_before": never})
    named = await other.post("/jobs", {"plan": plan["id"], "vehicle": "south-v1", "not_before": never, "priority": 5})
    second = await one.post("/jobs", {"plan": plan["id"], "vehicle": "south-v1", "not_before": never})
    jobs = {job["id"]: job for job in (anybody, named, second)}
    for node in (one, other):
        await until(lambda node=node: ids_of_jobs(node), jobs.keys().__le__, "each node lists all jobs", SOON_S)
    async with http.patch(f"{cluster.nodes[1].url}/api/v1/jobs/{second['id']}", json={"before": named["id"]}) as answer:
        assert (answer.status, (await answer.json())["priority"]) == (200, 5)
    queues = await one.get("/job-queues")
    assert [job["id"] for job in queues["waiting"]] == [second["id"], named["id"], anybody["id"]]
    assert {vehicle["queue"]["vehicle_id"] for vehicle in queues["vehicles"]} == {"north-v1", "south-v1"}
    for job_id in jobs:
        assert (await other.post(f"/jobs/{job_id}/cancel"))["state"] == "cancelled"

    webhooks = f"{cluster.nodes[1].url}/api/v1/webhooks"
    await until(lambda: status_of(http, webhooks), lambda status: status == 200, "a node delivers webhooks", SOON_S)
    hook_id = (await one.post("/webhooks", {"url": "http://127.0.0.1:9/hook"}))["webhook"]["id"]
    assert [hook["webhook"]["id"] for hook in (await other.get("/webhooks"))["webhooks"]] == [hook_id]
    async with http.delete(f"{webhooks}/{hook_id}") as answer:
        assert answer.status == 204
    assert (await one.get("/webhooks"))["webhooks"] == []


async def test_a_job_that_both_sites_may_fly_goes_to_the_other_one_once_its_claim_is_cleared(
    cluster: Cluster, http: aiohttp.ClientSession
) -> None:
    one, other = (Dispatcher(http, node.url) for node in cluster.nodes)
    for node in (one, other):
        await node.until_vehicles(2, within_s=SOON_S)
    plan = await one.post("/plans", PLAN)
    job = await one.post("/jobs", {"plan": plan["id"], "allowed_vehicles": ["north-v1", "south-v1"]})
    path = f"/jobs/{job['id']}"
    site = await site_that_keeps(cluster, http, path)
    cluster.gateways[site].kill()
    assert (await one.get(path))["claim"]["site"] == site, "no other gateway gets it"
    assert (await other.post(f"{path}/clear-claim"))["state"] == "queued"
    elsewhere = await until(
        lambda: one.get(path),
        lambda now: now["state"] == "prepared" and now["claim"]["site"] != site,
        "the other site gets it",
        FLIGHT_S,
    )
    await asyncio.to_thread(cluster.gateways[site].start)
    await one.until_vehicles(2, within_s=SOON_S)
    assert (await one.get(path))["run_id"] == elsewhere["run_id"], "what the first gateway says of it does not count"
    for at in (one, Dispatcher(http, cluster.gateways[site].url)):
        await at.post(f"{path}/cancel")
        await until(lambda at=at: at.get(path), lambda now: now["state"] == "cancelled", "its run is ended", SOON_S)
    await require_whole(cluster, http)


async def site_that_keeps(cluster: Cluster, http: aiohttp.ClientSession, path: str) -> str:
    """The site whose gateway has the job, and answers so when somebody wants to clear its claim: it is not cleared.

    On a busy machine a gateway may need too long for that answer. Then the job is given again; what the gateway has
    begun is ended there, or its vehicle would get nothing any more.
    """
    node = cluster.nodes[1]
    for _ in range(5):
        prepared = await until(
            lambda: Dispatcher(http, node.url).get(path),
            lambda now: now["state"] == "prepared",
            "a gateway has it",
            FLIGHT_S,
        )
        assert prepared["claim"]["taken"]
        site = str(prepared["claim"]["site"])
        async with http.post(f"{node.url}/api/v1{path}/clear-claim", json={}) as answer:
            if answer.status != 200:
                assert (answer.status, (await answer.json())["code"]) == (409, "job.wrong_state")
                return site
        await Dispatcher(http, cluster.gateways[site].url).post(f"{path}/cancel")
    raise AssertionError("each claim was cleared, though its gateway runs")


async def test_a_job_for_any_vehicle_is_delivered_once(cluster: Cluster, http: aiohttp.ClientSession) -> None:
    one, other = (Dispatcher(http, node.url) for node in cluster.nodes)
    for node in (one, other):
        await node.until_vehicles(2, within_s=SOON_S)
    job = await one.post("/jobs", {"plan": PLAN, "auto_start": True})
    path = f"/jobs/{job['id']}"
    over = await until(lambda: other.get(path), lambda now: now["ended_at"] is not None, "it ends", FLIGHT_S)
    assert over["state"] == "completed", over
    runs = (await one.get(f"/runs?plan={over['plan_id']}"))["runs"]
    assert [(run["id"], run["state"]) for run in runs] == [(over["run_id"], "completed")]
    assert (await one.get(f"/runs/{over['run_id']}"))["drops"][0]["outcome"] == "released"


async def ids_of_jobs(node: Dispatcher) -> set[str]:
    return {job["id"] for job in (await node.get("/jobs"))["jobs"]}


async def status_of(http: aiohttp.ClientSession, url: str) -> int:
    async with http.get(url) as answer:
        return answer.status


async def test_a_gateway_that_is_gone_is_told_in_words(cluster: Cluster, http: aiohttp.ClientSession) -> None:
    node, gateway = Dispatcher(http, cluster.nodes[0].url), cluster.gateways["south"]
    await node.until_vehicles(2, within_s=SOON_S)
    gateway.kill()
    try:
        hold = f"{cluster.nodes[0].url}/api/v1/vehicles/south-v1/hold"
        await until_refused(http, hold, "gateway.unreachable")
        await until(
            lambda: node.get("/vehicles/south-v1"),
            lambda view: not view["state"]["connected"],
            "a silent site is shown as disconnected",
            SOON_S,
        )
        expected = [("north", True), ("south", False)]
        await until(lambda: connected_sites(node), expected.__eq__, "its site is shown as silent", SOON_S)
    finally:
        gateway.start()
    await node.until_vehicles(2, within_s=SOON_S)


async def test_a_second_gateway_of_a_site_begins_nothing_and_nodes_command_the_first_one(
    cluster: Cluster, http: aiohttp.ClientSession, tmp_path: Path
) -> None:
    node = Dispatcher(http, cluster.nodes[0].url)
    await node.until_vehicles(2, within_s=SOON_S)
    with (
        SimulatedFleet("quad") as fleet,
        ForkedService(
            tmp_path / "second", fleet.connections, part="gateway", WAYDROP_SITE="south", **cluster.environment
        ) as process,
    ):
        second = Dispatcher(http, process.url)
        await second.until_vehicles(1, within_s=SOON_S)
        await until(lambda: site_lease(http, process), "taken".__eq__, "it learns that the site is taken", SOON_S)
        await until(lambda: site_lease(http, cluster.gateways["south"]), "held".__eq__, "the first one has it", SOON_S)
        plan = await second.post("/plans", PLAN)
        async with http.post(
            f"{process.url}/api/v1/runs", json={"plan": plan["id"], "vehicle": "south-v1", "start": True}
        ) as answer:
            assert (answer.status, (await answer.json())["code"]) == (409, "cluster.site_taken")
        before = await commands_at(http, cluster.gateways["south"])
        for at in (second, node):
            assert (await at.post("/vehicles/south-v1/hold"))["id"] == "south-v1", "hold is always sent"
        assert await commands_at(http, process) == 1
        assert await commands_at(http, cluster.gateways["south"]) == before + 1


async def connected_sites(node: Dispatcher) -> list[tuple[str, bool]]:
    return [(site["site"], site["connected"]) for site in (await node.get("/sites"))["sites"]]


async def site_lease(http: aiohttp.ClientSession, gateway: ServiceProcess) -> str | None:
    """What the gateway says of the lease of its site."""
    async with http.get(f"{gateway.url}/healthz") as answer:
        found: str | None = (await answer.json())["site_lease"]
        return found


async def commands_at(http: aiohttp.ClientSession, gateway: ServiceProcess) -> int:
    """How many commands to vehicles the gateway has carried out."""
    events = await events_of(Dispatcher(http, gateway.url))
    return sum(event["kind"] == "vehicle.command" and event["data"]["outcome"] == "done" for event in events)


async def test_a_delivery_outlives_the_loss_of_nats_of_postgres_and_of_its_gateway(
    cluster: Cluster, http: aiohttp.ClientSession
) -> None:
    first, other = cluster.nodes
    node, gateway = Dispatcher(http, first.url), cluster.gateways["north"]
    await node.until_vehicles(2, within_s=SOON_S)
    run_id = await node.fly(PLAN, "north-v1")
    await until_run(http, other, run_id, ("flying",), "it takes off, as another node says")

    await asyncio.to_thread(cluster.nats.kill)
    await asyncio.to_thread(cluster.nats.lose_store)
    await until_refused(http, f"{first.url}/api/v1/vehicles/south-v1/hold", "cluster.bus_down")
    assert (await node.get(f"/runs/{run_id}"))["id"] == run_id, "what is stored can be read"
    await asyncio.to_thread(cluster.nats.start)

    await asyncio.to_thread(cluster.databases.server.stop_immediately)
    async with http.get(f"{first.url}/api/v1/runs/{run_id}") as answer:
        assert (answer.status, (await answer.json())["code"]) == (503, "storage.failed")
    assert await status_of(http, f"{first.url}/healthz") == 200
    assert await status_of(http, f"{gateway.url}/api/v1/runs/{run_id}") == 200, "the site goes on"
    await asyncio.to_thread(cluster.databases.server.start)

    gateway.kill()
    await asyncio.to_thread(gateway.start)

    over = await until_run(http, first, run_id, ("completed", "aborted", "failed", "lost"), "the run must end")
    assert (over["state"], over["drops"][0]["outcome"]) == ("completed", "released")
    events = await require_whole(cluster, http)
    assert {event["kind"] for event in events} >= {"plan.created", "run.created", "run.drop", "request.accepted"}
