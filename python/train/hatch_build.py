"""Puts the program into the wheel: the file that $FURROW_TRAIN_PROGRAM names."""

import os

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Program(BuildHookInterface):
    def initialize(self, version, build_data):
        # `auditwheel repair` then replaces the tag by that of a manylinux.
        build_data["tag"] = "py3-none-linux_x86_64"
        build_data["pure_python"] = False
        build_data["force_include"][os.environ["FURROW_TRAIN_PROGRAM"]] = "furrow_train/train"
