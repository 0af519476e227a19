//! Calibration of a camera: intrinsics and lens from a file of OpenCV.
//!
//! OpenCV puts the first pixel's centre at (0, 0), this program at (0.5, 0.5), so the optical axis moves by half a pixel.
//!
//! The matrix of a ROS `camera_info` is that of the whole sensor; images are its region of interest, binned. With the offset o
//! and the binning b of each axis, focal length f and optical axis c become f / b and (c − o) / b, where c counts from the
//! corner of the first pixel. Source: ROS, `sensor_msgs/CameraInfo`.

use super::distortion::Distortion;
use super::file_storage::{self, Entry};
use super::fisheye::Fisheye;
use super::model::Lens;
use super::opencv::OpenCv;
use furrow_base::math::RoundTo;
use furrow_base::{Error, Result};

/// Names of the camera matrix: those of OpenCV's samples, of ROS 1 and 2, and of scripts.
const MATRIX: [&str; 6] = ["camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "k", "mtx"];
/// Names of the distortion coefficients.
const COEFFICIENTS: [&str; 7] =
    ["distortion_coefficients", "distCoeffs", "dist_coeffs", "Distortion_Coefficients", "D", "d", "dist"];
/// Names of the image's width and height.
const SIZE: [[&str; 2]; 2] = [["image_width", "image_Width"], ["image_height", "image_Height"]];
/// Largest focal length, pixels.
const MOST_FOCAL: f64 = 1e6;
/// Largest side of a calibrated image, pixels.
const MOST_PIXELS: f64 = 1e6;
/// Largest relative difference between the aspect ratios of the calibration and of the image.
const SAME_SHAPE: f64 = 2e-3;

/// Names of the width and height in a `camera_info` of ROS.
const ROS_SIZE: [&str; 2] = ["width", "height"];
/// Names of the binning, and of offset and size of the region of interest, in a `camera_info` of ROS.
const BINNING: [&str; 2] = ["binning_x", "binning_y"];
const OFFSET: [&str; 2] = ["x_offset", "y_offset"];
/// Largest binning.
const MOST_BINNED: f64 = 64.0;

/// Calibration of a camera, in this program's pixel coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Width and height of the calibrated images, if the file has them.
    size: Option<[f64; 2]>,
    focal: [f64; 2],
    centre: [f64; 2],
    coefficients: Vec<f64>,
    /// Whether the file says that the lens is a fisheye; `None` if it does not say.
    fisheye: Option<bool>,
    /// Line of the distortion coefficients.
    line: usize,
}

impl Calibration {
    /// Reads a file that `cv2.FileStorage` has written, as YAML or XML. Errors name the line.
    pub fn read(text: &str) -> Result<Self> {
        let all = file_storage::read(text)?;
        let twice = all.iter().enumerate().find(|(i, entry)| all[..*i].iter().any(|before| before.key == entry.key));
        if let Some((_, entry)) = twice {
            return Err(entry.fault("is given twice").help("keep one of the two"));
        }
        let find = |names: &[&str]| all.iter().find(|entry| names.contains(&entry.key.as_str()));
        let need = |names: &[&str], what: &str| {
            let mut others = all.iter().filter(|entry| names.contains(&entry.key.as_str()));
            if let (Some(one), Some(other)) = (others.next(), others.next())
                && one.matrix().ok() != other.matrix().ok()
            {
                let words = format!("is another {what} than that of {} in line {}", one.key, one.line);
                return Err(other.fault(words).help("keep one of the two"));
            }
            find(names).ok_or_else(|| {
                Error::input(format!("the file has no {}", names[0]))
                    .help(format!("write the {what} with fs.write(\"{}\", …)", names[0]))
            })
        };
        let entry = need(&MATRIX, "camera matrix")?;
        let matrix = entry.matrix()?;
        let &[fx, skew, cx, zero, fy, cy, p, q, one] = matrix.as_slice() else {
            return Err(entry
                .fault(format_args!("has {} numbers, not 3 × 3", matrix.len()))
                .help("it is cv2's 3 × 3 camera matrix"));
        };
        if skew != 0.0 || [zero, p, q] != [0.0; 3] || one != 1.0 {
            return Err(entry.fault("is not of the form fx 0 cx 0 fy cy 0 0 1").help("calibrate without skew"));
        }
        if fx <= 0.0 || fy <= 0.0 {
            return Err(entry.fault("has focal lengths that are not above 0").help("calibrate again"));
        }
        if fx > MOST_FOCAL || fy > MOST_FOCAL {
            let words = format!("has a focal length above {MOST_FOCAL} pixels");
            return Err(entry.fault(words).help("focal lengths are in pixels"));
        }
        let entry = need(&COEFFICIENTS, "distortion coefficients")?;
        let coefficients = entry.matrix()?;
        let line = entry.line;
        let size = size(&all)?;
        let (focal, centre, size) = part_of_sensor(&all, [fx, fy], [cx + 0.5, cy + 0.5], size)?;
        let fisheye = match find(&["distortion_model"]) {
            Some(entry) => Some(named(entry)?),
            None => find(&["fisheye_model"]).map(flag).transpose()?,
        };
        Ok(Self { size, focal, centre, coefficients, fisheye, line })
    }

