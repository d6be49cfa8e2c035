"""Scoring parts of a file on a Dask cluster."""

import secrets
import threading
from collections.abc import Iterator, Sequence
from importlib import import_module
from importlib.util import find_spec
from itertools import islice
from typing import Any

from probdmp.errors import MissingExtraError, ProbDMPError
from probdmp.fleet.plan import Part
from probdmp.fleet.work import WAITING, Assignment, Worker

__all__ = ["require_distributed", "score_on_cluster"]

PATIENCE = 30
"""Seconds to wait for a scheduler to answer."""


def require_distributed() -> None:
    """Refuse, with the command to type, where dask.distributed is not installed."""
    if find_spec("distributed") is None:
        raise MissingExtraError("dask.distributed for --scheduler", "none installed", "Type: pip install 'probdmp[fleet]'")


def score_on_cluster(assignment: Assignment, parts: Sequence[Part], address: str) -> Iterator[tuple[int, bytes]]:
    """On the workers of a cluster, as they get done. What a worker has not handed over when it dies is done by another.

    Parameters
    ----------
    address : of the scheduler, such as tcp://127.0.0.1:8786.

    Raises
    ------
    ProbDMPError
        If there is no scheduler, or workers die over and over.
    """
    if not parts:
        return
    require_distributed()
    distributed: Any = import_module("distributed")  # whose functions have no types
    try:
        client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ProbDMPError(f"a Dask scheduler at {address!r}", str(error), "Start one: dask scheduler") from error
    with client, client.as_current():
        plugin = _plugin(assignment)
        client.register_plugin(plugin)
        n_threads = max(sum(client.nthreads().values()), 1)
        remaining = iter(parts)
        begun = [_submitted(client, plugin.name, part) for part in islice(remaining, WAITING * n_threads)]
        pending = distributed.as_completed(begun)
        del begun  # what is done with is forgotten only when nothing points at it
        try:
            for future in pending:
                yield future.result()
                future.release()
                if (part := next(remaining, None)) is not None:
                    pending.add(_submitted(client, plugin.name, part))
        except distributed.KilledWorker as error:
            hint = "Was there enough memory? Call it again: it goes on where it stopped."
            raise ProbDMPError("workers that live", f"several that died over one part: {error}", hint) from error
        finally:
            client.unregister_worker_plugin(plugin.name)


def _submitted(client: Any, name: str, part: Part) -> Any:
    return client.submit(_score, name, part, pure=False, key=f"{name}-{part.number}")


def _score(name: str, part: Part) -> tuple[int, bytes]:
    plugin: Any = import_module("distributed").get_worker().plugins[name]
    return next(plugin.worker.scores([part]))


def _plugin(assignment: Assignment) -> Any:
    """What brings the assignment to every worker once, those that join later too."""
    base: Any = import_module("distributed").WorkerPlugin

    class Assigned(base):  # type: ignore[misc]
        """Makes a `Worker` for each thread of a worker when it is first needed."""

        def __init__(self) -> None:
            self.name = f"probdmp-{secrets.token_hex(8)}"
            self.assignment = assignment

        def setup(self, worker: Any) -> None:
            self._local = threading.local()

        @property
        def worker(self) -> Worker:
            if not hasattr(self._local, "worker"):
                self._local.worker = Worker(self.assignment)
            worker: Worker = self._local.worker
            return worker

    return Assigned()
