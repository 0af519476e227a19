//! Output files have the documented contents, or do not exist.
//!
//! Rationale: the written files are all that users see. Expected: the EXR has the documented channels with the film's
//! and the labels' values and records its provenance; PNGs contain no time and no path; a folder that is not writable
//! and a full disk give a clear error, a non-zero exit code and no partial file. Source: the documentation of `output`
//! and `furrow_output::exr`.

use crate::common::program::{FILES, SMALL, bits, field, names, run, scratch, shoot, small_text, trace};
use crate::common::python::python;
use exr::prelude::*;
use furrow_base::math::Spectrum;
use furrow_field::assemble::Options;
use furrow_output::{CameraTags, Provenance, Spp};
use furrow_render::film::Film;
use furrow_render::render::{LabelMap, label::NONE};
use std::collections::BTreeMap;
use std::path::Path as File;

fn provenance(hash: &str) -> Provenance {
    Provenance {
        scene_hash: hash.into(),
        seed: 3,
        index: 0,
        light: 0,
        spp: Spp::Uniform(3),
        integrator: "path".into(),
        deviations: Vec::new(),
        kernels: "Embree of the test".into(),
    }
}

/// Renders the small scene; returns its image in memory and on disk.
fn written() -> (tempfile::TempDir, std::path::PathBuf, Film, LabelMap, Provenance) {
    let field = field(&small_text(), &Options { width: Some(64), ..Options::default() });
    let (film, labels) = shoot(&field, 3, 2);
    let provenance = provenance(&field.hash);
    let (keep, out) = scratch();
    let (photograph, tags) = (field.photograph(&film), CameraTags::of(&field));
    let files = furrow_output::image_files(&film, &labels, &photograph, &provenance, &tags).unwrap();
    furrow_output::write_files(&out, &files).unwrap();
    (keep, out, film, labels, provenance)
}

/// Samples of a channel: f32, f16 widened to f32, or u32.
#[derive(Debug, PartialEq)]
enum Samples {
    Whole(Vec<u32>),
    Single(Vec<f32>),
    Half(Vec<f32>),
}

/// Reads the channels by name, and the comment of the header.
fn channels(path: &File) -> (BTreeMap<String, Samples>, String) {
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let layer = image.from_file(path).unwrap().layer_data;
    let comment = layer.attributes.comments.as_ref().map(ToString::to_string).unwrap_or_default();
    let channels = layer.channel_data.list.into_iter().map(|c| {
        let samples = match c.sample_data {
            FlatSamples::U32(v) => Samples::Whole(v),
            FlatSamples::F32(v) => Samples::Single(v),
            FlatSamples::F16(v) => Samples::Half(v.into_iter().map(f16::to_f32).collect()),
        };
        (c.name.to_string(), samples)
    });
    (channels.collect(), comment)
}

