#!/usr/bin/env python3
"""Writes the figures of the documentation: `python3 docs/figures/make.py` rewrites `docs/figures/*.svg`.

`crates.svg` is read from the Cargo.toml files; `leaf-skeleton.svg` is computed with the equations of
`crates/grow/src/plant/skeleton.rs`, `blade.rs` and `skin.rs`. Needs Python 3.11 or newer and no packages. Equal sources
give equal files.
"""

import math
import textwrap
import tomllib
from html import escape
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parent.parent

INK, GREY, GREEN, RED, BLUE, ORANGE, VIOLET = (
    "#1f2933", "#6b7680", "#2e7d32", "#c62828", "#1565c0", "#b45f06", "#8e24aa")
STYLE = f"""
text{{font:12px sans-serif;fill:{INK}}}.b{{font-weight:bold}}.t{{font-size:14px;font-weight:bold}}.g{{fill:{GREY}}}
.s{{font-size:11px}}.m{{text-anchor:middle}}.e{{text-anchor:end}}.h{{stroke:#fff;stroke-width:3;paint-order:stroke}}
"""


def num(x):
    """Formats a coordinate with one decimal at most."""
    words = f"{round(10 * x) / 10:.1f}".removesuffix(".0")
    return words.replace("0.", ".", 1) if words.lstrip("-").startswith("0.") else words.replace("-0", "0")


def points(places, close=False):
    """Returns the path data of a polyline: absolute start, then relative steps, which are shorter."""
    grid = [(round(10 * x), round(10 * y)) for x, y in places]
    steps = " ".join(num((b[k] - a[k]) / 10) for a, b in zip(grid, grid[1:]) for k in range(2))
    data = f"M{num(grid[0][0] / 10)} {num(grid[0][1] / 10)}l{steps}"
    return data.replace(" -", "-") + ("z" if close else "")


class Svg:
    """A figure with a white rounded background."""

    def __init__(self, name, title, width, height):
        self.name, self.parts = name, []
        self.head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
            f'height="{height}" fill="none" role="img">\n<title>{escape(title)}</title>\n<style>{STYLE}</style>\n'
        )
        self.rect(0.5, 0.5, width - 1, height - 1, "#fff", "#d5dade", 10)

    def add(self, tag, **attributes):
        words = [f'{k.rstrip("_").replace("_", "-")}="{v}"' for k, v in attributes.items() if v is not None]
        self.parts.append(f"<{tag} {' '.join(words)}/>")

    def rect(self, x, y, w, h, fill="#fff", stroke=INK, rx=5, dash=None):
        self.add("rect", x=num(x), y=num(y), width=num(w), height=num(h), rx=rx, fill=fill, stroke=stroke,
                 stroke_dasharray=dash)

    def path(self, d, stroke=INK, width=1, fill="none", dash=None):
        self.add("path", d=d, fill=None if fill == "none" else fill, stroke=None if stroke == "none" else stroke,
                 stroke_width=None if width == 1 or stroke == "none" else width, stroke_dasharray=dash)

    def line(self, places, stroke=INK, width=1, dash=None, fill="none", close=False):
        self.path(points(places, close), stroke, width, fill, dash)

    def arrow(self, places, stroke=INK, width=1.4, dash=None):
        """Draws a polyline with a head at its end."""
        (x0, y0), (x1, y1) = places[-2:]
        length = math.hypot(x1 - x0, y1 - y0)
        u, v = (x1 - x0) / length, (y1 - y0) / length
        back = (x1 - 7 * u, y1 - 7 * v)
        self.line(places[:-1] + [back], stroke, width, dash)
        wings = [(x1, y1), (back[0] - 3.5 * v, back[1] + 3.5 * u), (back[0] + 3.5 * v, back[1] - 3.5 * u)]
        self.line(wings, "none", 1, None, stroke, True)

    def dot(self, at, r=3, fill=INK, stroke=None):
        self.add("circle", cx=num(at[0]), cy=num(at[1]), r=r, fill=fill, stroke=stroke)

    def dots(self, places, r=3.5, color=INK):
        """Draws many dots as one path."""
        d = "".join(f"M{num(x)} {num(y)}h0" for x, y in places)
        self.add("path", d=d, stroke=color, stroke_width=2 * r, stroke_linecap="round")

    def out(self, at, stroke):
        """Draws an axis that points at the reader."""
        self.dot(at, 6, "#fff", stroke)
        self.dot(at, 2, stroke)

    def text(self, x, y, words, kind="", fill=None):
        kind, fill = (f' class="{kind}"' if kind else ""), (f' style="fill:{fill}"' if fill else "")
        self.parts.append(f'<text x="{num(x)}" y="{num(y)}"{kind}{fill}>{escape(words, False)}</text>')

    def box(self, x, y, w, h, title, lines=(), fill="#f3f6f8", stroke=INK):
        """Draws a box with a title and lines below it, centred."""
        self.rect(x, y, w, h, fill, stroke)
        top = y + h / 2 + 5 - 8 * len(lines)
        self.text(x + w / 2, top, title, "t m")
        for k, line in enumerate(lines):
            self.text(x + w / 2, top + 17 + 15 * k, line, "m")

    def write(self):
        text = self.head + "\n".join(self.parts) + "\n</svg>\n"
        (FOLDER / f"{self.name}.svg").write_text(text, encoding="utf-8")


