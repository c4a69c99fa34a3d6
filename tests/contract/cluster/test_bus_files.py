"""A gateway proves to a real NATS who it is by a credentials file, and files that are no use are told."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import pytest

from app.cluster import BusSettings, open_bus
from app.cluster_application import serve_api, serve_gateway
from app.config import Settings, SettingsError, load_settings
from app.domain.cluster.errors import BusDownError
from app.domain.cluster.ports import Bus
from tests.support.certificates import write_certificate
from tests.support.cluster_servers import held_port
from tests.support.nats_accounts import write_nats_user
from tests.support.service_process import until
from tools.cluster_servers import NatsServer

SOON_S = 60.0


@pytest.fixture
def port() -> Iterator[int]:
    with held_port() as number:
        yield number


async def publishes(bus: Bus) -> bool:
    try:
        await bus.publish("waydrop.test", b"")
    except BusDownError:
        return False
    return True


async def test_a_user_with_a_credentials_file_connects_also_when_the_file_comes_later(
    tmp_path: Path, port: int, capfd: pytest.CaptureFixture[str]
) -> None:
    config, credentials = write_nats_user(tmp_path)
    server = NatsServer(tmp_path / "nats", port, config)
    await asyncio.to_thread(server.start)
    later = tmp_path / "later.creds"
    try:
        async with open_bus(BusSettings(servers=(server.url,), name="test", credentials=later)) as bus:
            await until(lambda: asyncio.sleep(0, capfd.readouterr()), _tells, "the missing file is logged", SOON_S)
            assert not await publishes(bus)
            credentials.rename(later)
            await until(lambda: publishes(bus), bool, "connected", SOON_S)
    finally:
        await asyncio.to_thread(server.kill)


def _tells(output: tuple[str, str]) -> bool:
    return "No such file" in "".join(output)


async def test_a_missing_authority_is_logged_and_tried_again(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    settings = BusSettings(servers=("tls://127.0.0.1:9",), name="test", ca=tmp_path / "ca.pem")
    async with open_bus(settings):
        await until(lambda: asyncio.sleep(0, capfd.readouterr()), _tells, "the missing file is logged", SOON_S)
        write_certificate(tmp_path, "ca")[0].rename(tmp_path / "ca.pem")
        await until(lambda: asyncio.sleep(0, capfd.readouterr()), _refused, "it connects", SOON_S)


def _refused(output: tuple[str, str]) -> bool:
    return "NATS cannot be reached" in "".join(output)


def missing(path: Path) -> None:
    path.unlink(missing_ok=True)


def empty(path: Path) -> None:
    path.write_text("")


def damaged(path: Path) -> None:
    _, credentials = write_nats_user(path.parent)
    path.write_text(credentials.read_text().replace("\nSU", "\nSV"))


@pytest.mark.parametrize("name", ["nats_credentials", "nats_ca"])
@pytest.mark.parametrize("damage", [missing, empty, damaged])
@pytest.mark.parametrize("serve", [serve_gateway, serve_api])
async def test_a_file_that_is_no_use_is_told_before_anything_starts(
    tmp_path: Path, name: str, damage: Callable[[Path], None], serve: Callable[[Settings], Awaitable[None]]
) -> None:
    damage(tmp_path / "file")
    settings = load_settings(
        site="north",
        cluster_key="k" * 32,
        postgres_url="postgresql://nobody@127.0.0.1:9/none",
        data_dir=tmp_path / "data",
        **{name: tmp_path / "file"},
    )
    with pytest.raises(SettingsError, match=f"^WAYDROP_{name.upper()}: {tmp_path}/file cannot be used: "):
        await serve(settings)
    assert not (tmp_path / "data").exists()
