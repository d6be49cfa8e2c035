"""Probabilistic Dynamic Movement Primitives: learn a movement, execute it with feedback, know when it goes wrong.

Source: F. Meier, S. Schaal, A Probabilistic Representation for Dynamic Movement Primitives (2016).

Names are loaded when first used, so that `import probdmp` and the command line's help cost next to nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from probdmp.demonstrations import Demonstration, demonstration_from_times, synthetic_arm_movements, synthetic_letters
    from probdmp.detection import FailureDetector, Verdict
    from probdmp.dmp import Primitive, Task
    from probdmp.errors import InputError, ModelFileError, ProbDMPError
    from probdmp.estimator import PrimitiveLibrary, ProbabilisticDMP, load, load_detector
    from probdmp.execution import GaussianTrajectory, OnlineExecution, TrackedTrajectory
    from probdmp.io import read_demonstrations, write_demonstrations

__all__ = [
    "Demonstration",
    "FailureDetector",
    "GaussianTrajectory",
    "InputError",
    "ModelFileError",
    "OnlineExecution",
    "Primitive",
    "PrimitiveLibrary",
    "ProbDMPError",
    "ProbabilisticDMP",
    "Task",
    "TrackedTrajectory",
    "Verdict",
    "demonstration_from_times",
    "load",
    "load_detector",
    "read_demonstrations",
    "synthetic_arm_movements",
    "synthetic_letters",
    "write_demonstrations",
]

__version__ = "0.1.0"

_HOMES = {
    "demonstrations": ("Demonstration", "demonstration_from_times", "synthetic_arm_movements", "synthetic_letters"),
    "detection": ("FailureDetector", "Verdict"),
    "dmp": ("Primitive", "Task"),
    "errors": ("InputError", "ModelFileError", "ProbDMPError"),
    "estimator": ("PrimitiveLibrary", "ProbabilisticDMP", "load", "load_detector"),
    "execution": ("GaussianTrajectory", "OnlineExecution", "TrackedTrajectory"),
    "io": ("read_demonstrations", "write_demonstrations"),
}
"""Which sub-package each public name comes from."""


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            value = getattr(import_module(f"probdmp.{home}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module 'probdmp' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
