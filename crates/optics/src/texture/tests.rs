//! Tests of the runtime textures.

use super::*;
use furrow_base::error::Kind;
use furrow_base::math::{ToFloat, ToInt, vec2};

/// Returns a green disc on transparent black with an odd size.
fn disc() -> Texture {
    let (w, h) = (101u32, 67u32);
    let rgba: Vec<u8> = (0..w * h)
        .flat_map(|i| {
            let (x, y) = ((i % w).to_f32() - 50.0, (i / w).to_f32() - 33.0);
            if x.hypot(y) < 25.0 { [40, 120, 20, 255] } else { [0, 0, 0, 0] }
        })
        .collect();
    Texture::from_rgba8(w, h, &rgba, ColorSpace::Srgb)
}

#[test]
fn colour_bleeds_into_what_is_transparent() {
    let t = disc();
    let centre = t.sample(vec2(0.5, 0.5), 0.0);
    for lod in [0.0, 1.0, 2.0, 4.0, 9.0] {
        for i in 0..50 {
            let c = t.sample(vec2(0.02 * i.to_f32(), 0.31), lod);
            for k in 0..3 {
                // Within one 8-bit code: there is no dark fringe.
                assert!((c[k] - centre[k]).abs() < 0.004, "{lod} {i}: {c:?} {centre:?}");
            }
        }
    }
}

#[test]
fn every_level_keeps_the_mean() {
    let t = disc();
    let mean = |level: &Level<[u8; 4]>| {
        let sum: u64 = (0..level.height)
            .flat_map(|y| (0..level.width).map(move |x| (x, y)))
            .map(|(x, y)| u64::from(level.get(x, y)[3]))
            .sum();
        sum.to_f64() / f64::from(level.width * level.height)
    };
    let first = mean(&t.pyramid.levels[0]);
    for level in &t.pyramid.levels {
        assert!((mean(level) - first).abs() < 0.75, "{} wide: {} for {first}", level.width, mean(level));
    }
    assert_eq!(t.pyramid.levels.last().map(|l| (l.width, l.height)), Some((1, 1)));
}

#[test]
fn the_mask_is_where_alpha_is_at_least_half() {
    let mask = disc().alpha_mask().unwrap();
    assert!(mask.opaque_at(vec2(0.5, 0.5)) && !mask.opaque_at(vec2(0.05, 0.5)));
    assert!(Texture::from_rgba8(1, 1, &[9, 9, 9, 200], ColorSpace::Srgb).alpha_mask().is_none());
}

