"""Datasets rendered by the workers of another scheduler: Dask, Ray, MPI, or a pool of processes."""

from __future__ import annotations

import os
import subprocess
from typing import Any, Callable, Dict, Protocol, Union

from ._errors import FurrowError, ended
from ._program import program


class Task(Protocol):
    """A submitted call, as `concurrent.futures.Future`."""

    def result(self) -> Any:
        """Wait, and return the result of the call or raise its exception."""

    def cancel(self) -> Any:
        """Do not start the call, if it waits."""


class Executor(Protocol):
    """Whatever runs calls elsewhere, as `concurrent.futures.Executor`."""

    def submit(self, call: Callable[..., None], /, *args: Any) -> Task:
        """Run `call(*args)` on a worker."""


def _run(*words: str) -> None:
    path = program()
    try:
        made = subprocess.run([path, *words], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    except OSError as error:
        raise FurrowError(f"{path}: {error}", "missing") from error
    if made.returncode != 0:
        raise ended(f"{path} {' '.join(words)}", made.returncode, made.stderr.decode(errors="replace"))


def render_shard(folder: str, shard: int, shards: int, threads: int) -> None:
    """Render the missing images of one shard on this machine."""
    _run("dataset", "render", folder, "--shard", f"{shard}/{shards}", "--threads", str(threads), "--quiet")


def distribute(
    folder: Union[str, "os.PathLike[str]"], executor: Executor, shards: int, threads: int = 0, tries: int = 3
) -> None:
    """Render a dataset that `trace dataset plan` made on the workers of `executor`, then write the files of the whole.

    Workers need the package and the same `folder`. `threads` is the number of threads of a worker, 0 for all cores. A shard
    that is interrupted, or whose disk fails, is submitted up to `tries` times; other errors are raised at once. Images that are
    complete are kept, so a call after any failure renders the rest.
    """
    if shards < 1 or tries < 1 or threads < 0:
        raise ValueError("shards and tries are at least 1, threads at least 0")
    place = os.path.abspath(os.fsdecode(folder))

    def submit(shard: int) -> Task:
        return executor.submit(render_shard, place, shard, shards, threads)

    tasks: Dict[int, Task] = {}
    try:
        for shard in range(shards):
            tasks[shard] = submit(shard)
        for shard in range(shards):
            for left in reversed(range(tries)):
                try:
                    tasks[shard].result()
                    break
                except FurrowError as error:
                    if left == 0 or error.kind not in ("io", "interrupted"):
                        raise
                    tasks[shard] = submit(shard)
    except BaseException:
        for task in tasks.values():
            task.cancel()
        raise
    _run("dataset", "finish", place, "--quiet")
