#!/usr/bin/env python3
"""Size and time of each compression of an EXR file: `python benches/exr.py out/field/radiance.exr`.

The methods are those of the OpenEXR library, whose levels cannot be set here. The levels are those of zlib, on blocks of 16
rows whose bytes are reordered and predicted as by OpenEXR's ZIP. Times are the minimum of three runs, in core seconds.
Needs a Python with OpenEXR and numpy, as `race.py` does.
"""

import sys
import tempfile
import time
import zlib
from pathlib import Path

import numpy as np
import OpenEXR

ROWS = 16
METHODS = ("NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24")
LEVELS = (1, 2, 4, 6, 9)


def least(work):
    """Returns the result of `work`, and the minimum of its core seconds in three runs."""
    taken = []
    for _ in range(3):
        began = time.process_time()
        given = work()
        taken.append(time.process_time() - began)
    return given, min(taken)


def predicted(channels):
    """Returns the bytes of each block of 16 rows as ZIP compresses them: even bytes first, each minus its predecessor."""
    blocks = []
    for first in range(0, len(channels[0]), ROWS):
        plain = np.frombuffer(b"".join(row.tobytes() for rows in zip(*(c[first : first + ROWS] for c in channels)) for row in rows), np.uint8)
        apart = np.concatenate([plain[0::2], plain[1::2]]).astype(np.int16)
        blocks.append((np.diff(apart, prepend=apart[:1]) + 128).astype(np.uint8).tobytes())
    return blocks


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__.split("\n\n")[0])
    part = OpenEXR.File(sys.argv[1], separate_channels=True).parts[0]
    channels = {name: channel.pixels for name, channel in part.channels.items()}
    print("| compression | core s | MB |\n|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "image.exr"
        for method in METHODS:
            header = {"compression": getattr(OpenEXR, f"{method}_COMPRESSION"), "type": OpenEXR.scanlineimage}
            _, seconds = least(lambda: OpenEXR.File(header, dict(channels)).write(str(file)))
            print(f"| {'none' if method == 'NO' else method} | {seconds:.2f} | {file.stat().st_size / 1e6:.1f} |")
    blocks = predicted(list(channels.values()))
    for level in LEVELS:
        size, seconds = least(lambda: sum(len(zlib.compress(block, level)) for block in blocks))
        print(f"| ZIP by zlib, level {level} | {seconds:.2f} | {size / 1e6:.1f} |")


if __name__ == "__main__":
    main()
