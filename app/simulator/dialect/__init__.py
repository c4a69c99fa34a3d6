"""The MAVLink 2 dialect of the simulated vehicles, as a pymavlink module.

`mavlink` is made from waydrop.xml by app/simulator/dialect_build.py, hence untyped: its message classes are built only
in the files that send (streams, command acks, mission protocol), with keyword-free positional fields in XML order.
"""

from __future__ import annotations

import importlib.util
import os
from types import ModuleType
from typing import Any

from app.simulator.dialect_build import module_path


def _load() -> ModuleType:
    os.environ["MAVLINK20"] = "1"  # read by the generated module when it packs
    spec = importlib.util.spec_from_file_location("waydrop_dialect", module_path())
    if spec is None or spec.loader is None:  # pragma: no cover - importlib contract
        raise ImportError("the generated MAVLink dialect cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


mavlink: Any = _load()

Message = Any
"""A MAVLink message of the generated module (mavlink.MAVLink_message)."""
