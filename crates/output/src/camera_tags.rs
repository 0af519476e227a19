//! Camera, exposure, place and time of an image as EXIF and XMP, for viewers and photogrammetry programs.
//!
//! | value | EXIF | XMP |
//! |---|---|---|
//! | focal length | `FocalLength`, mm; `FocalLengthIn35mmFilm` by the width | `Camera:PerspectiveFocalLength`, mm |
//! | pixel pitch | `FocalPlaneXResolution`, pixels per cm | |
//! | principal point, distortion | | `Camera:PrincipalPoint`, mm; `Camera:PerspectiveDistortion`: k1, k2, k3, p1, p2 |
//! | f-number, plane in focus | `FNumber`, `SubjectDistance` | |
//! | exposure | `ExposureTime` | |
//! | analog gain | `RecommendedExposureIndex` and `PhotographicSensitivity`: 100 times the factor | `furrow:AnalogGain` |
//! | band | | `Camera:BandName` |
//! | pose in the field | | `furrow:PositionM`, `furrow:WorldToCamera` as in `record.json` |
//! | place and time of the sun | `GPSLatitude`, `GPSLongitude`, `DateTimeOriginal` in UTC | |
//!
//! Values that a scene file does not give are left out: millimetres without a focal length or pixel pitch, place and
//! time if it gives the sun's direction.
//!
//! Sources: CIPA DC-008-2019, tables 4 to 15; Adobe 2012, "XMP Specification Part 1"; Pix4D 2020, "EXIF and XMP tag data".

use super::exif::{Directory, Value};
use furrow_base::math::{RoundTo, ToFloat};
use furrow_field::Field;
use furrow_optics::light::{LightRecord, MomentRecord};
use furrow_optics::sensor::{CameraRecord, Photograph};
use std::fmt::Write;

/// Part of the sensor in an image: left, top, width and height in pixels.
pub(super) type Crop = [u32; 4];

/// Width of 35 mm film, mm.
const FILM_MM: f64 = 36.0;
/// Sensitivity of analog gain 1, as multispectral cameras state it.
const BASE_SENSITIVITY: f32 = 100.0;

/// Camera, place and time of a field's image.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraTags {
    camera: CameraRecord,
    focal_mm: Option<f64>,
    f_number: Option<f32>,
    moment: Option<MomentRecord>,
}

/// Images of one photograph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bands {
    /// Red, green and blue.
    Rgb,
    /// Near infrared.
    Nir,
}

impl Bands {
    /// Returns the indices of the bands in R, G, B, NIR; the exposure is that of the middle one.
    fn indices(self) -> &'static [usize] {
        match self {
            Self::Rgb => &[0, 1, 2],
            Self::Nir => &[3],
        }
    }

    fn exposed(self) -> usize {
        self.indices()[self.indices().len() / 2]
    }

    fn names(self) -> &'static [&'static str] {
        match self {
            Self::Rgb => &["Red", "Green", "Blue"],
            Self::Nir => &["NIR"],
        }
    }
}

impl CameraTags {
    /// Returns the tags of the field's current image.
    pub fn of(field: &Field) -> Self {
        let moment = field.conditions.lights.iter().find_map(|light| match light {
            LightRecord::Daylight(daylight) => daylight.moment,
            _ => None,
        });
        let camera = &field.scene.camera;
        let (focal_mm, f_number) = (camera.focal_mm(), camera.f_number());
        Self { camera: camera.record(), focal_mm, f_number, moment }
    }

    /// Returns the EXIF block of an image.
    pub(super) fn exif(&self, photograph: &Photograph, bands: Bands, [_, _, width, height]: Crop) -> Vec<u8> {
        let mut main = Directory::default();
        main.add(0x010f, Value::Text("Furrow".into()));
        main.add(0x0110, Value::Text("simulated camera".into()));
        main.add(0x0112, Value::Short(1));
        main.add(0x0131, Value::Text(concat!("furrow ", env!("CARGO_PKG_VERSION")).into()));
        main.add(0x8769, Value::Directory(self.settings(photograph, bands, width, height)));
        if let Some(moment) = self.moment {
            main.add(0x8825, Value::Directory(place(moment)));
        }
        main.block()
    }