def pipeline():
    s = Svg("pipeline", "The pipeline from scene file to images, labels, dataset and network", 880, 372)
    soft = {"data": "#eaf4ea", "work": "#eaf1fa"}
    w, h, gap, left, a, b, c = 122, 62, 22, 16, 46, 166, 288
    column = [left + k * (w + gap) for k in range(6)]
    s.rect(8, 10, 864, 236, "#fafbfc", "#d5dade", 8)
    s.text(18, 29, "one field, one image", "g")
    s.rect(8, 256, 864, 108, "#fafbfc", "#d5dade", 8)
    s.text(18, 275, "many fields", "g")
    s.text(862, 29, "green: data, blue: steps", "g e")

    def box(k, y, title, lines, kind, wide=w, high=h):
        s.box(column[k], y, wide, high, title, lines, soft[kind])

    box(0, a, "scene file", ["distribution", "over fields (RON)"], "data")
    box(1, a, "field", ["plants, ground,", "lights, camera"], "data")
    box(2, a, "path tracer", ["or rasterizer"], "work")
    box(3, a, "film", ["mean, variance of", "R, G, B and NIR"], "data")
    box(4, a, "sensor", ["exposure, noise,", "colours, bits"], "work")
    box(2, b, "label rays", ["one through each", "pixel’s centre"], "work")
    box(3, b, "label maps", ["class, plant and", "leaf of each pixel"], "data")
    s.rect(column[5], a, w, b + h - a, soft["data"])
    x = column[5] + 12
    s.text(column[5] + w / 2, a + 20, "files", "t m")
    for y, name in [(a + 41, "rgb.png"), (a + 56, "nir.png"), (a + 95, "radiance.exr"), (b + 19, "semantics.png"),
                    (b + 34, "plants.png"), (b + 49, "leaves.png")]:
        s.text(x, y, name)
    for k in range(5):
        s.arrow([(column[k] + w, a + h / 2), (column[k + 1], a + h / 2)])
    s.text(column[0] + w / 2, a + h + 22, "+ seed and index:", "s m g")
    s.text(column[0] + w / 2, a + h + 36, "always the same field", "s m g")
    middle = column[1] + w / 2
    s.arrow([(middle, a + h), (middle, b + h / 2), (column[2], b + h / 2)])
    s.arrow([(column[2] + w, b + h / 2), (column[3], b + h / 2)])
    s.arrow([(column[3] + w, b + h / 2), (column[5], b + h / 2)])
    middle, level = column[3] + w / 2, (a + b + h) / 2
    s.line([(middle, a + h), (middle, b)], INK, 1.4)
    s.arrow([(middle, level), (column[5], level)])
    s.text(column[4] + w / 2, b + h / 2 + 18, "no filter, no noise", "s m g")

    box(4, c, "dataset", ["images, label maps and records;", "rendered or imported"], "data", 2 * w + gap)
    box(2, c, "training", ["reads files only; loss,", "validation set, checkpoints"], "work", 2 * w + gap - 40)
    box(0, c, "network", ["class of each pixel", "of a new image"], "data", 2 * w + gap - 40)
    s.arrow([(column[5] + w / 2, b + h), (column[5] + w / 2, c)])
    s.arrow([(column[4], c + h / 2), (column[4] - gap - 40, c + h / 2)])
    s.arrow([(column[2], c + h / 2), (column[2] - gap - 40, c + h / 2)])
    s.write()


