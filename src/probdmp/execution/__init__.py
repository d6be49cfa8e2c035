"""Running a primitive: rollout, tracking, smoothing and sampling of recordings, online execution."""

from probdmp.execution.online import ExecutionStep, Judgement, Monitor, Observed, OnlineExecution
from probdmp.execution.recordings import (
    check_tasks,
    filter_recordings,
    score_recordings,
    smooth_recording,
    task_of_recording,
    track_recording,
)
from probdmp.execution.rollout import position_covariances, roll_out, sample_trajectories
from probdmp.execution.trajectory import GaussianTrajectory, TrackedTrajectory

__all__ = [
    "ExecutionStep",
    "GaussianTrajectory",
    "Judgement",
    "Monitor",
    "Observed",
    "OnlineExecution",
    "TrackedTrajectory",
    "check_tasks",
    "filter_recordings",
    "position_covariances",
    "roll_out",
    "sample_trajectories",
    "score_recordings",
    "smooth_recording",
    "task_of_recording",
    "track_recording",
]