    fn settings(&self, photograph: &Photograph, bands: Bands, width: u32, height: u32) -> Directory {
        let (shot, band) = (&photograph.shot, bands.exposed());
        let sensitivity = BASE_SENSITIVITY * shot.analog_gain[band];
        let mut of = Directory::default();
        of.add_positive(0x829a, shot.time_s[band].into());
        of.add_positive(0x829d, self.f_number.unwrap_or(0.0).into());
        if sensitivity.is_finite() && sensitivity > 0.0 {
            // 65535 in the 16-bit tag refers to the 32-bit one.
            of.add(0x8827, Value::Short(sensitivity.round_to()));
            // Kind of sensitivity: recommended exposure index, which the maker defines.
            of.add(0x8830, Value::Short(2));
            of.add(0x8832, Value::Long(sensitivity.round_to()));
        }
        of.add(0x9000, Value::Raw(*b"0232"));
        if let Some(MomentRecord { utc, .. }) = self.moment {
            let ([year, month, day], [hour, minute, second]) = (utc.date(), utc.time());
            of.add(0x9003, Value::Text(format!("{year:04}:{month:02}:{day:02} {hour:02}:{minute:02}:{second:02}")));
            of.add(0x9011, Value::Text("+00:00".into()));
        }
        of.add_positive(0x9206, self.camera.aperture.as_ref().map_or(0.0, |aperture| aperture.focus_m).into());
        of.add_positive(0x920a, self.focal_mm.unwrap_or(0.0));
        // sRGB, or none.
        of.add(0xa001, Value::Short(if bands == Bands::Rgb { 1 } else { u16::MAX }));
        of.add(0xa002, Value::Long(width));
        of.add(0xa003, Value::Long(height));
        if let Some(pitch) = self.pitch_mm() {
            for (tag, pitch) in [(0xa20e, pitch[0]), (0xa20f, pitch[1])] {
                of.add_positive(tag, 10.0 / pitch);
            }
            // Centimetres.
            of.add(0xa210, Value::Short(3));
        }
        let in_film = FILM_MM * self.camera.fx_px / self.camera.width_px.to_f64();
        of.add(0xa405, Value::Short(in_film.round_to()));
        of
    }

    /// Returns the distance between pixels along x and y in millimetres.
    fn pitch_mm(&self) -> Option<[f64; 2]> {
        Some([self.camera.fx_px, self.camera.fy_px].map(|focal_px| self.focal_mm.unwrap_or(f64::NAN) / focal_px))
            .filter(|pitch| pitch.iter().all(|mm| mm.is_finite() && *mm > 0.0))
    }

