#!/usr/bin/env python3
"""Compares the speed of Furrow and Cycles, Blender's path tracer, on one GLB file: seconds until the image's error falls below a target.

    target/venv-bpy/bin/python benches/race_cycles.py --scene scenes/field.ron --width 648 --reference-spp 1024 --spp 16 64

Needs Blender's Python module (`python3.11 -m venv target/venv-bpy && target/venv-bpy/bin/pip install bpy==5.0.1 numpy OpenEXR`; on Debian
`apt-get install libgl1 libxi6 libsm6 libxkbcommon0 libxrender1 libxfixes3`), and `cargo build --release`. Options, error, references and
rounds are those of race.py; options for Mitsuba or the filter have no effect.

Method: `trace export` writes the scene as a GLB file, and both programs render that file, with the same triangles, normals,
textures, masks, camera and sun. glTF has no sky: the scene file that places the GLB for Furrow repeats the lights of the
original, and Cycles gets the same sky as an environment map from `trace export --format mitsuba`. Both trace paths of at
most 12 surfaces with a box filter of one pixel. Cycles runs on the CPU without denoising, adaptive sampling and clamping,
otherwise with default settings. Its importer does not support diffuse transmission, so materials are built here.

Rough thin sheets (Diffuse and Translucent) and masks are equal. Soil (Oren–Nayar; Cycles uses Fujii's variant, equal if
light and viewer are on one side) and coats (GGX with IOR 1.5; Principled) are approximately equal. Furrow filters textures
and normal maps over a ray's footprint and Cycles reads single texels, so that its relief is rougher, more so in small
images. Only Furrow's sun has limb darkening. Lamps become spot lights in the GLB, so that scenes with lamps differ.

Seconds are sampling times as reported by each program; "in all" includes import, scene construction and output.
"""

import hashlib
import itertools
import json
import os
import re
import subprocess
import sys
import time

sys.dont_write_bytecode = True
import bpy  # noqa: E402
import numpy as np  # noqa: E402
import OpenEXR  # noqa: E402
import race  # noqa: E402

PHOTOMETRIC = 106.857  # factor of the export on watts, divided by the divisor of Blender's importer
# Least α without a coat in Furrow; coat albedo at normal incidence; light below it, c(20°) c(45°) of `crates/optics/src/bsdf/leaf.rs`.
MATTE, COAT, BELOW = 0.8, 0.04, 1.05
# Oren–Nayar's B / A for a slope of 0.3 rad, and its A = 0.8881 divided by Fujii's, 1 / (1 + σ (1/2 − 2 / 3π)).
ROUGHNESS, DARKER = 0.252, 0.8881 * (1 + 0.252 * (0.5 - 2 / (3 * np.pi)))


def read_radiance(path):
    return OpenEXR.File(str(path)).channels()["RGB"].pixels.astype(np.float64)


def fields(text):
    """Returns the source text of a scene file's fields, by name."""
    text = re.sub(r'("(?:[^"\\]|\\.)*")|//[^\n]*|/\*.*?\*/', lambda m: m[1] or "", text, flags=re.DOTALL)
    parts, depth = [""], 0
    for token in re.findall(r'"(?:[^"\\]|\\.)*"|.', text[text.index("(") + 1 : text.rindex(")")], re.DOTALL):
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(token, 0)
        parts = [*parts, ""] if token == "," and depth == 0 else [*parts[:-1], parts[-1] + token]
    return {name.strip(): value.strip() for name, value in (part.split(":", 1) for part in parts if part.strip())}