    /// Returns focal lengths, optical axis and lens for images of `size` pixels. `fisheye` is the model of a file that
    /// does not say which it has.
    pub(super) fn lens(&self, size: (u32, u32), fisheye: bool) -> Result<([f64; 2], [f64; 2], Lens)> {
        let image = [f64::from(size.0), f64::from(size.1)];
        let own = self.size.unwrap_or(image);
        if (own[0] / own[1] / (image[0] / image[1]) - 1.0).abs() > SAME_SHAPE {
            let [w, h] = own.map(RoundTo::round_to::<u32>);
            let words = format!(
                "the camera was calibrated with images of {w} × {h} pixels, not of the shape of {} × {}",
                size.0, size.1
            );
            return Err(Error::input(words).help(format!("write size: ({w}, {h}), or a multiple of it")));
        }
        let scaled = |of: [f64; 2]| [0, 1].map(|axis| of[axis] * (image[axis] / own[axis]));
        let model = if self.fisheye.unwrap_or(fisheye) { self.fisheye()? } else { self.polynomials()? };
        Ok((scaled(self.focal), scaled(self.centre), model))
    }

    fn fisheye(&self) -> Result<Lens> {
        let k: [f64; 4] = self.coefficients.as_slice().try_into().map_err(|_| self.count("4 of cv2.fisheye"))?;
        Ok(Lens::Fisheye(Fisheye { k }))
    }

    fn polynomials(&self) -> Result<Lens> {
        if ![4, 5, 8, 12, 14].contains(&self.coefficients.len()) {
            return Err(self.count("4, 5, 8, 12 or 14"));
        }
        let all: [f64; 14] = std::array::from_fn(|i| self.coefficients.get(i).copied().unwrap_or(0.0));
        let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tx, ty] = all;
        let more = all[5..].iter().any(|c| *c != 0.0);
        if !more {
            return Ok(Lens::BrownConrady(Distortion { k1, k2, p1, p2, k3 }));
        }
        Ok(Lens::OpenCv(OpenCv { k: [k1, k2, k3, k4, k5, k6], p: [p1, p2], s: [s1, s2, s3, s4], tilt: [tx, ty] }))
    }

    fn count(&self, expected: &str) -> Error {
        let words = format!("line {}: {} distortion coefficients, not {expected}", self.line, self.coefficients.len());
        Error::input(words).help("write all coefficients that cv2.calibrateCamera or cv2.fisheye.calibrate returns")
    }
}

