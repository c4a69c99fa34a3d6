"""The MAVLink side: vehicles on native mavsdk. The only importer of mavsdk."""

from app.vehicles.link_guard.key_file import KeyFile, LinkKeyFiles, MemoryFile
from app.vehicles.link_guard.memory import SigningStore
from app.vehicles.link_source import MavsdkLinkSource
from app.vehicles.native import provide_cache_directory
from app.vehicles.settings import LinkSettings
from app.vehicles.simulator_control import SimulatorControlSocket

__all__ = [
    "KeyFile",
    "LinkKeyFiles",
    "LinkSettings",
    "MavsdkLinkSource",
    "MemoryFile",
    "SigningStore",
    "SimulatorControlSocket",
    "provide_cache_directory",
]
