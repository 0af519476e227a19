#!/usr/bin/env bash
# Installs the dependencies of the build and the tests on Debian 12, as root or as a user with sudo, without prompts:
# bash tests/peers.sh [build|packages|libtorch|python], all four by default. Installed packages are left alone.
#   build     Embree, a C compiler, and a Python that fetches libtorch
#   packages  Mesa's Vulkan driver for the raster engine; the programs used as independent references by the tests: a browser, a batch
#             system, Debian's PyTorch for the CPU
#   libtorch  for the feature `train`, and weights that start a training
#   python    clients that the tests compare with, in target/venv and target/venv-torch; needs `packages`; 240 MB to download
set -euo pipefail
cd "$(dirname "$0")/.."

# Installs Debian packages unless all of them are there.
debian() {
  if ! dpkg -s "$@" >/dev/null 2>&1; then
    local sudo
    sudo=$([ "$(id -u)" = 0 ] || echo sudo)
    $sudo apt-get update
    # shellcheck disable=SC2086 # `sudo` or nothing
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "$@"
  fi
}

build() {
  debian libembree-dev build-essential python3-venv
}

packages() {
  debian mesa-vulkan-drivers libvulkan1 libllvm19 chromium slurm-wlm munge iproute2 procps parallel curl \
    python3-torch python3-torchvision python3-pil
}

libtorch() {
  sh .libtorch/get.sh
  sh .libtorch/imagenet.sh
}

python() {
  if ! cmp -s tests/requirements.txt target/venv/installed; then
    [ -x target/venv/bin/pip ] || { mkdir -p target && python3 -m venv target/venv; }
    target/venv/bin/pip install -q -r tests/requirements.txt
    cp tests/requirements.txt target/venv/installed
  fi
  # PyPI's torch for Linux needs three gigabytes of CUDA. Debian's is CPU-only, and is visible to Debian's Python only.
  local beside_torch
  beside_torch="$(grep '^safetensors==' tests/requirements.txt) efficientnet-lite-pytorch==0.1.0 timm==0.9.16 ultralytics==8.4.190 opencv-python-headless==4.10.0.84"
  if [ "$(cat target/venv-torch/installed 2>/dev/null || true)" != "$beside_torch" ]; then
    /usr/bin/python3 -m venv --system-site-packages target/venv-torch
    # shellcheck disable=SC2086 # a list of packages
    target/venv-torch/bin/pip install -q --no-deps $beside_torch
    echo "$beside_torch" > target/venv-torch/installed
  fi
}

[ $# -gt 0 ] || set -- build packages libtorch python
for part; do
  case $part in
    build | packages | libtorch | python) $part ;;
    *) echo "no part: $part; bash tests/peers.sh [build|packages|libtorch|python]" >&2; exit 2 ;;
  esac
done
