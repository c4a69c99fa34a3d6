"""docs/how-to/receive-webhooks.md: its receiver is run as it stands there, and its table has every event."""

from __future__ import annotations

import asyncio
import os
import re
import sys
import time
from asyncio.subprocess import PIPE
from collections.abc import Iterator
from typing import Any

import pytest

from app.domain.webhooks.lifecycle import DeliveryEvent
from app.domain.webhooks.webhook import MAX_HOOKS, Backoff
from app.webhooks.http_sender import TOTAL_S
from tests.support.cluster_servers import held_port
from tests.support.deliveries import DELIVERED, a_plan, deliver
from tests.support.paths import ROOT
from tests.support.service_in_process import Service

PAGE = (ROOT / "docs" / "how-to" / "receive-webhooks.md").read_text(encoding="utf-8")


@pytest.fixture
def port() -> Iterator[int]:
    """A port that nobody else is given before the receiver takes it."""
    with held_port() as held:
        yield held


async def test_the_receiver_of_the_page_takes_what_is_signed_and_nothing_else(
    service: Service, plan: dict[str, Any], port: int
) -> None:
    program = re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert program is not None
    url = f"http://127.0.0.1:{port}/"
    plan_id = await a_plan(service, plan)
    _, _, made = await service.call("POST", "/api/v1/webhooks", json={"url": url})
    environment = {**os.environ, "SECRET": made["secret"], "PORT": str(port)}
    receiver = await asyncio.create_subprocess_exec(
        sys.executable, "-c", program.group(1), env=environment, stdout=PIPE, stderr=asyncio.subprocess.DEVNULL
    )
    try:
        await deliver(service.services.journal, plan_id, "run-1")
        assert receiver.stdout is not None
        async with asyncio.timeout(60):
            assert [(await receiver.stdout.readline()).decode().strip() for _ in DELIVERED] == DELIVERED
        forged = {
            "webhook-id": "x",
            "webhook-timestamp": str(int(time.time())),
            "webhook-signature": f"v1,{'A' * 43}=",
        }
        async with service.http.post(url, data=b'{"type": "forged"}', headers=forged) as answer:
            assert answer.status == 401
    finally:
        receiver.kill()
        rest, _ = await receiver.communicate()
    assert rest == b"", "nothing forged, and nothing twice"


def test_the_receiver_is_short_enough_to_be_read() -> None:
    program = re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert program is not None
    assert len([line for line in program.group(1).splitlines() if line.strip()]) <= 20


def test_every_event_is_in_the_table_and_no_other() -> None:
    listed = re.findall(r"^\| `((?:delivery|drop|job|queue|webhook)\.[a-z_]+)` \|", PAGE, re.MULTILINE)
    assert sorted(listed) == sorted(DeliveryEvent)


def test_the_numbers_of_the_page_are_those_of_the_code() -> None:
    assert f"At most {MAX_HOOKS} webhooks" in PAGE
    assert f"within {TOTAL_S:g} s" in PAGE
    assert f"after {Backoff().first_s:g} s" in PAGE
    assert Backoff().longest_s == 3600.0
