"""Waydrop behind nginx, as docs/nginx.conf sets it up: requests and websockets, and whose address counts."""

from __future__ import annotations

import asyncio
import json
import ssl
import subprocess
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import aiohttp
import pytest

from app.services.attempts import MOST_FAILURES
from tests.support.certificates import trusting
from tests.support.forked_service import ForkedService
from tests.support.paths import PLANS, ROOT
from tests.support.proxy import Proxy, nginx_before
from tests.support.simulated import free_udp_ports

HOST = "waydrop.example"
SETTINGS = {"WAYDROP_ALLOWED_HOSTS": HOST, "WAYDROP_TRUSTED_PROXIES": "127.0.0.1"}


@pytest.fixture
async def proxy(tmp_path: Path) -> AsyncIterator[Proxy]:
    (tmp_path / "nginx").mkdir()
    connections = [f"udpin://127.0.0.1:{free_udp_ports(1)}"]
    with (
        ForkedService(tmp_path, connections, **SETTINGS) as service,
        nginx_before(service.port, tmp_path / "nginx") as running,
    ):
        yield running


def new_token(data_dir: Path, role: str) -> dict[str, str]:
    """Headers of a token that the command line makes, and of a client that knows the service by its name."""
    command = [sys.executable, "-m", "app", "token", "create", f"a {role}", "--role", role, "--data-dir", str(data_dir)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True, timeout=60)
    return {"Host": HOST, "Authorization": f"Bearer {done.stdout.strip()}"}


def client(context: ssl.SSLContext, address: str) -> aiohttp.ClientSession:
    """A client at one of this machine's loopback addresses."""
    return aiohttp.ClientSession(connector=aiohttp.TCPConnector(ssl=context, local_addr=(address, 0)))


async def test_the_sample_passes_requests_and_websockets_on(tmp_path: Path, proxy: Proxy) -> None:
    async with client(trusting(proxy.certificate), "127.0.0.2") as http:
        async with http.get(f"{proxy.url}/api/v1/vehicles", headers={"Host": HOST}) as refused:
            problem = await refused.json(content_type=None)
            assert (refused.status, problem["code"]) == (401, "auth.required")
            assert "proxy" in problem["detail"], "without tokens nothing that was passed on is accepted"
        token = await asyncio.to_thread(new_token, tmp_path, "dispatcher")
        plan = json.loads((PLANS / "clinic-run.json").read_text(encoding="utf-8"))
        page = {"Origin": f"https://{HOST}", "Sec-Fetch-Site": "same-origin"}
        async with http.post(f"{proxy.url}/api/v1/plans", json=plan, headers=token | page) as made:
            assert made.status == 201, await made.text()
            assert made.headers["Server"] == "nginx"
        url = f"{proxy.url}/api/v1/stream".replace("https", "wss")
        async with http.ws_connect(url, headers=token | page) as socket:
            assert (await socket.receive_json(timeout=10))["type"] == "hello"
        foreign = {"Origin": "https://evil.example"}
        async with http.post(f"{proxy.url}/api/v1/plans", json=plan, headers=token | foreign) as refused:
            assert refused.status == 403
        async with http.get(f"{proxy.plain_url}/x", headers={"Host": HOST}, allow_redirects=False) as moved:
            assert (moved.status, moved.headers["Location"]) == (308, f"https://{HOST}/x")


async def test_a_client_that_guesses_tokens_is_held_off_and_no_other_client_of_the_proxy(
    tmp_path: Path, proxy: Proxy
) -> None:
    token = await asyncio.to_thread(new_token, tmp_path, "viewer")
    context, path = trusting(proxy.certificate), f"{proxy.url}/api/v1/vehicles"

    async def status(http: aiohttp.ClientSession, authorization: str) -> int:
        # what a client itself says of where it comes from is replaced by the proxy
        headers = {"Host": HOST, "Authorization": authorization, "X-Forwarded-For": "198.51.100.9"}
        async with http.get(path, headers=headers) as answer:
            return answer.status

    async with client(context, "127.0.0.2") as guessing, client(context, "127.0.0.3") as other:
        for number in range(MOST_FAILURES):
            assert await status(guessing, f"Bearer wd_guess-{number}") == 401
        assert await status(guessing, "Bearer wd_guess") == 429
        assert await status(other, token["Authorization"]) == 200