#[test]
fn sampling_is_exact_at_texel_centres_and_wraps() {
    let rgba = [0, 0, 0, 255, 255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255];
    let t = Texture::from_rgba8(2, 2, &rgba, ColorSpace::Linear);
    assert_eq!(t.sample(vec2(0.75, 0.25), 0.0), [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(t.sample(vec2(0.25, 0.75), 0.0), [0.0, 1.0, 0.0, 1.0]);
    assert_eq!(t.sample(vec2(7.0, 0.25), 0.0), [1.0, 0.0, 0.0, 1.0]);
    let t = t.wrapped(Wrap::Repeat);
    assert_eq!(t.sample(vec2(0.0, 0.25), 0.0), [0.5, 0.0, 0.0, 1.0]);
    assert_eq!(t.sample(vec2(-5.25, 3.25), 0.0), [1.0, 0.0, 0.0, 1.0]);
    let t = t.wrapped_by([Wrap::Mirror, Wrap::Clamp]);
    for (u, red) in [(0.0, 0.0), (1.0, 1.0), (1.25, 1.0), (1.75, 0.0), (-0.25, 0.0), (-0.75, 1.0), (2.75, 1.0)] {
        assert_eq!(t.sample(vec2(u, -3.0), 0.0)[0], red, "{u}");
    }
    for odd in [f32::NAN, f32::INFINITY, f32::MIN, f32::MAX] {
        let c = t.sample(vec2(odd, odd), odd);
        assert!(c[3].is_nan() || (0.0..=1.001).contains(&c[3]), "{odd}: {c:?}");
    }
}

#[test]
fn a_missing_or_broken_image_says_so() {
    let missing = Texture::load(Path::new("textures/nowhere.png"), ColorSpace::Srgb).unwrap_err();
    assert!(missing.to_string().contains("no such image"), "{missing}");
    let page = Texture::load(Path::new("Cargo.toml"), ColorSpace::Srgb).unwrap_err();
    assert!(page.to_string().contains("not an image"), "{page}");
    assert_eq!(page.exit_code(), 2);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.png");
    std::fs::write(&path, [0x89, b'P', b'N', b'G', 13, 10, 26, 10, 0, 0]).unwrap();
    let error = Texture::load(&path, ColorSpace::Srgb).unwrap_err();
    assert_eq!(error.kind(), Kind::Input);
    assert_eq!(error.place().map(|place| &place.file), Some(&path));
}

/// Returns a hill of height 0.1 in the middle of a wide image.
fn hill(wrap: Wrap) -> Height {
    let (w, h) = (96u32, 64u32);
    let values = (0..w * h)
        .map(|i| {
            let (x, y) = (((i % w).to_f32() + 0.5 - 48.0) / 64.0, ((i / w).to_f32() + 0.5 - 32.0) / 64.0);
            0.1 * (-(x * x + y * y) * 40.0).exp()
        })
        .collect();
    Height::from_values(w, h, values).wrapped(wrap)
}

#[test]
fn slopes_are_those_of_the_hill() {
    let maps = Maps::from_height(hill(Wrap::Repeat));
    // On the hill's right flank, 0.1 image lengths from its top: x = 48 + 6.4 texels of 96.
    let uv = vec2(54.4 / 96.0, 0.5);
    let expected = -80.0 * 0.1 * 0.1 * (-40.0f32 * 0.01).exp();
    let s = maps.normal.sample(uv, 0.0);
    assert!((s.x - expected).abs() < 0.02 * expected.abs() && s.y.abs() < 1e-3, "{s} for {expected}");
    let direct = maps.height.slope(uv);
    assert!((direct.x - expected).abs() < 0.05 * expected.abs(), "{direct} for {expected}");
    // Above its top the hill falls towards the top of the image: up is −v.
    assert!(maps.normal.sample(vec2(0.5, 0.4), 0.0).y < -0.3);
    assert!((maps.height.at(vec2(0.5, 0.5)) - 0.1).abs() < 1e-3);
}

#[test]
fn a_pit_sees_less_sky_than_a_plain() {
    let maps = Maps::from_height(hill(Wrap::Clamp).scaled(-1.0));
    // From the bottom the steepest view of the rim rises by 0.4, so 1/(1 + 0.16) of the sky is visible.
    let bottom = maps.occlusion.sample(vec2(0.5, 0.5), 0.0);
    assert!((bottom - 0.86).abs() < 0.05, "{bottom}");
    assert!(maps.occlusion.sample(vec2(0.02, 0.02), 0.0) > 0.99);
}

/// Rationale: a photographed leaf has no relief of its own. Expected: its bright midrib becomes a furrow.
#[test]
fn a_pale_vein_is_impressed() {
    let (w, h) = (64u32, 128u32);
    let rgba: Vec<u8> = (0..w * h)
        .flat_map(|i| if (30..34).contains(&(i % w)) { [150, 170, 110, 255] } else { [50, 90, 30, 255] })
        .collect();
    let maps = Maps::derive(&Texture::from_rgba8(w, h, &rgba, ColorSpace::Srgb), &HeightFromBrightness::LEAF);
    assert!(maps.height.at(vec2(0.5, 0.5)) < maps.height.at(vec2(0.3, 0.5)) - 0.001);
    assert!(maps.normal.sample(vec2(0.46, 0.5), 0.0).x < -0.05);
}

#[test]
fn maps_take_no_longer_for_coarse_features_than_for_fine_ones() {
    let rgba: Vec<u8> = (0..1024u32 * 1024).flat_map(|i| [(i % 251).to_u8(), (i % 13).to_u8() * 9, 40, 255]).collect();
    let texture = Texture::from_rgba8(1024, 1024, &rgba, ColorSpace::Srgb);
    let derive = |coarsest: f32| {
        let start = std::time::Instant::now();
        let maps = Maps::derive(&texture, &HeightFromBrightness { coarsest, ..HeightFromBrightness::LEAF });
        (start.elapsed(), maps)
    };
    // Blurs of radius 3 and 26 texels; if the cost grew with the radius, the second would take many times as long. The
    // shortest of three alternating runs each, because the machine may be busy.
    let shortest = |coarsest: f32, so_far: std::time::Duration| so_far.min(derive(coarsest).0);
    let most = std::time::Duration::MAX;
    let [fine, coarse] = (0..3).fold([most; 2], |[fine, coarse], _| {
        [shortest(0.006, fine), shortest(HeightFromBrightness::LEAF.coarsest, coarse)]
    });
    assert!(coarse < 2 * fine, "{coarse:?} and {fine:?}");
    let maps = derive(HeightFromBrightness::LEAF.coarsest).1;
    assert!(maps.height.values().iter().all(|h| h.abs() <= 0.002));
}

/// Rationale: the decoder would clip linear values to bytes and take them for sRGB.
#[test]
fn a_radiance_image_is_no_texture() {
    let mut bytes = b"#?RADIANCE\n\n-Y 1 +X 1\n".to_vec();
    bytes.extend([128, 128, 128, 129]);
    let what = Texture::decode(&bytes, ColorSpace::Srgb).unwrap_err();
    assert!(what.contains("Radiance HDR picture; PNG and JPEG"), "{what}");
}
