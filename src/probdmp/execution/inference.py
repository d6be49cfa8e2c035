"""The two ways to carry the uncertainty of the weights through recordings: redrawn at every step, or constant and unknown."""

from collections.abc import Callable
from typing import Any, NamedTuple

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive, Task, linear_gaussian_model
from probdmp.dmp.joint_model import joint_executions
from probdmp.execution.independent_filtering import filter_independent, smooth_all_independent, smooth_independent
from probdmp.execution.joint_filtering import FilteredRecordings, filter_joint, smooth_all_joint, smooth_joint
from probdmp.execution.sensor_array import SensorArray
from probdmp.gaussian import GaussianSequence

__all__ = ["INFERENCES", "Inference"]


class Inference(NamedTuple):
    """One of them; what `prepare` returns goes into the others, with observations (T, N, O) and the sensors that made them."""

    prepare: Callable[[Primitive, Task, FloatArray, int], Any]
    """N tasks, their dt (N,) in seconds, and T."""
    filter: Callable[[Any, FloatArray, SensorArray], FilteredRecordings]
    smooth: Callable[[Any, FloatArray, SensorArray], GaussianSequence]
    """The states of all signals, (T, N, S, 3), and their covariances, signal by signal."""
    smooth_all: Callable[[Any, FloatArray, SensorArray], tuple[float, FloatArray, FloatArray]]
    """Log-likelihood of all recordings, nats; the states (T, N, 3 S) and their covariances, of all signals together."""


INFERENCES: dict[str, Inference] = {
    "independent": Inference(linear_gaussian_model, filter_independent, smooth_independent, smooth_all_independent),
    "joint": Inference(joint_executions, filter_joint, smooth_joint, smooth_all_joint),
}
"""By `weight_uncertainty`."""
