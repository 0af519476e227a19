//! Tests of the camera against OpenCV's conventions and for consistency.

use super::*;
use furrow_base::math::{ToFloat, Vec3, vec2, vec3};
use furrow_base::sampling::{Purpose, Stream};

fn build(page: &str) -> Result<Camera, String> {
    let desc: CameraDesc = ron::from_str(page).map_err(|e| e.to_string())?;
    desc.build(&mut Stream::of(1, 0, Purpose::Test, 0)).map_err(|e| e.to_string())
}

fn cameras() -> Vec<Camera> {
    [
        "JaiAd130()",
        "JaiAd130(focal_mm: 8, height_m: 1.1, at_m: (3, -2), yaw_deg: 35, pitch_deg: 4, roll_deg: -3, \
         distortion: (k1: -0.1, k2: 0.02, p1: 0.001, p2: -0.0007, k3: 0.004))",
        "Pinhole(size: (640, 480), intrinsics: Pixels(fx: 400, fy: 420, cx: 300, cy: 250), \
         pose: LookAt(position_m: (0.5, -2, 1.5), target_m: (0, 0, 0.1)), distortion: (k1: -0.2, k2: 0.05))",
        "Pinhole(size: (320, 240), intrinsics: FieldOfView(horizontal_deg: 90), pose: Nadir(height_m: 2), \
         distortion: (k1: 0.05, p1: 0.002))",
        "Phone(height_m: 0.4, yaw_deg: 70)",
    ]
    .map(|page| build(page).unwrap())
    .to_vec()
}

/// Rationale: labels, masks and stem points are projected and images are ray traced, so both must refer to the same
/// pixel. Expected: a pixel that is unprojected and projected returns to itself within 10⁻⁴ pixels, with and without
/// distortion; through f32 world points, within the precision of f32.
#[test]
fn a_pixel_projected_back_is_itself() {
    for camera in cameras() {
        let mut s = Stream::of(2, 0, Purpose::Test, 0);
        let depth_digits = 4.0 * camera.focal[0].to_f32() * f32::EPSILON * (1.0 + camera.pose.position.length());
        for i in 0..2000 {
            let (w, h) = (f64::from(camera.width), f64::from(camera.height));
            let px = match i {
                0 => [0.0, 0.0],
                1 => [w, h],
                _ => [s.range(0.0, w), s.range(0.0, h)],
            };
            let [x, y] = camera.unproject(px);
            let z = s.range(0.2, 5.0);
            let back = camera.project_camera([x * z, y * z, z]).unwrap();
            assert!((back[0] - px[0]).abs() < 1e-4 && (back[1] - px[1]).abs() < 1e-4, "{px:?} {back:?}");

            let px = vec2(px[0].to_f32(), px[1].to_f32());
            let (origin, dir) = camera.ray(px, [0.3, 0.7]);
            assert!((dir.length() - 1.0).abs() < 1e-6);
            let back = camera.project(origin + dir * z.to_f32()).unwrap();
            assert!((back - px).length() < depth_digits / z.min(1.0).to_f32() + 1e-4, "{px} {back}");
        }
    }
}

/// Rationale: a mirrored or rotated image trains a robot to steer the wrong way. Expected: looking down at yaw 0, image
/// right is east and image down is south; yaw 90 puts east at the top; pitch tilts the view to the top, roll to the
/// right. Source: OpenCV's frame, the azimuths of math::direction.
#[test]
fn the_image_of_a_nadir_camera_has_north_at_its_top() {
    let at = |page: &str, p: Vec3| build(page).unwrap().project(p).unwrap();
    let (east, north) = (vec3(0.05, 0.0, 0.0), vec3(0.0, 0.05, 0.0));
    let (middle, still) = (vec2(648.0, 483.0), "JaiAd130(height_m: 1)");
    assert!((at(still, Vec3::ZERO) - middle).length() < 1e-3);
    assert!((at(still, east) - vec2(648.0 + 200.0, 483.0)).length() < 1e-2);
    assert!((at(still, north) - vec2(648.0, 483.0 - 200.0)).length() < 1e-2);
    let turned = "JaiAd130(height_m: 1, yaw_deg: 90)";
    assert!((at(turned, east) - vec2(648.0, 483.0 - 200.0)).length() < 1e-2);
    assert!((at(turned, north) - vec2(648.0 - 200.0, 483.0)).length() < 1e-2);
    let shift = 4000.0 * 2.0_f32.to_radians().tan();
    assert!((at("JaiAd130(height_m: 1, pitch_deg: 2)", Vec3::ZERO) - vec2(648.0, 483.0 + shift)).length() < 0.1);
    assert!((at("JaiAd130(height_m: 1, roll_deg: 2)", Vec3::ZERO) - vec2(648.0 - shift, 483.0)).length() < 0.1);
    let upright = "Pinhole(size: (100, 100), intrinsics: FieldOfView(horizontal_deg: 60), \
                   pose: LookAt(position_m: (0, -3, 1), target_m: (0, 0, 1)))";
    assert!(at(upright, vec3(0.0, 0.0, 1.5)).y < 50.0 && at(upright, vec3(0.5, 0.0, 1.0)).x > 50.0);
    let down = "Pinhole(size: (100, 100), intrinsics: FieldOfView(horizontal_deg: 60), \
                pose: LookAt(position_m: (0, 0, 1), target_m: (0, 0, 0)))";
    assert!(at(down, east).x > 50.0 && at(down, north).y < 50.0);
}

