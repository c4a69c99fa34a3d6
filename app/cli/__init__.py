"""The waydrop command."""
