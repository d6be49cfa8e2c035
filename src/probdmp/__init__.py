"""Probabilistic Dynamic Movement Primitives: learn a movement, execute it with feedback, know when it goes wrong.

Source: F. Meier, S. Schaal, A Probabilistic Representation for Dynamic Movement Primitives (2016).
"""

from probdmp.demonstrations import Demonstration, demonstration_from_times, synthetic_letters
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
    "synthetic_letters",
    "write_demonstrations",
]

__version__ = "0.1.0"
