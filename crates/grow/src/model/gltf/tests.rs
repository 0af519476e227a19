//! glTF features one by one. Source: Khronos glTF 2.0 specification, and those of its extensions.

use super::super::tests::{self, Bytes, png};
use super::super::{Model, Up};
use furrow_base::Result;
use furrow_base::math::{Vec2, Vec3, vec2, vec3};
use serde_json::{Value, json};

const SQUARE: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
const RED: [u8; 4] = [255, 0, 0, 255];
const CLEAR: [u8; 4] = [0, 255, 0, 0];

/// Loads a square in the plane of x and y, z up, whose texture coordinates are its x and y, after an edit.
fn square(edit: impl FnOnce(&mut Value, &mut Bytes)) -> Result<Model> {
    let mut bytes = Bytes::default();
    bytes.floats(&SQUARE);
    bytes.floats(&[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
    bytes.view(&[0, 1, 2, 0, 2, 3]);
    let mut document = json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "mesh": 0, "name": "leaf" }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2, "material": 0 }] }],
        "materials": [{ "name": "green", "pbrMetallicRoughness": { "metallicFactor": 0 } }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 2, "componentType": 5121, "count": 6, "type": "SCALAR" },
        ],
    });
    edit(&mut document, &mut bytes);
    tests::load(&[("model.glb", &bytes.glb(document))], Up::Z)
}

/// Gives the material a picture of two by one texels, red and transparent.
fn pictured(document: &mut Value, bytes: &mut Bytes) {
    let view = bytes.view(&png(2, &[RED, CLEAR]));
    document["images"] = json!([{ "bufferView": view }]);
    document["textures"] = json!([{ "source": 0 }]);
    document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
}

/// Adds an accessor of numbers, and returns its index.
fn accessor(document: &mut Value, bytes: &mut Bytes, kind: &str, values: &[f32]) -> usize {
    let each = [("VEC2", 2), ("VEC3", 3), ("VEC4", 4), ("MAT4", 16)].iter().find(|(name, _)| *name == kind).unwrap().1;
    let view = bytes.floats(values);
    let all = document["accessors"].as_array_mut().unwrap();
    all.push(json!({ "bufferView": view, "componentType": 5126, "count": values.len() / each, "type": kind }));
    all.len() - 1
}

fn corner(model: &Model, uv: Vec2) -> Vec3 {
    let mesh = &model.parts[0].mesh;
    mesh.positions[mesh.uvs.iter().position(|t| *t == uv).unwrap()]
}

/// Expected: labels are read with classes in any capitals; what is no label is named, and other extras are none.
#[test]
fn labels_are_read_or_what_is_wrong_is_named() {
    let labelled = |extras: Value| square(|document, _| document["nodes"][0]["extras"] = extras).unwrap();
    let model = labelled(json!({ "class": "Weed", "plant": 2, "leaf": 1 }));
    let label = model.parts[0].label.as_ref().unwrap();
    assert_eq!((label.class.as_str(), label.plant, label.leaf, &model.label_fault), ("weed", 2, 1, &None));
    assert!(labelled(json!({ "colour": 1 })).label_fault.is_none());
    for extras in
        [json!({ "class": "crop", "plant": "2" }), json!({ "class": "crop", "plant": 2.5 }), json!({ "class": 3 })]
    {
        let fault = labelled(extras).label_fault.unwrap();
        assert!(fault.contains("the label of `leaf` is wrong"), "{fault}");
    }
}

/// Expected: transparent texels that OPAQUE shows are warned of, and not with MASK.
#[test]
fn transparent_texels_of_an_opaque_material_are_warned_of() {
    let warnings = |mode: Option<&str>| {
        let model = square(|document, bytes| {
            pictured(document, bytes);
            document["materials"][0]["alphaMode"] = json!(mode);
        });
        model.unwrap().warnings.into_iter().filter(|words| words.contains("OPAQUE shows transparent")).count()
    };
    assert_eq!([warnings(None), warnings(Some("OPAQUE")), warnings(Some("MASK"))], [1, 1, 0]);
}

#[test]
fn a_plain_square_has_no_warnings() {
    let model = square(|_, _| ()).unwrap();
    assert_eq!(model.warnings, Vec::<String>::new());
    assert_eq!(corner(&model, vec2(1.0, 1.0)), vec3(1.0, 1.0, 0.0));
}