def split(glb):
    """Returns the JSON document and the binary chunk of a GLB file."""
    data = glb.read_bytes()
    length = int.from_bytes(data[12:16], "little")
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def export(options, folder):
    """Writes the GLB, the scene file that places it, and a scene of the lights alone; returns the path of the scene file."""
    page = fields((race.ROOT / options.scene).read_text())
    if missing := {"camera", "lights"} - set(page):
        sys.exit(f"{options.scene} has no {' and no '.join(missing)} of its own")
    kept = "".join(f"    {name}: {page[name]},\n" for name in ("seed", "camera", "lights") if name in page)
    for stem, models in (("light", ""), ("glb", '    models: [(file: "scene.glb")],\n')):
        (folder / f"{stem}.ron").write_text(f"Field(\n    filter: Box,\n{kept}{models})\n")
    size = [f"--{k}={v}" for k in ("width", "height") if (v := getattr(options, k))]
    light = str(folder / "light.ron"), folder / "light"
    for scene, out, form in ((options.scene, folder, "gltf"), (*light, "gltf"), (*light, "mitsuba")):
        command = [options.trace, "export", "--scene", scene, "--format", form, "--quiet", "--out", str(out), *size]
        subprocess.run(command, cwd=race.ROOT, check=True, stdout=subprocess.DEVNULL)
    both = [split(glb)[0] for glb in (folder / "scene.glb", folder / "light" / "scene.glb")]
    views = [[of["cameras"], of.get("extensions"), *(n["matrix"] for n in of["nodes"] if "mesh" not in n)] for of in both]
    if views[0] != views[1]:
        sys.exit(f"{options.scene}: the scene file of the GLB samples another camera or sun")
    return folder / "glb.ron"


