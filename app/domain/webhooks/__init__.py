"""Webhooks: what a delivery's lifecycle is, how it is told to other systems, and how they know that it is true."""
