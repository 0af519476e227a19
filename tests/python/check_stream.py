"""Checks that `furrow.stream` yields the samples of a dataset. Arguments: a scene file, a dataset of two images of it."""

import os
import subprocess
import sys
import tempfile
import time

import furrow
import numpy as np

scene, dataset = sys.argv[1:]
SIZE = {"width": 48, "spp": 1}
started = []
popen = subprocess.Popen


def remembered(*arguments, **named):
    """Starts the program and stores the process."""
    started.append(popen(*arguments, **named))
    return started[-1]


subprocess.Popen = remembered

# Twenty samples of an endless stream; afterwards the program and its temporary files are gone.
with tempfile.TemporaryDirectory() as folder:
    os.environ["TMPDIR"] = tempfile.tempdir = folder
    samples = furrow.stream(scene, threads=2, **SIZE)
    first = [next(samples) for _ in range(20)]
    assert started[0].poll() is None, "the endless stream has ended"
    begin = time.monotonic()
    del samples
    assert started[0].poll() is not None and time.monotonic() - begin < 30, "the program still runs"
    assert not os.listdir(folder), os.listdir(folder)
    os.environ.pop("TMPDIR")
    tempfile.tempdir = None
assert [s["record"]["index"] for s in first] == list(range(20))

# Compared with a dataset of the same order.
for ours, other in zip(first, furrow.Dataset(dataset)):
    assert list(ours) == list(other), list(ours)
    assert ours["record"] == other["record"]
    for name in ours:
        if name != "record":
            assert ours[name].dtype == other[name].dtype and np.array_equal(ours[name], other[name]), name
            ours[name][:] = 0  # The caller owns the memory.

# Shards, and a finite stream.
indices = [s["record"]["index"] for s in furrow.stream(scene, first=2, count=5, shard=(1, 2), **SIZE)]
assert indices == [3, 5], indices
assert started[1].returncode == 0
bare = next(furrow.stream(scene, keep="none", **SIZE))
assert "nir" not in bare and "image" in bare, list(bare)

bare = next(furrow.stream(scene, labels_only=True, count=1))
assert "image" not in bare and bare["semantics"].ndim == 2 and bare["record"]["index"] == 0, list(bare)

# Errors contain the program's own message.
for flags, words in [({"count": 0}, "0 is not in"), ({"shard": (3, 2)}, "k/N"), ({"without": ["none-such"]}, "none-such")]:
    try:
        next(furrow.stream(scene, **flags))
    except furrow.FurrowError as error:
        assert words in str(error), error
    else:
        raise AssertionError(flags)
# If the program is killed, the stream raises an error instead of ending.
samples = furrow.stream(scene, **SIZE)
next(samples)
started[-1].kill()
try:
    for _ in samples:
        pass
except furrow.FurrowError as error:
    assert "ended with -9" in str(error), error
else:
    raise AssertionError("a truncated stream ended without an error")
os.environ["FURROW_TRACE"] = "/nowhere/trace"
try:
    next(furrow.stream(scene))
except furrow.FurrowError as error:
    assert "/nowhere/trace" in str(error), error
else:
    raise AssertionError("a missing program was accepted")
