"""The NumPy twin of the compiled kernels, in a process of its own: the library chooses between the two when it is imported."""

import os
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any, Self

from probdmp.checks import FloatArray
from speed.interleaving import Clocked

__all__ = ["Twin"]

CHOICE = "PROBDMP_NO_EXTENSION"


class Twin:
    """Scores as `probdmp.gaussian.score_series` does, but without the extension."""

    def __enter__(self) -> Self:
        context = get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, os.sched_getaffinity(0)), daemon=True)
        before = os.environ.get(CHOICE)
        os.environ[CHOICE] = "1"
        try:
            self._process.start()
        finally:
            if before is None:
                del os.environ[CHOICE]
            else:
                os.environ[CHOICE] = before
        assert not self._ask("compiled")
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._pipe.close()
        self._process.join(timeout=10)

    def score(self, workload: tuple[str, int, int], n_recordings: int) -> FloatArray:
        """What it makes of the first recordings of `model_of(*workload)`."""
        return self._ask("score", workload, n_recordings)

    def clocked(self, workload: tuple[str, int, int], n_recordings: int) -> Clocked:
        """That, measured where it is done."""

        def run(count: int) -> float:
            return self._ask("run", workload, n_recordings, count)

        return run

    def _ask(self, *question: Any) -> Any:
        self._pipe.send(question)
        return self._pipe.recv()


def _serve(pipe: Connection, affinity: set[int]) -> None:
    os.sched_setaffinity(0, affinity)
    from probdmp.gaussian import kernels, score_series, shared_gains
    from speed.machine import in_step
    from speed.workload import model_of, recordings_of

    prepared: dict[Any, Any] = {}
    while True:
        try:
            wanted, *given = pipe.recv()
        except EOFError:
            return
        if wanted == "compiled":
            pipe.send(kernels.COMPILED)
            continue
        workload, n_recordings, *count = given
        if (workload, n_recordings) not in prepared:
            prepared.clear()
            model = model_of(*workload)
            prepared[workload, n_recordings] = shared_gains(model), recordings_of(model, n_recordings)
        gains, recordings = prepared[workload, n_recordings]
        if wanted == "score":
            pipe.send(score_series(gains, recordings))
        else:
            pipe.send(in_step(partial(score_series, gains, recordings), *count))
