"""Runs: one flight of one plan by one vehicle, from its creation to a known end."""

from app.services.runs.runs import Runs
from app.services.runs.settings import RunSettings

__all__ = ["RunSettings", "Runs"]
