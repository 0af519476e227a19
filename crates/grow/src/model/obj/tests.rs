//! OBJ and MTL features one by one. Source: the Alias|Wavefront formats, and files as common programs write them.

use super::super::tests::{self, png};
use super::super::{Model, Up};
use furrow_base::Result;
use furrow_base::math::{ToInt, Vec3, vec2, vec3};

const SQUARE: &str = "mtllib m.mtl\no leaf\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl green\nf 1/1 2/2 3/3 4/4\n";
const GREEN: &str = "newmtl green\nKd 0.1 0.5 0.1\n";

fn load(obj: &[u8], mtl: &[u8]) -> Result<Model> {
    // The left half of the picture is transparent, and so is its upper half.
    let picture = png(2, &[[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [255, 0, 0, 255]]);
    tests::load(&[("model.obj", obj), ("m.mtl", mtl), ("a picture.png", &picture)], Up::Z)
}

fn read(obj: &str, mtl: &str) -> Model {
    load(obj.as_bytes(), mtl.as_bytes()).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(obj: &str, mtl: &str) -> String {
    load(obj.as_bytes(), mtl.as_bytes()).unwrap_err().to_string()
}

fn area(model: &Model) -> f32 {
    model.parts.iter().map(|part| part.mesh.area()).sum()
}

#[test]
fn a_plain_square_has_no_warnings() {
    let model = read(SQUARE, GREEN);
    assert_eq!(model.warnings, Vec::<String>::new());
    assert_eq!((area(&model), model.surfaces[0].color), (1.0, [0.1, 0.5, 0.1]));
    assert!(model.parts[0].mesh.normals.iter().all(|n| *n == Vec3::Z));
}

/// Expected: the L has its own area whichever corner comes first; crossed sides give a warning.
#[test]
fn concave_faces_are_not_filled() {
    for first in 0..6 {
        let corners: Vec<String> = (0..6).map(|k| ((k + first) % 6 + 1).to_string()).collect();
        let text = format!("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\nf {}\n", corners.join(" "));
        let model = read(&text, "");
        assert_eq!((area(&model), model.parts[0].mesh.triangles.len()), (4.0, 4), "{first}");
    }
    let bow = read("v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 3 0\nf 1 2 3 4\n", "");
    assert_eq!(bow.warnings, ["faces whose sides cross one another, cut into a fan: `unnamed_object`"]);
}

/// Expected: byte order marks, ISO 8859-1, carriage returns and continued lines change nothing; UTF-16 is refused.
#[test]
fn text_of_other_programs_is_read() {
    let with_mark = [b"\xef\xbb\xbf", SQUARE.as_bytes()].concat();
    let latin = [b"# gr\xfcn\n", SQUARE.as_bytes()].concat();
    let windows = SQUARE.replace('\n', "\r\n").into_bytes();
    let old = SQUARE.replace('\n', "\r").into_bytes();
    let continued = SQUARE.replace("f 1/1 2/2", "f 1/1 \\\n 2/2").into_bytes();
    for obj in [with_mark, latin, windows, old, continued] {
        let model = load(&obj, &[b"\xef\xbb\xbf", GREEN.as_bytes()].concat()).unwrap();
        assert_eq!((model.surfaces[0].color, area(&model)), ([0.1, 0.5, 0.1], 1.0));
    }
    // A name in ISO 8859-1 in both files is the same name.
    let name =
        |text: &str| text.replace("green", "gr\u{fc}n").chars().map(|c| u32::from(c).to_u8()).collect::<Vec<u8>>();
    assert_eq!(load(&name(SQUARE), &name(GREEN)).unwrap().warnings, Vec::<String>::new());
    assert!(load(b"\xff\xfev\0", b"").unwrap_err().to_string().contains("UTF-16"));
}

/// Rationale: colours from 0 to 255 would all become white without a word. Expected: a warning, and the colour cut; comments
/// behind numbers change nothing, and a name may contain their sign.
#[test]
fn colours_beyond_one_are_reported_and_comments_left_out() {
    let bytes = read(SQUARE, "newmtl green\nKd 26 128 0.5\n");
    assert_eq!(bytes.surfaces[0].color, [1.0, 1.0, 0.5]);
    assert_eq!(bytes.warnings, ["colours that are not between 0 and 1, cut to them: `green`"]);
    let named = |text: &str| text.replace("green", "leaf #2");
    let commented =
        named(SQUARE).replace("4/4\n", "4/4 # the leaf\n").replace("v 1 1 0\n", "v 1 1 0 # a corner of it\n");
    let model = read(&commented, &(named(GREEN).replace("0.1\n", "0.1 # green\n") + "d 1 # solid\n"));
    assert_eq!((model.surfaces[0].color, area(&model)), ([0.1, 0.5, 0.1], 1.0));
    assert_eq!(model.warnings, Vec::<String>::new());
}

/// Rationale: a damaged number gave a plausible surface without a word. Expected: a number that is not finite is refused
/// with its line, like that of a vertex; one out of range is cut or passed over with a warning.
#[test]
fn numbers_of_materials_are_checked() {
    for damaged in
        ["Kd .2 nan .1", "Kd inf", "Kd 1e39 0 0", "d nan", "Tr -inf", "Ns nan", "Pr NaN", "map_Kd -s nan a.png"]
    {
        let shown = refused(SQUARE, &format!("{GREEN}{damaged}\n"));
        assert!(shown.contains("m.mtl: line 3: `") && shown.contains("` is not a finite number"), "{damaged}: {shown}");
    }
    for (beyond, warning) in [
        ("d 1.5", "numbers `d` that are not between 0 and 1, cut to them: `green`"),
        ("Tr -0.2", "numbers `Tr` that are not between 0 and 1, cut to them: `green`"),
        ("Pr 7", "numbers `Pr` that are not between 0 and 1, cut to them: `green`"),
        ("Kd .2 -5 .1", "colours that are not between 0 and 1, cut to them: `green`"),
        ("Ns -5", "passed over: negative exponents `Ns`: `green`"),
    ] {
        assert_eq!(read(SQUARE, &format!("{GREEN}{beyond}\n")).warnings, [warning], "{beyond}");
    }
    assert_eq!(read(SQUARE, &format!("{GREEN}Pr 7\n")).surfaces[0].roughness, Some(1.0));
    assert_eq!(read(SQUARE, &format!("{GREEN}Pr 1\nd 1\nNs 0\n")).warnings, Vec::<String>::new());
}

/// Expected: of two materials of one name the first counts, with a warning if they differ; statements that belong to no
/// material are named.
#[test]
fn materials_described_twice_and_statements_without_one_are_reported() {
    let twice = read(SQUARE, &format!("{GREEN}{}", GREEN.replace("0.5", "0.9")));
    assert_eq!(twice.surfaces[0].color, [0.1, 0.5, 0.1]);
    assert_eq!(twice.warnings, ["materials that are described twice and differently; the first counts: `green`"]);
    let library_twice = format!("mtllib m.mtl\n{SQUARE}");
    assert_eq!(read(&library_twice, GREEN).warnings, Vec::<String>::new());
    let stray = read(SQUARE, &format!("Ka 0 0 0\nKd 1 0 0\n{GREEN}"));
    assert_eq!(stray.warnings, ["passed over: statements of the MTL file before the first `newmtl`: `Kd`"]);
}

#[test]
fn missing_materials_and_coordinates_are_reported() {
    let white = read(&SQUARE.replace("usemtl green", "usemtl blue"), GREEN);
    assert_eq!(white.warnings, ["materials that its MTL files lack, replaced by white: `blue`"]);
    let pictured = format!("{GREEN}map_Kd a picture.png\n");
    assert!(read(SQUARE, &pictured).surfaces[0].mask.is_some());
    let bare = read(&SQUARE.replace("f 1/1 2/2 3/3 4/4", "f 1 2 3 4"), &pictured);
    assert_eq!(bare.warnings, ["no texture coordinates, so the pictures of its material are passed over: `leaf`"]);
    let surface = &bare.surfaces[bare.parts[0].surface];
    assert!(surface.mask.is_none() && surface.picture.is_none() && surface.color == [0.1, 0.5, 0.1]);
}

#[test]
fn faint_materials_are_left_out_with_a_warning() {
    let both = SQUARE.to_owned() + "usemtl stem\nf 1 2 3\n";
    for opacity in ["d 0.498", "Tr 0.6", "d 0.4\nTr 0.1"] {
        let mtl = format!("{GREEN}{opacity}\nnewmtl stem\nd 0.9\n");
        let model = read(&both, &mtl);
        assert_eq!(area(&model), 0.5, "{opacity}");
        assert_eq!(model.warnings, ["left out: materials whose opacity `d` is below ½: `green`"]);
    }
    assert!(refused(SQUARE, &format!("{GREEN}d 0.2\n")).contains("no triangles; left out: materials"));
    assert_eq!(read(SQUARE, &format!("{GREEN}Tr 0.1\nd 1\n")).warnings, Vec::<String>::new());
}

/// Expected: u′ = 2u + 0.25, v′ = 3v + 0.5 with v upwards; a clamped picture; other options give a warning or an error.
#[test]
fn options_of_pictures_are_read() {
    let with = |options: &str| format!("{GREEN}map_Kd {options} a picture.png\n");
    let opaque = format!("{GREEN}map_Ks a picture.png\nbump -bm 0.2 a picture.png\n");
    assert_eq!(read(SQUARE, &opaque).warnings, ["passed over: `bump` of the MTL file: `green`"]);
    let laid = read(SQUARE, &with("-s 0.5 0.5 1 -o 0.25 0.5 -blendu on"));
    let mesh = &laid.parts[0].mesh;
    let at = |uv| mesh.uvs.iter().position(|t| *t == uv).map(|k| mesh.positions[k]);
    assert_eq!(at(vec2(0.25, 0.5)), Some(vec3(0.0, 0.0, 0.0)));
    assert_eq!(at(vec2(0.75, 0.0)), Some(vec3(1.0, 1.0, 0.0)));
    let stated = read(SQUARE, &with("-mm 0 0.5 -imfchan l -clamp on"));
    assert_eq!(stated.warnings.len(), 2, "{:?}", stated.warnings);
    assert!(refused(SQUARE, &with("-huge 2")).contains("line 3: the option -huge of a picture is unknown"));
    assert!(refused(SQUARE, &format!("{GREEN}map_Kd -s 1 1 1\n")).contains("a file `1`"));
    let grey = read(SQUARE, "newmtl green\nKd 0.25\nPr 0.5\n");
    assert_eq!((grey.surfaces[0].color, grey.surfaces[0].roughness), ([0.25; 3], Some(0.25)));
}

/// Expected: two faces that meet at a right angle share a normal in one smoothing group, and not without.
#[test]
fn smoothing_groups_average_normals() {
    let fold = |group: &str| {
        let text = format!("v 0 0 0\nv 0 1 0\nv -1 0 0\nv 0 0 -1\ns {group}\nf 1 2 3\nf 2 1 4\n");
        read(&text, "").parts[0].mesh.normals.clone()
    };
    let flat = fold("off");
    assert!(flat.iter().all(|n| n.abs().max_element() > 0.999), "{flat:?}");
    let smooth = fold("1");
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let shared = smooth.iter().filter(|n| (n.abs() - vec3(half, 0.0, half)).length() < 1e-6).count();
    assert_eq!((shared, smooth.len()), (2, 4), "{smooth:?}");
}

/// Rationale: coordinates of a national grid lose their shape in single precision before anything is computed.
#[test]
fn large_coordinates_keep_their_shape() {
    let corners = [(0.0, 0.0), (0.3, 0.0), (0.3, 0.2), (0.0, 0.2)];
    let lines = corners.map(|(x, y)| format!("v {:.3} {:.3} 312.125\n", 612_345.25 + x, 5_412_345.5 + y));
    let model = read(&(lines.concat() + "f -4 -3 -2 -1\n"), "");
    let (lo, hi) = model.parts[0].mesh.bounds().unwrap();
    assert!((lo - vec3(-0.15, -0.1, 0.0)).length() < 1e-6 && (hi - vec3(0.15, 0.1, 0.0)).length() < 1e-6, "{lo} {hi}");
    assert!(model.warnings[0].contains("far from the origin"), "{:?}", model.warnings);
}

#[test]
fn what_is_passed_over_or_broken_is_named() {
    let more = "v 2 2 2 1 0 0\nl 1 2\nf 1 2\ncstype bezier\ncurv 0 1\n";
    assert_eq!(
        read(&(SQUARE.to_owned() + more), GREEN).warnings,
        [
            "passed over: colours of vertices",
            "passed over: points and lines",
            "passed over: faces with fewer than three corners: `leaf`",
            "passed over: statements of the OBJ file: `cstype`, `curv`",
        ]
    );
    for (text, words) in [
        ("v 0 0\n", "line 1: `v` has 2 of 3 numbers"),
        ("v 0 0 x\n", "line 1: `x` is not a number"),
        ("v 0 0 0\nf 1 1 -2\n", "line 2: the corner `-2` refers to a missing element"),
        ("v 0 0 0\nf 1 1 0\n", "line 2: the corner `0` refers to a missing element"),
        ("v 0 0 0\nf 1 1 2\n", "line 2: a corner of the face refers to a missing element"),
        ("v 0 0 0\nf 1 1 a/1\n", "line 2: the corner `a/1` is not"),
        ("v 0 0 0\nf 1/4 1/4 1/4\n", "line 2: a corner of the face refers to a missing element"),
    ] {
        let shown = refused(text, "");
        assert!(shown.contains(words), "{shown}");
    }
    assert!(
        refused(SQUARE, "newmtl green\nKd 0.1 0.2\n").contains("its materials m.mtl: line 2: `Kd` has 2 of 3 numbers")
    );
}