#[test]
fn the_exr_holds_the_film_and_the_labels() {
    let (_keep, out, film, labels, provenance) = written();
    let (channels, comment) = channels(&out.join("radiance.exr"));
    assert_eq!(comment, provenance.text());
    let names: Vec<&str> = channels.keys().map(String::as_str).collect();
    let mut documented: Vec<String> =
        ["depth.Z", "id.class", "id.leaf", "id.part", "id.plant"].map(String::from).into();
    for band in Spectrum::NAMES {
        documented.extend([band.to_string(), format!("variance.{band}"), format!("albedo.{band}")]);
    }
    documented.extend(["normal.X", "normal.Y", "normal.Z"].map(String::from));
    documented.sort();
    assert_eq!(names, documented);
    let single = |name: &str| match &channels[name] {
        Samples::Single(v) => v,
        other => panic!("{name} is not f32: {other:?}"),
    };
    let half = |name: &str| match &channels[name] {
        Samples::Half(v) => v,
        other => panic!("{name} is not f16: {other:?}"),
    };
    for (band, name) in Spectrum::NAMES.iter().enumerate() {
        let of = |f: fn(&furrow_render::film::Pixel) -> Spectrum| {
            film.pixels.iter().map(|p| f(p).to_array()[band]).collect::<Vec<_>>()
        };
        assert_eq!(single(name), &of(|p| p.mean), "{name} must equal the film's mean bit for bit");
        assert_eq!(single(&format!("variance.{name}")), &of(|p| p.variance));
        assert!(single(name).iter().all(|v| v.is_finite() && *v >= 0.0), "{name} must be finite and not negative");
        assert!(single(&format!("variance.{name}")).iter().all(|v| v.is_finite() && *v >= 0.0));
        for (stored, kept) in half(&format!("albedo.{name}")).iter().zip(of(|p| p.albedo)) {
            assert!((stored - kept).abs() <= 1e-3 * kept + 1e-7 && *stored <= 1.01, "albedo {stored} for {kept}");
        }
    }
    for (axis, name) in ["normal.X", "normal.Y", "normal.Z"].iter().enumerate() {
        for (stored, pixel) in half(name).iter().zip(&film.pixels) {
            assert!((stored - pixel.normal.to_array()[axis]).abs() < 1e-3, "{name}");
        }
    }
    let depth: Vec<f32> = film.pixels.iter().map(|p| p.depth).collect();
    assert_eq!(single("depth.Z"), &depth);
    assert!(depth.iter().all(|d| *d > 0.0), "nothing may be behind the camera");
    let ids = |f: fn(&furrow_render::scene::tag::Tag) -> u32| Samples::Whole(labels.tags.iter().map(f).collect());
    assert_eq!(channels["id.class"], ids(|t| t.class as u32));
    assert_eq!(channels["id.plant"], ids(|t| t.plant));
    assert_eq!(channels["id.leaf"], ids(|t| u32::from(t.leaf)));
    let parts = labels.parts.iter().map(|p| if *p == NONE { 0 } else { p + 1 }).collect();
    assert_eq!(channels["id.part"], Samples::Whole(parts));
    assert!(bits(&film).iter().any(|b| *b != 0));
}

/// Returns the text chunks of a PNG: all chunks except pixels, palette and colour space.
fn text_of(path: &File) -> Vec<(String, String)> {
    let bytes = std::fs::read(path).unwrap();
    let mut at = 8;
    let mut texts = Vec::new();
    while at < bytes.len() {
        let length = u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        let kind = String::from_utf8_lossy(&bytes[at + 4..at + 8]).into_owned();
        if !["IHDR", "PLTE", "IDAT", "IEND", "sRGB", "gAMA", "cHRM"].contains(&kind.as_str()) {
            texts.push((kind, String::from_utf8_lossy(&bytes[at + 8..at + 8 + length]).into_owned()));
        }
        at += length + 12;
    }
    texts
}

#[test]
fn a_pngs_text_has_its_origin_but_no_path_and_no_time() {
    let (_keep, out, .., provenance) = written();
    for name in FILES.iter().filter(|f| **f != "radiance.exr") {
        let (texts, tags): (Vec<_>, Vec<_>) =
            text_of(&out.join(name)).into_iter().partition(|(kind, _)| kind == "tEXt");
        assert_eq!(texts, [("tEXt".to_string(), format!("Comment\0{}", provenance.text()))], "{name}");
        // Images of the sensor have the camera's tags too.
        let kinds: Vec<&str> = tags.iter().map(|(kind, _)| kind.as_str()).collect();
        let is_photograph = name.starts_with("rgb") || name.starts_with("nir");
        assert_eq!(kinds, if is_photograph { &["eXIf", "iTXt"][..] } else { &[] }, "{name}");
    }
    let text = provenance.text();
    for key in
        ["program: furrow ", "scene: sha256 ", "seed: 3", "index: 0", "spp: 3", "integrator: path", "kernels: Embree"]
    {
        assert!(text.lines().any(|l| l.starts_with(key)), "{key} is missing:\n{text}");
    }
    let year = 1970 + std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap().as_secs() / 31_556_952;
    let prose = text.replace(&text.lines().nth(1).unwrap()["scene: sha256 ".len()..], "");
    for hint in ["/", "\\", ".ron", &year.to_string()] {
        assert!(!prose.contains(hint), "`{hint}` in\n{text}");
    }
}

