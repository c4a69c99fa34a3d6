"""The HTTP and websocket side: the only importer of aiohttp's server."""