/// Rationale: transforms that the format forbids were read in silence. Expected: projections and rotations of length 0 are refused by
/// name; other lengths, and what stands beside a matrix, are warned of. Source: 3.5.3.
#[test]
fn transforms_that_are_none_are_refused_or_warned_of() {
    let with = |node: Value| square(|document, _| document["nodes"][0].as_object_mut().unwrap().extend(object(node)));
    let matrix = |edit: fn(&mut [f64; 16])| {
        let mut matrix = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 0.0, 0.0, 1.0];
        edit(&mut matrix);
        json!({ "matrix": matrix })
    };
    for (node, words) in [
        (matrix(|m| m[3] = 0.5), "the last row of the matrix of `leaf` is not 0, 0, 0, 1"),
        (matrix(|m| m[15] = 2.0), "the last row of the matrix of `leaf` is not 0, 0, 0, 1"),
        (json!({ "rotation": [0, 0, 0, 0] }), "the rotation of `leaf` is a quaternion of length 0"),
    ] {
        let error = with(node).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let mut both = matrix(|_| ());
    both["scale"] = json!([2, 2, 2]);
    let model = with(both).unwrap();
    assert_eq!(corner(&model, vec2(1.0, 1.0)), vec3(6.0, 1.0, 0.0));
    assert_eq!(model.warnings, ["passed over: translation, rotation and scale of nodes that have a matrix: `leaf`"]);
    let model = with(json!({ "rotation": [0, 0, 2, 0] })).unwrap();
    assert!((corner(&model, vec2(1.0, 1.0)) - vec3(-1.0, -1.0, 0.0)).length() < 1e-6);
    assert_eq!(model.warnings, ["quaternions whose length is not 1, which were normalized: `leaf`"]);
    assert!(with(json!({ "rotation": [0, 0, 0.6, 0.80005] })).unwrap().warnings.is_empty());
}

fn object(value: Value) -> serde_json::Map<String, Value> {
    serde_json::from_value(value).unwrap()
}

/// Source: 3.9.5: alpha is ignored under OPAQUE.
#[test]
fn alpha_counts_under_mask_and_blend_alone() {
    let read = |mode: &str| {
        let model = square(|d, b| {
            pictured(d, b);
            d["materials"][0]["alphaMode"] = json!(mode);
        });
        let surface = model.unwrap().surfaces.remove(0);
        (surface.picture.unwrap().texel(1, 0), surface.mask.map(|mask| mask.count()))
    };
    assert_eq!(read("OPAQUE"), ([0.0, 1.0, 0.0, 1.0], None));
    assert_eq!(read("MASK").1, Some(1));
    assert_eq!(read("BLEND").1, Some(1));
}

