#!/usr/bin/env bash
# Installs the dependencies of the build and the tests on Debian 12, as root or as a user with sudo, without prompts:
# Embree and a C compiler; Mesa's Vulkan driver for the raster engine; the programs used as independent references by
# the tests (a browser, a batch system, Python clients in target/venv, Debian's PyTorch for the CPU with
# target/venv-torch, 210 MB to download); and libtorch for the feature `train`. Installed packages are left alone.
set -euo pipefail
cd "$(dirname "$0")/.."
packages="libembree-dev build-essential mesa-vulkan-drivers libvulkan1 python3-venv libllvm19 chromium slurm-wlm munge iproute2 procps parallel python3-torch python3-torchvision python3-pil"
# shellcheck disable=SC2086 # a list of packages
if ! dpkg -s $packages >/dev/null 2>&1; then
  sudo=$([ "$(id -u)" = 0 ] || echo sudo)
  $sudo apt-get update
  $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $packages
fi
if ! cmp -s tests/requirements.txt target/venv/installed; then
  [ -x target/venv/bin/pip ] || { mkdir -p target && python3 -m venv target/venv; }
  target/venv/bin/pip install -q -r tests/requirements.txt
  cp tests/requirements.txt target/venv/installed
fi
# PyPI's torch for Linux needs three gigabytes of CUDA. Debian's is CPU-only, and is visible to Debian's Python only.
beside_torch="$(grep '^safetensors==' tests/requirements.txt) efficientnet-lite-pytorch==0.1.0 timm==0.9.16 ultralytics==8.4.190 opencv-python-headless==4.10.0.84"
if [ "$(cat target/venv-torch/installed 2>/dev/null || true)" != "$beside_torch" ]; then
  /usr/bin/python3 -m venv --system-site-packages target/venv-torch
  # shellcheck disable=SC2086 # a list of packages
  target/venv-torch/bin/pip install -q --no-deps $beside_torch
  echo "$beside_torch" > target/venv-torch/installed
fi
sh .libtorch/get.sh
sh .libtorch/imagenet.sh
