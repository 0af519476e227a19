"""Opens FOLDER/image.exr with cryptomatte-api and OpenEXR and compares it with FOLDER/expected.json."""

import json
import sys
from pathlib import Path

import cryptomatte_api
import numpy as np
import OpenEXR

folder = Path(sys.argv[1])
expected = json.loads((folder / "expected.json").read_text())
path = str(folder / "image.exr")

found = {matte.metadata().name(): matte for matte in cryptomatte_api.Cryptomatte.load(path)}
assert set(found) == set(expected["mattes"]), f"mattes {sorted(found)}"
objects = 0
for layer, wanted in expected["mattes"].items():
    decoded = found[layer].masks()
    for name, coverage in wanted.items():
        coverage = np.array(coverage, np.float32)
        mask = np.array(decoded[name]).reshape(-1) if name in decoded else np.zeros_like(coverage)
        assert np.array_equal(mask, coverage), f"{layer} {name}: {np.abs(mask - coverage).max()}"
        objects += 1
    assert set(decoded) <= set(wanted), f"{layer}: {set(decoded) - set(wanted)}"

with OpenEXR.File(path, separate_channels=True) as file:
    header, channels = file.header(), file.channels()
    for name, wanted in expected["ids"].items():
        pixels = channels[name].pixels
        assert pixels.dtype == np.uint32, f"{name} is {pixels.dtype}"
        assert np.array_equal(pixels.reshape(-1), np.array(wanted, np.uint32)), name
    for k, band in enumerate(("R", "G", "B", "NIR")):
        wanted = np.array(expected["radiance"], np.float32)[:, k]
        assert np.array_equal(channels[band].pixels.reshape(-1), wanted), band
    shares = sum(channels[f"coverage.{c}"].pixels for c in ("soil", "crop", "weed"))
    assert np.allclose(shares, 1, atol=1e-6)
    assert header["comments"] == "a comment"
    manifests = [json.loads(header[key]) for key in header if key.endswith("/manifest")]
    assert len(manifests) == 3 and all(len(set(m.values())) == len(m) for m in manifests)

print(f"cryptomatte: {objects} objects of {len(found)} mattes, every pixel equal")
