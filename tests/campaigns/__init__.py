"""Campaigns: long searches for what breaks. Each is a command with a short form that runs in CI."""
