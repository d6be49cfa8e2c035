"""Running a primitive: rollout, tracking, smoothing and sampling of recordings, online execution."""

from probdmp.execution.execution_batch import ExecutionBatch, is_batch, own_batch
from probdmp.execution.execution_step import ExecutionStep, Judgement
from probdmp.execution.feedback_gains import feedback_gains
from probdmp.execution.movement_change import MovementChange, movement_change
from probdmp.execution.online import Monitor, Observed, OnlineExecution
from probdmp.execution.passing import via_points_for
from probdmp.execution.plain_sensors import sensors_as_plain, sensors_from_plain
from probdmp.execution.planar_arm import PlanarArm, planar_arm_sensor
from probdmp.execution.readings import readings_of, recording_of_readings
from probdmp.execution.recordings import (
    check_tasks,
    filter_recordings,
    smooth_recording,
    smooth_recordings,
    task_of_recording,
    track_recording,
)
from probdmp.execution.rollout import position_covariances, roll_out, sample_recordings, sample_states, sample_trajectories
from probdmp.execution.scoring import score_batch, score_recordings
from probdmp.execution.sensor_array import SensorArray
from probdmp.execution.sensor_noise import SensorNoise, estimate_sensor_noise
from probdmp.execution.sensor_reports import SensorCounts, SensorTrack
from probdmp.execution.sensors import ChannelSensor, LinearSensor, NonlinearSensor, Sensor, default_sensors, state_sensor
from probdmp.execution.simulated_pen import DISTURBANCES, SimulatedPen, planned_recording
from probdmp.execution.trajectory import GaussianChannel, GaussianTrajectory, TrackedTrajectory

__all__ = [
    "DISTURBANCES",
    "ChannelSensor",
    "ExecutionBatch",
    "ExecutionStep",
    "GaussianChannel",
    "GaussianTrajectory",
    "Judgement",
    "LinearSensor",
    "Monitor",
    "MovementChange",
    "NonlinearSensor",
    "Observed",
    "OnlineExecution",
    "PlanarArm",
    "Sensor",
    "SensorArray",
    "SensorCounts",
    "SensorNoise",
    "SensorTrack",
    "SimulatedPen",
    "TrackedTrajectory",
    "check_tasks",
    "default_sensors",
    "estimate_sensor_noise",
    "feedback_gains",
    "filter_recordings",
    "is_batch",
    "movement_change",
    "own_batch",
    "planar_arm_sensor",
    "planned_recording",
    "position_covariances",
    "readings_of",
    "recording_of_readings",
    "roll_out",
    "sample_recordings",
    "sample_states",
    "sample_trajectories",
    "score_batch",
    "score_recordings",
    "sensors_as_plain",
    "sensors_from_plain",
    "smooth_recording",
    "smooth_recordings",
    "state_sensor",
    "task_of_recording",
    "track_recording",
    "via_points_for",
]
