"""The autopilot's missions: items, their checks, the store with two slots, and the transfer protocol."""
