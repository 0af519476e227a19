"""Starts the program `train` with the libtorch of the package torch."""

from __future__ import annotations

import importlib.util
import os
import sys
from importlib import metadata
from pathlib import Path
from typing import NoReturn, Optional

__all__ = ["libtorch", "main", "program"]


def program() -> Path:
    """Return the path of `train`."""
    return Path(__file__).parent / "train"


def libtorch() -> Optional[Path]:
    """Return the folder of libtorch in the package torch, which is not imported: that takes seconds."""
    spec = importlib.util.find_spec("torch")
    folders = [Path(place) / "lib" for place in (spec and spec.submodule_search_locations) or []]
    return next((folder for folder in folders if (folder / "libtorch_cpu.so").is_file()), None)


def _mismatch() -> Optional[str]:
    """Return what is wrong with the version of torch. Another one has other symbols, or other behaviour."""
    try:
        wanted = next(r for r in metadata.requires("furrow-train") or [] if r.startswith("torch==")).split("==")[1]
        # 2.11.0+cpu is a build of 2.11.0.
        found = metadata.version("torch").split("+")[0]
    except (metadata.PackageNotFoundError, StopIteration):
        return None
    return None if found == wanted else f"torch is {found}, but train needs {wanted}: pip install torch=={wanted}"


def main() -> NoReturn:
    """Become the program, with this process's arguments."""
    folder = libtorch()
    wrong = "libtorch was not found: pip install torch" if folder is None else _mismatch()
    if folder is None or wrong:
        sys.exit(f"error: {wrong}")
    others = os.environ.get("LD_LIBRARY_PATH")
    libraries = f"{folder}:{others}" if others else str(folder)
    os.execve(program(), [str(program()), *sys.argv[1:]], {**os.environ, "LD_LIBRARY_PATH": libraries})
