"""What administrators are shown of a webhook. Never its secret."""

from __future__ import annotations

from enum import StrEnum

from pydantic import BaseModel, ConfigDict

from app.domain.webhooks.hook import Progress, Webhook


class HookState(StrEnum):
    """How a webhook stands. `stopped` is a defect of ours: the log has it, and a change or a restart begins anew."""

    DELIVERING = "delivering"
    RETRYING = "retrying"
    DISABLED = "disabled"
    STOPPED = "stopped"


class WebhookView(BaseModel):
    """A webhook, its progress, and how many events of the journal are still before it."""

    model_config = ConfigDict(frozen=True)

    webhook: Webhook
    state: HookState
    progress: Progress
    events_behind: int


class WebhookTestView(BaseModel):
    """How a test message went. `status` is the receiver's, null if it gave none."""

    model_config = ConfigDict(frozen=True)

    delivered: bool
    status: int | None
    problem: str
    message_id: str
