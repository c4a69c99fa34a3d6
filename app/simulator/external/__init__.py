"""Payload components beside the autopilot: each hears COMMAND_LONG and acknowledges by itself."""
