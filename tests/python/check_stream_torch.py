"""Runs the guide's example of training on a stream at a small size. Arguments: its file, a scene file."""

import sys
from pathlib import Path

import furrow
import torch

example, scene = sys.argv[1:]
stream, seen = furrow.stream, []


def small(_, **flags):
    """Replaces the example's stream by smaller images of another scene."""
    seen.append(flags)
    return stream(scene, **{**flags, "width": 64, "height": 48, "spp": 1, "threads": 1})


furrow.stream = small
space = {"__name__": "example"}
exec(compile(Path(example).read_text(), example, "exec"), space)
assert space["step"] + 1 == space["STEPS"] and torch.isfinite(space["loss"]), space["loss"]

# Workers divide the fields among them: none occurs twice.
class Indices(torch.utils.data.IterableDataset):
    """Indices of the images from the example's dataset."""

    def __iter__(self):
        fields = space["Fields"]("field")
        fields.item = lambda sample: sample["record"]["index"]
        return iter(fields)


batches = iter(torch.utils.data.DataLoader(Indices(), batch_size=2, num_workers=2))
indices = torch.cat([next(batches) for _ in range(4)]).tolist()
assert sorted(indices) == list(range(8)), indices
