"""Images a second from Python: one worker process for all images, against a process for each image.

FURROW_TRACE=target/release/trace PYTHONPATH=python python benches/worker.py [SCENE...]
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import furrow as fw

COUNT, WIDTH, SPP = 12, 320, 4


def by_worker(scene: str) -> None:
    for index in range(COUNT):
        fw.render(scene, index=index, width=WIDTH, spp=SPP)


def by_processes(scene: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for index in range(COUNT):
            command = [os.environ["FURROW_TRACE"], "--scene", scene, "--index", str(index), "--width", str(WIDTH)]
            subprocess.run(command + ["--spp", str(SPP), "--quiet", "--out", str(Path(folder) / str(index))], check=True, capture_output=True)


for scene in sys.argv[1:] or ["01-one-leaf", "02-one-plant", "field"]:
    rates = {}
    # The worker starts with the first image; both orders, so that a busy machine counts for both.
    for act in (by_worker, by_processes, by_worker, by_processes):
        begin = time.perf_counter()
        act(scene)
        rates.setdefault(act.__name__, []).append(COUNT / (time.perf_counter() - begin))
    worker, processes = (max(rates[act.__name__]) for act in (by_worker, by_processes))
    print(f"| `{scene}` | {worker:.2f} | {processes:.2f} | {worker / processes:.1f} |", flush=True)
