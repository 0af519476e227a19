//! OpenEXR environment maps: choice of part and channels, and placement of the pixels.
//!
//! Read are half, float and integer channels, scan lines in both orders, tiles (the finest level), and files of several
//! parts or layers. Pixels of the display window that the data window does not cover are black.

use super::exr_size;
use super::primaries::{Primaries, convert};
use super::texels::{Texels, check, is_equirectangular};
use exr::meta::MetaData;
use exr::meta::attribute::EnvironmentMap;
use exr::meta::header::Header;
use exr::prelude::{ReadChannels, ReadLayers, read};
use furrow_base::math::ToInt;
use std::collections::BTreeMap;
use std::io::Cursor;

/// Channels of a file that hold its colours.
#[derive(Debug, PartialEq)]
struct Choice {
    /// Index of the part.
    part: usize,
    /// Names of red, green and blue; thrice the same for grey.
    colors: [String; 3],
    /// Name of near infrared.
    nir: String,
}

/// Decodes a whole file. The error is a message.
pub(super) fn decode(bytes: &[u8]) -> Result<Texels, String> {
    exr_size::check(bytes)?;
    let wrong = |e: exr::error::Error| format!("it cannot be read: {e}");
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(wrong)?;
    let choice = choose(&meta.headers)?;
    let header = &meta.headers[choice.part];
    let window = Window::of(header)?;
    let primaries = header
        .shared_attributes
        .chromaticities
        .map(|c| Primaries([c.red, c.green, c.blue, c.white].map(|at| [f64::from(at.x()), f64::from(at.y())])));
    let matrix = primaries.map_or(Ok(None), Primaries::to_rec709)?;
    let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let image = reader.from_buffered(Cursor::new(bytes)).map_err(wrong)?;
    let layer = image.layer_data.get(choice.part).ok_or("it ends before its colours")?;
    let channel = |name: &str| {
        let found = layer.channel_data.list.iter().find(|channel| channel.name.to_string() == name)?;
        Some(window.placed(&found.sample_data.values_as_f32().collect::<Vec<f32>>()))
    };
    let [Some(r), Some(g), Some(b)] = choice.colors.each_ref().map(|name| channel(name)) else {
        return Err("it ends before its colours".into());
    };
    let mut rgb: Vec<[f32; 3]> = r.into_iter().zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect();
    if let Some(matrix) = matrix {
        convert(&mut rgb, matrix);
    }
    Ok(Texels { width: window.size.0, height: window.size.1, rgb, nir: channel(&choice.nir) })
}

/// Chooses the colours: R, G, B without a layer's name, or of the only layer that has them, or luminance Y.
fn choose(headers: &[Header]) -> Result<Choice, String> {
    let mut layers: BTreeMap<(String, usize), Vec<String>> = BTreeMap::new();
    for (part, header) in headers.iter().enumerate() {
        for channel in &header.channels.list {
            let name = channel.name.to_string();
            let (layer, channel) = name.rsplit_once('.').unwrap_or(("", &name));
            layers.entry((layer.to_owned(), part)).or_default().push(channel.to_owned());
        }
    }
    let with = |wanted: &[&str]| {
        let all = move |has: &Vec<String>| wanted.iter().all(|w| has.iter().any(|h| h == w));
        layers.iter().filter(move |(_, has)| all(has)).map(|(at, _)| at).collect::<Vec<_>>()
    };
    let plain = |found: &[&(String, usize)]| found.iter().find(|(layer, _)| layer.is_empty()).map(|(_, part)| *part);
    let (colors, grey) = (with(&["R", "G", "B"]), with(&["Y"]));
    let ((layer, part), names) = if let Some(part) = plain(&colors) {
        (("", part), ["R", "G", "B"])
    } else if let [(layer, part)] = &colors[..] {
        ((layer.as_str(), *part), ["R", "G", "B"])
    } else if !colors.is_empty() {
        let names: Vec<String> = colors.iter().map(|(layer, _)| format!("`{layer}`")).collect();
        return Err(format!("several of its layers have channels R, G and B: {}; save one alone", names.join(", ")));
    } else if let Some(part) = plain(&grey) {
        if with(&["RY"]).iter().chain(&with(&["BY"])).any(|(_, at)| *at == part) {
            return Err("it stores luminance and chroma (Y, RY, BY); save it with channels R, G and B".into());
        }
        if with(&["X", "Z"]).iter().any(|(_, at)| *at == part) {
            return Err("it stores CIE XYZ (channels X, Y and Z); save it with channels R, G and B".into());
        }
        (("", part), ["Y"; 3])
    } else {
        return Err("it has no channels R, G and B".into());
    };
    let header = &headers[part];
    if header.deep {
        return Err("it holds deep samples; flatten it".into());
    }
    let full = |name: &str| if layer.is_empty() { name.to_owned() } else { format!("{layer}.{name}") };
    let choice = Choice { part, colors: names.map(full), nir: full("NIR") };
    let used = |name: &String| choice.colors.contains(name) || *name == choice.nir;
    let coarse = header.channels.list.iter().find(|c| c.sampling != exr::math::Vec2(1, 1) && used(&c.name.to_string()));
    if let Some(channel) = coarse {
        return Err(format!("its channel {} is subsampled; save it at full resolution", channel.name));
    }
    if header.own_attributes.environment_map == Some(EnvironmentMap::Cube) {
        return Err("it is a cube map; save it as latitude and longitude".into());
    }
    Ok(choice)
}