/// Expected: a surface below the threshold everywhere is left out with a warning, and an error if nothing is left; one
/// whose coordinates show its transparent half alone is invisible with a warning.
#[test]
fn invisible_surfaces_are_reported() {
    let faint = |d: &mut Value| {
        d["materials"][0] = json!({ "name": "glass", "alphaMode": "BLEND", "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorFactor": [1, 1, 1, 0.4] } });
    };
    let alone = square(|d, _| faint(d)).unwrap_err().to_string();
    assert!(
        alone.contains("it holds no triangles; left out: surfaces whose opacity") && alone.contains("`glass`"),
        "{alone}"
    );
    let beside = square(|d, _| {
        faint(d);
        d["meshes"][0]["primitives"].as_array_mut().unwrap().push(json!({ "attributes": { "POSITION": 0 } }));
    });
    assert!(beside.unwrap().warnings.iter().any(|words| words.ends_with("everywhere: `glass`")));
    let hidden = square(|d, b| {
        pictured(d, b);
        d["materials"][0]["alphaMode"] = json!("MASK");
        let uvs = accessor(d, b, "VEC2", &[0.6, 0.0, 0.9, 0.0, 0.9, 1.0, 0.6, 1.0]);
        d["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    });
    let warnings = hidden.unwrap().warnings;
    assert!(warnings[0].contains("`green` cuts away every triangle: `leaf`"), "{warnings:?}");
    assert!(warnings[1].contains("no visible surface"), "{warnings:?}");
}

/// Expected: pictures with the coordinates of the colour are read; those with others are passed over with a warning.
#[test]
fn a_normal_map_needs_the_coordinates_of_the_colour() {
    let read = |normal: Value| {
        let model = square(|d, b| {
            pictured(d, b);
            d["materials"][0]["alphaMode"] = json!("MASK");
            d["materials"][0]["normalTexture"] = normal;
        });
        let mut model = model.unwrap();
        (model.surfaces.remove(0).relief.is_some(), model.warnings)
    };
    let turned = json!({ "KHR_texture_transform": { "scale": [2, 2] } });
    assert_eq!(read(json!({ "index": 0 })), (true, vec![]));
    for normal in [json!({ "index": 0, "texCoord": 1 }), json!({ "index": 0, "extensions": turned })] {
        let (there, warnings) = read(normal);
        assert!(!there && warnings[0].contains("normal maps with other texture coordinates"), "{warnings:?}");
    }
    let alone = square(|d, b| {
        pictured(d, b);
        let uvs = accessor(d, b, "VEC2", &[0.0, 0.0, 2.0, 0.0, 2.0, 2.0, 0.0, 2.0]);
        d["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(uvs);
        d["materials"][0] = json!({ "normalTexture": { "index": 0, "texCoord": 1 } });
    });
    assert_eq!(corner(&alone.unwrap(), vec2(2.0, 2.0)), vec3(1.0, 1.0, 0.0));
}

/// Source: 3.7.2.2: the weights of the node override those of the mesh; absent normals are computed after morphing.
#[test]
fn morph_targets_are_applied_at_rest() {
    let read = |mesh: Value, node: Value| {
        square(|d, b| {
            let east = accessor(d, b, "VEC3", &[0.25, 0.0, 0.0].repeat(4));
            let up = accessor(d, b, "VEC3", &[0.0, 0.0, 1.0].repeat(4));
            d["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": east }, { "POSITION": up }]);
            d["meshes"][0]["weights"] = mesh;
            if !node.is_null() {
                d["nodes"][0]["weights"] = node;
            }
        })
    };
    let at = |mesh, node| corner(&read(mesh, node).unwrap(), vec2(0.0, 0.0));
    assert_eq!(at(json!([1, 0]), Value::Null), vec3(0.25, 0.0, 0.0));
    assert_eq!(at(json!([1, 0]), json!([0, 0.5])), vec3(0.0, 0.0, 0.5));
    assert_eq!(at(json!([]), Value::Null), Vec3::ZERO);
    let short = square(|d, b| {
        let by = accessor(d, b, "VEC3", &[0.25, 0.0, 0.0]);
        d["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": by }]);
        d["meshes"][0]["weights"] = json!([1]);
    });
    assert!(short.unwrap_err().to_string().contains("1 values of POSITION for 4 vertices"));
}

/// Source: 3.6.2.3: sparse elements override those of the buffer view, or zeros without one.
#[test]
fn sparse_accessors_are_read() {
    let read = |base: bool, index: u8| {
        square(|d, b| {
            let (indices, values) = (b.view(&[2, index]), b.floats(&[5.0, 5.0, 0.0, 0.0, 7.0, 0.0]));
            let positions = &mut d["accessors"][0];
            positions["sparse"] = json!({ "count": 2, "indices": { "bufferView": indices, "componentType": 5121 }, "values": { "bufferView": values } });
            if !base {
                positions.as_object_mut().unwrap().remove("bufferView");
            }
        })
    };
    let model = read(true, 3).unwrap();
    let at = |model: &Model| [vec2(1.0, 0.0), vec2(1.0, 1.0), vec2(0.0, 1.0)].map(|uv| corner(model, uv));
    assert_eq!(at(&model), [vec3(1.0, 0.0, 0.0), vec3(5.0, 5.0, 0.0), vec3(0.0, 7.0, 0.0)]);
    assert_eq!(at(&read(false, 3).unwrap())[0], Vec3::ZERO);
    assert!(read(true, 4).unwrap_err().to_string().contains("sparse element past its end"));
}

