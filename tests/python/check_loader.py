"""Reads a dataset with PyTorch's DataLoader. Argument: a dataset of two images."""

import sys

import furrow
import torch


def arrays(sample):
    """The arrays of a sample, without the record."""
    return {name: value for name, value in sample.items() if name != "record"}


data = furrow.Dataset(sys.argv[1], transform=arrays)
for workers in (0, 2):
    (batch,) = torch.utils.data.DataLoader(data, batch_size=2, num_workers=workers)
    assert batch["image"].shape[0] == 2 and batch["image"].shape[3] == 3, batch["image"].shape
    assert batch["plants"].dtype == torch.int32 and batch["semantics"].dtype == torch.uint8
    assert torch.equal(batch["plants"][1], torch.from_numpy(data[1]["plants"]))
