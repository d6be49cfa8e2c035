"""Many executions at once: a Parquet file of them scored, on this machine or on a cluster, or a library learned from it."""

from probdmp.fleet.scoring import FleetSummary, score_executions
from probdmp.fleet.teaching import Teaching, teaching_executions

__all__ = ["FleetSummary", "Teaching", "score_executions", "teaching_executions"]
