"""Commands whose modules are imported when they run: a list of commands needs names and a line of help alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, ClassVar

import typer
from typer.core import TyperCommand, TyperGroup

from app.cli.loading import loaded_for_good


@dataclass(frozen=True, slots=True)
class LazyCommand:
    """`where` is `module:name` of a function or of a Typer app; `help` its first line. `settings` are typer's."""

    name: str
    where: str
    help: str
    settings: Mapping[str, Any] = field(default_factory=dict)

    def load(self) -> Any:
        """Import it, as the command that click runs."""
        module, _, name = self.where.partition(":")
        with loaded_for_good():
            found = getattr(import_module(module), name)
        if isinstance(found, typer.Typer):
            command: Any = typer.main.get_group(found)
        else:
            alone = typer.Typer(add_completion=False)
            alone.command(**self.settings)(found)
            command = typer.main.get_command(alone)
        command.name = self.name
        return command


class LazyGroup(TyperGroup):
    """Subclasses define the commands."""

    lazy: ClassVar[tuple[LazyCommand, ...]] = ()

    def list_commands(self, ctx: Any) -> list[str]:
        """In the order of the table."""
        return [command.name for command in self.lazy]

    def get_command(self, ctx: Any, cmd_name: str) -> TyperCommand | None:
        """What the list of commands shows of it."""
        found = next((command for command in self.lazy if command.name == cmd_name), None)
        return None if found is None else TyperCommand(found.name, help=found.help)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """The command that is run, imported."""
        name, shown, rest = super().resolve_command(ctx, args)
        found = next((command for command in self.lazy if command.name == name), None)
        return name, shown if found is None else found.load(), rest
