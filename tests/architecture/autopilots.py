"""Where an autopilot's own names may stand: parameters, mode numbers, firmware versions."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator

from pymavlink.dialects.v20 import common

from tests.architecture.sources import ROOT, Source

FAMILY = "app/domain/autopilot/"
ONE = re.compile(rf"{FAMILY}\w+/")
"""The folder of one autopilot."""
FOLDERS = re.compile(rf"{ONE.pattern}|app/vehicles/|app/simulator/")
"""Here everything may be named."""
GROUPS = (
    "ASPD BAT BAT1 BAT2 CA CAL CBRK COM EKF2 FD FW GF HIL LNDFW LNDMC MAN MC MIS MNT MPC NAV NPFG PD PWM RA RC RD RO "
    "RTL RWTO SDLOG SENS SIH SIM SYS UAVCAN VT WV"
)
PARAMETER = re.compile(rf"\b(?:(?:{'|'.join(GROUPS.split())})(?:_[A-Z0-9]+)+|MAV_(?:SYS|COMP)_ID|MAV_PROTO_VER)")
COMMANDS = frozenset(entry.name.removeprefix("MAV_CMD_") for entry in common.enums["MAV_CMD"].values())
"""MAVLink's own: NAV_DELAY is no parameter."""
MODE_NUMBER = re.compile(r"custom_mode|main_mode|sub_mode")
VERSION = re.compile(r"(?:^|_)(?:firmware|SINCE|BEFORE)$")
ORDER = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)
CITING = {"rules.error": slice(1, 3), "rules.warning": slice(1, 3)}
"""Whose arguments are documentation: a rule's reason and source."""


def named_outside(sources: Iterable[Source]) -> list[str]:
    """What only one autopilot knows, outside of its folder. Docstrings and comments may cite it."""
    return [
        f"{source.at(node)}: {what}; ask app/domain/autopilot"
        for source in sources
        if source.path.startswith("app/") and not FOLDERS.match(source.path)
        for node, what in _named(source)
    ]


def folders_imported(sources: Iterable[Source]) -> list[str]:
    """Imports of one autopilot's folder: all others, vehicles/ too, ask app.domain.autopilot."""
    return [
        f"{source.at(node)}: imports {module}; ask app/domain/autopilot"
        for source in sources
        if source.path.startswith("app/") and not source.path.startswith(FAMILY)
        for node in source.nodes
        for module in _modules(node)
        if _is_folder_of_one(module)
    ]


def _is_folder_of_one(module: str) -> bool:
    path = module.replace(".", "/")
    return ONE.match(f"{path}/") is not None and (ROOT / "/".join(path.split("/")[:4])).is_dir()


def _named(source: Source) -> Iterator[tuple[ast.AST, str]]:
    cited = _citations(source)
    for node in source.nodes:
        match node:
            case ast.Constant(value=str(text)) if id(node) not in cited:
                yield from ((node, f"names the parameter {name}") for name in _parameters(text))
            case ast.Call(func=ast.Name(id="FirmwareVersion"), args=[ast.Constant(), *_]):
                yield node, "knows a firmware version"
            case ast.Compare(ops=ops, left=left, comparators=others) if any(isinstance(op, ORDER) for op in ops):
                if any(VERSION.search(_last_name(one)) for one in (left, *others)):
                    yield node, "branches on a firmware version"
            case ast.Name() | ast.Attribute() | ast.arg() | ast.keyword() if MODE_NUMBER.search(_last_name(node)):
                yield node, "handles a mode number"
            case _:
                pass


def _citations(source: Source) -> set[int]:
    """Strings that say something to a reader of the code or of the rules alone."""
    found: set[int] = set()
    for node in source.nodes:
        if isinstance(node, ast.Expr):
            found.add(id(node.value))
        elif isinstance(node, ast.Call) and ast.unparse(node.func) in CITING:
            cited = node.args[CITING[ast.unparse(node.func)]]
            found |= {id(part) for argument in cited for part in ast.walk(argument)}
    return found


def _parameters(text: str) -> list[str]:
    return [name for name in PARAMETER.findall(text) if name not in COMMANDS]


def _modules(node: ast.AST) -> list[str]:
    match node:
        case ast.ImportFrom(module=str(module), names=names):
            return [module, *(f"{module}.{one.name}" for one in names)]
        case ast.Import(names=names):
            return [one.name for one in names]
    return []


def _last_name(node: ast.AST) -> str:
    match node:
        case ast.Name(id=name) | ast.Attribute(attr=name) | ast.arg(arg=name):
            return name
        case ast.keyword(arg=str(name)):
            return name
    return ""