# Leaf: `Measures` of a leaf with four vein joints, metres and radians.
STALK, STALK_JOINTS, LENGTH, WIDTH, VEINS, ANGLE = 0.03, 3, 0.08, 0.05, [0.2, 0.4, 0.6, 0.8], 0.95
ROWS, COLUMNS, PAD, INNER, OUTER = 12, 8, 0.014, 0.4, (0.45, 0.95)


def product(a, b):
    """Multiplies two motions, each three rows of four numbers."""
    return [[sum(r[k] * b[k][j] for k in range(3)) + (r[3] if j == 3 else 0) for j in range(4)] for r in a]


def moved(m, p):
    return [sum(r[k] * p[k] for k in range(3)) + r[3] for r in m]


def inverse(m):
    turned = [[m[j][i] for j in range(3)] for i in range(3)]
    return [r + [-sum(r[k] * m[k][3] for k in range(3))] for r in turned]


def half_width(t):
    """`Outline::Power` with a = 0.55, b = 1, metres."""
    a, b, t = 0.55, 1.0, min(max(t, 0), 1)
    peak = a / (a + b)
    return 0.5 * WIDTH * t**a * (1 - t) ** b / (peak**a * (1 - peak) ** b)


class Leaf:
    """The kinematic tree of `skeleton.rs` and the rest mesh of `blade.rs`."""

    def __init__(self, bends=None, hinges=(0, 0)):
        self.along = [-STALK * (1 - i / STALK_JOINTS) for i in range(STALK_JOINTS)]
        self.along += [0.0] + [t * LENGTH for t in VEINS] + [LENGTH]
        names = [f"ST{i + 1}" for i in range(STALK_JOINTS)] + ["B"] + [f"VN{i + 1}" for i in range(len(VEINS))] + ["PK"]
        bends = bends or [0.0] * len(names)
        # Name, parent, a, α, rest, bend.
        self.joints = [
            (name, k - 1, self.along[k] - self.along[k - 1] if k else 0.0, 0.0, 0.0, bends[k])
            for k, name in enumerate(names)
        ]
        for i, t in enumerate(VEINS):
            for side, sign in [("L", 1), ("R", -1)]:
                first, reach = len(self.joints), half_width(t) / math.sin(ANGLE)
                self.joints.append((f"ST{side}{i + 1}", STALK_JOINTS + 1 + i, 0.0, -math.pi / 2, sign * ANGLE, 0.0))
                self.joints.append((f"ST{side}{i + 1}", first, 0.0, math.pi / 2, 0.0, hinges[0]))
                self.joints.append((f"ST{side}{i + 1}", first + 1, 0.5 * reach, 0.0, 0.0, hinges[1]))

    def poses(self, bent=True):
        """Forward kinematics: pose(j) = pose(parent) · Tx(a) · Rx(α) · Rz(θ)."""
        root = [[0, 0, 1, 0], [1, 0, 0, -STALK], [0, 1, 0, 0]]
        all_poses = []
        for _, parent, a, alpha, rest, bend in self.joints:
            theta = rest + (bend if bent else 0)
            (st, ct), (sa, ca) = [(math.sin(v), math.cos(v)) for v in (theta, alpha)]
            step = [[ct, -st, 0, a], [st * ca, ct * ca, -sa, 0], [st * sa, ct * sa, ca, 0]]
            all_poses.append(product(root if parent < 0 else all_poses[parent], step))
        return all_poses

    def carriers(self, y):
        last = len(self.along) - 2
        middle = [0.5 * (self.along[k] + self.along[k + 1]) for k in range(last + 1)]
        after = next((k for k in range(last + 1) if y < middle[k]), last + 1)
        if after == 0 or after > last:
            return [(min(after, last), 1.0)]
        share = (y - middle[after - 1]) / (middle[after] - middle[after - 1])
        return [(after - 1, 1 - share), (after, share)]

    def weights(self, x, y, across):
        """Skin weights: pairs of a joint's index and its weight."""
        origin = y - abs(x) / math.tan(ANGLE)
        at = [t * LENGTH for t in VEINS]
        upper = sum(v <= origin for v in at)
        lo, hi = max(upper - 1, 0), min(upper, len(at) - 1)
        share = min(max((origin - at[lo]) / (at[hi] - at[lo]), 0), 1) if hi > lo else 0

        def branch(part, scale):
            base = len(self.along) + (3 if x > 0 else 0) + part - 1
            return [(base + 6 * lo, scale * (1 - share)), (base + 6 * hi, scale * share)]

        if across < INNER:
            out = across / INNER
            return [(k, w * (1 - out)) for k, w in self.carriers(y)] + branch(2, out)
        out = min(max((across - OUTER[0]) / (OUTER[1] - OUTER[0]), 0), 1)
        return branch(2, 1 - out) + branch(3, out)

    def rest(self, i, j):
        """Vertex of the rest mesh in row `i` and column `j`, both possibly fractional: x, y, across."""
        s = i / ROWS
        s -= 0.4 * math.sin(2 * math.pi * s) / (2 * math.pi)
        t = (1 + 2 * PAD) * s - PAD
        reach = max(half_width(v) for v in (t - PAD, t, t + PAD)) + PAD * WIDTH
        q = 2 * j / COLUMNS - 1
        return q * reach, t * LENGTH, abs(q)

    def skinned(self, motions, x, y, across):
        """Linear blend skinning: p′ = Σ wₖ Mₖ p."""
        weights = self.weights(x, y, across)
        return [sum(w * moved(motions[k], (x, y, 0))[axis] for k, w in weights) for axis in range(3)]


