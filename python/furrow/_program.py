"""The program `trace`: where it is, and a process of it that renders one image after the other."""

from __future__ import annotations

import atexit
import json
import os
import shutil
import subprocess
import sysconfig
import tempfile
import threading
from pathlib import Path
from typing import IO, Any, Callable, Dict, List, Optional, Tuple

import numpy as np

from ._errors import FurrowError, answered, ended


def program() -> str:
    """Return the path of `trace`.

    It is `$FURROW_TRACE`, else the program in this package, else the one compiled in this clone, else the first on `$PATH`.
    """
    above = Path(__file__).parent.parent
    compiled = above.parent / "target/release/trace"
    own = (above / "furrow.scripts/trace", Path(sysconfig.get_path("scripts")) / "trace", compiled)
    named = os.environ.get("FURROW_TRACE")
    found = named or next((str(path) for path in own if path.is_file()), None) or shutil.which("trace")
    if not found:
        help = "install Furrow, compile it with `cargo build --release` in its clone, or set FURROW_TRACE to its path"
        raise FurrowError(f"the program `trace` was not found: {help}", "missing")
    return found


def plain(value: Any) -> Any:
    """Convert values that `json` does not know: NumPy's, and paths."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"{value!r} cannot be a value of a scene")


class _Worker:
    """A running `trace serve`. One request is answered at a time."""

    def __init__(self, path: str) -> None:
        self.path = path
        # A file, because unlike a pipe it accepts any number of messages without being read.
        self.said: IO[bytes] = tempfile.TemporaryFile(prefix="furrow-")
        try:
            # A session of its own, so that Ctrl-C in a terminal reaches only Python, which then ends the process.
            self.process = subprocess.Popen(
                [path, "serve"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self.said,
                start_new_session=True,
            )
        except OSError as error:
            self.said.close()
            raise FurrowError(f"{path}: {error}", "missing") from error

    def end(self) -> None:
        """End the process at once."""
        self.process.kill()
        self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout, self.said):
            if pipe is not None:
                pipe.close()

    def _lost(self) -> FurrowError:
        """Return the error of a process that ended before its answer was complete."""
        code = self.process.wait()
        self.said.seek(0)
        return ended(f"{self.path} serve", code, self.said.read().decode(errors="replace"))

    def _bytes(self, count: int) -> bytearray:
        assert self.process.stdout is not None
        found = bytearray(self.process.stdout.read(count))
        if len(found) < count:
            raise self._lost()
        return found

    def ask(
        self, request: Dict[str, Any], progress: Optional[Callable[[float], None]]
    ) -> Tuple[Dict[str, Any], List[np.ndarray[Any, Any]]]:
        assert self.process.stdin is not None and self.process.stdout is not None
        try:
            line = json.dumps(request, default=plain, allow_nan=False).encode() + b"\n"
        except (ValueError, RecursionError) as error:
            raise FurrowError(f"the scene cannot be written: {error}", "input", "give finite numbers, without cycles") from None
        try:
            self.process.stdin.write(line)
            self.process.stdin.flush()
        except OSError:
            raise self._lost() from None
        while True:
            line = self.process.stdout.readline()
            if not line.endswith(b"\n"):
                raise self._lost()
            answer: Dict[str, Any] = json.loads(line)
            if "progress" not in answer:
                break
            if progress is not None:
                progress(answer["progress"])
        if "error" in answer:
            raise answered(answer["error"])
        arrays = []
        for about in answer.get("maps", ()):
            kind, shape = np.dtype("<" + about["type"]), tuple(about["shape"])
            arrays.append(np.frombuffer(self._bytes(kind.itemsize * int(np.prod(shape))), kind).reshape(shape))
        return answer, arrays


_lock = threading.Lock()
_worker: Optional[_Worker] = None
_owner: Optional[int] = None


def _end() -> None:
    """End the process, if this Python process started it and not the one that it was forked from."""
    global _worker
    if _worker is not None and _owner == os.getpid():
        _worker.end()
    _worker = None


def _forked() -> None:
    """Forget the process and the lock of the parent."""
    global _lock, _worker
    _lock, _worker = threading.Lock(), None


atexit.register(_end)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)


def ask(
    request: Dict[str, Any], progress: Optional[Callable[[float], None]] = None
) -> Tuple[Dict[str, Any], List[np.ndarray[Any, Any]]]:
    """Send a request to `trace serve`, and return the answer and its maps. The process is started if none is running."""
    global _worker, _owner
    with _lock:
        path = program()
        if _worker is not None and (_worker.path != path or _worker.process.poll() is not None):
            _end()
        if _worker is None:
            _worker, _owner = _Worker(path), os.getpid()
        try:
            return _worker.ask(request, progress)
        except FurrowError:
            raise
        except BaseException:
            # An interrupt, say, leaves an answer half read.
            _end()
            raise
