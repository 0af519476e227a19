"""Page to mark crop plants and weeds by clicks, for `train predict --like`.

    python -m furrow.points photos/
    train predict any-field photos/ --like points.csv --out corrected

The first command writes `photos/points.html`. Open it in a browser: a click marks a crop plant, a click with the shift key
a weed, and a click on a mark removes it. The page saves the marks as `points.csv` where the browser saves downloads.
Nothing leaves the computer.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import List, Optional, Sequence

from ._errors import FurrowError, reported

_ENDINGS = {".png", ".jpg", ".jpeg"}
_MARK = "<!-- furrow.points -->"

_PAGE = """<!doctype html>
MARK
<html lang="en"><meta charset="utf-8"><title>Points on crop plants and weeds</title>
<style>
  body { margin: 0; font: 15px sans-serif; background: #222; color: #eee }
  header { padding: 8px; display: flex; gap: 12px; align-items: center; flex-wrap: wrap }
  #view { position: relative; display: inline-block; line-height: 0; cursor: crosshair }
  img { max-height: calc(100vh - 60px); min-width: 40vw; user-select: none }
  .mark { position: absolute; width: 14px; height: 14px; margin: -8px; border-radius: 8px; border: 2px solid #fff; cursor: pointer }
  .crop { background: #2c2 } .weed { background: #d22 }
</style>
<header>
  <button id="back">&#8592;</button><b id="name"></b><button id="next">&#8594;</button>
  <label>mark <select id="type"><option>crop</option><option>weed</option></select></label>
  <span>shift + click: the other class; click on a mark: remove it</span>
  <label>zoom <input id="zoom" type="range" min="1" max="8" step="0.25" value="1"></label>
  <span id="count"></span><button id="save">Save points.csv</button>
</header>
<div id="view"><img id="image" alt="" draggable="false"></div>
<script>
const names = NAMES, points = names.map(() => []);
let at = 0, saved = true, loaded = false;
const of = id => document.getElementById(id), image = of("image");
const count = type => points.flat().filter(point => point.type === type).length;
function draw() {
  document.querySelectorAll(".mark").forEach(mark => mark.remove());
  of("name").textContent = `${names[at]} (${at + 1} of ${names.length})`;
  of("count").textContent = `${count("crop")} crop, ${count("weed")} weed`;
  if (!loaded) return;
  for (const point of points[at]) {
    const mark = document.createElement("div");
    mark.className = `mark ${point.type}`;
    mark.style.left = `${100 * point.x / image.naturalWidth}%`;
    mark.style.top = `${100 * point.y / image.naturalHeight}%`;
    mark.onclick = event => { event.stopPropagation(); points[at].splice(points[at].indexOf(point), 1); saved = false; draw() };
    of("view").append(mark);
  }
}
function show(step) {
  at = (at + step + names.length) % names.length;
  loaded = false;
  image.src = encodeURIComponent(names[at]);
  draw();
}
function zoom() {
  const times = +of("zoom").value;
  image.style.maxHeight = times > 1 ? "none" : "";
  image.style.width = times > 1 ? `${100 * times}vw` : "";
}
of("zoom").oninput = zoom;
image.onload = () => { loaded = true; draw() };
image.onclick = event => {
  if (!loaded) return;
  const box = image.getBoundingClientRect(), isWeed = (of("type").value === "weed") !== event.shiftKey;
  const type = isWeed ? "weed" : "crop";
  const part = (value, from, length) => Math.min(Math.max((value - from) / length, 0), 1);
  const x = part(event.clientX, box.left, box.width) * image.naturalWidth;
  const y = part(event.clientY, box.top, box.height) * image.naturalHeight;
  points[at].push({ x: x.toFixed(1), y: y.toFixed(1), type });
  saved = false;
  draw();
};
of("back").onclick = () => show(-1);
of("next").onclick = () => show(1);
document.onkeydown = event => { if (event.key === "ArrowLeft") show(-1); if (event.key === "ArrowRight") show(1) };
of("save").onclick = () => {
  const quoted = name => `"${name.replaceAll('"', '""')}"`;
  const rows = points.flatMap((list, k) => list.map(point => [quoted(names[k]), point.x, point.y, point.type].join()));
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([["image,x,y,class", ...rows, ""].join("\\n")], { type: "text/csv" }));
  link.download = "points.csv";
  link.click();
  saved = true;
};
onbeforeunload = event => { if (!saved) event.preventDefault() };
show(0);
</script>
</html>
"""


def _is_photograph(file: Path) -> bool:
    """Return whether `train predict` takes a file for a photograph. The near infrared of a.jpg is a.nir.png."""
    try:
        file.name.encode()
    except UnicodeEncodeError:
        return False
    return file.suffix.lower() in _ENDINGS and not file.stem.endswith(".nir") and file.is_file()


def page(folder: Path) -> Path:
    """Write the page for the images of a folder into it and return its path."""
    try:
        names: List[str] = sorted(file.name for file in folder.iterdir() if _is_photograph(file))
    except OSError as error:
        raise FurrowError(f"{folder} cannot be listed: {error}", help="name a folder of photographs") from error
    if not names:
        raise FurrowError(f"{folder} has no PNG or JPEG image", help="name a folder of photographs")
    path = folder / "points.html"
    if path.is_dir() or path.is_symlink():
        raise FurrowError(f"{path} is no page", help="move it away")
    if path.exists() and _MARK not in path.read_text(encoding="utf-8", errors="replace")[:200]:
        raise FurrowError(f"{path} is another page", help="move it away")
    # A name with "</script>" must not end the script.
    listed = json.dumps(names).replace("<", "\\u003c")
    path.write_text(_PAGE.replace("MARK", _MARK).replace("NAMES", listed), encoding="utf-8")
    return path


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m furrow.points", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, help="folder of photographs")
    folder = parser.parse_args(arguments).folder
    with reported(parser):
        print(page(folder))


if __name__ == "__main__":
    main()