def view(turn, elevation, scale, at):
    """Returns the parallel projection of a camera that looks down at `elevation`, in degrees."""
    (sb, cb), (se, ce) = [(math.sin(math.radians(v)), math.cos(math.radians(v))) for v in (turn, elevation)]
    return lambda p: (at[0] + scale * (cb * p[0] + sb * p[1]),
                      at[1] - scale * (ce * p[2] + se * (cb * p[1] - sb * p[0])))


def leaf_skeleton():
    s = Svg("leaf-skeleton", "The skeleton of a leaf, its rest mesh with skin weights, and its bent pose", 860, 476)
    leaf = Leaf()
    joints = [(name, [row[3] for row in pose]) for (name, *_), pose in zip(leaf.joints, leaf.poses())]
    chain = len(leaf.along)

    def flat(x0, y0=302):
        return lambda p: (x0 + 2900 * p[0], y0 - 2900 * p[1])

    rim = [(side * half_width(t), t * LENGTH) for side, ts in [(1, range(0, 31)), (-1, range(30, -1, -1))]
           for t in [(k / 30) ** 1.5 for k in ts]]

    # Kinematic tree.
    at = flat(130)
    s.text(24, 34, "1 Kinematic tree", "t")
    s.line([at(p) for p in rim], "#9dbfaa", 1, None, "#eef6ee", True)
    veins, branches, hinges = "", "", []
    for k in range(chain, len(joints), 3):
        name, inner, outer = joints[k][0], at(joints[k + 1][1]), at(joints[k + 2][1])
        x, y = joints[k][1][:2]
        sign = -1 if "L" in name else 1
        # The vein ends where it meets the outline.
        end = next(r for r in (n / 1e4 for n in range(1, 999)) if half_width((y + r * math.cos(ANGLE)) / LENGTH)
                   < r * math.sin(ANGLE))
        tip = at((sign * end * math.sin(ANGLE), y + end * math.cos(ANGLE)))
        veins += points([outer, tip])
        branches += points([inner, outer])
        hinges.append(outer)
        s.text(tip[0] + 4 * sign, tip[1] - 1, name, "s" if sign > 0 else "s e", VIOLET)
    s.path(veins, VIOLET, 1, dash="2 2")
    s.path(branches, VIOLET, 2)
    s.dots(hinges, 3.5, RED)
    s.line([at(p) for _, p in joints[:chain]], BLUE, 2.5)
    s.dots([at(p) for _, p in joints[:chain]], 3.5, BLUE)
    for name, p in joints[:chain]:
        x, y = at(p)
        s.text(x + 7, y + 13 if name[0] == "V" else y + 4, name, "s h", BLUE)
    x, y = 46, 350
    s.arrow([(x, y), (x + 34, y)], RED)
    s.arrow([(x, y), (x, y - 34)], GREEN)
    s.out((x, y), BLUE)
    s.text(x + 30, y + 15, "x", "s")
    s.text(x - 3, y - 38, "y", "s")
    s.text(x - 20, y + 4, "z", "s")
    s.text(24, y + 31, "leaf frame", "s g")
    notes = ["pose(j) = pose(parent) · Tx(a) · Rx(α) · Rz(θ)", "Chain from the stem (ST1) to the tip (PK);",
             "branches with hinges at the midrib", "and half-way out."]

    def write(x, lines):
        for k, line in enumerate(lines):
            s.text(x, 412 + 16 * k, line)

    write(24, notes)

    # Rest mesh with the weights of three joints.
    at = flat(396)
    s.text(310, 34, "2 Rest mesh and skin weights", "t")
    shown = [("VN2", BLUE, {chain - 4}), ("STL2, STR2, at the midrib", VIOLET, {chain + 7, chain + 10}),
             ("STL2, STR2, half-way out", RED, {chain + 8, chain + 11})]
    cells = {}
    for i in range(ROWS):
        for j in range(COLUMNS):
            weights = leaf.weights(*leaf.rest(i + 0.5, j + 0.5))
            part = [round(4 * sum(w for k, w in weights if k in group)) / 4 for _, _, group in shown]
            if any(part):
                mixed = [255 - sum(w * (255 - int(color[1 + 2 * c : 3 + 2 * c], 16)) for w, (_, color, _) in
                                   zip(part, shown)) for c in range(3)]
                key = "#" + "".join(f"{max(0, round(v)):02x}" for v in mixed)
                corners = [at(leaf.rest(i + u, j + v)) for u, v in [(0, 0), (0, 1), (1, 1), (1, 0)]]
                cells.setdefault(key, []).append(points(corners, True))
    for color, paths in cells.items():
        s.path("".join(paths), "none", 1, color)
    grid = [[at(leaf.rest(i, j)) for j in (0, COLUMNS)] for i in range(ROWS + 1)]
    grid += [[at(leaf.rest(i, j)) for i in range(ROWS + 1)] for j in range(COLUMNS + 1)]
    s.path("".join(points(row) for row in grid), GREY, 0.6)
    s.line([at((0, -STALK)), at((0, 0))], GREEN, 4)
    for k, (name, color, _) in enumerate(shown):
        s.rect(416, 337 + 17 * k, 11, 11, color, "none", 1)
        s.text(432, 347 + 17 * k, name, "s")
    s.text(416, 328, "weights of the joints", "s g")
    write(310, ["Flat grid, midrib in the middle column.", "Each vertex: up to four joints,", "Σ wₖ = 1, wₖ ≥ 0."])

    # Bent pose.
    s.text(590, 34, "3 Bent pose", "t")
    bent = Leaf([0.95, -0.1, -0.15, -0.3, -0.25, -0.28, -0.25, -0.2, 0], (0.3, -0.35))
    poses = bent.poses()
    motions = [product(p, inverse(q)) for p, q in zip(poses, bent.poses(False))]
    at = view(52, 34, 3100, (668, 290))
    mesh = [[bent.skinned(motions, *bent.rest(i, j)) for j in range(COLUMNS + 1)] for i in range(ROWS + 1)]
    light, shades = (-0.2, -0.35, 0.91), {}
    for i in range(ROWS):
        for j in range(COLUMNS):
            p, q, r, t = mesh[i][j], mesh[i][j + 1], mesh[i + 1][j + 1], mesh[i + 1][j]
            u, v = [[b[k] - a[k] for k in range(3)] for a, b in [(p, r), (q, t)]]
            n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
            lit = sum(a * b for a, b in zip(n, light)) / math.hypot(*n)
            shade = min(max(round(5 * lit), 1), 5)
            shades.setdefault(shade, []).append(points([at(c) for c in (p, q, r, t)], True))
    s.line([at([row[3] for row in pose]) for pose in poses[: STALK_JOINTS + 1]], GREEN, 4)
    for shade, paths in sorted(shades.items()):
        color = "#" + "".join(f"{round(v * (0.45 + 0.11 * shade)):02x}" for v in (150, 205, 140))
        s.path("".join(paths), GREY, 0.4, color)
    places = [at([row[3] for row in pose]) for pose in poses]
    s.path("".join(points([places[k + 1], places[k + 2]]) for k in range(chain, len(poses), 3)), VIOLET, 1.5)
    s.dots(places[chain + 2 :: 3], 3, RED)
    s.line(places[:chain], BLUE, 2)
    s.dots(places[:chain], 3.5, BLUE)
    for k, dx, dy in [(0, 8, 6), (STALK_JOINTS, -14, -4), (chain - 1, 6, 12)]:
        x, y = places[k]
        s.text(x + dx, y + dy, joints[k][0], "s h", BLUE)
    write(590, ["Each joint turns about its own z axis:", "θ = rest + bend. A vertex moves to", "p′ = Σ wₖ Mₖ p."])
    s.write()


