"""Requests of the commands: a lost answer is asked for again, and what is no Waydrop is told as that."""

from __future__ import annotations

import asyncio

import pytest
from aiohttp import web

from app.cli.service_client import default_server, parsed, service_client
from app.cli.terminal import AnswerLostError, ServerRefusedError, ServerUnreachableError
from app.domain.errors import InvalidInputError
from app.domain.run.run import Run
from tests.support.scripted_service import answering


class Unsteady:
    """Carries out each POST, and cuts its connection before the first `lost` answers."""

    def __init__(self, lost: int) -> None:
        self.lost = lost
        self.keys: list[str | None] = []

    async def handle(self, request: web.Request) -> web.Response:
        self.keys.append(request.headers.get("Idempotency-Key"))
        if len(self.keys) <= self.lost:
            assert request.transport is not None
            request.transport.close()
        return web.json_response({"id": "r1"})


async def test_a_post_whose_answer_is_lost_is_repeated_with_its_key() -> None:
    server = Unsteady(lost=2)
    async with answering(server.handle) as url, service_client(url, None) as client:
        assert await client.post("/runs", {}) == {"id": "r1"}
    assert len(server.keys) == 3
    assert len(set(server.keys)) == 1
    assert server.keys[0]


async def test_an_answer_that_does_not_come_says_that_the_request_was_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.cli.service_client.REPEATED_FOR_S", 0.3)
    server = Unsteady(lost=1000)
    async with answering(server.handle) as url, service_client(url, None) as client:
        with pytest.raises(AnswerLostError, match="may have been carried out"):
            await client.post("/runs", {})


async def test_a_post_to_a_route_without_keys_is_sent_once() -> None:
    server = Unsteady(lost=1000)
    async with answering(server.handle) as url, service_client(url, None) as client:
        with pytest.raises(AnswerLostError):
            await client.post("/webhooks", {}, repeats=False)
    assert len(server.keys) == 1


async def test_a_connection_that_is_refused_is_not_tried_again() -> None:
    server = Unsteady(lost=1000)
    async with answering(server.handle) as url, service_client(url, None) as client:
        with pytest.raises(ServerUnreachableError):
            await client.get("/runs")
    async with service_client(url, None) as client:
        with pytest.raises(ServerUnreachableError):
            await client.post("/runs", {})


@pytest.mark.parametrize("status", [502, 503, 504])
async def test_a_proxy_without_a_waydrop_behind_it_is_no_refusal(status: int) -> None:
    async def bad_gateway(_request: web.Request) -> web.Response:
        return web.Response(status=status, text="<html>Bad Gateway</html>", content_type="text/html")

    async with answering(bad_gateway) as url, service_client(url, None) as client:
        with pytest.raises(ServerUnreachableError):
            await client.get("/vehicles")


@pytest.mark.parametrize("text", ["", "[]", "null", '{"run', "<html>"])
async def test_what_is_no_document_of_waydrop_is_told_as_that(text: str) -> None:
    async def answer(_request: web.Request) -> web.Response:
        return web.Response(text=text, content_type="application/json")

    async with answering(answer) as url, service_client(url, None) as client:
        with pytest.raises(ServerRefusedError, match="not Waydrop"):
            await client.get("/vehicles")


async def test_a_document_of_another_version_is_told_as_that() -> None:
    async def answer(_request: web.Request) -> web.Response:
        return web.json_response({})

    async with answering(answer) as url, service_client(url, None) as client:
        document = await client.get("/runs/r1")
    with pytest.raises(ServerRefusedError, match="no 'vehicles'"):
        _ = document["vehicles"]
    with pytest.raises(ServerRefusedError, match="no Run"):
        parsed(Run, document)


@pytest.mark.parametrize(
    "server", ["http://[::1", "http://h:99999", "http://h:abc", "http://h:0", "h:80", "http://h?x=1"]
)
async def test_an_unusable_address_is_an_unusable_option(server: str) -> None:
    with pytest.raises(InvalidInputError, match="--server"):
        async with service_client(server, None):
            pass


@pytest.mark.parametrize("token", ["abc\n", "a\u0142b"])
async def test_a_token_that_no_header_can_carry_is_an_unusable_option(token: str) -> None:
    with pytest.raises(InvalidInputError, match="--token"):
        async with service_client("http://127.0.0.1:1", token):
            pass


@pytest.mark.parametrize("run_id", ["../vehicles", "a/../b", "r1?x=1", "r1#y", "r%2f"])
async def test_an_id_does_not_lead_to_another_resource(run_id: str) -> None:
    asked = asyncio.Event()

    async def answer(_request: web.Request) -> web.Response:
        asked.set()
        return web.json_response({})

    async with answering(answer) as url, service_client(url, None) as client:
        with pytest.raises(InvalidInputError, match="ID"):
            await client.get(f"/runs/{run_id}")
    assert not asked.is_set()


@pytest.mark.parametrize(
    ("port", "certificate", "server"),
    [
        ("", "", "http://127.0.0.1:8080"),
        ("8090", "", "http://127.0.0.1:8090"),
        ("", "/etc/waydrop/chain.pem", "https://127.0.0.1:8080"),
    ],
)
def test_commands_ask_the_service_of_this_machine_as_it_is_configured(
    monkeypatch: pytest.MonkeyPatch, port: str, certificate: str, server: str
) -> None:
    monkeypatch.setenv("WAYDROP_PORT", port)
    monkeypatch.setenv("WAYDROP_TLS_CERT", certificate)
    assert default_server() == server
