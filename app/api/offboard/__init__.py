"""Offboard control over HTTP and over a websocket."""
