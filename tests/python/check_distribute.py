"""Checks that `furrow.distribute` renders the same dataset with Dask's workers as one process. Arguments: `trace`, a scene file, an empty
folder."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import furrow

trace, scene, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
os.environ["FURROW_TRACE"] = trace
order = ["--scene", scene, "--count", "5", "--width", "24", "--spp", "1"]


def plan(name):
    subprocess.run([trace, "dataset", "plan", *order, "--out", folder / name], check=True, capture_output=True)
    return folder / name


def files(name):
    """Returns all files but the timing log."""
    found = (path for path in (folder / name).rglob("*") if path.is_file())
    found = {str(path.relative_to(folder / name)): path.read_bytes() for path in found}
    return {name: of for name, of in found.items() if not name.startswith("ledger/")}


class Unreliable(ThreadPoolExecutor):
    """Loses the first call of each shard as a machine does that is switched off."""

    def __init__(self, kind):
        super().__init__(2)
        self.kind, self.lost = kind, set()

    def submit(self, call, *args):
        if args[1] in self.lost:
            return super().submit(call, *args)
        self.lost.add(args[1])
        return super().submit(self.fail, args[1])

    def fail(self, shard):
        raise furrow.FurrowError(f"shard {shard} is lost", self.kind)


if __name__ == "__main__":
    from dask.distributed import Client, LocalCluster

    subprocess.run([trace, "dataset", *order, "--quiet", "--out", folder / "whole"], check=True, stdout=subprocess.DEVNULL)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster, Client(cluster) as client:
        furrow.distribute(plan("dask"), client.get_executor(), shards=3, threads=1)
    assert files("dask") == files("whole")

    # An interrupted shard is submitted again; a mistake is not, nor a shard that fails for ever.
    with Unreliable("interrupted") as pool:
        furrow.distribute(plan("again"), pool, shards=2, threads=1)
    assert files("again") == files("whole")
    for executor, tries, what in ((Unreliable("input"), 3, "shard 0 is lost"), (Unreliable("io"), 1, "shard 0 is lost")):
        with executor as pool:
            try:
                furrow.distribute(plan(f"failed-{tries}"), pool, shards=2, threads=1, tries=tries)
            except furrow.FurrowError as error:
                assert what in str(error)
            else:
                raise AssertionError("no error")
    with ThreadPoolExecutor(1) as pool:
        try:
            furrow.distribute(folder / "nothing", pool, shards=1)
        except furrow.FurrowError as error:
            assert error.kind == "input" and "nothing" in str(error), error
        else:
            raise AssertionError("no error")
