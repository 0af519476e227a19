//! Chooses the level of geometric detail of a field.

use super::extent::LONGEST_REACH;
use super::footprint::Footprint;
use crate::desc::{Detail, FieldDesc};
use crate::drive::Capture;

/// Largest area of planted ground in an image with which `detail: Auto` is `Full`, m². A camera of 60° by 47° sees it from 3.5 m. In full
/// detail, 6 m² of a natural seedbed have 14 million triangles and take 20 s on two cores.
const FULL_UP_TO_M2: f32 = 12.0;

/// Level of geometric detail that a field is built with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MeshDetail {
    /// [`Detail::Full`].
    Full,
    /// [`Detail::ByPixel`].
    ByPixel,
    /// [`Detail::Instanced`].
    Instanced,
}

impl MeshDetail {
    /// Returns the level that the scene file asks for. `Auto` is chosen from the area of ground in the images. A scan is never `Full`: its
    /// pixel size is the spacing of the LiDAR's rays.
    pub(super) fn of(desc: &FieldDesc, scanned: bool, captures: &[Capture]) -> Self {
        match desc.detail {
            Detail::Full | Detail::Auto if scanned => Self::ByPixel,
            Detail::Auto if sees_much(desc, captures) => Self::ByPixel,
            Detail::Full | Detail::Auto => Self::Full,
            Detail::ByPixel => Self::ByPixel,
            Detail::Instanced => Self::Instanced,
        }
    }

    /// Returns the level for the record of an image; `None` if it follows from the scene file alone, and for `Full`.
    pub(super) fn record(self, desc: &FieldDesc, scanned: bool) -> Option<Detail> {
        (desc.detail == Detail::Auto && !scanned && self == Self::ByPixel).then_some(Detail::ByPixel)
    }
}

/// Returns `true` if any image shows more ground than [`FULL_UP_TO_M2`].
fn sees_much(desc: &FieldDesc, captures: &[Capture]) -> bool {
    let reach = desc.reach_m.f32().min(LONGEST_REACH);
    let area = |capture: &Capture| Footprint::of(&capture.camera, reach).planted_area();
    desc.has_ground() && captures.iter().any(|capture| area(capture) > FULL_UP_TO_M2)
}

#[cfg(test)]
mod tests {
    use super::super::{Options, Source};
    use super::*;
    use furrow_optics::sensor::LidarDesc;
    use std::path::Path;

    /// Returns the levels of the first four fields of a scene file.
    fn levels(source: &Source) -> Vec<MeshDetail> {
        let level =
            |index| source.query(&Options { index, ..Options::default() }, |asked| Ok(asked.drawn.detail)).unwrap();
        (0..4).map(level).collect()
    }

    /// Rationale: the choice must not change the pixels of scenes that were made for full detail. Expected: every shipped scene file that
    /// leaves the level to the field is `Full`, although their cameras are drawn anew for each field; three state another level.
    #[test]
    fn shipped_scenes_have_full_detail() {
        let mut chosen = 0;
        for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes")).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|ending| ending != "ron") {
                continue;
            }
            let source = Source::open(&path).unwrap();
            if source.desc.detail == Detail::Auto {
                chosen += 1;
                assert_eq!(levels(&source), [MeshDetail::Full; 4], "{}", path.display());
            }
        }
        assert!(chosen > 15, "{chosen}");
    }

    /// Expected: a camera of 60° by 46.8° sees the square of its height, so the limit is between 3.4 and 3.6 m. At the horizon the
    /// reach limits the area: half a square of 144 m², or of 16 m² with a reach of 2 m. Scenes without ground are `Full`, and a level in
    /// the scene file is kept. Only a choice of `ByPixel` is recorded, and a scan is always `ByPixel`. Source: 2 tan 30° · 2 tan 23.4° = 1.0.
    #[test]
    fn the_area_in_view_decides() {
        let down = |height: f64| format!("Nadir(height_m: {height})");
        let ahead = || "LookAt(position_m: (0, 0, 1.2), target_m: (0, 4, 0.5))".to_owned();
        let asked = |pose: &str, rest: &str, scan: Option<super::super::Scanner>| {
            let text = format!(
                "Field(camera: Pinhole(size: (640, 480), intrinsics: FieldOfView(horizontal_deg: 60), pose: {pose}), {rest})"
            );
            let source = Source::of_text(Path::new("field.ron"), &text).unwrap();
            let options = Options { scan, ..Options::default() };
            let answer = source.query(&options, |asked| {
                let scanned = !asked.drawn.scanners.is_empty();
                Ok((asked.drawn.detail, asked.drawn.detail.record(asked.drawn.desc, scanned)))
            });
            answer.unwrap()
        };
        let (full, by_pixel) = ((MeshDetail::Full, None), (MeshDetail::ByPixel, Some(Detail::ByPixel)));
        for (pose, rest, expected) in [
            (down(3.4), "soil: ()", full),
            (down(3.6), "soil: ()", by_pixel),
            (down(3.6), "detail: Full, soil: ()", full),
            (down(1.0), "detail: ByPixel, soil: ()", (MeshDetail::ByPixel, None)),
            (down(3.6), "detail: Instanced, soil: ()", (MeshDetail::Instanced, None)),
            (down(8.0), "", full),
            (ahead(), "soil: ()", by_pixel),
            (ahead(), "reach_m: 2, soil: ()", full),
            (down(8.0), "reach_m: 1.5, soil: ()", full),
        ] {
            assert_eq!(asked(&pose, rest, None), expected, "{pose} {rest}");
        }
        let scanner = || {
            let lidar: LidarDesc = ron::from_str("Vlp16(position_m: (0, 0, 1))").unwrap();
            Some(super::super::Scanner::AtCamera(Box::new(lidar)))
        };
        for rest in ["soil: ()", "detail: Full, soil: ()"] {
            assert_eq!(asked(&down(1.0), rest, scanner()), (MeshDetail::ByPixel, None), "{rest}");
        }
    }
}
