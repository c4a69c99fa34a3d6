"""Whose address counts behind a proxy: only proxies that were named are believed."""

from __future__ import annotations

import ipaddress
from dataclasses import replace
from pathlib import Path

import pytest

from app.api.connections import ConnectionLimits
from app.api.proxies import Network, TrustedProxies
from app.services.access import Role
from app.services.attempts import MOST_FAILURES
from tests.support.connections import served
from tests.support.raw_socket import exchange, status_of
from tests.support.service_in_process import SETTINGS, Service, run_service

HERE = (ipaddress.ip_network("127.0.0.1/32"),)
NAMED = TrustedProxies([ipaddress.ip_network(one) for one in ("127.0.0.1/32", "10.0.0.0/8", "2001:db8::/32")])


@pytest.mark.parametrize(
    ("peer", "forwarded_for", "client"),
    [
        ("127.0.0.1", ["203.0.113.7"], "203.0.113.7"),
        ("127.0.0.1", ["198.51.100.1, 203.0.113.7"], "203.0.113.7"),
        ("127.0.0.1", ["198.51.100.1", "203.0.113.7, 10.1.2.3"], "203.0.113.7"),
        ("::ffff:127.0.0.1", ["203.0.113.7"], "203.0.113.7"),
        ("2001:db8::1", ["2001:470::9"], "2001:470::9"),
        ("127.0.0.1", ["10.1.2.3, 10.1.2.4"], "10.1.2.3"),
        ("127.0.0.1", ["203.0.113.7, unknown"], "127.0.0.1"),
        ("127.0.0.1", ["203.0.113.7:5000"], "127.0.0.1"),
        ("127.0.0.1", [""], "127.0.0.1"),
        ("127.0.0.1", [], "127.0.0.1"),
        ("203.0.113.9", ["198.51.100.1"], "203.0.113.9"),
        ("", ["198.51.100.1"], ""),
    ],
)
def test_the_client_is_the_last_address_that_no_named_proxy_has(
    peer: str, forwarded_for: list[str], client: str
) -> None:
    assert NAMED.client_of(peer, forwarded_for) == client


def test_without_names_nobody_is_believed() -> None:
    assert TrustedProxies(()).client_of("127.0.0.1", ["203.0.113.7"]) == "127.0.0.1"


async def guess(service: Service, client: str) -> int:
    """The status of an attempt that says it comes from there."""
    headers = {"X-Forwarded-For": client, "Authorization": "Bearer wd_guess"}
    return (await service.call("GET", "/api/v1/vehicles", headers=headers))[0]


@pytest.mark.parametrize(("proxies", "others"), [(HERE, 401), ((), 429)])
async def test_attempts_count_for_the_client_of_a_named_proxy_and_else_for_whoever_connects(
    tmp_path: Path, proxies: tuple[Network, ...], others: int
) -> None:
    settings = replace(SETTINGS, trusted_proxies=proxies)
    async with run_service(tmp_path, settings=settings) as service:
        await service.token(Role.VIEWER)
        for _ in range(MOST_FAILURES):
            assert await guess(service, "203.0.113.7") == 401
        assert await guess(service, "203.0.113.7") == 429
        assert await guess(service, "203.0.113.8") == others


async def test_a_named_proxy_may_have_more_connections_than_a_client() -> None:
    limits = ConnectionLimits(most=12, most_per_address=2, proxies=HERE)
    slow = b"GET /slow HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    async with served(limits) as port:
        for _ in range(6):
            with pytest.raises(TimeoutError):
                await exchange(port, slow, timeout_s=0.1)
        assert status_of(await exchange(port, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n")) == 200
