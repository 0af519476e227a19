//! The cameras of a field, and the images that they take on their way through it.

use crate::math::Vec3;
use crate::ron_file::{RonFile, Step};
use crate::sampling::{Purpose, Stream};
use crate::scatter::Rows;
use crate::scene::desc::FieldDesc;
use crate::scene::drive::{self, Around, Capture, FIRST, PathDesc};
use crate::scene::library::Library;
use crate::sensor::Camera;
use crate::{Error, Result};

/// Address of the stream from which the drive is drawn, and of the first of those of further cameras.
const DRIVE: u64 = 4 << 32;
/// Most pixels of an image.
const MOST_PIXELS: u64 = 1 << 28;
/// Most images of a field.
const MOST_CAPTURES: u64 = 100_000;
/// Most letters of a camera's name.
const LONGEST_NAME: usize = 64;
/// Names that are no camera's.
const RESERVED: [&str; 2] = ["next", "none"];
/// How far the shapes of a rig's images may differ: a pixel of a thousand.
const SAME_SHAPE: f64 = 1e-3;

/// The first camera, in the size that is asked for.
pub(super) fn first(
    page: &RonFile,
    desc: &FieldDesc,
    (width, height): (Option<u32>, Option<u32>),
    stream: &mut Stream,
) -> Result<Camera> {
    let camera = desc.camera.build(stream).map_err(|e| page.blame(&[Step::Field("camera")], e))?;
    let camera = match (width, height) {
        (None, None) => camera,
        (w, h) => {
            let (w0, h0) = (camera.width(), camera.height());
            let aspect = f64::from(h0) / f64::from(w0);
            let width = w.unwrap_or_else(|| h.map_or(w0, |h| (f64::from(h) / aspect).round().max(1.0) as u32));
            let height = h.unwrap_or_else(|| (f64::from(width) * aspect).round().max(1.0) as u32);
            camera.with_size(width, height)
        }
    };
    let (w, h) = (camera.width(), camera.height());
    if u64::from(w) * u64::from(h) > MOST_PIXELS {
        let fault = Error::input(format!("an image of {w} × {h} pixels is too large"))
            .help(format!("at most {MOST_PIXELS} pixels, 16384 × 16384"));
        return Err(page.blame(&[Step::Field("camera"), Step::Field("size")], fault));
    }
    Ok(camera)
}

/// All images of a field: those of the first camera and of those that are carried with it. `stream` gives the field's random numbers by
/// purpose and address, `sown` the places of its crops.
pub(super) fn captures(
    page: &RonFile,
    desc: &FieldDesc,
    library: &mut Library,
    first: Camera,
    sown: std::ops::Range<usize>,
    stream: &dyn Fn(Purpose, u64) -> Stream,
) -> Result<Vec<Capture>> {
    let mut cameras = vec![(FIRST.to_owned(), first)];
    for (k, mounted) in desc.cameras.iter().enumerate() {
        let at = [Step::Field("cameras"), Step::Item(k)];
        let blame = |e| page.blame(&at, e);
        let named = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if !(1..=LONGEST_NAME).contains(&mounted.name.len()) || !mounted.name.chars().all(named) {
            let words = format!("`{}` cannot be part of a file's name", mounted.name);
            return Err(blame(
                Error::input(words)
                    .help(format!("give the camera a name of up to {LONGEST_NAME} letters, digits, - and _")),
            ));
        }
        if RESERVED.contains(&mounted.name.as_str()) {
            let help = "files of flow call other things so; give the camera another name";
            return Err(blame(Error::input(format!("no camera can be called `{}`", mounted.name)).help(help)));
        }
        // Files are named by them, and some file systems do not tell capitals from small letters.
        if let Some((name, _)) = cameras.iter().find(|(name, _)| name.eq_ignore_ascii_case(&mounted.name)) {
            let words = format!("two cameras are called `{name}` and `{}`", mounted.name);
            let help = format!("give this one a name of its own; the first camera is called `{FIRST}`");
            return Err(blame(Error::input(words).help(help)));
        }
        let camera = mounted.camera.build(&mut stream(Purpose::Page, DRIVE + 1 + k as u64)).map_err(blame)?;
        let shape = |camera: &Camera| f64::from(camera.width()) / f64::from(camera.height());
        let own = desc.camera.build(&mut stream(Purpose::Page, 0)).map_or(shape(&first), |camera| shape(&camera));
        if (shape(&camera) / own - 1.0).abs() > SAME_SHAPE {
            let words = "its images have another shape than the first camera's";
            return Err(blame(
                Error::input(words)
                    .help("all images of a scene file have one size: give it the same ratio of width to height"),
            ));
        }
        cameras.push((mounted.name.clone(), camera.with_size(first.width(), first.height())));
    }
    let frames = desc.drive.as_ref().map_or(1, |drive| drive.frames.get() as u64);
    if frames.saturating_mul(cameras.len() as u64) > MOST_CAPTURES {
        let words = format!("{frames} frames of {} cameras are too many for one field", cameras.len());
        let help = format!("at most {MOST_CAPTURES} images; drive through several fields");
        return Err(page.blame(&[Step::Field("drive"), Step::Field("frames")], Error::input(words).help(help)));
    }
    let mut around = Around::default();
    if let Some(k) = sown.into_iter().next() {
        around.rows = Some(Rows::draw(&desc.crops[k].rows, &stream(Purpose::Scatter, k as u64)).azimuth);
    }
    if let Some(PathDesc::Poses(file)) = desc.drive.as_ref().map(|drive| &drive.path) {
        around.poses = library.poses(page, file)?;
    }
    let captures = drive::captures(desc.drive.as_ref(), &cameras, &around, &mut stream(Purpose::Page, DRIVE));
    let captures = captures.map_err(|e| page.blame(&[Step::Field("drive"), Step::Field("path")], e))?;
    match captures.iter().find(|capture| desc.drive.is_some() && below_ground(capture)) {
        None => Ok(captures),
        Some(Capture { name, frame, .. }) => {
            let words = format!("camera `{name}` lies under the ground in frame {frame}");
            let help = "heights are counted from the ground, upwards";
            Err(page.blame(&[Step::Field("drive")], Error::input(words).help(help)))
        }
    }
}

fn below_ground(capture: &Capture) -> bool {
    let Vec3 { z, .. } = capture.camera.pose().position;
    !(z > 0.0 && z.is_finite())
}
