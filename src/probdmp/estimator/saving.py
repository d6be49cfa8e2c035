"""What a model file keeps of estimators."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from probdmp.dmp import Primitive
from probdmp.errors import InputError
from probdmp.io import ModelContents, write_model
from probdmp.io.model_contents import provenance_here

if TYPE_CHECKING:
    from probdmp.detection import FailureDetector

__all__ = ["write_learned"]


def write_learned(
    path: str | Path,
    learned: Mapping[str, tuple[Primitive, Mapping[str, Any]]],
    detector: "FailureDetector | None",
    command: str = "",
) -> None:
    """Write a model file, atomically.

    Parameters
    ----------
    learned : by label, a primitive and the constructor arguments of its estimator.
    command : what to type to make the file again.

    Raises
    ------
    InputError
        If the detector was fitted to other primitives.
    """
    primitives = {label: primitive for label, (primitive, _) in learned.items()}
    state = None if detector is None else detector.state()
    if detector is not None and _identities(detector.primitives_) != _identities(primitives):
        raise InputError("a detector fitted to these primitives", "one for others", "Fit it to them first.")
    settings = {label: _plain(parameters) for label, (_, parameters) in learned.items()}
    made = {**provenance_here(), **({"command": command} if command else {})}
    write_model(path, ModelContents(primitives, settings, state, made))


def _identities(primitives: Mapping[str, Primitive]) -> set[str]:
    return {primitive.identity for primitive in primitives.values()}


def _plain(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers of NumPy as numbers of Python, and tuples as lists, which a model file can hold."""
    as_numbers = {name: value.item() if isinstance(value, np.generic) else value for name, value in parameters.items()}
    return {name: list(value) if isinstance(value, tuple) else value for name, value in as_numbers.items()}
