"""Webhooks: the lifecycle of a delivery, its messages, and their signatures."""
