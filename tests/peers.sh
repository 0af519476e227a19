#!/usr/bin/env bash
# Installs what the build and the tests need, on Debian 12, as root or as a user who may sudo, and asks nothing: Embree and a C compiler; Mesa's
# Vulkan for the rasterized engine; and the
# programs that the tests ask for a second opinion (a browser, a batch system, Python clients in target/venv); libtorch for the feature `train`.
# What is there already is left alone.
set -euo pipefail
cd "$(dirname "$0")/.."
packages="libembree-dev build-essential mesa-vulkan-drivers libvulkan1 python3-venv libllvm19 chromium slurm-wlm munge iproute2 procps parallel"
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
sh .libtorch/get.sh
