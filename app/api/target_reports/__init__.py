"""The websocket over which a moving target is reported."""