class Cycles:
    """Cycles, in this process, so that the GLB is imported once."""

    name, share = "Cycles", 1  # the samples of the reference are independent of those of a run
    possible = staticmethod(lambda spp: 1 << (spp - 1).bit_length())  # Sobol points are well stratified at powers of two

    def __init__(self, options, folder):
        begin = time.perf_counter()
        self.folder, self.images = folder, {}
        self.document, self.bytes = split(folder / "scene.glb")
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.import_scene.gltf(filepath=str(folder / "scene.glb"), import_shading="NORMALS")
        for material in self.document["materials"]:
            self.material(material)
        for light in bpy.data.lights:
            light.energy /= PHOTOMETRIC
            if light.type == "SUN":
                light.angle = np.radians(2 * 0.2666)
        self.settings(options, self.world())
        self.loading = time.perf_counter() - begin

    def world(self):
        """Sets the sky from the scene of the lights exported for Mitsuba; returns the maximum number of bounces."""
        text, sky = (self.folder / "light" / "scene.xml").read_text(), np.zeros((4, 8, 3), np.float32)
        if constant := re.search(r'type="constant">\s*<rgb name="radiance" value="([^"]+)"', text):
            sky += np.array(constant[1].split(), np.float32)
        elif 'type="envmap"' in text:
            sky = read_radiance(self.folder / "light" / "textures" / "sky.exr").astype(np.float32)
            # Rows are averaged to lie between Mitsuba's; columns start in the north and run east, those of Cycles start in the west.
            sky = np.roll((sky[1:] + sky[:-1]) / 2, sky.shape[1] // 4, axis=1)
        OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": sky}).write(str(self.folder / "sky.exr"))
        world = bpy.context.scene.world = bpy.data.worlds.new("sky")
        picture = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
        picture.image = bpy.data.images.load(str(self.folder / "sky.exr"))
        picture.image.colorspace_settings.name = "Non-Color"
        world.node_tree.links.new(picture.outputs["Color"], world.node_tree.nodes["Background"].inputs["Color"])
        return int(re.search(r'"max_depth" value="(\d+)"', text)[1]) - 2  # Mitsuba also counts the first surface and the emitter

    def settings(self, options, depth):
        scene, of = bpy.context.scene, self.document["cameras"][0]["extras"]
        scene.render.engine, scene.camera = "CYCLES", next(o for o in scene.objects if o.type == "CAMERA")
        render, cycles, lens, picture = scene.render, scene.cycles, scene.camera.data, scene.render.image_settings
        (width, height), (cx, cy) = of["size"], of["centre"]
        lens.shift_x, lens.shift_y = (width / 2 - cx) / height, (cy - height / 2) / height
        render.resolution_x, render.resolution_y, self.pixels = width, height, width * height
        cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = depth
        cycles.transparent_max_bounces, cycles.device, cycles.pixel_filter_type, cycles.filter_width = 1024, "CPU", "BOX", 1
        cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_auto_tile = False
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
        render.threads_mode, render.threads = ("FIXED", options.threads) if options.threads else ("AUTO", 1)
        render.filepath, picture.file_format, picture.color_depth = str(self.folder / "theirs.exr"), "OPEN_EXR", "32"
        picture.color_mode = "RGB"

    def material(self, material):
        """Builds the nodes of a material of the document. The coat of a sheet is scaled up, because the mix with transmission weakens it."""
        tree, seen = bpy.data.materials[material["name"]].node_tree, {}
        tree.nodes.clear()

        def node(kind, attributes=(), **inputs):
            new = tree.nodes.new(f"ShaderNode{kind}")
            for name, value in attributes:
                setattr(new, name, value)
            for name, value in inputs.items():
                socket = new.inputs[int(name[1]) if name[0] == "_" else name.replace("_", " ")]
                tree.links.new(value, socket) if hasattr(value, "is_linked") else setattr(socket, "default_value", value)
            return new.outputs[0]

        def picture(info, space="sRGB", by="Closest"):
            """Returns the output of an image texture of the GLB, one node per image; alpha is not premultiplied."""
            number = self.document["textures"][info["index"]]["source"]
            if number not in self.images:
                span = self.document["bufferViews"][self.document["images"][number]["bufferView"]]
                path, begin = self.folder / f"picture-{number}.png", span.get("byteOffset", 0)
                path.write_bytes(self.bytes[begin : begin + span["byteLength"]])
                image = self.images[number] = bpy.data.images.load(str(path))
                image.colorspace_settings.name, image.alpha_mode = space, "CHANNEL_PACKED"
            if number not in seen:
                seen[number] = node("TexImage", [("image", self.images[number]), ("extension", "EXTEND"), ("interpolation", by)])
            return seen[number]

        def color(info, factor, less=0.0):  # clamped at 0
            if not info:
                return (*(max(f - less, 0) for f in factor), 1)
            if not less and factor == [1, 1, 1]:
                return picture(info)
            of = node("VectorMath", [("operation", "MULTIPLY_ADD")], _0=picture(info), _1=factor, _2=[-less] * 3)
            return node("VectorMath", [("operation", "MAXIMUM")], _0=of, _1=[0.0] * 3) if less else of

        pbr, relief = material["pbrMetallicRoughness"], material.get("normalTexture")
        base, factor, rough = pbr.get("baseColorTexture"), pbr["baseColorFactor"][:3], pbr["roughnessFactor"]
        sheet = material.get("extensions", {}).get("KHR_materials_diffuse_transmission")
        share, below = sheet["diffuseTransmissionFactor"] if sheet else 0.0, 1.0
        bent = {"Normal": node("NormalMap", Strength=relief["scale"], Color=picture(relief, "Non-Color", "Linear"))} if relief else {}
        if rough**2 < MATTE:
            coat, below = COAT / (1 - share), BELOW
            under = color(base, [f * below / (1 - coat) for f in factor], coat * below / (1 - coat))
            shine = {"Specular_IOR_Level": min(0.5 / (1 - share), 1), "IOR": 1.5} | bent
            shader = node("BsdfPrincipled", Base_Color=under, Roughness=rough, **shine)
        else:
            plain, rough = (factor, 0) if sheet else ([f * DARKER for f in factor], ROUGHNESS)
            shader = node("BsdfDiffuse", Color=color(base, plain), Roughness=rough, **bent)
        if sheet:
            passed = color(sheet.get("diffuseTransmissionColorTexture"), [f * below for f in sheet["diffuseTransmissionColorFactor"]])
            shader = node("MixShader", _0=share, _1=shader, _2=node("BsdfTranslucent", Color=passed, **bent))
        if material.get("alphaMode") == "MASK":
            shader = node("MixShader", _0=picture(base).node.outputs["Alpha"], _1=node("BsdfTransparent"), _2=shader)
        tree.links.new(shader, tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])

    def render(self, spp, take, timed=True):
        """Returns radiance and sampling time in seconds."""
        scene, begin = bpy.context.scene, time.perf_counter()
        scene.cycles.samples, scene.cycles.seed = spp, take
        bpy.ops.render.render(write_still=True)
        self.rest = self.loading + time.perf_counter() - begin
        told = next(value for name, value in OpenEXR.File(scene.render.filepath).header().items() if name.endswith(".render_time"))
        seconds = sum(float(part) * 60**k for k, part in enumerate(reversed(told.split(":"))))
        self.rest -= seconds
        return read_radiance(scene.render.filepath), seconds


