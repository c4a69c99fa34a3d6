"""Sending webhooks over HTTP: a client only, which trusts no receiver."""

from app.webhooks.http_sender import open_sender

__all__ = ["open_sender"]
