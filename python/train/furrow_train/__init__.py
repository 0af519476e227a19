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


def _wanted() -> str:
    """Return the version of torch that the program was built with."""
    required = metadata.requires("furrow-train") or []
    return next(name for name in required if name.startswith("torch==")).split("==")[1]


def _fault(folder: Optional[Path]) -> Optional[str]:
    """Return what is wrong with the package torch. Another version has other symbols, or other behaviour."""
    if folder is None:
        return f"libtorch was not found: pip install torch=={_wanted()}"
    try:
        # 2.11.0+cpu is a build of 2.11.0.
        found = metadata.version("torch").split("+")[0]
    except metadata.PackageNotFoundError:
        return None
    wanted = _wanted()
    return None if found == wanted else f"torch is {found}, but train needs {wanted}: pip install torch=={wanted}"


def main() -> NoReturn:
    """Become the program, with this process's arguments."""
    folder = libtorch()
    fault = _fault(folder)
    if fault:
        sys.exit(f"error: {fault}")
    others = os.environ.get("LD_LIBRARY_PATH")
    libraries = f"{folder}:{others}" if others else str(folder)
    os.execve(program(), [str(program()), *sys.argv[1:]], {**os.environ, "LD_LIBRARY_PATH": libraries})
