"""What to type to do the same again."""

from shlex import join
from typing import Any

__all__ = ["command_line"]


def command_line(context: Any, leave_out: tuple[str, ...] = ("as_json",)) -> str:
    """The command that a verb was called with, arguments first, then the options that are not as by default.

    Parameters
    ----------
    context : typer's, of the verb.
    leave_out : names of parameters that change nothing of what is made.
    """
    words, options = [context.info_name], []
    for parameter in context.command.params:
        value = context.params.get(parameter.name)
        if parameter.name in leave_out or value is None:
            continue
        if parameter.param_type_name == "argument":
            words += map(str, value) if isinstance(value, list | tuple) else [str(value)]
        elif value != parameter.get_default(context):
            options += [parameter.opts[0]] if value is True else [parameter.opts[0], str(value)]
    return join(["probdmp", *words, *options])
