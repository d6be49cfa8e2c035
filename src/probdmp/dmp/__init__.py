"""The movement primitive: phase, basis, spring-damper system, forcing term, and the linear system they make."""

from probdmp.dmp.primitive import PUBLISHED, Configuration, Primitive, task_for
from probdmp.dmp.state_space import control_inputs, linear_gaussian_model, step_count
from probdmp.dmp.task import Task, demonstrated_tasks

__all__ = [
    "PUBLISHED",
    "Configuration",
    "Primitive",
    "Task",
    "control_inputs",
    "demonstrated_tasks",
    "linear_gaussian_model",
    "step_count",
    "task_for",
]
