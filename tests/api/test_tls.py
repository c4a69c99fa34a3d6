"""The service speaks TLS itself: requests, websockets, limits, a certificate that is replaced."""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import urlsplit

import aiohttp
import pytest
from aiohttp import web

from app.api.connections import ConnectionLimits
from app.api.server import serving
from app.api.tls import ListenError, TlsFiles
from tests.support.certificates import PrivateKey, elliptic, of_rsa, trusting, write_certificate
from tests.support.raw_socket import exchange

FEW = ConnectionLimits(most=6, most_per_address=6)
WHOLE = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"


@dataclass(frozen=True)
class Pair:
    certificate: Path
    key: Path

    @property
    def files(self) -> TlsFiles:
        return TlsFiles(self.certificate, self.key, look_every_s=0.05)


@pytest.fixture
def pair(tmp_path: Path) -> Pair:
    return Pair(*write_certificate(tmp_path))


@asynccontextmanager
async def served(pair: Pair, limits: ConnectionLimits | None = None) -> AsyncIterator[str]:
    """A service that says yes, and echoes on a socket; its URL."""

    async def yes(request: web.Request) -> web.StreamResponse:
        if "Upgrade" not in request.headers:
            return web.Response(text=f"yes over {request.scheme}", body=None)
        socket = web.WebSocketResponse()
        await socket.prepare(request)
        async for message in socket:
            await socket.send_str(message.data)
        return socket

    async def large(_: web.Request) -> web.Response:
        return web.Response(body=b"x" * 3_000_000)

    app = web.Application(client_max_size=4 * 1024 * 1024)
    app.router.add_get("/", yes)
    app.router.add_get("/large", large)
    async with serving(app, "127.0.0.1", 0, limits, pair.files) as url:
        yield url


async def asked(url: str, context: ssl.SSLContext) -> str:
    """What a new connection is answered."""
    connector = aiohttp.TCPConnector(ssl=context, force_close=True)
    async with aiohttp.ClientSession(connector=connector) as http, http.get(url) as answer:
        return await answer.text()


async def test_requests_and_websockets_go_over_tls(pair: Pair) -> None:
    async with served(pair) as url:
        assert url.startswith("https://127.0.0.1:")
        connector = aiohttp.TCPConnector(ssl=trusting(pair.certificate))
        async with aiohttp.ClientSession(connector=connector) as http:
            async with http.get(url) as answer:
                assert await answer.text() == "yes over https"
            async with http.get(f"{url}/large") as answer:
                assert len(await answer.read()) == 3_000_000
            async with http.ws_connect(url.replace("https", "wss")) as socket:
                await socket.send_str("setpoint")
                assert (await socket.receive()).data == "setpoint"


@pytest.mark.filterwarnings("ignore:ssl.TLSVersion:DeprecationWarning")
async def test_old_versions_of_tls_are_refused(pair: Pair) -> None:
    context = trusting(pair.certificate)
    context.minimum_version = ssl.TLSVersion.TLSv1
    context.maximum_version = ssl.TLSVersion.TLSv1_1
    context.set_ciphers("ALL:@SECLEVEL=0")
    async with served(pair) as url:
        with pytest.raises(aiohttp.ClientConnectorError):
            await asked(url, context)


async def test_a_client_that_speaks_no_tls_gets_nothing_and_hurts_nobody(pair: Pair) -> None:
    async with served(pair) as url:
        port = urlsplit(url).port or 0
        assert b"HTTP" not in await exchange(port, WHOLE)
        assert await exchange(port, b"\x16\x03\x01\xff\xff" + b"\x00" * 100) is not None
        assert await asked(url, trusting(pair.certificate)) == "yes over https"


async def test_handshakes_that_are_not_finished_give_way_and_are_cut(pair: Pair) -> None:
    async with served(pair, replace(FEW, head_s=5.0)) as url:  # a real client has as long on a busy machine
        port = urlsplit(url).port or 0
        held = [await asyncio.open_connection("127.0.0.1", port) for _ in range(30)]
        for _ in range(3):
            assert await asked(url, trusting(pair.certificate)) == "yes over https"
        async with asyncio.timeout(60):
            for reader, _ in held:
                with suppress(ConnectionResetError):
                    await reader.read(-1)
        for _, writer in held:
            writer.close()


async def test_beyond_the_limit_a_connection_is_closed_without_a_handshake(pair: Pair) -> None:
    async with served(pair, FEW) as url, aiohttp.ClientSession() as http:
        context = trusting(pair.certificate)
        sockets = [await http.ws_connect(url.replace("https", "wss"), ssl=context) for _ in range(6)]
        with pytest.raises(aiohttp.ClientConnectionError):
            await asked(url, context)
        for socket in sockets:
            await socket.close()


async def test_a_certificate_that_is_replaced_is_used_for_new_connections(
    pair: Pair, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "new").mkdir()
    new = Pair(*write_certificate(tmp_path / "new"))
    async with served(pair) as url:
        old = trusting(pair.certificate)
        new.certificate.replace(pair.certificate)
        async with asyncio.timeout(20):
            while "the old one stays" not in "".join(capfd.readouterr()):
                await asyncio.sleep(0.02)
        assert await asked(url, old), "half of a pair is not used"
        new.key.replace(pair.key)
        await used(url, pair)


@pytest.mark.parametrize(("before", "after"), [(elliptic, of_rsa), (of_rsa, elliptic)])
async def test_a_certificate_with_a_key_of_another_type_replaces_the_old_one(
    tmp_path: Path, before: Callable[[], PrivateKey], after: Callable[[], PrivateKey]
) -> None:
    (tmp_path / "new").mkdir()
    pair = Pair(*write_certificate(tmp_path, new_key=before))
    new = Pair(*write_certificate(tmp_path / "new", new_key=after))
    async with served(pair) as url:
        assert await asked(url, trusting(pair.certificate))
        new.certificate.replace(pair.certificate)
        new.key.replace(pair.key)
        await used(url, pair)


async def used(url: str, pair: Pair) -> None:
    """Wait until new connections get this certificate."""
    async with asyncio.timeout(10):
        while True:
            try:
                await asked(url, trusting(pair.certificate))
            except aiohttp.ClientConnectorCertificateError:
                await asyncio.sleep(0.05)
            else:
                return


def gone(pair: Pair) -> None:
    pair.key.unlink()


def no_pem(pair: Pair) -> None:
    pair.certificate.write_text("certificate")


def other_key(pair: Pair) -> None:
    write_certificate(pair.key.parent, "other")[1].replace(pair.key)


def with_password(pair: Pair) -> None:
    write_certificate(pair.key.parent, password=b"secret")


@pytest.mark.parametrize("damage", [gone, no_pem, other_key, with_password])
async def test_files_that_are_no_use_are_told_at_the_start(pair: Pair, damage: Callable[[Pair], None]) -> None:
    damage(pair)
    with pytest.raises(ListenError, match="cannot be used") as refused:
        async with served(pair):
            pass
    assert str(pair.key) in refused.value.detail
    assert "WAYDROP_TLS_KEY" in refused.value.hint