/// Rectangle of the pixels that are kept, and the position of the stored ones in it.
struct Window {
    /// Width and height.
    size: (usize, usize),
    /// Column and row of the first stored pixel; negative outside.
    first: (i64, i64),
    /// Width and height of the stored pixels.
    stored: (usize, usize),
}

impl Window {
    fn of(header: &Header) -> Result<Self, String> {
        let (display, at) = (header.shared_attributes.display_window, header.own_attributes.layer_position);
        let stored = (header.layer_size.0, header.layer_size.1);
        let first = |k: fn(exr::math::Vec2<i32>) -> i32| i64::from(k(at)) - i64::from(k(display.position));
        let mut window =
            Self { size: (display.size.0, display.size.1), first: (first(|v| v.0), first(|v| v.1)), stored };
        // Some writers leave another image's display window.
        if !is_equirectangular(window.size.0, window.size.1) && is_equirectangular(stored.0, stored.1) {
            window = Self { size: stored, first: (0, 0), stored };
        }
        check(window.size.0, window.size.1)?;
        let beside = |first: i64, stored: usize, size: usize| first >= size.to_i64() || first + stored.to_i64() <= 0;
        if beside(window.first.0, stored.0, window.size.0) || beside(window.first.1, stored.1, window.size.1) {
            return Err("its data window lies outside its display window".into());
        }
        Ok(window)
    }

    /// Returns the kept pixels of a channel, 0 where none is stored.
    fn placed(&self, values: &[f32]) -> Vec<f32> {
        if self.first == (0, 0) && self.stored == self.size {
            return values.to_vec();
        }
        let mut all = vec![0.0; self.size.0 * self.size.1];
        let clip = |first: i64, stored: usize, size: usize| {
            first.max(0).to_usize()..(first + stored.to_i64()).clamp(0, size.to_i64()).to_usize()
        };
        let columns = clip(self.first.0, self.stored.0, self.size.0);
        for y in clip(self.first.1, self.stored.1, self.size.1) {
            let row = (y.to_i64() - self.first.1).to_usize() * self.stored.0;
            let from = row + (columns.start.to_i64() - self.first.0).to_usize();
            all[y * self.size.0..][columns.clone()].copy_from_slice(&values[from..from + columns.len()]);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::meta::attribute::Chromaticities;
    use exr::prelude::*;
    use furrow_base::math::ToFloat;

    /// Returns a file of one layer that covers `data` (x, y, width, height) of a display window of `display`.
    fn file(channels: &[(&str, f32)], [x, y, w, h]: [i32; 4], display: (usize, usize), encoding: Encoding) -> Vec<u8> {
        let size = (w.to_usize(), h.to_usize());
        // Values count up from the first pixel.
        let values = |first: f32| (0..size.0 * size.1).map(|k| first + k.to_f32()).collect();
        let list = channels.iter().map(|(name, first)| AnyChannel::new(*name, FlatSamples::F32(values(*first))));
        let attributes = LayerAttributes { layer_position: Vec2(x, y), ..LayerAttributes::default() };
        let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(list.collect()));
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(display));
        let image = Image::from_layers(attributes, vec![layer]);
        written(&image)
    }

    fn written(image: &Image<Layers<AnyChannels<FlatSamples>>>) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write().non_parallel().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    const RGB: [(&str, f32); 3] = [("R", 1.0), ("G", 1.0), ("B", 1.0)];

