"""A library of two letters, executions of it that are fine and blocked, and how they are written for a fleet."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from probdmp import FailureDetector, PrimitiveLibrary, synthetic_letters
from probdmp.demonstrations import Demonstration, hold

VARIED = {"n_basis": 8, "weight_model": "hierarchical", "weight_uncertainty": "joint"}


@dataclass(frozen=True)
class Fleet:
    """Files and what is in them."""

    folder: Path
    library: PrimitiveLibrary
    detector: FailureDetector
    executions: list[Demonstration]

    @property
    def model(self) -> Path:
        """With the calibrated detector."""
        return self.folder / "letters.probdmp"

    @property
    def quick(self) -> Path:
        """With the paper's rule, which takes no time."""
        return self.folder / "paper.probdmp"


@pytest.fixture(scope="session")
def fleet(tmp_path_factory) -> Fleet:
    folder = tmp_path_factory.mktemp("fleet")
    taught, executions = {}, []
    for label in "cl":
        recordings = synthetic_letters(12, seed=1, letters=label, dt=0.03)
        taught[label], new = recordings[:8], recordings[8:]
        rng = np.random.default_rng(0)
        executions += [*new, replace(new[0], positions=hold(new[0].positions, new[0].n_samples // 2, rng))]
    library = PrimitiveLibrary.fit(taught, **VARIED)
    detector = FailureDetector().fit(library, taught)
    library.save(folder / "letters.probdmp", detector)
    library.save(folder / "paper.probdmp", FailureDetector(rule="paper").fit(library, taught))
    library.save(folder / "bare.probdmp")
    return Fleet(folder, library, detector, executions)


@pytest.fixture
def write(tmp_path) -> Callable[..., Path]:
    """`write("name", columns, row_group_size=…)`: a Parquet file in the folder of the test."""

    def write(name: str, columns: dict[str, Any], **options: Any) -> Path:
        pq.write_table(pa.table(columns), tmp_path / f"{name}.parquet", **options)
        return tmp_path / f"{name}.parquet"

    return write
