"""The machine: who it is, how fast it reads memory, what an empty call costs; and keeping to one of its cores."""

import os
import platform
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from probdmp.checks import FloatArray

__all__ = ["CORES", "PEERS", "cores", "described", "empty_call", "in_step", "multiplied", "read_all", "versions"]

CORES: list[int] = sorted(os.sched_getaffinity(0))
PEERS = ("statsmodels", "dynamax", "filterpy", "pykalman", "simdkalman", "movement_primitives", "pydmps")
"""Distributions that the library is compared with."""
BESIDE = ("jax", "jaxlib", "numpy", "scipy")
"""Others whose version matters."""


@contextmanager
def cores(n_cores: int = 1) -> Iterator[None]:
    """Keep to the last cores: the first one serves interrupts. Threads inherit it when they begin."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, CORES[-n_cores:])
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def described() -> list[str]:
    """Processor, caches, memory, system, and which BLAS kernels NumPy runs."""
    caches = [f"L{_text(index, 'level')}{_kind(index)} {_text(index, 'size')}" for index in _caches()]
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return [
        f"Processor: {_processor()}, {len(CORES)} cores used; caches of a core {', '.join(caches) or 'unknown'}",
        f"Memory: {memory:.0f} GiB",
        f"System: {platform.system()} {platform.release().split('-')[0]}, {platform.python_implementation()} "
        f"{platform.python_version()}, {_blas()}",
    ]


def versions() -> dict[str, str]:
    """By distribution; "not installed" for what is not."""

    def found(name: str) -> str:
        try:
            return version(name)
        except PackageNotFoundError:
            return "not installed"

    return {name: found(name) for name in (*PEERS, *BESIDE)}


def read_all(array: FloatArray, n_threads: int = 1) -> Callable[[], object]:
    """Reads a whole array as fast as NumPy can: BLAS's inner product of each part with itself, which writes nothing."""
    parts = np.array_split(array.reshape(-1), n_threads)
    if n_threads == 1:
        return lambda: np.dot(parts[0], parts[0])
    pool = ThreadPoolExecutor(n_threads)
    return lambda: list(pool.map(lambda part: np.dot(part, part), parts))


def in_step(work: Callable[[], object], count: int) -> float:
    """Seconds that `count` calls take."""
    repeated = range(count)
    began = time.perf_counter()
    for _ in repeated:
        work()
    return time.perf_counter() - began


def empty_call() -> float:
    """Seconds of a call that does nothing, with its share of the loop: the least that anything called from Python costs."""

    def nothing() -> None:
        pass

    return min(in_step(nothing, 100_000) for _ in range(20)) / 100_000


def multiplied(n_cores: int = 1) -> float:
    """Multiply-adds a second of each of so many cores at the same time, in products of matrices.

    That is what other guests of a virtual machine's host leave of them, and what they leave each other.
    """

    def of_one(seed: int) -> float:
        a, b = np.random.default_rng(seed).normal(size=(2, 512, 512))
        return float(a.size * len(b) / np.median([in_step(lambda: a @ b, 1) for _ in range(60)]))

    with ThreadPoolExecutor(n_cores) as pool:
        return float(np.mean(list(pool.map(of_one, range(n_cores)))))


def _processor() -> str:
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    facts = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    named = facts.get("model name", platform.processor() or platform.machine())
    where = f" (family {facts['cpu family']}, model {facts['model']})" if "cpu family" in facts else ""
    virtual = ", virtual machine" if "hypervisor" in facts.get("flags", "") else ""
    return f"{named}{where}{virtual}"


def _caches() -> list[Path]:
    return sorted(Path(f"/sys/devices/system/cpu/cpu{CORES[0]}/cache").glob("index*"))


def _text(index: Path, name: str) -> str:
    return (index / name).read_text().strip()


def _kind(index: Path) -> str:
    return {"Data": "d", "Instruction": "i"}.get(_text(index, "type"), "")


def _blas() -> str:
    try:
        from threadpoolctl import threadpool_info
    except ImportError:
        return "BLAS unknown"
    kernels = {
        f"{info['internal_api']} {info.get('architecture', '')}" for info in threadpool_info() if info["user_api"] == "blas"
    }
    return f"BLAS {', '.join(sorted(kernels))}"
