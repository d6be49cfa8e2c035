"""How the help of a verb looks."""

from typing import Any

from typer.core import TyperCommand

__all__ = ["Verb"]


class Verb(TyperCommand):
    """A verb whose arguments are shown as they are called, `FILE…`, without braces and types."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """What follows the name of the verb in the first line."""
        return ["[OPTIONS]", *(_name(parameter) for parameter in _arguments(self, ctx))]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Arguments, then options."""
        arguments = _arguments(self, ctx)
        options = [parameter for parameter in self.get_params(ctx) if parameter not in arguments]
        rows = [(_name(argument), getattr(argument, "help", "") or "") for argument in arguments]
        records = [record for record in (option.get_help_record(ctx) for option in options) if record]
        for title, listed in (("Arguments", rows), ("Options", records)):
            if listed:
                with formatter.section(title):
                    formatter.write_dl(listed)


def _arguments(verb: TyperCommand, ctx: Any) -> list[Any]:
    return [parameter for parameter in verb.get_params(ctx) if parameter.param_type_name == "argument"]


def _name(argument: Any) -> str:
    name = argument.metavar or argument.name.upper()
    return name if argument.required else f"[{name}]"