#[test]
fn distortion_has_opencvs_signs() {
    // Barrel distortion moves corners inwards; p1 and p2 follow their formula at one point.
    let barrel = Distortion { k1: -0.1, ..Distortion::default() };
    assert_eq!(barrel.distort([0.5, 0.0]), [0.5 * (1.0 - 0.1 * 0.25), 0.0]);
    let tangential = Distortion { p1: 0.01, p2: 0.02, ..Distortion::default() };
    let [x, y] = tangential.distort([0.3, 0.4]);
    assert!((x - (0.3 + 2.0 * 0.01 * 0.12 + 0.02 * (0.25 + 0.18))).abs() < 1e-12);
    assert!((y - (0.4 + 0.01 * (0.25 + 0.32) + 2.0 * 0.02 * 0.12)).abs() < 1e-12);
}

#[test]
fn the_preset_sees_what_its_data_sheet_says() {
    let camera = build("JaiAd130(focal_mm: 15, height_m: 0.85)").unwrap();
    let outline = camera.outline(0.0, 1).unwrap();
    let [a, b, c, _] = outline[..] else { panic!("{outline:?}") };
    assert!((b.x - a.x - 0.2754).abs() < 1e-4 && (b.y - c.y - 0.2053).abs() < 1e-4, "275 × 205 mm");
    assert!((camera.pixel_angle() * 0.85 - 0.2125e-3).abs() < 1e-6, "0.2125 mm per pixel");
    assert!(camera.contains(vec2(0.0, 0.0)) && !camera.contains(vec2(1296.0, 1.0)));
}

/// Rationale: with barrel distortion the sides are bent between the corners, and ground outside them is in no image.
/// Expected: points of the ground outline project to the image's border, in order.
#[test]
fn the_outline_on_the_ground_is_the_images_border() {
    let text = "Pinhole(size: (200, 150), intrinsics: FieldOfView(horizontal_deg: 60), distortion: (k1: -0.2), pose: Nadir(height_m: 0.8))";
    let camera = build(text).unwrap();
    let outline = camera.outline(0.0, 8).unwrap();
    assert_eq!(outline.len(), 32);
    for (k, at) in outline.iter().enumerate() {
        let px = camera.project(at.extend(0.0)).unwrap();
        let (x, y) = [(0, 0), (200, 0), (200, 150), (0, 150)][k / 8];
        let (to_x, to_y) = [(200, 0), (200, 150), (0, 150), (0, 0)][k / 8];
        let part = (k % 8).to_f32() / 8.0;
        let border = vec2(x.to_f32() + part * (to_x - x).to_f32(), y.to_f32() + part * (to_y - y).to_f32());
        assert!(px.distance(border) < 0.01, "{k}: {px} for {border}");
    }
}

#[test]
fn another_size_keeps_the_field_of_view() {
    for camera in cameras() {
        let small = camera.with_size(camera.width() / 4, camera.height() / 2);
        for share in [[0.0, 0.0], [0.3, 0.9], [1.0, 1.0]] {
            let dir =
                |c: &Camera| c.ray(vec2(share[0] * c.width().to_f32(), share[1] * c.height().to_f32()), [0.5; 2]).1;
            assert!((dir(&camera) - dir(&small)).length() < 1e-6);
        }
    }
}

#[test]
fn a_lens_is_sharp_in_its_plane_and_passes_through_its_centre() {
    let camera = build("JaiAd130(height_m: 1, f_number: 2, distortion: (k1: -0.05))").unwrap();
    let px = vec2(300.5, 200.5);
    let (eye, straight) = camera.centre_ray(300, 200);
    let focus = eye + straight / -straight.z;
    let mut s = Stream::of(1, 0, Purpose::Test, 0);
    for _ in 0..200 {
        let (origin, dir) = camera.ray(px, [s.uniform32(), s.uniform32()]);
        assert!((origin + dir / -dir.z - focus).length() < 1e-6, "a blurred plane of focus");
        assert!((origin - eye).length() <= 0.00375 * 1.0001 && (origin.z - eye.z).abs() < 1e-6);
    }
    let (pinhole, same) = build("JaiAd130(height_m: 1, distortion: (k1: -0.05))").unwrap().ray(px, [0.1, 0.9]);
    assert!((pinhole - eye).length() < 1e-6 && (same - straight).length() < 1e-6, "labels use the same lens");
}

#[test]
fn cameras_that_see_nothing_say_why() {
    for (page, why) in [
        ("JaiAd130(focal_mm: 2, distortion: (k1: -3))", "folds the image"),
        (
            "Pinhole(size: (10, 10), intrinsics: FieldOfView(horizontal_deg: 60), pose: Nadir(height_m: 1), \
             aperture: (f_number: 2, focus_m: 1))",
            "focal length in millimetres",
        ),
        (
            "Pinhole(size: (10, 10), intrinsics: FieldOfView(horizontal_deg: 180), pose: Nadir(height_m: 1))",
            "less than 180",
        ),
        (
            "Pinhole(size: (10, 10), intrinsics: FieldOfView(horizontal_deg: 60), \
             pose: LookAt(position_m: (1, 1, 1), target_m: (1, 1, 1)))",
            "its own position",
        ),
        ("JaiAd130(height_m: -1)", "above 0"),
    ] {
        let message = build(page).err().unwrap_or_default();
        assert!(message.contains(why), "{page}: {message}");
    }
    assert!(build("JaiAd130()").unwrap().project(vec3(0.0, 0.0, 2.0)).is_none(), "behind the lens");
    let page = "JaiAd130(focal_mm:8.0,height_m:1.0,at_m:(0.0,0.0),yaw_deg:0.0,pitch_deg:0.0,roll_deg:0.0,\
                distortion:(k1:-0.1,k2:0.0,p1:0.0,p2:0.0,k3:0.0),f_number:4.0)";
    let desc: CameraDesc = ron::from_str(page).unwrap();
    assert_eq!(ron::to_string(&desc).unwrap(), page);
}