/// Source: 3.7.3.3: a skinned mesh is placed by its joints, not by its node. The right half follows the second joint.
#[test]
fn skins_are_applied_at_rest() {
    let changed = |lifted: f64, change: &dyn Fn(&mut Value)| {
        square(|d, b| {
            let back = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -3.0, 0.0, 0.0, 1.0];
            let binds = accessor(d, b, "MAT4", &[back, back].concat());
            let weights = accessor(
                d,
                b,
                "VEC4",
                &[[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0], [0.0; 4]].concat(),
            );
            let joints = b.view(&[[0_u8, 1, 0, 0]; 4].concat());
            let accessors = d["accessors"].as_array_mut().unwrap();
            accessors.push(json!({ "bufferView": joints, "componentType": 5121, "count": 4, "type": "VEC4" }));
            let joints = accessors.len() - 1;
            d["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
            d["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
            d["nodes"] = json!([
                { "mesh": 0, "skin": 0, "name": "leaf" },
                { "translation": [3, 0, 0], "children": [2] },
                { "translation": [0, 0, lifted] },
            ]);
            d["skins"] = json!([{ "joints": [1, 2], "inverseBindMatrices": binds }]);
            change(d);
        })
    };
    let read = |lifted: f64| changed(lifted, &|_| ());
    let rest = read(0.0).unwrap();
    assert_eq!(corner(&rest, vec2(1.0, 1.0)), vec3(1.0, 1.0, 0.0));
    let bent = read(0.5).unwrap();
    assert_eq!(corner(&bent, vec2(0.0, 0.0)), Vec3::ZERO);
    assert_eq!(corner(&bent, vec2(1.0, 0.0)), vec3(1.0, 0.0, 0.5));
    // Weights that do not sum to one are normalised; a vertex without weights stays at its node.
    assert_eq!(corner(&bent, vec2(1.0, 1.0)), vec3(1.0, 1.0, 0.5));
    assert_eq!(corner(&bent, vec2(0.0, 1.0)), vec3(0.0, 1.0, 0.0));
    assert_eq!(bent.warnings, Vec::<String>::new());
    // A skin that cannot bend its mesh is named.
    let jointless = changed(0.5, &|d| d["skins"][0]["joints"] = json!([])).unwrap();
    assert_eq!(jointless.warnings, ["skins without joints, so their meshes stay in the bind pose: `leaf`"]);
    for attribute in ["JOINTS_0", "WEIGHTS_0"] {
        let unbound = changed(0.5, &|d: &mut Value| {
            d["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove(attribute);
        });
        let unbound = unbound.unwrap();
        assert_eq!(unbound.warnings, ["no `JOINTS_0` and `WEIGHTS_0`, so the skin is passed over: `leaf`"]);
        assert_eq!(corner(&unbound, vec2(1.0, 0.0)), vec3(1.0, 0.0, 0.0));
    }
}

#[test]
fn samplers_repeat_mirror_and_clamp_each_axis() {
    let model = square(|d, b| {
        pictured(d, b);
        d["samplers"] = json!([{ "wrapS": 33648, "wrapT": 33071 }]);
        d["textures"][0]["sampler"] = json!(0);
    });
    let picture = model.unwrap().surfaces.remove(0).picture.unwrap();
    // Green begins at a quarter of the second, mirrored repetition before it ends in red.
    assert_eq!(picture.sample(vec2(1.25, 0.5), 0.0)[..2], [0.0, 1.0]);
    assert_eq!(picture.sample(vec2(1.75, 7.0), 0.0)[..2], [1.0, 0.0]);
    // The mirrored tile of a masked surface is folded back.
    let masked = square(|d, b| {
        pictured(d, b);
        d["materials"][0]["alphaMode"] = json!("MASK");
        d["samplers"] = json!([{ "wrapS": 33648 }]);
        d["textures"][0]["sampler"] = json!(0);
        let uvs = accessor(d, b, "VEC2", &[1.0, 0.0, 2.0, 0.0, 2.0, 1.0, 1.0, 1.0]);
        d["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    });
    assert_eq!(corner(&masked.unwrap(), vec2(0.0, 0.0)), vec3(1.0, 0.0, 0.0));
}

/// Expected: the picture and the opacity of `KHR_materials_pbrSpecularGlossiness`; a roughness of one minus glossiness.
#[test]
fn specular_glossiness_is_read() {
    let model = square(|d, b| {
        pictured(d, b);
        d["extensionsUsed"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
        let of = json!({ "diffuseFactor": [0.5, 1, 1, 1], "diffuseTexture": { "index": 0 }, "glossinessFactor": 0.5 });
        d["materials"] = json!([{ "alphaMode": "MASK", "extensions": { "KHR_materials_pbrSpecularGlossiness": of } }]);
    });
    let mut model = model.unwrap();
    assert_eq!(model.warnings, Vec::<String>::new());
    let surface = model.surfaces.remove(0);
    assert_eq!((surface.color, surface.roughness), ([0.5, 1.0, 1.0], Some(0.25)));
    assert_eq!(surface.mask.unwrap().count(), 1);
}

/// Expected: one warning for each kind of content, with names.
#[test]
fn what_is_passed_over_is_named() {
    let colors: Vec<f32> = [0.5, 1.0, 1.0].repeat(4);
    let model = square(|d, b| {
        let colors = accessor(d, b, "VEC3", &colors);
        d["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
        d["meshes"][0]["primitives"]
            .as_array_mut()
            .unwrap()
            .push(json!({ "attributes": { "POSITION": 0 }, "mode": 1 }));
        d["cameras"] = json!([{ "type": "perspective" }]);
        d["animations"] = json!([{}, {}]);
        d["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{}] } });
        d["extensionsUsed"] = json!(["KHR_lights_punctual", "EXT_mesh_gpu_instancing", "KHR_materials_sheen"]);
        d["materials"][0] = json!({ "name": "tin", "emissiveFactor": [0, 1, 0] });
    });
    assert_eq!(
        model.unwrap().warnings,
        [
            "passed over: 1 camera, 1 light, 2 animations",
            "passed over: extensions of glTF: `EXT_mesh_gpu_instancing`, `KHR_materials_sheen`",
            "passed over: metal, whose base colour becomes its reflectance: `tin`",
            "passed over: emitted light: `tin`",
            "passed over: colours of vertices: `leaf`",
            "passed over: points and lines: `leaf`",
        ]
    );
    let own = square(|d, _| {
        d["asset"]["generator"] = json!("furrow 0.1.0");
        d["cameras"] = json!([{ "type": "perspective" }]);
    });
    assert_eq!(own.unwrap().warnings, Vec::<String>::new());
    let bare = square(|d, b| {
        pictured(d, b);
        d["materials"][0]["alphaMode"] = json!("MASK");
        d["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("TEXCOORD_0");
    });
    let bare = bare.unwrap();
    assert_eq!(bare.warnings, ["no texture coordinates TEXCOORD_0, so the pictures are passed over: `leaf`"]);
    let surface = &bare.surfaces[bare.parts[0].surface];
    assert!(surface.mask.is_none() && surface.picture.is_none() && surface.name == "green");
}

/// Edit of a model's document and buffer.
type Edit<'a> = &'a dyn Fn(&mut Value, &mut Bytes);

#[test]
fn what_cannot_be_read_is_refused_by_name() {
    let draco = "KHR_draco_mesh_compression";
    let edits: [(Edit<'_>, &str); 5] = [
        (
            &|d, _| d["extensionsRequired"] = json!(["EXT_meshopt_compression"]),
            "requires the extension EXT_meshopt_compression",
        ),
        (
            &|d, _| {
                d["accessors"][0].as_object_mut().unwrap().remove("bufferView");
                d["meshes"][0]["primitives"][0]["extensions"] = json!({ draco: {} });
            },
            "`leaf` is compressed with KHR_draco_mesh_compression",
        ),
        (
            &|d, b| {
                pictured(d, b);
                d["textures"] = json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }]);
            },
            "no PNG or JPEG image, only that of KHR_texture_basisu",
        ),
        (&|d, _| d["asset"]["minVersion"] = json!("2.1"), "it is glTF \"2.1\""),
        (
            &|d, _| d["accessors"][0] = json!({ "componentType": 5126, "count": u64::MAX, "type": "VEC3" }),
            "too many elements",
        ),
    ];
    for (edit, words) in edits {
        let error = square(edit).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let stored = square(|d, _| d["meshes"][0]["primitives"][0]["extensions"] = json!({ draco: {} }));
    assert!(stored.is_ok(), "the uncompressed geometry must be read");
}

/// Rationale: models that are placed in a national grid would lose their shape in single precision.
#[test]
fn a_model_far_away_is_moved_to_the_origin() {
    let model = square(|d, _| d["nodes"][0]["translation"] = json!([650_000.25, 5_400_000.5, 300.0])).unwrap();
    assert_eq!(corner(&model, vec2(0.0, 0.0)), vec3(-0.5, -0.5, 0.0));
    assert_eq!(corner(&model, vec2(1.0, 1.0)), vec3(0.5, 0.5, 0.0));
    let words = "its coordinates are far from the origin: the point 650000.75 east, 5400001.00 north, 300.00 up becomes its foot";
    assert_eq!(model.warnings, [words]);
}

#[test]
fn a_byte_order_mark_before_the_document_is_ignored() {
    let document = json!({
        "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }], "buffers": [{ "uri": "a.bin", "byteLength": 36 }],
    });
    let bytes: Vec<u8> = SQUARE[..9].iter().flat_map(|v| v.to_le_bytes()).collect();
    let text = [b"\xef\xbb\xbf", document.to_string().as_bytes()].concat();
    assert!(tests::load(&[("model.gltf", &text), ("a.bin", &bytes)], Up::Y).is_ok());
}
