"""HTTP and websockets: the only package that runs an aiohttp server."""

from app.api.application import build_app
from app.api.services import ApiServices
from app.api.settings import ApiSettings, MapSettings

__all__ = ["ApiServices", "ApiSettings", "MapSettings", "build_app"]