/// Returns the image size in a file, pixels; `None` if it has none.
fn size(all: &[Entry]) -> Result<Option<[f64; 2]>> {
    let find = |names: &[&str]| all.iter().find(|entry| names.contains(&entry.key.as_str()));
    // A width in another file may be that of a chessboard.
    let of_ros = find(&["distortion_model"]).is_some() && find(&SIZE.concat()).is_none();
    let names = if of_ros { ROS_SIZE.map(|name| vec![name]) } else { SIZE.map(|names| names.to_vec()) };
    let [width, height] = names.map(|names| find(&names).map(Entry::number).transpose());
    let size = match (width?, height?) {
        (Some(width), Some(height)) => [width, height],
        (None, None) => return Ok(None),
        _ => {
            return Err(Error::input("the file has only one of image_width and image_height")
                .help("write both, or none of them"));
        }
    };
    if size.iter().any(|side| !(1.0..=MOST_PIXELS).contains(side) || side.fract() != 0.0) {
        let words = format!("the image size in the file is not in whole pixels from 1 to {MOST_PIXELS}");
        return Err(Error::input(words).help("write image_width and image_height in pixels"));
    }
    Ok(Some(size))
}

/// Focal lengths, optical axis and image size, pixels.
type Pinhole = ([f64; 2], [f64; 2], Option<[f64; 2]>);

/// Returns the pinhole of the images that ROS describes as a binned region of the sensor; unchanged if the file has neither.
fn part_of_sensor(all: &[Entry], focal: [f64; 2], centre: [f64; 2], size: Option<[f64; 2]>) -> Result<Pinhole> {
    let find = |name: &str| all.iter().find(|entry| entry.key == name);
    let mut binning = [1.0; 2];
    for (binning, name) in binning.iter_mut().zip(BINNING) {
        let Some(entry) = find(name) else { continue };
        let value = entry.number()?;
        if !(0.0..=MOST_BINNED).contains(&value) || value.fract() != 0.0 {
            let words = format!("is not a whole number from 0 to {MOST_BINNED}");
            return Err(entry.fault(words).help("0 and 1 mean no binning"));
        }
        *binning = value.max(1.0);
    }
    let (mut offset, mut whole) = ([0.0; 2], size);
    if let Some(roi) = find("roi") {
        let read = |names: [&str; 2]| -> Result<[f64; 2]> {
            Ok([roi.named(names[0])?.unwrap_or(0.0), roi.named(names[1])?.unwrap_or(0.0)])
        };
        let side = read(ROS_SIZE)?;
        offset = read(OFFSET)?;
        // A size of 0 means the whole sensor.
        if side != [0.0; 2] {
            whole = Some(side);
        }
        let ends = [0, 1].map(|axis| offset[axis] + whole.map_or(0.0, |whole| whole[axis]));
        let fits = size.is_none_or(|size| [0, 1].iter().all(|axis| ends[*axis] <= size[*axis]));
        let whole_numbers = offset.iter().chain(&side).all(|n| *n >= 0.0 && *n <= MOST_PIXELS && n.fract() == 0.0);
        if !fits || !whole_numbers || side.contains(&0.0) != (side == [0.0; 2]) {
            return Err(roi
                .fault("is not a region of the image")
                .help("write x_offset, y_offset, width and height in pixels; all are 0 for the whole image"));
        }
    }
    let axes = [0, 1];
    Ok((
        axes.map(|axis| focal[axis] / binning[axis]),
        axes.map(|axis| (centre[axis] - offset[axis]) / binning[axis]),
        whole.map(|whole| axes.map(|axis| (whole[axis] / binning[axis]).floor().max(1.0))),
    ))
}

/// Returns a flag that is written as 0 or 1.
fn flag(entry: &Entry) -> Result<bool> {
    match entry.number()? {
        0.0 => Ok(false),
        1.0 => Ok(true),
        _ => Err(entry.fault("is neither 0 nor 1").help("write 1 for cv2.fisheye, 0 for cv2.calibrateCamera")),
    }
}

