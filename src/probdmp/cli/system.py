"""What the program runs on: what to put into a report of a problem."""

import os
import platform
import sys
from pathlib import Path
from typing import Any

from probdmp import __version__
from probdmp.cli.output import print_table

__all__ = ["print_system", "system_summary"]

REQUIRED = ("numpy", "scipy", "safetensors", "typer", "rich")
EXTRAS = {
    "plot": ("matplotlib",),
    "fleet": ("pyarrow", "dask", "distributed", "threadpoolctl"),
    "lerobot": ("pyarrow",),
    "ros": ("rosbags", "mcap"),
    "sklearn": ("scikit-learn",),
    "foxglove": ("foxglove-sdk",),
    "rerun": ("rerun-sdk",),
    "studio": ("starlette", "uvicorn", "websockets"),
}
"""By extra: the packages that it brings."""
RECORDINGS = "PROBDMP_RECORDINGS"
KERNELS = {
    "compiled": "compiled",
    "switched off": "NumPy: PROBDMP_NO_EXTENSION is set",
    "not built": "NumPy: no compiler was found at installation; slower, but all there",
}
THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


def system_summary() -> dict[str, Any]:
    """Versions, the linear algebra behind NumPy, processors, and what the environment says; None for what is not there."""
    recordings = os.environ.get(RECORDINGS)
    return {
        "probdmp": __version__,
        "python": platform.python_version(),
        "executable": sys.executable,
        "platform": platform.platform(),
        "packages": {name: _version(name) for name in REQUIRED},
        "extras": {extra: {name: _version(name) for name in names} for extra, names in EXTRAS.items()},
        "kernels": _kernels(),
        "blas": _blas(),
        "threads": {name: os.environ[name] for name in THREADS if name in os.environ},
        "processors": os.cpu_count(),
        "processors_allowed": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "recordings": recordings,
        "recordings_found": recordings is not None and Path(recordings).is_dir(),
    }


def print_system(summary: dict[str, Any]) -> None:
    """The same for people; what is missing comes with the command that brings it."""
    rows = [[name, summary[name]] for name in ("probdmp", "python", "executable", "platform")]
    rows += [[name, found or f"missing: pip install {name}"] for name, found in summary["packages"].items()]
    for extra, packages in summary["extras"].items():
        command = f"missing: pip install 'probdmp[{extra}]'"
        rows += [[f"{name} (extra {extra})", found or command] for name, found in packages.items()]
    threads = ", ".join(f"{name}={value}" for name, value in summary["threads"].items())
    rows.append(["kernels", KERNELS[summary["kernels"]]])
    rows.append(["BLAS", summary["blas"] + (f", {threads}" if threads else "")])
    rows.append(["processors", f"{summary['processors_allowed']} of {summary['processors']}"])
    where = "not set: real recordings are for the tests alone" if summary["recordings"] is None else summary["recordings"]
    lost = summary["recordings"] is not None and not summary["recordings_found"]
    rows.append([RECORDINGS, where + (", which is no folder" if lost else "")])
    print_table(["", ""], rows)


def _version(name: str) -> str | None:
    from importlib.metadata import PackageNotFoundError, version  # takes longer to load than the help to show

    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _kernels() -> str:
    """What filters executions: a name from `KERNELS`."""
    from probdmp.gaussian import kernels

    if kernels.COMPILED:
        return "compiled"
    return "switched off" if kernels.SWITCHED_OFF else "not built"


def _blas() -> str:
    """Name and version of the linear algebra that NumPy was built with."""
    try:
        import numpy as np

        built = np.show_config(mode="dicts")["Build Dependencies"]["blas"]
        return f"{built['name']} {built['version']}"
    except (ImportError, AttributeError, KeyError, TypeError):  # NumPy makes no promise about what it tells
        return "unknown"
