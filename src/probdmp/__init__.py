"""Probabilistic Dynamic Movement Primitives: learn a movement, execute it with feedback, know when it goes wrong.

Source: F. Meier, S. Schaal, A Probabilistic Representation for Dynamic Movement Primitives (2016).

Names are loaded when first used, so that `import probdmp` and the command line's help cost next to nothing.
"""

from typing import TYPE_CHECKING

from probdmp.loading import loaded_when_used

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

__getattr__, __dir__ = loaded_when_used(
    __name__,
    {
        "demonstrations": ("Demonstration", "demonstration_from_times", "synthetic_arm_movements", "synthetic_letters"),
        "detection": ("FailureDetector", "Verdict"),
        "dmp": ("Primitive", "Task"),
        "errors": ("InputError", "ModelFileError", "ProbDMPError"),
        "estimator": ("PrimitiveLibrary", "ProbabilisticDMP", "load", "load_detector"),
        "execution": ("GaussianTrajectory", "OnlineExecution", "TrackedTrajectory"),
        "io": ("read_demonstrations", "write_demonstrations"),
    },
)
