"""What every WebhookStore promises."""

from __future__ import annotations

import pytest

from app.domain.errors import StorageError
from app.domain.webhooks.lifecycle import DeliveryEvent
from app.domain.webhooks.webhook import Progress, StoredWebhook, Webhook
from tests.contract.storage.conftest import Opener, Stores


def webhook(number: int = 1) -> StoredWebhook:
    hook = Webhook(
        id=f"hook-{number}",
        url="https://dispatch.example/größe",
        events=(DeliveryEvent.COMPLETED, DeliveryEvent.DROP_RELEASED),
        description="ward 3",
        created_at=1000.0,
        created_by="admin",
    )
    return StoredWebhook(hook, f"whsec_{number}", Progress(cursor=number))


async def test_webhooks_survive_a_restart_in_order_of_creation(opener: Opener) -> None:
    async with opener() as stores:
        for number in (2, 1, 3):
            await stores.webhooks.add(webhook(number))
    async with opener() as stores:
        assert list(await stores.webhooks.list_webhooks()) == [webhook(2), webhook(1), webhook(3)]


async def test_ids_are_unique(stores: Stores) -> None:
    await stores.webhooks.add(webhook())
    with pytest.raises(StorageError):
        await stores.webhooks.add(webhook())


async def test_settings_and_progress_are_stored_apart_and_the_secret_stays(stores: Stores) -> None:
    await stores.webhooks.add(webhook(1))
    await stores.webhooks.add(webhook(2))
    progress = Progress(cursor=7).failed(503, "HTTP 503", now=5.0, retry_s=2.0)
    await stores.webhooks.save_progress("hook-1", progress)
    changed = webhook(1).hook.model_copy(update={"enabled": False})
    await stores.webhooks.change(changed)
    listed = list(await stores.webhooks.list_webhooks())
    assert listed == [StoredWebhook(changed, "whsec_1", progress), webhook(2)]


async def test_one_that_is_deleted_is_gone_and_its_last_progress_hurts_nobody(stores: Stores) -> None:
    await stores.webhooks.add(webhook())
    await stores.webhooks.delete("hook-1")
    await stores.webhooks.save_progress("hook-1", Progress(cursor=9))
    await stores.webhooks.delete("hook-1")
    assert list(await stores.webhooks.list_webhooks()) == []
