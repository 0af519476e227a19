//! Cameras of a field, and the images that they take on a drive.

use super::seed_rows;
use crate::desc::FieldDesc;
use crate::drive::{self, Capture, DriveInputs, FIRST, PathDesc};
use crate::library::Library;
use furrow_base::math::{RoundTo, ToInt, Vec3};
use furrow_base::ron_file::{RonFile, Step};
use furrow_base::sampling::{Purpose, Stream};
use furrow_base::{Error, Result};
use furrow_optics::sensor::Camera;

/// Random stream address of the drive; those of additional cameras follow it.
const DRIVE: u64 = 4 << 32;
/// Maximum number of pixels of an image.
const MOST_PIXELS: u64 = 1 << 28;
/// Maximum number of images of a field.
const MOST_CAPTURES: u64 = 100_000;
/// Maximum length of a camera's name.
const LONGEST_NAME: usize = 64;
/// Names that a camera cannot have.
const RESERVED: [&str; 2] = ["next", "none"];
/// Maximum relative difference between the aspect ratios of a rig's cameras: one pixel in a thousand.
const SAME_SHAPE: f64 = 1e-3;

/// Builds the first camera, scaled to the requested image size.
pub(super) fn first(
    page: &RonFile,
    desc: &FieldDesc,
    library: &mut Library,
    (width, height): (Option<u32>, Option<u32>),
    stream: &mut Stream,
) -> Result<Camera> {
    let camera = desc.camera.build_with(stream, &mut |file| library.calibration(page, file));
    let camera = camera.map_err(|e| page.blame(&[Step::Field("camera")], e))?;
    let camera = match (width, height) {
        (None, None) => camera,
        (w, h) => {
            let (w0, h0) = (camera.width(), camera.height());
            let aspect = f64::from(h0) / f64::from(w0);
            let width =
                w.unwrap_or_else(|| h.map_or(w0, |h| (f64::from(h) / aspect).round().max(1.0).trunc_to::<u32>()));
            let height = h.unwrap_or_else(|| (f64::from(width) * aspect).round().max(1.0).trunc_to::<u32>());
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

/// Returns all captures of a field, by the first camera and the additional cameras. `stream` returns the field's random stream for a
/// purpose and an address; `sown` are the indices of its crops.
pub(super) fn captures(
    page: &RonFile,
    desc: &FieldDesc,
    library: &mut Library,
    first: &Camera,
    sown: std::ops::Range<usize>,
    stream: &dyn Fn(Purpose, u64) -> Stream,
) -> Result<Vec<Capture>> {
    let mut cameras = vec![(FIRST.to_owned(), *first)];
    for (k, mounted) in desc.cameras.iter().enumerate() {
        let at = [Step::Field("cameras"), Step::Item(k)];
        let blame = |e| page.blame(&at, e);
        let named = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if !(1..=LONGEST_NAME).contains(&mounted.name.len()) || !mounted.name.chars().all(named) {
            let words = format!("`{}` cannot be part of a file name", mounted.name);
            return Err(blame(
                Error::input(words)
                    .help(format!("give the camera a name of up to {LONGEST_NAME} letters, digits, - and _")),
            ));
        }
        if RESERVED.contains(&mounted.name.as_str()) {
            let help = "this name is reserved in the files of optical flow; give the camera another name";
            return Err(blame(Error::input(format!("a camera cannot be called `{}`", mounted.name)).help(help)));
        }
        // Names become file names, and some file systems ignore case.
        if let Some((name, _)) = cameras.iter().find(|(name, _)| name.eq_ignore_ascii_case(&mounted.name)) {
            let words = format!("two cameras are called `{name}` and `{}`", mounted.name);
            let help = format!("give this camera another name; the first camera is called `{FIRST}`");
            return Err(blame(Error::input(words).help(help)));
        }
        let mut own = stream(Purpose::Page, DRIVE + 1 + k.to_u64());
        let camera = mounted.camera.build_with(&mut own, &mut |file| library.calibration(page, file)).map_err(blame)?;
        let shape = |camera: &Camera| f64::from(camera.width()) / f64::from(camera.height());
        let own = desc.camera.build_with(&mut stream(Purpose::Page, 0), &mut |file| library.calibration(page, file));
        let own = own.map_or(shape(first), |camera| shape(&camera));
        if (shape(&camera) / own - 1.0).abs() > SAME_SHAPE {
            let words = "its images have another aspect ratio than the first camera's";
            return Err(blame(
                Error::input(words)
                    .help("all images of a scene file have the same size: use the same ratio of width to height"),
            ));
        }
        cameras.push((mounted.name.clone(), camera.with_size(first.width(), first.height())));
    }
    let frames = desc.drive.as_ref().map_or(1, |drive| drive.frames.get().trunc_to::<u64>());
    if frames.saturating_mul(cameras.len().to_u64()) > MOST_CAPTURES {
        let words = format!("{frames} frames of {} cameras are too many for one field", cameras.len());
        let help = format!("at most {MOST_CAPTURES} images; drive through several fields");
        return Err(page.blame(&[Step::Field("drive"), Step::Field("frames")], Error::input(words).help(help)));
    }
    let rows = seed_rows::first_rows(desc, sown, stream).map(|rows| rows.azimuth);
    let mut around = DriveInputs { rows, ..DriveInputs::default() };
    if let Some(PathDesc::Poses(file)) = desc.drive.as_ref().map(|drive| &drive.path) {
        around.poses = library.poses(page, file)?;
    }
    let captures = drive::captures(desc.drive.as_ref(), &cameras, &around, &mut stream(Purpose::Page, DRIVE));
    let captures = captures.map_err(|e| page.blame(&[Step::Field("drive"), Step::Field("path")], e))?;
    match captures.iter().find(|capture| desc.drive.is_some() && below_ground(capture)) {
        None => Ok(captures),
        Some(Capture { name, frame, .. }) => {
            let words = format!("camera `{name}` is below the ground in frame {frame}");
            let help = "heights are measured upwards from the ground";
            Err(page.blame(&[Step::Field("drive")], Error::input(words).help(help)))
        }
    }
}

fn below_ground(capture: &Capture) -> bool {
    let Vec3 { z, .. } = capture.camera.pose().position;
    !(z > 0.0 && z.is_finite())
}
