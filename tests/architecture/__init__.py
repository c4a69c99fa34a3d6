"""The laws of the architecture that a machine can check (docs/architecture.md)."""