/// Expected: Pillow reads lens, exposure, place and time as the scene file gives them, and the band from the XMP packet.
#[test]
fn pillow_reads_the_tags_of_the_camera() {
    let Some(python) = python("import PIL") else { return };
    let (keep, out) = scratch();
    let page = keep.path().join("tags.ron");
    let text = "Field(seed: 1, camera: JaiAd130(focal_mm: 8, height_m: 0.5, f_number: 4, motion: (exposure_ms: 2)), \
                lights: [Daylight(sun: At(latitude_deg: 50.6, longitude_deg: -7.25, utc: \"2016-05-27T09:30:00Z\", later_h: 1))])";
    std::fs::write(&page, text).unwrap();
    let args = ["--scene", page.to_str().unwrap(), "--spp", "1", "--width", "32", "--quiet", "--out"];
    let done = trace(&args).arg(&out).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let script = "import sys; from PIL import Image; i = Image.open(sys.argv[1]); e = i.getexif(); s = e.get_ifd(0x8769); \
                  g = e.get_ifd(0x8825); print(e[271], float(s[0x920a]), float(s[0x829d]), float(s[0x829a]), s[0x9003], \
                  [float(x) for x in g[2]], g[3], [float(x) for x in g[4]], s[0xa002], s[0xa405]); \
                  print(i.info['XML:com.adobe.xmp'].split('BandName>')[1])";
    for (name, band) in [("rgb.png", "Red"), ("nir.png", "NIR")] {
        let read = std::process::Command::new(&python).args(["-c", script]).arg(out.join(name)).output().unwrap();
        let words = String::from_utf8_lossy(&read.stdout).into_owned();
        let tags = "Furrow 8.0 4.0 0.002 2016:05:27 10:30:00 [50.0, 36.0, 0.0] W [7.0, 15.0, 0.0] 32 59\n";
        assert!(words.starts_with(tags), "{words}{}", String::from_utf8_lossy(&read.stderr));
        assert!(words.contains(&format!("<rdf:li>{band}</rdf:li>")), "{words}");
    }
}

/// Expected: exit code 2, because the command must change; the path on stderr, nothing on stdout.
#[test]
fn a_folder_that_cannot_be_made_is_a_clear_error() {
    let (keep, _) = scratch();
    let file = keep.path().join("file");
    std::fs::write(&file, "not a folder").unwrap();
    let under = file.join("image");
    for out in [&under, &file] {
        let args = ["--scene", SMALL, "--spp", "1", "--width", "24", "--out", out.to_str().unwrap()];
        let output = trace(&args).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        let error =
            message.lines().find(|l| l.starts_with("error: ")).unwrap_or_else(|| panic!("no error in {message}"));
        assert!(error.contains(file.to_str().unwrap()), "no path in: {error}");
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(output.stdout.is_empty(), "{}", String::from_utf8_lossy(&output.stdout));
        assert_eq!(names(keep.path()), ["file"]);
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "not a folder");
    }
}

/// Rationale: disks fill up in the middle of a file; the shell's limit on file sizes makes writes fail in the same way.
/// Expected: an error that names the file, exit code 1; an existing image is unchanged, with none of its files
/// replaced; otherwise no file and no temporary file is left.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_no_half_written_file() {
    let (_keep, out) = scratch();
    let program = env!("CARGO_BIN_EXE_trace");
    // Blocks of 512 or 1024 bytes: enough for the PNGs of 64 × 48 pixels, but not for the radiance.
    let script = format!(
        "trap '' XFSZ; ulimit -f 24; exec '{program}' --scene {SMALL} --spp 1 --width 64 --out '{}'",
        out.display()
    );
    let refused = || {
        let output = std::process::Command::new("sh").args(["-c", &script]).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{message}");
        let error =
            message.lines().find(|l| l.starts_with("error: ")).unwrap_or_else(|| panic!("no error in {message}"));
        assert!(error.contains("radiance.exr") && error.contains("File too large"), "{error}");
    };
    refused();
    assert_eq!(names(&out), [""; 0]);
    // Another field in the same folder.
    run(&out, &["--width", "64", "--index", "1"]);
    let read = || names(&out).into_iter().map(|name| std::fs::read(out.join(name)).unwrap()).collect::<Vec<_>>();
    let before = read();
    refused();
    assert_eq!(names(&out), FILES);
    assert!(read() == before, "files of two fields are mixed in one folder");
}

#[test]
fn a_file_is_replaced_whole() {
    let (_keep, out) = scratch();
    let path = out.join("deep").join("file");
    furrow_output::write_atomically(&path, b"first, and long").unwrap();
    furrow_output::write_atomically(&path, b"second").unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), b"second");
    assert_eq!(names(path.parent().unwrap()), ["file"]);
}