def camera_frames():
    s = Svg("camera-frames", "World, camera, pixel and leaf frames, and azimuths", 860, 640)
    s.line([(0.5, 356), (859.5, 356)], "#d5dade")
    s.line([(470, 0.5), (470, 639.5)], "#d5dade")

    def axis(at, start, vector, color, name, dx, dy, kind=""):
        end = [a + b for a, b in zip(start, vector)]
        s.arrow([at(start), at(end)], color, 2)
        x, y = at(end)
        s.text(x + dx, y + dy, name, f"h {kind}".strip(), color)

    # World and camera.
    s.text(24, 32, "World frame and camera frame", "t")
    at = view(28, 30, 152, (62, 240))
    x0, y0, height, wide, high = 1.3, 0.62, 1.25, 0.46, 0.34
    s.line([at(p + (0,)) for p in [(0, 0), (2, 0), (2, 1.2), (0, 1.2)]], "none", 1, None, "#f1ede6", True)
    lens = (x0, y0, height)
    foot = [(x0 - wide, y0 + high, 0), (x0 + wide, y0 + high, 0), (x0 + wide, y0 - high, 0), (x0 - wide, y0 - high, 0)]
    s.line([at(p) for p in foot], GREY, 1, None, "#dfeadf", True)
    for p in foot:
        s.line([at(lens), at(p)], GREY, 0.8, "3 3")
    s.line([at(foot[0]), at(foot[1])], INK, 3)
    x, y = at((x0 + wide, y0 + high, 0))
    s.text(x + 6, y + 2, "image’s top", "s")
    s.text(x + 6, y + 16, "(north at yaw 0)", "s")
    axis(at, (0, 0, 0), (0.62, 0, 0), RED, "x east", -14, 20)
    axis(at, (0, 0, 0), (0, 0.75, 0), GREEN, "y north", 4, -6)
    axis(at, (0, 0, 0), (0, 0, 0.75), BLUE, "z up", -10, -8)
    s.text(at((0, 0, 0))[0] - 38, at((0, 0, 0))[1] + 20, "world", "b")
    axis(at, lens, (0.5, 0, 0), RED, "x right", 6, 8)
    axis(at, lens, (0, -0.6, 0), GREEN, "y down", -8, 6, "e")
    axis(at, lens, (0, 0, -0.6), BLUE, "z forward", 8, 4)
    s.dot(at(lens), 4)
    x, y = at(lens)
    s.text(x - 4, y - 14, "camera (OpenCV’s axes)", "b m")
    s.text(24, 324, "Yaw turns the image’s top clockwise, seen from above; pitch tilts the view", "s")
    s.text(24, 340, "to the image’s top, roll to its right. Order: roll, pitch, yaw.", "s")

    # Pixels.
    s.text(494, 32, "Pixel frame", "t")
    left, top, size = 540, 84, 44
    s.rect(left + 2 * size, top + size, size, size, "#dbe8f7", "none", 0)
    lines = [[(left + k * size, top), (left + k * size, top + 4 * size)] for k in range(7)]
    lines += [[(left, top + k * size), (left + 6 * size, top + k * size)] for k in range(5)]
    s.path("".join(points(line) for line in lines), "#a9b4bd")
    s.arrow([(left, top), (left + 6.7 * size, top)], RED, 2)
    s.arrow([(left, top), (left, top + 4.7 * size)], GREEN, 2)
    s.text(left + 6.7 * size + 5, top + 4, "x", "", RED)
    s.text(left - 4, top + 4.7 * size + 14, "y", "", GREEN)
    s.dot((left, top), 4)
    s.text(left - 8, top - 10, "(0, 0): the image’s corner", "s")
    for column, row in [(0, 0), (2, 1)]:
        x, y = left + (column + 0.5) * size, top + (row + 0.5) * size
        s.dot((x, y), 3, BLUE)
        s.text(x + 5, y - 6, f"({column}.5, {row}.5)", "s h", BLUE)
    s.text(left + 2 * size, top + 2 * size + 13, "column 2, row 1", "s h")
    x, y = left + 3.07 * size, top + 2.62 * size
    s.path(f"M{num(x - 6)} {num(y)}h12m-6 -6v12", ORANGE, 2)
    s.text(x + 9, y + 14, "(cx, cy)", "s h", ORANGE)
    s.dot((left + 6 * size, top + 4 * size), 4)
    s.text(left + 6 * size, top + 4 * size + 17, "(width, height)", "s m")
    s.text(494, 324, "Labels: the ray through the pixel’s centre, at +0.5.", "s")
    s.text(494, 340, "x = fx x′ + cx,  y = fy y′ + cy", "s")

    # Azimuth.
    s.text(24, 388, "Azimuth", "t")
    cx, cy, r, azimuth = 150, 520, 84, 55
    s.dot((cx, cy), r, "#f1ede6", "#c9c2b6")
    end = (cx + r * math.sin(math.radians(azimuth)), cy - r * math.cos(math.radians(azimuth)))
    s.arrow([(cx, cy), (cx, cy - r - 14)], GREEN, 2)
    s.arrow([(cx, cy), (cx + r + 14, cy)], RED, 2)
    s.arrow([(cx, cy), end], INK, 2)
    arc = [(cx + 46 * math.sin(v), cy - 46 * math.cos(v)) for v in (math.radians(azimuth * k / 12) for k in range(13))]
    s.arrow(arc, ORANGE, 2)
    s.text(cx + 18, cy - 52, "a", "b", ORANGE)
    s.text(cx + 7, cy - r - 12, "y north, a = 0°", "h", GREEN)
    s.text(cx + r + 2, cy + 18, "x east, 90°", "h", RED)
    s.text(cx, cy + r + 16, "180°", "s m")
    s.text(cx - r - 6, cy + 4, "270°", "s e")
    s.out((cx, cy), BLUE)
    s.text(cx - 10, cy + 18, "z up", "s e", BLUE)
    for k, words in enumerate(["Degrees clockwise from north,", "as seen from above:", "direction (sin a, cos a).",
                               "", "", "", "", "Sun, rows and leaves use it;", "yaw turns the same way."]):
        s.text(278, 446 + 17 * k, words)

    # Leaf.
    s.text(494, 388, "Leaf frame", "t")
    rim = [(side * half_width(t), t * LENGTH, 0) for side, ts in [(1, range(0, 31)), (-1, range(30, -1, -1))]
           for t in [(k / 30) ** 1.5 for k in ts]]
    at = view(38, 36, 3300, (606, 560))
    s.line([at((0, -0.022, 0)), at((0, 0, 0))], GREEN, 4)
    s.line([at(p) for p in rim], "#7da389", 1, None, "#e3f1e3", True)
    s.line([at((0, 0, 0)), at((0, LENGTH, 0))], "#7da389")
    axis(at, (0, 0, 0), (0, 0.05, 0), GREEN, "y along the midrib", 8, 14)
    axis(at, (0, 0, 0), (0.03, 0, 0), RED, "x right", 6, 10)
    axis(at, (0, 0, 0), (0, 0, 0.05), BLUE, "z out of the upper (adaxial) side", -20, -10)
    s.dot(at((0, 0, 0)), 4)
    x, y = at((0, 0, 0))
    s.text(x - 14, y - 2, "blade’s base", "s e")
    x, y = at((0, -0.022, 0))
    s.text(x + 10, y + 6, "petiole", "s")
    s.text(494, 626, "World, camera and leaf frames are right-handed, in metres.", "s")
    s.write()


