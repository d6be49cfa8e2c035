"""The movement primitive: phase, basis, spring-damper system, forcing term, and the linear system they make."""

from probdmp.dmp.channels import ChannelVariation, Signals
from probdmp.dmp.configuration import PUBLISHED, Configuration
from probdmp.dmp.path_distribution import path_distribution
from probdmp.dmp.primitive import Primitive, task_for
from probdmp.dmp.state_space import control_inputs, linear_gaussian_model, step_count
from probdmp.dmp.task import Task, demonstrated_tasks, stack_tasks, take_tasks, unstack_tasks
from probdmp.dmp.variation import PathDistribution, Variation
from probdmp.dmp.via_points import ViaPoint, condition_primitive

__all__ = [
    "PUBLISHED",
    "ChannelVariation",
    "Configuration",
    "PathDistribution",
    "Primitive",
    "Signals",
    "Task",
    "Variation",
    "ViaPoint",
    "condition_primitive",
    "control_inputs",
    "demonstrated_tasks",
    "linear_gaussian_model",
    "path_distribution",
    "stack_tasks",
    "step_count",
    "take_tasks",
    "task_for",
    "unstack_tasks",
]
