"""Messages between the parts of a cluster: the only importer of nats."""

from app.cluster.nats_bus import BusSettings, open_bus, unusable_files

__all__ = ["BusSettings", "open_bus", "unusable_files"]
