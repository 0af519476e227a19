"""Opens USD/scene.usda with usd-core 26.11 and compares it with SCENE.glb of the same field: meshes, labels, materials, camera, lights, skeletons.

Arguments: both, then file, text and other text of each damage that the comparison must find.
"""

import collections
import json
import math
import os
import struct
import sys
from pathlib import Path

import numpy as np
import OpenEXR
from pxr import Gf, Kind, Usd, UsdGeom, UsdLux, UsdSemantics, UsdShade, UsdSkel, UsdValidation, Vt

NOW = Usd.TimeCode.Default()
# Lumens per W/nm of light with a flat spectrum.
LUMENS = 683 * 106.857


class Glb:
    """The same field as glTF."""

    def __init__(self, path):
        data = Path(path).read_bytes()
        length = struct.unpack_from("<I", data, 12)[0]
        self.document = json.loads(data[20 : 20 + length])
        self.buffer = data[28 + length :]

    def array(self, index):
        """Returns the values of an accessor; its buffer view is not interleaved."""
        accessor = self.document["accessors"][index]
        view = self.document["bufferViews"][accessor["bufferView"]]
        kind = {5126: "<f4", 5125: "<u4", 5123: "<u2"}[accessor["componentType"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        values = np.frombuffer(self.buffer, kind, accessor["count"] * width, start)
        return values.reshape(-1, width)

    def meshes(self):
        for mesh in self.document["meshes"]:
            (primitive,) = mesh["primitives"]
            of = {name: self.array(index) for name, index in primitive["attributes"].items()}
            uv = of["TEXCOORD_0"].astype(np.float64)
            material = self.document["materials"][primitive["material"]]
            pbr = material["pbrMetallicRoughness"]
            share = material.get("extensions", {}).get("KHR_materials_diffuse_transmission", {}).get("diffuseTransmissionFactor", 0)
            yield {
                "label": (mesh["extras"]["class"], mesh["extras"]["plant"], mesh["extras"]["leaf"]),
                "points": of["POSITION"],
                "normals": of["NORMAL"],
                "st": np.stack([uv[:, 0], 1 - uv[:, 1]], 1).astype(np.float32),
                "indices": self.array(primitive["indices"]).ravel().astype(np.int32),
                "weights": of.get("WEIGHTS_0", np.empty(0, np.float32)),
                "masked": material.get("alphaMode") == "MASK",
                "pictured": "baseColorTexture" in pbr,
                "raised": "normalTexture" in material,
                "nir": np.array([material["extras"]["nir_reflectance"], material["extras"]["nir_transmittance"]], np.float32),
                "color": np.array(pbr["baseColorFactor"][:3]) * (1 - share),
                "roughness": np.array(pbr["roughnessFactor"]),
            }


def directly(prim, kind):
    return list(UsdSemantics.LabelsQuery(kind, NOW).ComputeUniqueDirectLabels(prim))


def number(prim, kind):
    labels = directly(prim, kind)
    assert len(labels) <= 1, labels
    return int(labels[0]) if labels else 0


def material(prim):
    """Returns the properties of the bound material that the GLB has as well; its files must exist."""
    bound = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    assert bound, f"{prim.GetPath()} has no material"
    surface = bound.ComputeSurfaceSource()[0]
    assert surface.GetIdAttr().Get() == "UsdPreviewSurface"

    def texture(name):
        source = surface.GetInput(name).GetConnectedSources()[0] if surface.GetInput(name) else []
        if not source:
            return None
        shader = UsdShade.Shader(source[0].source)
        file = shader.GetInput("file").Get()
        assert file.resolvedPath, f"{file.path} is missing"
        assert Path(file.resolvedPath).read_bytes()[:4] == b"\x89PNG"
        reader = UsdShade.Shader(shader.GetInput("st").GetConnectedSources()[0][0].source)
        assert (reader.GetIdAttr().Get(), reader.GetInput("varname").Get()) == ("UsdPrimvarReader_float2", "st")
        return shader

    color, opacity, relief = texture("diffuseColor"), texture("opacity"), texture("normal")
    if color:
        assert color.GetInput("sourceColorSpace").Get() == "sRGB"
        factor = color.GetInput("scale").Get()[:3]
    else:
        factor = surface.GetInput("diffuseColor").Get()
    if opacity:
        assert surface.GetInput("opacityThreshold").Get() == 0.5
        assert opacity.GetInput("file").Get().path == color.GetInput("file").Get().path
    if relief:
        assert relief.GetInput("sourceColorSpace").Get() == "raw"
    nir = [bound.GetPrim().GetAttribute(f"furrow:nir{name}").Get() for name in ("Reflectance", "Transmittance")]
    return {
        "masked": opacity is not None,
        "pictured": color is not None,
        "raised": relief is not None,
        "nir": np.array(nir, np.float32),
        "color": np.array(factor),
        "roughness": np.array(surface.GetInput("roughness").Get()),
    }


def usd_mesh(prim):
    mesh, primvars = UsdGeom.Mesh(prim), UsdGeom.PrimvarsAPI(prim)
    points = np.array(mesh.GetPointsAttr().Get())
    st = primvars.GetPrimvar("st")
    assert st.GetInterpolation() == mesh.GetNormalsInterpolation() == "vertex"
    assert mesh.GetSubdivisionSchemeAttr().Get() == "none" and mesh.GetDoubleSidedAttr().Get()
    assert (np.array(mesh.GetFaceVertexCountsAttr().Get()) == 3).all()
    assert (np.array(mesh.GetExtentAttr().Get()) == [points.min(0), points.max(0)]).all()
    assert UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(NOW) == Gf.Matrix4d(1)
    (name,) = directly(prim, "class")
    weights = primvars.GetPrimvar("skel:jointWeights")
    values = np.array(weights.Get(), np.float32).reshape(-1, 4) if weights.HasValue() else np.empty(0, np.float32)
    return {
        "label": (name, number(prim, "plant"), number(prim, "leaf")),
        "points": points,
        "normals": np.array(mesh.GetNormalsAttr().Get()),
        "st": np.array(st.Get()),
        "indices": np.array(mesh.GetFaceVertexIndicesAttr().Get()),
        "weights": values,
        **material(prim),
    }


def key(mesh):
    """Identity of a mesh in both files: every value that must have the same bits."""
    exact = ["points", "normals", "st", "indices", "weights", "nir"]
    same = tuple(mesh[name].tobytes() for name in exact)
    return (mesh["label"], mesh["masked"], mesh["pictured"], mesh["raised"], *same)


def check_meshes(stage, glb):
    prims = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    ours = collections.defaultdict(list)
    for prim in prims:
        ours[key(usd_mesh(prim))].append(prim)
        _, plant, leaf = usd_mesh(prim)["label"]
        parent = prim.GetParent()
        names = ("ground", "objects") if plant == 0 else (f"plant_{plant}",)
        assert parent.GetName() in names and Usd.ModelAPI(parent).GetKind() == Kind.Tokens.component
        assert Usd.ModelAPI(parent).IsModel(), parent.GetPath()
        assert leaf == 0 or f"{prim.GetName()}_".startswith(f"leaf_{leaf}_")
    theirs = list(glb.meshes())
    assert len(prims) == len(theirs), (len(prims), len(theirs))
    for mesh in theirs:
        found = ours[key(mesh)]
        assert found, f"{mesh['label']} differs"
        of = usd_mesh(found.pop())
        assert np.abs(of["color"] - mesh["color"]).max() < 1e-6 and abs(of["roughness"] - mesh["roughness"]) < 1e-6
    plants = {mesh["label"][1] for mesh in theirs} - {0}
    for plant in plants:
        prim = stage.GetPrimAtPath(f"/field/plants/plant_{plant}")
        classes = {mesh["label"][0] for mesh in theirs if mesh["label"][1] == plant}
        assert number(prim, "plant") == plant and set(directly(prim, "class")) == classes and directly(prim, "species")
        leaves = {mesh["label"][2] for mesh in theirs if mesh["label"][1] == plant}
        assert leaves == {number(child, "leaf") for child in prim.GetChildren() if child.IsA(UsdGeom.Mesh)}
    return prims, plants


def check_camera(stage, glb):
    """The frustum gives the intrinsics of the GLB's extras, and both cameras have the same pose."""
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/field/camera"))
    of = camera.GetCamera(NOW)
    extras = glb.document["cameras"][0]["extras"]
    (width, height), (fx, fy), (cx, cy) = extras["size"], extras["focal"], extras["centre"]
    window = of.frustum.GetWindow()
    low, high = window.GetMin(), window.GetMax()
    expected = [-cx / fx, (cy - height) / fy, (width - cx) / fx, cy / fy]
    assert np.abs(np.array([*low, *high]) - expected).max() < 1e-6, (window, expected)
    assert abs(of.clippingRange.min - 0.01) < 1e-6
    node = next(node for node in glb.document["nodes"] if "camera" in node)
    # Both formats look along -z with +y up, and both write row after row of row vectors.
    assert np.abs(np.array(of.transform).ravel() - node["matrix"]).max() < 1e-6


def check_lights(stage, glb):
    """Returns the horizontal illuminance of sun and sky at the origin, lux."""
    theirs = [node for node in glb.document["nodes"] if "KHR_lights_punctual" in node.get("extensions", {})]
    lights = glb.document.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    ours = [prim for prim in stage.Traverse() if prim.HasAPI(UsdLux.LightAPI) and not prim.IsA(UsdLux.DomeLight)]
    assert len(ours) == len(theirs) == len(lights)
    total, sun = np.zeros(3), None
    for prim, node, light in zip(ours, theirs, lights):
        api = UsdLux.LightAPI(prim)
        strength = np.array(api.GetColorAttr().Get()) * api.GetIntensityAttr().Get()
        matrix = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(NOW)
        towards = np.array(matrix)[2, :3]
        assert np.abs(np.array(matrix).ravel() - node["matrix"]).max() < 1e-6
        if prim.IsA(UsdLux.DistantLight):
            area, sun = 1, towards
            assert api.GetNormalizeAttr().Get() and abs(UsdLux.DistantLight(prim).GetAngleAttr().Get() - 0.5332) < 1e-6
            total += strength * max(towards[2], 0)
        elif prim.IsA(UsdLux.RectLight):
            area = UsdLux.RectLight(prim).GetWidthAttr().Get() * UsdLux.RectLight(prim).GetHeightAttr().Get()
        else:
            area = math.pi * UsdLux.DiskLight(prim).GetRadiusAttr().Get() ** 2
        assert np.abs(strength * area - np.array(light["color"]) * light["intensity"]).max() < 1e-4 * light["intensity"]
    return total, sun


def dome_directions(width, height):
    """Directions of the texels of a latitude-longitude map, and their solid angles; OpenEXR specification."""
    longitude = math.pi * (1 - 2 * (np.arange(width) + 0.5) / width)
    latitude = math.pi * (0.5 - (np.arange(height) + 0.5) / height)
    y, c = np.sin(latitude)[:, None], np.cos(latitude)[:, None]
    directions = np.stack(np.broadcast_arrays(c * np.sin(longitude), y, c * np.cos(longitude)), -1)
    return directions, np.broadcast_to(c * (math.pi / height) * (2 * math.pi / width), (height, width))


def check_sky(stage, total, sun):
    """The sky is brightest below the sun. Returns the value of a white horizontal surface under sun and sky at the camera's exposure."""
    (dome,) = [prim for prim in stage.Traverse() if prim.IsA(UsdLux.DomeLight)]
    light = UsdLux.DomeLight(dome)
    file = light.GetTextureFileAttr().Get()
    if file is None:
        radiance = np.array(light.GetColorAttr().Get()) * light.GetIntensityAttr().Get()
        sky = math.pi * radiance
    else:
        with OpenEXR.File(file.resolvedPath) as image:
            pixels = image.channels()["RGB"].pixels.astype(np.float64) * light.GetIntensityAttr().Get()
        directions, angles = dome_directions(pixels.shape[1], pixels.shape[0])
        world = directions @ np.array(UsdGeom.Xformable(dome).ComputeLocalToWorldTransform(NOW))[:3, :3]
        brightest = world.reshape(-1, 3)[pixels.sum(2).argmax()]
        # The aureole is brightest towards the horizon, below the sun.
        turn = 0 if sun is None else math.atan2(sun[0], sun[1]) - math.atan2(brightest[0], brightest[1])
        assert math.cos(turn) > math.cos(math.radians(3)) and brightest[2] > 0, (brightest, sun)
        sky = (pixels * (angles * world[..., 2].clip(0))[..., None]).sum((0, 1))
    exposure = UsdGeom.Camera(stage.GetPrimAtPath("/field/camera")).GetExposureAttr().Get()
    white = (total + sky).mean() / math.pi * 2**exposure
    return white


def check_skeletons(stage, plants):
    """At rest the skinned points are those of the meshes; a rotated joint moves what depends on it and nothing else."""
    worst, tested = 0, 0
    for plant in sorted(plants):
        root = UsdSkel.Root(stage.GetPrimAtPath(f"/field/plants/plant_{plant}"))
        assert root, f"plant {plant} has no joints"
        cache = UsdSkel.Cache()
        assert cache.Populate(root, Usd.PrimDefaultPredicate)
        (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
        query, targets = cache.GetSkelQuery(binding.GetSkeleton()), binding.GetSkinningTargets()
        assert len(targets) == sum(prim.IsA(UsdGeom.Mesh) for prim in root.GetPrim().GetChildren())
        topology, joints = query.GetTopology(), list(query.GetJointOrder())
        assert topology.Validate()[0] and len(set(joints)) == len(joints)

        def skinned():
            transforms = query.ComputeSkinningTransforms(NOW)
            return [np.array(points(target, transforms)) for target in targets]

        def points(target, transforms):
            of = Vt.Vec3fArray(UsdGeom.Mesh(target.GetPrim()).GetPointsAttr().Get())
            assert target.ComputeSkinnedPoints(transforms, of, NOW)
            return of

        rest = skinned()
        meshes = [np.array(UsdGeom.Mesh(target.GetPrim()).GetPointsAttr().Get()) for target in targets]
        worst = max([worst, *(np.abs(a - b).max() for a, b in zip(rest, meshes))])
        # The joint in the middle of the longest chain.
        deepest = max(range(len(joints)), key=lambda k: joints[k].count("/"))
        turned = deepest
        for _ in range(joints[deepest].count("/") // 2):
            turned = topology.GetParent(turned)
        below = np.array([joint == joints[turned] or joint.startswith(f"{joints[turned]}/") for joint in joints])
        with Usd.EditContext(stage, stage.GetSessionLayer()):
            animation = UsdSkel.Animation.Define(stage, root.GetPath().AppendChild("pose"))
            animation.GetJointsAttr().Set(joints)
            transforms = list(UsdSkel.Skeleton(binding.GetSkeleton().GetPrim()).GetRestTransformsAttr().Get())
            transforms[turned] = Gf.Matrix4d().SetRotate(Gf.Rotation((0, 0, 1), 20)) * transforms[turned]
            animation.SetTransforms(Vt.Matrix4dArray(transforms), NOW)
            api = UsdSkel.BindingAPI.Apply(binding.GetSkeleton().GetPrim())
            api.CreateAnimationSourceRel().SetTargets([animation.GetPath()])
        cache = UsdSkel.Cache()
        cache.Populate(root, Usd.PrimDefaultPredicate)
        query = cache.GetSkelQuery(binding.GetSkeleton())
        for target, before, after in zip(targets, rest, skinned()):
            indices, weights = (np.array(of).reshape(len(before), 4) for of in target.ComputeJointInfluences(NOW))
            assert np.abs(weights.sum(1) - 1).max() < 1e-6
            beyond = (weights * below[indices]).sum(1)
            moved = np.linalg.norm(after - before, axis=1)
            assert moved[beyond == 0].max(initial=0) < 1e-5, target.GetPrim().GetPath()
            tested += (moved[beyond > 0] > 1e-4).sum()
    assert worst < 1e-5, worst
    assert tested > 100, f"{tested} moved"
    return worst


def check(folder, glb):
    """Compares the export with the GLB, and returns a summary."""
    stage = Usd.Stage.Open(str(folder / "scene.usda"))
    assert stage.GetDefaultPrim().GetPath() == "/field"
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1
    data = stage.GetRootLayer().customLayerData
    assert data["provenance"] == glb.document["asset"]["extras"]["provenance"] and data["creator"] == glb.document["asset"]["generator"]
    prims, plants = check_meshes(stage, glb)
    check_camera(stage, glb)
    total, sun = check_lights(stage, glb)
    lamps = any(prim.IsA(UsdLux.RectLight) or prim.IsA(UsdLux.DiskLight) for prim in stage.Traverse())
    domes = any(prim.IsA(UsdLux.DomeLight) for prim in stage.Traverse())
    if domes and not lamps:
        white = check_sky(stage, total, sun)
        assert abs(white - 1) < 0.01, white
    errors = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators()).Validate(stage)
    assert not errors, [error.GetErrorAsString() for error in errors]
    rest = check_skeletons(stage, plants) if "skins" in glb.document else 0
    return (f"usd: {len(prims)} meshes of {len(plants)} plants agree with the GLB, at rest within {rest:.1e} m")


def is_found(folder, glb, name, before, after):
    """Returns whether the check fails if a piece of a file is replaced. In a process of its own, because OpenUSD keeps layers."""
    file = folder / name
    whole = file.read_text()
    damaged = whole.replace(before, after, 1)
    assert damaged != whole, f"{name} has no `{before}`"
    child = os.fork()
    if child == 0:
        file.write_text(damaged)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        try:
            check(folder, glb)
        except BaseException:
            os._exit(1)
        os._exit(0)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    file.write_text(whole)
    return code != 0


folder, glb = Path(sys.argv[1]), Glb(sys.argv[2])
damages = sys.argv[3:]
for damage in zip(*[iter(damages)] * 3):
    assert is_found(folder, glb, *damage), f"{damage} is accepted"
print(check(folder, glb))
