"""What keeps the service running: liveness, readiness, metrics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from app.api import ApiServices
from app.domain.vehicle.link_security import LinkSecurity, RefusalKind, Refused, Relayed
from tests.support.service_in_process import Service, run_service
from tests.support.socket_limits import sockets_open


async def test_a_healthy_service_is_alive_and_ready(service: Service) -> None:
    status, _, health = await service.call("GET", "/healthz")
    assert (status, health) == (200, {"status": "ok", "version": "0.0-test", "site_lease": None})
    status, _, ready = await service.call("GET", "/readyz")
    assert (status, ready) == (200, {"ready": True, "reasons": {}})


async def test_what_is_not_ready_says_why(tmp_path: Path) -> None:
    def change(services: ApiServices) -> ApiServices:
        checks = {"links": lambda: "udpin://0.0.0.0:14540 is not open", "fine": lambda: None}
        return replace(services, readiness=checks)

    async with run_service(tmp_path, change=change) as service:
        status, _, ready = await service.call("GET", "/readyz")
        assert (status, ready["ready"]) == (503, False)
        assert ready["reasons"] == {"links": "udpin://0.0.0.0:14540 is not open"}


async def test_metrics_count_requests_sockets_events_runs_and_vehicles(service: Service, plan: dict[str, Any]) -> None:
    await service.call("POST", "/api/v1/plans", json=plan)
    await service.call("GET", "/api/v1/runs/nothing")
    await service.call("GET", "/no/such/path")
    service.links[1].change(connected=False)
    async with service.http.ws_connect(f"{service.url}/api/v1/stream") as socket:
        await socket.receive_json()
        status, headers, text = await service.call("GET", "/metrics")
    assert status == 200
    assert headers["Content-Type"].startswith("text/plain; version=0.0.4")
    lines = set(text.splitlines())
    assert 'waydrop_http_requests_total{method="POST",route="/api/v1/plans",status="201"} 1.0' in lines
    assert 'waydrop_http_requests_total{method="GET",route="/api/v1/runs/{run_id}",status="404"} 1.0' in lines
    assert 'waydrop_http_requests_total{method="GET",route="unmatched",status="404"} 1.0' in lines
    assert "waydrop_websocket_clients 1.0" in lines
    assert 'waydrop_events_total{kind="plan.created"} 1.0' in lines
    assert 'waydrop_vehicles{link="connected"} 1.0' in lines
    assert 'waydrop_vehicles{link="lost"} 1.0' in lines
    assert 'waydrop_runs_open{state="flying"} 0.0' in lines


async def test_the_life_of_a_socket_is_no_response_time(service: Service) -> None:
    async with service.http.ws_connect(f"{service.url}/api/v1/stream") as socket:
        await socket.receive_json()
    await sockets_open(service, 0)
    lines = set((await service.call("GET", "/metrics"))[2].splitlines())
    assert 'waydrop_http_requests_total{method="GET",route="/api/v1/stream",status="101"} 1.0' in lines
    assert 'waydrop_websocket_seconds_count{route="/api/v1/stream"} 1.0' in lines
    assert not [line for line in lines if line.startswith('waydrop_http_request_seconds_count{route="/api/v1/stream"')]
    await service.call("GET", "/api/v1/vehicles")
    text = (await service.call("GET", "/metrics"))[2]
    assert 'waydrop_http_request_seconds_count{route="/api/v1/vehicles"} 1.0' in text


async def test_metrics_tell_what_the_link_guards_pass_and_refuse(service: Service) -> None:
    url = "udpin://0.0.0.0:14540"
    service.guards.passed = [Relayed(url, 1200, 34)]
    service.guards.refusals = [Refused(url, RefusalKind.OTHER_PEER, 7, "10.0.0.66:5000", (1,))]
    service.links[0].change(link_security=LinkSecurity.SIGNED)
    lines = set((await service.call("GET", "/metrics"))[2].splitlines())
    assert f'waydrop_link_frames_total{{connection="{url}",direction="from_vehicles"}} 1200.0' in lines
    assert f'waydrop_link_frames_total{{connection="{url}",direction="to_vehicles"}} 34.0' in lines
    assert f'waydrop_link_refused_total{{connection="{url}",reason="other_peer"}} 7.0' in lines
    assert 'waydrop_vehicle_links{security="signed"} 1.0' in lines


async def test_metrics_tell_how_late_the_loop_turns(service: Service) -> None:
    for delay_s in (0.0005, 0.03, 0.3):
        service.services.loop_watch.delays.add(delay_s)
    lines = set((await service.call("GET", "/metrics"))[2].splitlines())
    assert 'waydrop_loop_delay_seconds_bucket{le="0.1"} 2.0' in lines
    assert 'waydrop_loop_delay_seconds_bucket{le="+Inf"} 3.0' in lines
    assert "waydrop_loop_delay_worst_seconds 0.3" in lines


async def test_odd_methods_and_paths_do_not_grow_the_metrics(service: Service) -> None:
    for number, method in enumerate(("PROPFIND", "MKCOL", "COPY", "MOVE", "LOCK")):
        await service.call(method, f"/odd/{number}")
    _, _, text = await service.call("GET", "/metrics")
    assert "PROPFIND" not in text
    assert "/odd/" not in text
    assert 'waydrop_http_requests_total{method="other",route="unmatched",status="404"} 5.0' in text
