"""Fly on the workers of a dask cluster: each part of a campaign is a task, flown there by a compiled engine.

A task is sent its cases and the program as data, and sends back what its cases came to; only this process writes. So a
worker that is lost loses its task alone, which the scheduler gives to another, and nothing can be there twice.
"""

from __future__ import annotations

import logging
import os
import pickle
import zlib
from collections.abc import Iterable, Iterator
from functools import lru_cache
from importlib import import_module, metadata
from typing import Any

import numpy as np

from casadi_gnc.campaigns.engines import CompiledBatch
from casadi_gnc.campaigns.program import BatchEngine, Flown, Program, T, Told
from casadi_gnc.errors import CampaignError, GncError

#: Seconds in which a scheduler must answer, and then those in which it must have a worker.
_ANSWER, _WORKER = 10.0, 10.0
#: Workers that may be lost with one part before it is given up.
_LOSSES = 10


class DaskBatch(BatchEngine):
    """Fly parts of a campaign on workers.

    Parameters
    ----------
    program : what flies.
    inside : engine of each worker, "c" or "cuda".
    scheduler : its address, such as "tcp://host:8786"; without it workers are started here, and ended with it.
    vectors : as for `CompiledBatch`; by default the best of each worker's processor.
    workers : that are started here, each a process with one thread; one a core by default.

    Raises
    ------
    CampaignError
        Where dask is not installed, the scheduler does not answer, or it has no worker.
    """

    name = "dask"

    def __init__(
        self,
        program: Program,
        *,
        inside: str = "c",
        scheduler: str | None = None,
        vectors: str | None = None,
        workers: int | None = None,
    ) -> None:
        dask, distributed = _module("dask"), _module("distributed")
        self.program, self._inside, self._vectors = program, inside, vectors
        if inside == "cuda":
            from casadi_gnc.campaigns.cuda import CudaBatch

            self.at_once = CudaBatch.at_once
        self._sent = zlib.compress(pickle.dumps(program))
        self._cluster: Any = None
        for name in (
            "distributed",
            "distributed.client",
            "distributed.nanny",
            "distributed.scheduler",
            "distributed.worker",
        ):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # what matters is raised
        if scheduler is None:
            if inside == "c":
                CompiledBatch(program, vectors=vectors, threads=1)  # built once, and found by every worker
            with dask.config.set({"distributed.scheduler.allowed-failures": _LOSSES}):
                self._cluster = distributed.LocalCluster(
                    n_workers=workers or os.cpu_count() or 1,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=None,
                    scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # its server of pages has any free port
                    silence_logs=logging.CRITICAL,
                )
        try:
            self._client = distributed.Client(self._cluster or scheduler, timeout=_ANSWER, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            self._end()
            told = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise CampaignError(
                f"the dask scheduler {scheduler} does not answer ({told}); start one (dask scheduler), or give the "
                "address that it told"
            ) from None
        try:
            self._client.wait_for_workers(1, timeout=_WORKER)
        except TimeoutError:
            self.close()
            raise CampaignError(
                f"the dask scheduler {scheduler} has no worker; start some (dask worker {scheduler})"
            ) from None

    def fly(self, values: np.ndarray, seeds: np.ndarray, told: Told | None = None) -> Flown:
        """Fly cases to their end on one worker, as `BatchEngine.fly`."""
        ((_, flown),) = self.fly_all([(None, values, seeds)], told)
        return flown

    def fly_all(
        self, parts: Iterable[tuple[T, np.ndarray, np.ndarray]], told: Told | None = None
    ) -> Iterator[tuple[T, Flown]]:
        """Fly parts on all workers, and yield them as they are done."""
        left, names = iter(parts), dict[str, tuple[T, int]]()
        running = _module("distributed").as_completed(loop=self._client.loop)
        futures = {}

        def send() -> None:
            """Give the scheduler the next part, if there is one."""
            for name, values, seeds in left:
                future = self._client.submit(
                    _fly,
                    self._sent,
                    self._inside,
                    self._vectors,
                    values,
                    seeds,
                    pure=False,
                    key=f"flights-{id(self)}-{len(names)}",
                )
                names[future.key] = (name, len(seeds))
                futures[future.key] = future
                running.add(future)
                return

        try:
            for _ in range(2 * max(1, sum(self._client.nthreads().values()))):
                send()
            for future in running:
                flown = _result(future)
                name, count = names[future.key]
                del futures[future.key]
                send()
                if told:
                    told(count)
                yield name, flown
        finally:
            if futures:
                self._client.cancel(list(futures.values()), force=True)

    def close(self) -> None:
        """End the connection, and the workers that were started here."""
        self._client.close(timeout=_ANSWER)
        self._end()

    def _end(self) -> None:
        if self._cluster is not None:
            self._cluster.close(timeout=_ANSWER)


def _module(name: str) -> Any:
    """Return a module of the extra `campaign`, which only this engine imports."""
    try:
        return import_module(name)
    except ImportError as error:
        raise CampaignError(
            f'engine "dask" needs a package that is not installed ({error.name}); pip install "casadi-gnc[campaign]"'
        ) from None


def _result(future: Any) -> Flown:
    """Return what a task came to; raise `CampaignError` that says why there is nothing."""
    distributed = _module("distributed")
    try:
        return Flown(*future.result())
    except GncError:
        raise
    except distributed.KilledWorker:
        raise CampaignError(
            "workers were lost again and again while they flew one part of the campaign: they are killed or out of "
            "memory; what is finished is kept, and the same command goes on"
        ) from None
    except (distributed.client.FutureCancelledError, OSError):
        raise CampaignError(
            "the connection to the dask scheduler is lost; what is finished is kept, and the same command goes on"
        ) from None
    except (ImportError, AttributeError) as error:
        raise CampaignError(f"a dask worker cannot fly: {error}; it needs casadi-gnc as it is here") from None


def _fly(
    sent: bytes, inside: str, vectors: str | None, values: np.ndarray, seeds: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Fly cases; what runs on a worker."""
    flown = _engine(sent, inside, vectors).fly(values, seeds)
    return flown.tally, flown.x, flown.m, flown.actuators, flown.good


@lru_cache(maxsize=1)
def _engine(sent: bytes, inside: str, vectors: str | None) -> BatchEngine:
    """Return the engine of a program, built when the first part of it comes."""
    program: Program = pickle.loads(zlib.decompress(sent))
    here = metadata.version("casadi-gnc")
    if here != program.version:
        raise CampaignError(f"a dask worker has casadi-gnc {here}, and the campaign is of {program.version}")
    if inside == "cuda":
        from casadi_gnc.campaigns.cuda import CudaBatch

        return CudaBatch(program)
    return CompiledBatch(program, vectors=vectors, threads=1)