/// Returns whether the model that ROS names is a fisheye.
fn named(entry: &Entry) -> Result<bool> {
    match entry.text.as_str() {
        "plumb_bob" | "rational_polynomial" | "thin_prism" => Ok(false),
        "equidistant" | "fisheye" => Ok(true),
        other => Err(entry
            .fault(format_args!("is `{other}`, which is not known"))
            .help("known are plumb_bob, rational_polynomial, equidistant and fisheye")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Camera, Pose};
    use super::*;
    use furrow_base::math::Vec3;

    /// Points of the camera frame.
    const POINTS: [[f64; 3]; 6] =
        [[0.0, 0.0, 1.0], [0.3, -0.2, 1.0], [-0.45, 0.3, 1.2], [0.55, 0.42, 1.0], [-0.5, -0.4, 0.9], [0.1, 0.6, 1.5]];
    const ALL: [f64; 14] =
        [0.35, -0.12, 8e-4, -6e-4, 0.02, 0.52, -0.09, 0.015, 0.0012, -4e-4, -9e-4, 3e-4, 0.02, -0.03];
    const FIVE: [f64; 5] = [-0.21, 0.06, 0.0015, -0.001, -0.01];
    const FISHEYE: [f64; 4] = [-0.031, 0.012, -0.0045, 7e-4];

    /// Number of coefficients, and pixels of the points. OpenCV 5.0.0, Python, with K = [[500, 0, 322.5], [0, 510, 238.25],
    /// [0, 0, 1]]: `cv2.projectPoints(POINTS, zeros(3), zeros(3), K, D)`.
    const PROJECTED: [(usize, [[f64; 2]; 6]); 5] = [
        (
            4,
            [
                [322.5, 238.25],
                [468.3121, 139.153022],
                [142.151062012, 360.973605957],
                [573.432270965, 434.256295339],
                [69.7874307778, 32.6302842554],
                [354.689639506, 435.879593778],
            ],
        ),
        (
            5,
            [
                [322.5, 238.25],
                [468.3088045, 139.15526294],
                [142.16677618, 360.962920322],
                [573.130229057, 434.021032151],
                [70.1476725022, 32.9242415025],
                [354.688157205, 435.870522096],
            ],
        ),
        (
            8,
            [
                [322.5, 238.25],
                [469.179782063, 138.534268197],
                [140.858282356, 361.807805498],
                [577.742575881, 437.36805981],
                [65.4004085171, 28.7871629796],
                [354.918063471, 437.017561774],
            ],
        ),
        (
            12,
            [
                [322.5, 238.25],
                [469.254402063, 138.477183897],
                [140.971905403, 361.720883867],
                [577.984046839, 437.183334527],
                [65.6528700321, 28.5940299206],
                [355.011321742, 436.946219196],
            ],
        ),
        (
            14,
            [
                [322.5, 238.25],
                [470.042908295, 138.056482349],
                [141.983125192, 360.891904309],
                [584.153472668, 442.096364699],
                [71.4719098614, 33.2415277211],
                [355.346032145, 438.961746928],
            ],
        ),
    ];
    /// The same of `cv2.fisheye.projectPoints(POINTS, zeros(3), zeros(3), K, FISHEYE)`.
    const PROJECTED_FISHEYE: [[f64; 2]; 6] = [
        [322.5, 238.25],
        [465.953482069, 140.701632193],
        [147.257717308, 357.414752231],
        [560.662686266, 423.757081448],
        [83.5606979209, 43.2755295034],
        [354.029877299, 431.212849068],
    ];

    /// Returns a file as OpenCV writes it.
    fn yaml(coefficients: &[f64], more: &str) -> String {
        let data: Vec<String> = coefficients.iter().map(ToString::to_string).collect();
        format!(
            "%YAML 1.2\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   \
             dt: d\n   data: [ 500., 0., 322.5, 0., 510., 238.25, 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   \
             rows: 1\n   cols: {}\n   dt: d\n   data: [ {} ]\n{more}",
            data.len(),
            data.join(",\n       ")
        )
    }

    const XML: &str = r#"<?xml version="1.0"?>
<opencv_storage>
<!-- by hand -->
<image_width>640</image_width>
<image_height>480</image_height>
<camera_matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    500. 0. 322.5 0. 510. 238.25 0. 0. 1.</data></camera_matrix>
<distortion_coefficients type_id="opencv-matrix">
  <rows>1</rows>
  <cols>5</cols>
  <dt>d</dt>
  <data>
    -0.21 0.06 0.0015 -0.001
    -0.01</data></distortion_coefficients>
<image_points type_id="opencv-matrix">
  <rows>1</rows>
  <cols>2</cols>
  <dt>"2f"</dt>
  <data>
    0. 0. 0. 0.</data></image_points>
</opencv_storage>
"#;

    fn camera(text: &str, fisheye: bool) -> Result<Camera> {
        let (focal, centre, lens) = Calibration::read(text)?.lens((640, 480), fisheye)?;
        Camera::new(
            (640, 480),
            focal,
            centre,
            lens,
            Pose { position: Vec3::Z, axes: furrow_base::math::Mat3::IDENTITY },
        )
    }

    fn check(camera: &Camera, expected: &[[f64; 2]; 6]) {
        for (point, [x, y]) in POINTS.iter().zip(expected) {
            let got = camera.project_camera(*point).expect("within the horizon");
            // The centre of the first pixel is at 0.5 here and at 0 there.
            assert!((got[0] - x - 0.5).abs() < 1e-9 && (got[1] - y - 0.5).abs() < 1e-9, "{got:?} for {x} {y}");
            let back = camera.unproject(got);
            assert!((back[0] - point[0] / point[2]).abs() < 1e-9 && (back[1] - point[1] / point[2]).abs() < 1e-9);
        }
    }

    /// Expected: the pixels of OpenCV's own functions, and the inverse. Source: `cv2.projectPoints`.
    #[test]
    fn points_are_projected_as_opencv_projects_them() {
        for (count, expected) in &PROJECTED {
            let coefficients = if *count < 8 { &FIVE[..*count] } else { &ALL[..*count] };
            check(&camera(&yaml(coefficients, ""), false).unwrap(), expected);
        }
        check(&camera(&yaml(&FISHEYE, ""), true).unwrap(), &PROJECTED_FISHEYE);
        check(&camera(&yaml(&FISHEYE, "fisheye_model: 1\n"), false).unwrap(), &PROJECTED_FISHEYE);
    }

    /// Expected: YAML, XML and the file of ROS give the same camera; half the size halves the intrinsics.
    #[test]
    fn all_forms_of_a_file_give_the_same_camera() {
        let expected = Calibration::read(&yaml(&FIVE, "rms: 0.25\nimage_points:\n   - [ 1., 2. ]\n")).unwrap();
        let same =
            |text: &str| assert_eq!(Calibration { line: expected.line, ..Calibration::read(text).unwrap() }, expected);
        same(XML);
        same(&yaml(&FIVE, "").replace('\n', "\r\n"));
        let ros = yaml(&FIVE, "").replace(" !!opencv-matrix", "");
        same(&ros);
        // Names of ROS 2.
        same(&ros.replace("camera_matrix:", "k:").replace("distortion_coefficients:", "d:"));
        let named = Calibration::read(&format!("{ros}distortion_model: plumb_bob\n")).unwrap();
        assert_eq!(named.fisheye, Some(false));
        let (focal, centre, _) = expected.lens((320, 240), false).unwrap();
        assert_eq!((focal, centre), ([250.0, 255.0], [161.5, 119.375]));
    }

    /// Rationale: cameras of robots bin and crop, and ROS files have the matrix of the whole sensor. Expected: the intrinsics of the
    /// published image, by arithmetic; zeros change nothing. Source: `sensor_msgs/CameraInfo`.
    #[test]
    fn binning_and_regions_of_ros_are_applied() {
        let ros = |more: &str| {
            format!("{}distortion_model: plumb_bob\n{more}", yaml(&FIVE, "").replace(" !!opencv-matrix", ""))
        };
        let lens = |more: &str, size| {
            let (focal, centre, _) = Calibration::read(&ros(more)).unwrap().lens(size, false).unwrap();
            (focal, centre)
        };
        let plain = lens("", (640, 480));
        assert_eq!(plain, ([500.0, 510.0], [323.0, 238.75]));
        let none = "binning_x: 0\nbinning_y: 1\nroi:\n  x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n  do_rectify: False\n";
        assert_eq!(lens(none, (640, 480)), plain);
        let binned = "binning_x: 2\nbinning_y: 2\n";
        assert_eq!(lens(binned, (320, 240)), ([250.0, 255.0], [161.5, 119.375]));
        let region = "roi:\n  x_offset: 40\n  y_offset: 20\n  height: 240\n  width: 320\n";
        assert_eq!(lens(region, (320, 240)), ([500.0, 510.0], [283.0, 218.75]));
        let inline = "roi: {x_offset: 40, y_offset: 20, height: 240, width: 320, do_rectify: false}\n";
        assert_eq!(lens(inline, (320, 240)), lens(region, (320, 240)));
        assert_eq!(lens(&format!("{binned}{region}"), (160, 120)), ([250.0, 255.0], [141.5, 109.375]));
        // A message as `rostopic echo` prints it names the size width and height.
        let message = ros(region).replace("image_width", "width").replace("image_height", "height");
        assert_eq!(Calibration::read(&message).unwrap(), Calibration::read(&ros(region)).unwrap());
        for (more, why) in [
            ("binning_x: 1.5\n", "line 20: binning_x is not a whole number from 0 to 64"),
            (
                "roi:\n  x_offset: 600\n  y_offset: 0\n  height: 240\n  width: 320\n",
                "line 20: roi is not a region of the image",
            ),
            ("roi:\n  x_offset: 40\n", "line 20: roi is not a region of the image"),
            ("roi:\n  x_offset: left\n", "line 20: roi has a x_offset that is not a number"),
        ] {
            let error = Calibration::read(&ros(more)).unwrap_err().to_string();
            assert!(error.contains(why) && error.contains("help: "), "{why}: {error}");
        }
    }

    #[test]
    fn files_that_are_no_calibration_are_refused_with_their_line() {
        let good = yaml(&FIVE, "");
        for (text, why) in [
            (String::new(), "the file is empty"),
            ("{}".into(), "JSON"),
            (good.replace("camera_matrix", "matrix"), "the file has no camera_matrix"),
            (good.replace("322.5", "nan"), "line 5: camera_matrix contains `nan`"),
            (good.replace("322.5, 0.", "322.5"), "line 5: camera_matrix has 8 numbers, not 3 × 3"),
            (good.replace("500., 0.,", "500., 0.1,"), "line 5: camera_matrix is not of the form"),
            (good.replace("500.", "-500."), "focal lengths"),
            (good.replace("500.", "1e12"), "a focal length above 1000000 pixels"),
            (
                format!("{good}K: [600, 0, 322.5, 0, 510, 238.25, 0, 0, 1]\n"),
                "K is another camera matrix than that of camera_matrix in line 5",
            ),
            (
                good.replace("data: [ -0.21", "data: [ -0.21, 1"),
                "line 10: distortion_coefficients has 6 numbers, not 1 × 5",
            ),
            (yaml(&[0.1; 6], ""), "line 10: 6 distortion coefficients, not 4, 5, 8, 12 or 14"),
            (good.replace(']', ""), "line 9: the list has no `]`"),
            (format!("{good}distortion_model: omni\n"), "`omni`"),
            (yaml(&FIVE, "fisheye_model: 1\n"), "5 distortion coefficients, not 4 of cv2.fisheye"),
            (good.replace("640", "480"), "images of 480 × 480 pixels"),
            (XML.replace("</data></camera_matrix>", "</camera_matrix>"), "line 11: </camera_matrix> closes no tag"),
            (XML.replace("</opencv_storage>", ""), "<opencv_storage> is not closed"),
            (
                yaml(&[0.3, 0.0, 0.0, 0.0], "fisheye_model: 1\n")
                    .replace("500., 0.", "100., 0.")
                    .replace("510.", "100."),
                "85°",
            ),
        ] {
            let error = camera(&text, false).map(|_| ()).unwrap_err().to_string();
            assert!(error.contains(why) && error.contains("help: "), "{why}: {error}");
        }
    }

    proptest::proptest! {
        #[test]
        fn random_text_never_panics(text in "[-a-z_:<>/!\\[\\]{}. 0-9,\n]{0,120}") {
            let _ = Calibration::read(&text);
        }
    }
}
