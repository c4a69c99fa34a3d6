"""Waydrop: the service between a dispatch system and delivery vehicles that speak MAVLink."""

__version__ = "0.1.0"