def main():
    options, table = race.arguments(), os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # Blender prints its progress to stdout
    name, folder = options.scene, race.ROOT / "target" / "race" / f"{race.Path(options.scene).stem}-cycles"
    folder.mkdir(parents=True, exist_ok=True)
    options.scene, race.read_radiance = str(export(options, folder)), read_radiance
    programs = [race.Furrow(options, folder), Cycles(options, folder)]
    parts = (options.trace, options.scene, folder / "scene.glb", folder / "sky.exr", __file__)
    key = hashlib.sha256(b"".join(race.Path(part).read_bytes() for part in parts)).hexdigest()[:12]
    references = [race.reference(p, options, folder, f"{key}-{options.reference_spp}") for p in programs]

    def measure(k, spp, take):
        program, long = programs[k], programs[k].possible(options.reference_spp)
        if spp >= long:
            sys.exit(f"{spp} samples need a longer reference than {long}: --reference-spp")
        image, seconds = program.render(spp, take)
        error = race.relmse(image, references[k]) * long / (long + program.share * spp)
        print(f"{program.name} {spp} spp: relMSE {error:.5f}, {seconds:.1f} s and {program.rest:.1f} s", file=sys.stderr)
        return error, seconds, program.rest

    spps, goal = options.spp, f"{options.target:g}"
    taken = [{p.possible(spp): [] for spp in spps} for p in programs]
    for take, spp, k in itertools.product(range(options.rounds), spps, range(2)):
        taken[k][programs[k].possible(spp)].append(measure(k, programs[k].possible(spp), take))
    head = ["", *(f"s at {n} spp (in all)" for n in spps), f"Msamples/s at {max(spps)}", *(f"relMSE at {n}" for n in spps)]
    head += [f"spp to {goal}", "relMSE there", f"s to {goal} (in all)", "ratio (in all)"]
    print("| " + " | ".join(head) + " |\n|" + "---|" * len(head), file=table)
    for k, program in enumerate(programs):
        points = {spp: np.median(runs, axis=0) for spp, runs in taken[k].items()}
        most, at = max(points), [points[program.possible(spp)] for spp in spps]
        needed, seconds = race.fit({spp: point[:2] for spp, point in points.items()}, options.target)
        needed, confirmed, rest = program.possible(needed), np.nan, points[most][2]
        if needed < program.possible(options.reference_spp):
            confirmed, there, rest = measure(k, needed, 500)
            seconds = there * confirmed / options.target
        ours = (seconds, seconds + rest) if k == 0 else ours
        cells = [program.name, *(f"{s:.1f} ({s + r:.1f})" for _, s, r in at), f"{programs[1].pixels * most / points[most][1] / 1e6:.2f}"]
        cells += [*(f"{error:.5f}" for error, _, _ in at), str(needed), f"{confirmed:.5f}", f"{seconds:.1f} ({seconds + rest:.1f})"]
        print("| " + " | ".join([*cells, f"{seconds / ours[0]:.2f} ({(seconds + rest) / ours[1]:.2f})"]) + " |", file=table)
    ours, theirs = (reference.mean((0, 1)) for reference in references)
    words = [" ".join(f"{x:.5f}" for x in mean) for mean in (ours, theirs, theirs / ours)]
    print("\nMean radiance: Furrow {}, Cycles {}, ratio {}.".format(*words), file=table)
    print(f"relMSE between the references {race.relmse(references[1], references[0]):.5f}; {name}, {programs[1].pixels} pixels, {os.cpu_count()} cores.", file=table)


if __name__ == "__main__":
    main()
