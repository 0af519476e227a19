"""Writes the page that marks plants by clicks, and checks the images it lists and its errors. Argument: an empty folder."""

import json
import re
import subprocess
import sys
from pathlib import Path

folder = Path(sys.argv[1])


def run():
    return subprocess.run([sys.executable, "-m", "furrow.points", str(folder)], capture_output=True, text=True)


refused = run()
assert refused.returncode == 2 and "no PNG or JPEG" in refused.stderr and "help:" in refused.stderr, refused
names = ['a "b".jpg', "<script>.PNG", "ü,1.jpeg"]
for name in [*names, "notes.txt", "a.nir.png"]:
    (folder / name).write_bytes(b"")
(folder / "folder.jpg").mkdir()
for _ in range(2):
    made = run()
    assert made.returncode == 0 and made.stdout.strip() == str(folder / "points.html"), made
page = (folder / "points.html").read_text(encoding="utf-8")
assert json.loads(re.search(r"const names = (\[.*?\]),", page)[1]) == sorted(names)
assert page.count("<script>") == page.count("</script>") == 1
(folder / "points.html").write_text("<p>mine</p>")
refused = run()
assert refused.returncode == 2 and "another page" in refused.stderr, refused
assert (folder / "points.html").read_text() == "<p>mine</p>"
