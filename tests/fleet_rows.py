"""Executions in the layouts that a fleet's files have."""

from typing import Any

import numpy as np

from probdmp.demonstrations import Demonstration

__all__ = ["dense_rows_of", "rows_of"]


def rows_of(executions: list[Demonstration], **more: Any) -> dict[str, Any]:
    """The long layout, as columns; names are e0, e1, …"""
    lengths = [execution.n_samples for execution in executions]
    return {
        "execution_id": np.repeat([f"e{k}" for k in range(len(executions))], lengths),
        "primitive": np.repeat([execution.label for execution in executions], lengths),
        "t": np.concatenate([execution.times for execution in executions]),
        **{name: np.concatenate([execution.positions[:, i] for execution in executions]) for i, name in enumerate("xy")},
    } | more


def dense_rows_of(executions: list[Demonstration]) -> dict[str, Any]:
    """The dense layout."""
    return {
        "execution_id": [f"e{k}" for k in range(len(executions))],
        "primitive": [execution.label for execution in executions],
        "dt": [execution.dt for execution in executions],
        **{name: [execution.positions[:, i].tolist() for execution in executions] for i, name in enumerate("xy")},
    }
