"""Jobs: plans wait for a vehicle, are given to one that can, and begun one after the other."""

from app.services.jobs.jobs import Jobs
from app.services.jobs.views import JobSettings

__all__ = ["JobSettings", "Jobs"]
