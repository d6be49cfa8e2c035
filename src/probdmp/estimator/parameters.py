"""The manners of scikit-learn's estimators: constructor arguments are stored, listed and changed by name."""

from inspect import signature
from typing import Any, Self

from probdmp.checks import check_choice

__all__ = ["HasParameters"]


class HasParameters:
    """A class whose constructor does nothing but store its arguments under their own names."""

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """The constructor's arguments by name."""
        return {name: getattr(self, name) for name in signature(type(self).__init__).parameters if name != "self"}

    def set_params(self, **parameters: Any) -> Self:
        """Change constructor's arguments by name."""
        for name, value in parameters.items():
            check_choice(name, "the name of a parameter", self.get_params())
            setattr(self, name, value)
        return self

    def __repr__(self) -> str:
        arguments = ", ".join(f"{name}={value!r}" for name, value in self.get_params().items())
        return f"{type(self).__name__}({arguments})"
