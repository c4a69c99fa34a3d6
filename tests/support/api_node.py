"""An API node of a cluster in this process, and a gateway with vehicles: the other form of a service under test."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

import nats
import pytest

from app.api import ApiServices
from app.cluster import BusSettings, open_bus
from app.cluster_application import api_node, joined
from app.config import Settings
from app.domain.cluster.errors import BusDownError, GatewayUnreachableError, NoReplyError
from app.domain.cluster.ports import Bus
from app.services.access import Access
from app.services.clock import SystemClock
from app.services.remote.gateway_services import GatewayServices
from app.services.remote.webhooks import LEADER_CALLS
from app.storage.postgres import open_cluster_storage
from tests.support.cluster_servers import PostgresDatabases, nats_server, postgres_databases
from tests.support.service_in_process import Service, run_service
from tools.cluster_servers import NatsServer

SITE: Final = "north"
SOON_S: Final = 60.0
LOOK_AGAIN_S: Final = 0.02


@dataclass(frozen=True)
class ClusterServers:
    """NATS and PostgreSQL, for one test after the other."""

    nats: NatsServer
    databases: PostgresDatabases

    def emptied(self) -> str:
        """Forget what the test before has stored; the URL of the database. It blocks."""
        asyncio.run(_delete_streams(self.nats.url))
        return self.databases.with_tables()


async def _delete_streams(url: str) -> None:
    client = await nats.connect(url)
    jetstream = client.jetstream()
    for stream in await jetstream.streams_info():
        await jetstream.delete_stream(stream.config.name)
    await client.close()


@contextmanager
def cluster_servers() -> Iterator[ClusterServers]:
    """Servers of their own for the block."""
    with postgres_databases() as databases, nats_server() as nats:
        yield ClusterServers(nats, databases)


@asynccontextmanager
async def run_node(folder: Path, servers: ClusterServers) -> AsyncIterator[Service]:
    """An API node, and the vehicles of `run_service` at a gateway. The servers must be empty."""
    settings = Settings(
        data_dir=folder / "node",
        port=0,
        postgres_url=await asyncio.to_thread(servers.emptied),
        nats_servers=(servers.nats.url,),
        cluster_key="a key that only this test's parts have",
        site=SITE,
        telemetry_period_s=LOOK_AGAIN_S,
    )
    bus_settings = BusSettings(servers=settings.nats_servers, name="test")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("app.services.remote.journal.REACHED_TIMEOUT_S", SOON_S)  # or a late view answers
        patch.setattr("app.services.projection.WAITING_TIMEOUT_S", LOOK_AGAIN_S)  # nothing waits from before the start
        async with run_service(folder, site=SITE) as gateway, api_node(settings) as url, open_bus(bus_settings) as bus:
            await _until_answered(bus, LEADER_CALLS)  # or the relay asks in vain at first
            async with (
                joined(settings, gateway.storage, _gateway_services(gateway.services)),
                open_cluster_storage(_text(settings), key_file=folder / "secret.key") as store,
            ):
                access = Access(store.tokens, SystemClock(), None)
                services = replace(gateway.services, access=access)
                node = replace(gateway, port=urlsplit(url).port or 0, services=services, site=SITE)
                await _until_reported(node)
                yield node


def _gateway_services(services: ApiServices) -> GatewayServices:
    return GatewayServices(**{field.name: getattr(services, field.name) for field in fields(GatewayServices)})


def _text(settings: Settings) -> str:
    return "" if settings.postgres_url is None else settings.postgres_url.get_secret_value()


async def _until_answered(bus: Bus, subject: str) -> None:
    async with asyncio.timeout(SOON_S):
        while True:
            try:
                await bus.request(subject, b"", timeout_s=SOON_S)
            except (BusDownError, GatewayUnreachableError, NoReplyError):
                await asyncio.sleep(LOOK_AGAIN_S)
            else:
                return


async def _until_reported(node: Service) -> None:
    """Wait until the node has the gateway's vehicles."""
    async with asyncio.timeout(SOON_S):
        while len((await node.call("GET", "/api/v1/vehicles"))[2]["vehicles"]) < len(node.links):
            await asyncio.sleep(LOOK_AGAIN_S)