    /// Expected: red of each pixel, row by row. A window without the display window's shape is replaced by the data window.
    #[test]
    fn the_data_window_is_placed_in_the_display_window() {
        let red = |data, display| {
            let of = decode(&file(&RGB, data, display, Encoding::UNCOMPRESSED))?;
            Ok::<_, String>(((of.width, of.height), of.rgb.iter().map(|c| c[0]).collect::<Vec<_>>()))
        };
        assert_eq!(red([0, 0, 2, 1], (2, 1)), Ok(((2, 1), vec![1.0, 2.0])));
        assert_eq!(red([2, 1, 2, 1], (4, 2)), Ok(((4, 2), vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0])));
        assert_eq!(red([-1, -1, 3, 3], (2, 1)), Ok(((2, 1), vec![5.0, 6.0])));
        assert_eq!(red([0, 0, 2, 1], (3, 3)), Ok(((2, 1), vec![1.0, 2.0])));
        assert!(red([4, 0, 2, 1], (4, 2)).is_err_and(|what| what.contains("outside its display window")));
        assert!(red([0, 0, 1, 1], (3, 3)).is_err_and(|what| what.contains("twice as wide as high")));
    }

    #[test]
    fn tiles_and_line_orders_give_the_same_pixels() {
        let tiled = Encoding { blocks: Blocks::Tiles(Vec2(3, 2)), ..Encoding::UNCOMPRESSED };
        let down = Encoding { line_order: LineOrder::Decreasing, ..Encoding::SMALL_FAST_LOSSLESS };
        for encoding in [Encoding::UNCOMPRESSED, tiled, down] {
            let of = decode(&file(&RGB, [0, 0, 8, 4], (8, 4), encoding)).unwrap();
            let expected: Vec<f32> = (1..=32).map(ToFloat::to_f32).collect();
            assert_eq!(of.rgb.iter().map(|c| c[0]).collect::<Vec<_>>(), expected, "{encoding:?}");
        }
    }

    #[test]
    fn colours_are_found_by_name_or_refused_by_name() {
        let found = |channels: &[(&str, f32)]| {
            decode(&file(channels, [0, 0, 2, 1], (2, 1), Encoding::UNCOMPRESSED)).map(|of| (of.rgb[0], of.nir))
        };
        let layer = |layer: &str| ["R", "G", "B", "NIR"].map(|name| format!("{layer}.{name}"));
        let [one, other] = [layer("View.Combined"), layer("Noise")];
        let four = |names: &[String; 4]| (0..4).map(|k| (names[k].clone(), k.to_f32())).collect::<Vec<_>>();
        let named =
            |all: &[(String, f32)]| found(&all.iter().map(|(name, first)| (name.as_str(), *first)).collect::<Vec<_>>());
        assert_eq!(named(&four(&one)), Ok(([0.0, 1.0, 2.0], Some(vec![3.0, 4.0]))));
        let xyz = found(&[("X", 1.0), ("Y", 1.0), ("Z", 1.0)]);
        assert!(xyz.is_err_and(|what| what.contains("CIE XYZ")));
        let both = named(&[four(&one), four(&other)].concat());
        assert!(both.is_err_and(|what| what.contains("`Noise`, `View.Combined`")));
        assert_eq!(found(&[("Y", 4.0)]), Ok(([4.0; 3], None)));
        for (channels, words) in [
            (&[("Y", 4.0), ("RY", 0.0), ("BY", 0.0)][..], "luminance and chroma"),
            (&[("Z", 4.0)], "no channels R, G and B"),
        ] {
            assert!(found(channels).is_err_and(|what| what.contains(words)), "{words}");
        }
    }

    /// Expected: the first part without a layer's name is read, whatever the parts before it hold; a cube map is
    /// refused; other primaries are converted.
    #[test]
    fn parts_cubes_and_primaries() {
        let layer = |name: &str, prefix: &str, value: f32| {
            let list = ["R", "G", "B"]
                .map(|c| AnyChannel::new(format!("{prefix}{c}").as_str(), FlatSamples::F32(vec![value; 2])));
            Layer::new(
                (2, 1),
                LayerAttributes::named(name),
                Encoding::UNCOMPRESSED,
                AnyChannels::sort(list.into_iter().collect()),
            )
        };
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions((2, 1)));
        let parts = Image::from_layers(attributes.clone(), vec![layer("a", "noise.", 1.0), layer("b", "", 2.0)]);
        assert_eq!(decode(&written(&parts)).unwrap().rgb, [[2.0; 3]; 2]);
        let mut cube = layer("a", "", 1.0);
        cube.attributes.environment_map = Some(EnvironmentMap::Cube);
        let cube = Image::from_layers(attributes.clone(), vec![cube]);
        assert!(decode(&written(&cube)).is_err_and(|what| what.contains("cube map")));
        let mut wide = Image::from_layers(attributes, vec![layer("a", "", 1.0)]);
        wide.layer_data[0].channel_data.list[0].sample_data = FlatSamples::F32(vec![0.0; 2]);
        let at = |x, y| Vec2(x, y);
        // Rec. 2020: yellow has more red and less blue than Rec. 709 can show.
        wide.attributes.chromaticities = Some(Chromaticities {
            red: at(0.708, 0.292),
            green: at(0.17, 0.797),
            blue: at(0.131, 0.046),
            white: at(0.3127, 0.329),
        });
        let [r, g, b] = decode(&written(&wide)).unwrap().rgb[0];
        assert!((r - 1.0728).abs() < 2e-3 && (g - 1.0083).abs() < 2e-3 && (b + 0.1187).abs() < 2e-3, "{r} {g} {b}");
    }
}