def dependencies(manifest):
    """Returns the crate's name, its description and its dependencies in this workspace: name to feature or `None`."""
    read = tomllib.loads(manifest.read_text(encoding="utf-8"))
    features = {item: name for name, items in read.get("features", {}).items() for item in items}
    used = {}
    for name, value in read.get("dependencies", {}).items():
        if name.startswith("furrow-"):
            optional = isinstance(value, dict) and value.get("optional", False)
            used[name] = features.get(f"dep:{name}", "optional") if optional else None
    return read["package"]["name"], read["package"]["description"], used


def crates():
    read = [dependencies(path) for path in [ROOT / "Cargo.toml", *sorted(ROOT.glob("crates/*/Cargo.toml"))]]
    uses = {name: used for name, _, used in read}
    about = {name: description for name, description, _ in read}

    def layer(name):
        return 1 + max((layer(other) for other in uses[name]), default=0)

    def reaches(start, goal, optional):
        """Whether `start` uses `goal` directly or through others; without `optional`, in every build."""
        return any(other == goal or reaches(other, goal, optional) for other, feature in uses[start].items()
                   if optional or feature is None)

    # An edge is left out if another dependency implies it, in every build in which the edge exists.
    edges = [(name, goal, feature) for name, used in uses.items() for goal, feature in used.items()
             if not any(reaches(other, goal, feature is not None) for other, f in used.items()
                        if other != goal and (feature is not None or f is None))]

    def above(name):
        """Length of the longest chain of crates that lead to this one."""
        return max((1 + above(user) for user, used in uses.items() if name in used), default=0)

    layers = {}
    for name in sorted(uses, key=lambda name: (-above(name), name)):
        layers.setdefault(layer(name), []).append(name)
    left, wide, side, gap, indent = 20, 456, 320, 74, 134
    place, y = {}, 54
    for level in sorted(layers, reverse=True):
        below = y
        for k, name in enumerate(layers[level]):
            # The first crate of a layer is in the main column, others are stacked beside it.
            width, chars = (wide, 52) if k == 0 else (side, 50)
            lines = textwrap.wrap(about[name], chars)
            height = 40 if len(lines) < 3 else 50
            if k > 0:
                height = 27 + 13 * len(lines)
            place[name] = (left, y, wide, height, lines) if k == 0 else (left + wide + gap, below, side, height, lines)
            below += (height + 14) if k > 0 else 0
        y = max(y + place[layers[level][0]][3], below - 14) + 20
    main = [names[0] for _, names in sorted(layers.items(), reverse=True)]

    s = Svg("crates", "The crates of the workspace and their dependencies", left * 2 + wide + gap + side, y)
    s.text(left, 32, "Crates of the workspace: an arrow leads to a crate that is used", "t")
    x, note = left + wide + gap, 70
    for words in ["Dependencies that follow from others are left", "out. A crate is one row above the highest",
                  "crate that it uses."]:
        s.text(x, note, words, "g")
        note += 16
    for feature in sorted({feature for *_, feature in edges if feature}):
        s.line([(x, note + 4), (x + 30, note + 4)], INK, 1.4, "3 2")
        s.text(x + 38, note + 8, f"only with the feature {feature}", "g")
        note += 18

    lanes = []
    for name, goal, feature in sorted(edges, key=lambda e: (place[e[1]][1] - place[e[0]][1], e)):
        (x0, y0, w0, h0, _), (x1, y1, w1, h1, _) = place[name], place[goal]
        dash = "3 2" if feature else None
        if (name, goal) in zip(main, main[1:]):
            s.arrow([(x0 + 60, y0 + h0), (x0 + 60, y1)], INK, 1.4, dash)
            continue
        # A lane between the columns that no other edge uses at this height.
        start, end = y0 + h0 * 0.7, y1 + h1 * 0.3
        free = (k for k, taken in enumerate(lanes) if all(end < a or b < start for a, b in taken))
        lane = next(free, len(lanes))
        lanes += [[]] if lane == len(lanes) else []
        lanes[lane].append((start, end))
        x = left + wide + 18 + 16 * lane
        out, into = [at + (w if at == left else 0) for at, w in [(x0, w0), (x1, w1)]]
        s.arrow([(out, start), (x, start), (x, end), (into, end)], INK, 1.4, dash)
    for name, (x, y, w, h, lines) in place.items():
        s.rect(x, y, w, h, "#eaf1fa" if name == "furrow" else "#f3f6f8")
        first = y + h / 2 + 4 - 7 * (len(lines) - 1)
        x0, y0, step = (x + indent, first, 14) if x == left else (x + 10, y + 31, 13)
        s.text(x + 10, y + h / 2 + 4 if x == left else y + 16, name, "b")
        for k, line in enumerate(lines):
            s.text(x0, y0 + step * k, line, "s")
    s.write()


if __name__ == "__main__":
    pipeline()
    leaf_skeleton()
    camera_frames()
    crates()
