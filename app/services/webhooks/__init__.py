"""Webhooks: messages about deliveries to other systems, in order, at least once."""

from app.services.webhooks.views import WebhookSettings
from app.services.webhooks.webhooks import Webhooks

__all__ = ["WebhookSettings", "Webhooks"]
