"""Builds the conda package of a wheel, and uses it from an environment folder laid out as conda does: RECIPE WHEEL FOLDER.

Nothing is downloaded: no channel is asked, so Python, NumPy and Pillow are those of the Python that runs this script."""

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import zstandard
from rattler_build import EnvironmentIsolation, Stage0Recipe

recipe, wheel, folder = map(Path, sys.argv[1:])
version = f"lib/python{sys.version_info.major}.{sys.version_info.minor}"

# The recipe finds the wheel by the layout of the repository.
shutil.copytree(recipe, folder / "python/conda")
(folder / "target/wheels").mkdir(parents=True)
shutil.copy(wheel, folder / "target/wheels")
os.environ["PATH"] = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
stage = Stage0Recipe.from_file(folder / "python/conda/recipe.yaml")
stage.run_build(
    output_dir=folder / "built", channels=[], package_format="conda:1", env_isolation=EnvironmentIsolation.NONE
)
(package,) = (folder / "built/linux-64").glob("furrow-*.conda")

# Installers move `python-scripts` and `site-packages` to the folders of the environment's Python.
prefix = folder / "environment"
with zipfile.ZipFile(package) as package:
    for name in package.namelist():
        if name.endswith(".tar.zst"):
            part = zstandard.ZstdDecompressor().stream_reader(package.open(name))
            with tarfile.open(fileobj=part, mode="r|") as archive:
                archive.extractall(prefix, filter="data")
(prefix / "python-scripts").rename(prefix / "bin")
(prefix / version).mkdir(parents=True)
(prefix / "site-packages").rename(prefix / version / "site-packages")
assert list((prefix / "info/licenses").rglob("BUNDLED.md")), "no licences of the libraries"

trace = prefix / "bin/trace"
libraries = subprocess.run(["ldd", trace], capture_output=True, text=True, check=True).stdout
for library in ["libembree", "libtbb"]:
    line = next(line for line in libraries.splitlines() if library in line)
    assert str(prefix) in os.path.realpath(line.split()[2]), line

clean = {k: v for k, v in os.environ.items() if not k.startswith("FURROW_") and k != "LD_LIBRARY_PATH"}
work = folder / "work"
work.mkdir()
command = [trace, "--scene", "field", "--width", "64", "--spp", "1", "--quiet"]
paths = subprocess.run(command, cwd=work, env=clean, capture_output=True, text=True, check=True).stdout.split()
assert paths and all((work / path).is_file() for path in paths), paths
soils = subprocess.run([trace, "soils"], cwd=work, env=clean, capture_output=True, text=True, check=True).stdout
assert str(prefix / "share/furrow") in os.path.realpath(next(w for w in soils.split() if w.endswith("dirt.png"))), soils
code = "import furrow; print(furrow.__file__, furrow.render('field', width=64, spp=1).rgb.shape)"
clean |= {"PYTHONPATH": str(prefix / version / "site-packages"), "PATH": f"{prefix}/bin:/usr/bin:/bin"}
shown = subprocess.run([sys.executable, "-c", code], cwd=work, env=clean, capture_output=True, text=True)
assert shown.returncode == 0 and str(prefix) in shown.stdout and "64, 3)" in shown.stdout, shown