    /// Returns the XMP packet of an image.
    pub(super) fn xmp(&self, photograph: &Photograph, bands: Bands, [left, top, ..]: Crop) -> String {
        let CameraRecord { cx_px, cy_px, k1, k2, k3, p1, p2, position_m, world_to_camera, lens, .. } = &self.camera;
        let mut attributes = String::new();
        let mut add = |name: &str, value: String| {
            let _ = write!(attributes, "\n    {name}=\"{value}\"");
        };
        // The model of the tags is Brown and Conrady's.
        let plain = lens.is_none();
        if let Some(pitch) = self.pitch_mm().filter(|_| plain) {
            let middle = [cx_px - left.to_f64(), cy_px - top.to_f64()];
            add("Camera:ModelType", "perspective".into());
            add("Camera:PerspectiveFocalLength", self.focal_mm.unwrap_or_default().to_string());
            add("Camera:PerspectiveFocalLengthUnits", "mm".into());
            add("Camera:PrincipalPoint", list(middle.iter().zip(pitch).map(|(px, mm)| px * mm)));
            add("Camera:PerspectiveDistortion", list([k1, k2, k3, p1, p2].into_iter().copied()));
        }
        add("furrow:PositionM", list(position_m.iter().copied()));
        add("furrow:WorldToCamera", list(world_to_camera.iter().flatten().copied()));
        add("furrow:AnalogGain", list(bands.indices().iter().map(|k| photograph.shot.analog_gain[*k])));
        add("furrow:ExposureTimeS", list(bands.indices().iter().map(|k| photograph.shot.time_s[*k])));
        let names: String = bands.names().iter().flat_map(|name| ["<rdf:li>", name, "</rdf:li>"]).collect();
        format!(
            "<?xpacket begin=\"\u{feff}\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>\n\
             <x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\n\
             <rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n\
             <rdf:Description rdf:about=\"\"\n    xmlns:Camera=\"http://pix4d.com/camera/1.0/\"\n    \
             xmlns:furrow=\"urn:furrow:image:1.0/\"{attributes}>\n\
             <Camera:BandName><rdf:Seq>{names}</rdf:Seq></Camera:BandName>\n\
             </rdf:Description>\n</rdf:RDF>\n</x:xmpmeta>\n<?xpacket end=\"r\"?>"
        )
    }
}

/// Returns numbers separated by commas.
fn list<T: ToString>(numbers: impl Iterator<Item = T>) -> String {
    numbers.map(|number| number.to_string()).collect::<Vec<_>>().join(",")
}

/// Returns the directory of place and time.
fn place(MomentRecord { latitude_deg, longitude_deg, utc }: MomentRecord) -> Directory {
    let side = |degrees: f64, names: [&str; 2]| Value::Text(names[usize::from(degrees < 0.0)].into());
    let [year, month, day] = utc.date();
    let mut of = Directory::default();
    of.add(0x00, Value::Bytes(vec![2, 3, 0, 0]));
    of.add(0x01, side(latitude_deg, ["N", "S"]));
    of.add(0x02, degrees(latitude_deg));
    of.add(0x03, side(longitude_deg, ["E", "W"]));
    of.add(0x04, degrees(longitude_deg));
    of.add(0x07, Value::Ratios(utc.time().iter().map(|part| part.to_f64()).collect()));
    of.add(0x12, Value::Text("WGS-84".into()));
    of.add(0x1d, Value::Text(format!("{year:04}:{month:02}:{day:02}")));
    of
}

