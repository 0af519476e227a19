"""Compares an exported ONNX file with the program's output and with `reference.py`.

    check_onnx.py FOLDER...

Images with nearly equal maxima are not compared, as documented in `reference.py`. Each folder holds `network.onnx`, `model.json`
and `weights.safetensors`, and `io.safetensors`: 8-bit images `images_K` (images x height x width x bands, as floats) and
`scores_K`, the program's output for them.
"""

import json
import sys

import numpy as np
import onnx
import onnxruntime
import reference
from reference import TOLERANCE, run_numpy
from safetensors.numpy import load_file

# ONNX Runtime folds batch norms into convolutions and sums in its own block order, so its rounding changes maxima more
# often. All decided images must agree, and most of the others.
reference.GAP = 2e-5


def normalise(images, how):
    """Normalises 8-bit pixels as documented, in double precision, to images x bands x height x width."""
    x = images.transpose(0, 3, 1, 2).astype(np.float64) / 255
    if how == "band" or how == "image":
        axes = (2, 3) if how == "band" else (1, 2, 3)
        mean, sd = x.mean(axis=axes, keepdims=True), x.std(axis=axes, keepdims=True)
    else:
        mean, sd = (np.array(how["fixed"][k], np.float64)[None, :, None, None] for k in ("mean", "sd"))
    return (x - mean) / np.maximum(sd, 1 / 255)


def check(folder):
    card = json.load(open(f"{folder}/model.json"))
    path = f"{folder}/network.onnx"
    onnx.checker.check_model(onnx.load(path), full_check=True)
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    told = session.get_modelmeta().custom_metadata_map
    assert json.loads(told["bands"]) == card["input"]["bands"], told
    assert json.loads(told["classes"]) == [c["name"] for c in card["classes"]], told
    assert (int(told["width"]), int(told["height"])) == (card["input"]["width"], card["input"]["height"]), told
    assert told["weights_sha256"] == card["weights_sha256"] and told["network"] == card["network"], told
    (taken,) = session.get_inputs()
    assert (taken.name, taken.type) == ("image", "tensor(uint8)") and taken.shape[3] == len(card["input"]["bands"])
    weights, io = load_file(f"{folder}/weights.safetensors"), load_file(f"{folder}/io.safetensors")
    cases = sorted(k.removeprefix("images_") for k in io if k.startswith("images_"))
    assert len(cases) > 2, cases
    decided_at_all = agree = all_pictures = 0
    for case in cases:
        images, ours = io[f"images_{case}"].astype(np.uint8), io[f"scores_{case}"]
        scores, classes = session.run(["scores", "classes"], {"image": images})
        assert scores.dtype == np.float32 and classes.dtype == np.uint8 and classes.shape == images.shape[:3]
        assert (classes == scores.argmax(axis=1)).all()
        pixels = normalise(images, card["normalisation"])
        exact, _, doubt, _ = run_numpy(card["network"], weights, pixels, len(card["classes"]))
        decided = np.ones(len(images), bool) if doubt is None else ~doubt
        decided_at_all += decided.sum()
        largest = max(1.0, np.abs(exact).max())
        for name, other in [("the program", ours), ("the reference", exact)]:
            apart = np.abs(scores - other)[decided].max(initial=0) / largest
            print(f"{card['network']} {images.shape}: {decided.sum()} decided, apart from {name} by {apart:.1e} of {largest:.2f}")
            assert apart < TOLERANCE, f"{folder}: case {case}: {apart} from {name}"
            # A maximum at another position changes values near it; a wrong graph changes all values.
            mean = np.abs(scores - other).mean(axis=(1, 2, 3)).max() / largest
            assert mean < 2e-3, f"{folder}: case {case}: {mean} from {name} in the mean"
        agree += (np.abs(scores - ours).max(axis=(1, 2, 3)) < TOLERANCE * largest).sum()
        all_pictures += len(images)
    print(f"{card['network']}: {decided_at_all} of {all_pictures} pictures decided, {agree} agree with the program")
    assert decided_at_all > 0, f"{folder}: all images have nearly equal maxima"
    assert agree * 4 >= all_pictures * 3, f"{folder}: only {agree} of {all_pictures} pictures agree with the program"


if __name__ == "__main__":
    for folder in sys.argv[1:]:
        check(folder)