/// Returns an angle as degrees, minutes and seconds, exact to a millionth of a second.
fn degrees(angle: f64) -> Value {
    let micros = (angle.abs() * 3600e6).round();
    let (whole, rest) = ((micros / 3600e6).floor(), micros.rem_euclid(3600e6));
    Value::Ratios(vec![whole, (rest / 60e6).floor(), rest.rem_euclid(60e6) / 1e6])
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToInt;
    use furrow_optics::light::Utc;
    use furrow_optics::sensor::ShotRecord;

    fn tags() -> CameraTags {
        let camera = CameraRecord {
            width_px: 1200,
            height_px: 800,
            fx_px: 4000.0,
            fy_px: 4000.0,
            cx_px: 610.0,
            cy_px: 400.0,
            k1: 0.125,
            k2: 0.0,
            p1: 0.0,
            p2: 0.0,
            k3: 0.0,
            lens: None,
            position_m: [0.5, -1.25, 2.0],
            world_to_camera: [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]],
            aperture: None,
            motion: None,
        };
        let utc = Utc::parse("2016-05-27T09:30:05Z").unwrap();
        let moment = Some(MomentRecord { latitude_deg: -50.51, longitude_deg: 7.0, utc });
        CameraTags { camera, focal_mm: Some(15.0), f_number: Some(4.0), moment }
    }

    fn photograph() -> Photograph {
        Photograph {
            width: 2,
            height: 1,
            rgb: vec![0; 6],
            nir: vec![0; 2],
            deep: None,
            gain: 1.0,
            nir_gain: 1.0,
            white_balance: [1.0; 3],
            shot: ShotRecord {
                time_s: [0.004, 0.004, 0.004, 0.01],
                analog_gain: [1.0, 1.0, 1.0, 2.5],
                full_scale_electrons: [8000.0; 4],
                saturated: [0.0; 4],
            },
        }
    }

    /// Returns the fractions at the offset of the entry with this tag, found by its bytes in the block.
    fn ratios(block: &[u8], tag: u16, count: u32) -> Vec<f64> {
        let entry = [&tag.to_le_bytes()[..], &[5, 0], &count.to_le_bytes()].concat();
        let at = block.windows(8).position(|eight| eight == entry).unwrap_or_else(|| panic!("no {tag:#x}")) + 8;
        let word = |at: usize| u32::from_le_bytes(block[at..at + 4].try_into().unwrap());
        let begin = word(at).to_usize();
        (0..count.to_usize()).map(|k| word(begin + 8 * k).to_f64() / word(begin + 8 * k + 4).to_f64()).collect()
    }

    /// Expected: the settings of each band as they were given; 50.51° is 50° 30′ 36″ south; the pitch is 15 mm / 4000.
    #[test]
    fn settings_are_those_of_the_camera() {
        let (tags, photograph) = (tags(), photograph());
        let block = tags.exif(&photograph, Bands::Rgb, [0, 0, 2, 1]);
        assert_eq!([0x829a, 0x829d, 0x920a].map(|tag| ratios(&block, tag, 1)[0]), [0.004, 4.0, 15.0]);
        assert!((ratios(&block, 0xa20e, 1)[0] - 10.0 * 4000.0 / 15.0).abs() < 1e-3);
        assert_eq!(ratios(&block, 2, 3), [50.0, 30.0, 36.0]);
        assert_eq!(ratios(&block, 7, 3), [9.0, 30.0, 5.0]);
        for text in ["S\0", "2016:05:27 09:30:05\0", "simulated camera\0", "0232"] {
            assert!(block.windows(text.len()).any(|of| of == text.as_bytes()), "{text}");
        }
        let nir = tags.exif(&photograph, Bands::Nir, [0, 0, 2, 1]);
        assert_eq!(ratios(&nir, 0x829a, 1), [0.01]);
        assert!(nir.windows(12).any(|entry| entry == [0x32, 0x88, 4, 0, 1, 0, 0, 0, 250, 0, 0, 0]), "gain 2.5");
    }

    /// Expected: bands, pose and gains; the principal point of a crop is relative to it, 10 px · 3.75 µm from its left edge.
    /// Without a focal length there are no millimetres, without place and time no GPS.
    #[test]
    fn what_is_not_known_is_left_out() {
        let (mut tags, photograph) = (tags(), photograph());
        let packet = tags.xmp(&photograph, Bands::Nir, [600, 0, 2, 1]);
        for text in [
            "<rdf:li>NIR</rdf:li>",
            "furrow:PositionM=\"0.5,-1.25,2\"",
            "furrow:AnalogGain=\"2.5\"",
            "PerspectiveFocalLength=\"15\"",
            "PrincipalPoint=\"0.0375,1.5\"",
            "PerspectiveDistortion=\"0.125,0,0,0,0\"",
        ] {
            assert!(packet.contains(text), "{text} is missing in {packet}");
        }
        (tags.focal_mm, tags.moment) = (None, None);
        assert!(!tags.xmp(&photograph, Bands::Rgb, [0, 0, 2, 1]).contains("Perspective"));
        let block = tags.exif(&photograph, Bands::Rgb, [0, 0, 2, 1]);
        assert!(
            [&b"WGS-84"[..], &[0x0a, 0x92, 5, 0], &[0x25, 0x88, 4, 0]]
                .iter()
                .all(|part| block.windows(part.len()).all(|of| of != *part))
        );
    }
}
