//! The textures that ship with the program.
//!
//! After a change of the texture generator, `cargo test --features system-tests --test system textures::redraw -- --ignored` generates all of them
//! again; with `ONLY=beet` before it, only those whose path contains the word.

use furrow_base::geometry::outline::Outline;
use furrow_base::math::vec2;
use furrow_optics::texture::draw::{self, GeneratedTexture, Margin, Recipe};
use furrow_optics::texture::{ColorSpace, Height, Texture, Wrap};
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn recipes(kind: &str) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = std::fs::read_dir(root().join("textures").join(kind))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "ron"))
        .collect();
    found.sort();
    assert!(!found.is_empty());
    found
}

fn all() -> Vec<PathBuf> {
    [recipes("leaf"), recipes("soil")].concat()
}

fn text_of(png_file: &Path) -> String {
    String::from_utf8_lossy(&std::fs::read(png_file).unwrap()[..600]).into_owned()
}

#[test]
#[ignore = "writes into the working tree; run it after changing the texture generator"]
fn redraw() {
    let only = std::env::var("ONLY").unwrap_or_default();
    for recipe in all() {
        if recipe.to_string_lossy().contains(&only) {
            draw::write(&recipe).unwrap();
        }
    }
}

/// Rationale: an image that its recipe no longer generates has a false provenance. Expected: a copy of the recipe in
/// another folder generates the same bytes, relief included.
#[test]
fn every_image_is_what_its_recipe_draws() {
    let check = |recipe: &Path| {
        let folder = tempfile::tempdir().unwrap();
        let copy = folder.path().join(recipe.file_name().unwrap());
        std::fs::copy(recipe, &copy).unwrap();
        for drawn in draw::write(&copy).unwrap() {
            let committed = recipe.with_file_name(drawn.file_name().unwrap());
            if drawn.extension().is_some_and(|e| e == "png") {
                let same = std::fs::read(&drawn).unwrap() == std::fs::read(&committed).unwrap_or_default();
                assert!(
                    same,
                    "{} differs from its recipe's output; see the documentation of this module",
                    committed.display()
                );
            }
        }
    };
    let recipes = all();
    std::thread::scope(|scope| {
        let halves = [0, 1].map(|k| {
            let recipes = &recipes;
            scope.spawn(move || recipes.iter().skip(k).step_by(2).for_each(|r| check(r)))
        });
        for half in halves {
            half.join().unwrap();
        }
    });
}

#[test]
fn every_texture_says_where_it_comes_from() {
    let source = std::fs::read_to_string(root().join("textures/SOURCE.md")).unwrap();
    let mut bytes = 0;
    for folder in ["leaf", "soil"] {
        for entry in std::fs::read_dir(root().join("textures").join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "ron") {
                continue;
            }
            let file = path.file_name().unwrap().to_string_lossy().into_owned();
            let name = file.split('.').next().unwrap().to_owned();
            assert!(source.contains(&format!("`{name}`")), "{file} is not in SOURCE.md");
            let text = text_of(&path);
            assert!(text.contains("Source") && text.contains("License"), "{file} has no Source and License text");
            let size = std::fs::metadata(&path).unwrap().len();
            assert!(size < 2_900_000, "{file}: {size} bytes");
            bytes += size;
        }
    }
    assert!(bytes < 24_000_000, "{bytes} bytes of textures");
}

#[test]
fn a_texture_drawn_elsewhere_gets_its_source_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let recipe = folder.path().join("näh 茎.ron");
    std::fs::write(&recipe, "Soil(seed: 1, size: 32, period_mm: 60, ground: Dirt)").unwrap();
    let written = draw::write(&recipe).unwrap();
    assert_eq!(written.len(), 3);
    assert!(written.iter().all(|p| p.exists()));
    assert!(std::fs::read_to_string(&written[2]).unwrap().contains("CC0"));
}

fn leaf(path: &Path) -> (draw::LeafRecipe, Texture) {
    match draw::read(path).unwrap() {
        Recipe::Leaf(recipe) => (*recipe, Texture::load(&path.with_extension("png"), ColorSpace::Srgb).unwrap()),
        Recipe::Soil(_) => panic!("{} is not a leaf", path.display()),
    }
}

/// Rationale: the renderer uses texels as reflectances. Expected: the mean of every leaf is in the range of measured
/// leaves, and green is the strongest band. Source: LOPEX93 band means of tomato, soybean, maize, lettuce and bindweed:
/// R 0.053–0.114, G 0.09–0.14, B 0.05–0.08 of the camera, whose red band reaches further into the dark red and whose
/// blue band is wider than the eye's. By the leaf model, R of 0.053–0.114 is 0.052–0.132 in the bands of textures.
#[test]
fn leaves_reflect_what_leaves_reflect() {
    for path in recipes("leaf") {
        let (_, texture) = leaf(&path);
        let (mut sum, mut weight, mut largest) = ([0.0f64; 3], 0.0, 0.0f32);
        for y in 0..texture.height() {
            for x in 0..texture.width() {
                let c = texture.texel(x, y);
                for k in 0..3 {
                    sum[k] += f64::from(c[k] * c[3]);
                }
                largest = if c[3] > 0.0 { largest.max(c[1]) } else { largest };
                weight += f64::from(c[3]);
            }
        }
        let [r, g, b] = sum.map(|s| s / weight);
        let ok = (0.05..0.132).contains(&r) && (0.08..0.20).contains(&g) && (0.02..0.10).contains(&b) && g > 1.15 * r;
        assert!(ok && largest < 0.6, "{}: {r:.3} {g:.3} {b:.3}, at most {largest}", path.display());
    }
}

/// Rationale: the mesh of an entire leaf is its outline, so alpha must not cut into it. Expected: the opaque area
/// equals the outline, or is up to two pixels larger on all sides; teeth and lobes only remove area.
#[test]
fn opacity_follows_the_outline() {
    for path in recipes("leaf") {
        let (recipe, texture) = leaf(&path);
        let mask = texture.alpha_mask().unwrap();
        let (w, h) = mask.size();
        let area =
            (0..h as i32).flat_map(|y| (0..w as i32).map(move |x| (x, y))).filter(|(x, y)| mask.texel(*x, *y)).count();
        let share = area as f32 / (w * h) as f32 * 1.08 * 1.08;
        let n = 2000;
        let outline =
            (0..n).map(|i| 2.0 * recipe.outline.half_width((i as f32 + 0.5) / n as f32)).sum::<f32>() / n as f32;
        let rim = 2.0 * 2.8 * (1.0 / w as f32 + 1.0 / h as f32);
        let name = path.display();
        match recipe.margin {
            Margin::Entire if recipe.notch.is_none() && recipe.sinus.is_none() => {
                assert!(share > outline && share < outline + rim, "{name}: {share} for {outline}");
            }
            Margin::Entire | Margin::Toothed { .. } | Margin::Spined { .. } => {
                assert!(share < outline * 1.01 && share > 0.75 * outline, "{name}: {share} for {outline}");
            }
            Margin::Lobed(_) | Margin::Lyrate(_) => assert!((0.25..0.85).contains(&share), "{name}: {share}"),
        }
        // Every point on the margin of an entire leaf's mesh is opaque.
        let uncut = recipe.notch.is_none() && recipe.sinus.is_none();
        if let (Outline::Power { .. }, Margin::Entire, true) = (recipe.outline, recipe.margin, uncut) {
            for i in 1..200 {
                let t = i as f32 / 200.0;
                for side in [-1.0, 1.0] {
                    let uv = furrow_base::geometry::outline::uv(side * recipe.outline.half_width(t), t);
                    assert!(mask.opaque_at(uv), "{name}: the margin at {t}");
                }
            }
        }
    }
}

fn soil(path: &Path) -> (draw::SoilRecipe, Texture, Height) {
    let Recipe::Soil(recipe) = draw::read(path).unwrap() else { panic!("{} is not a soil", path.display()) };
    let colour = Texture::load(&path.with_extension("png"), ColorSpace::Srgb).unwrap().wrapped(Wrap::Repeat);
    let height = Height::load(&path.with_extension("height.png"), recipe.range_mm.f32()).unwrap();
    (recipe, colour, height.wrapped(Wrap::Repeat))
}

/// Expected: colour and height steps across the tile's edge are no larger than within the tile.
#[test]
fn ground_tiles() {
    for path in recipes("soil") {
        let (_, colour, height) = soil(&path);
        let n = colour.width();
        let values = height.values();
        let at = |x: u32, y: u32| values[(y % n * n + x % n) as usize];
        let green = |x: u32, y: u32| colour.texel(x % n, y % n)[1];
        let step =
            |f: &dyn Fn(u32, u32) -> f32, x: u32| (0..n).map(|y| (f(x, y) - f(x + 1, y)).abs()).sum::<f32>() / n as f32;
        let fall =
            |f: &dyn Fn(u32, u32) -> f32, y: u32| (0..n).map(|x| (f(x, y) - f(x, y + 1)).abs()).sum::<f32>() / n as f32;
        for f in [&at as &dyn Fn(u32, u32) -> f32, &green] {
            let inside = |g: &dyn Fn(u32) -> f32| (0..32).map(|k| g(k * 31 + 7)).fold(0.0, f32::max);
            let (across, down) = (step(f, n - 1), fall(f, n - 1));
            assert!(across < 1.25 * inside(&|x| step(f, x)), "{}: {across}", path.display());
            assert!(down < 1.25 * inside(&|y| fall(f, y)), "{}: {down}", path.display());
        }
    }
}

#[test]
fn ground_has_the_colour_that_its_recipe_states() {
    for path in recipes("soil") {
        let (recipe, colour, height) = soil(&path);
        // The coarsest mip level is the mean.
        let mean = colour.sample(vec2(0.5, 0.5), 20.0);
        for k in 0..3 {
            let stated = recipe.albedo[k].f32();
            assert!((mean[k] / stated - 1.0).abs() < 0.12, "{}: {mean:?}", path.display());
        }
        let top = height.values().iter().copied().fold(0.0, f32::max);
        assert!(top < recipe.range_mm.f32() * 0.999, "{}: the relief is clipped", path.display());
        assert!(colour.alpha_mask().is_none());
    }
}

#[test]
fn what_cannot_be_drawn_is_refused_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.ron");
    for (page, words) in [
        ("Soil(seed: 1, size: 9000, period_mm: 60, ground: Dirt)", "at most 4096"),
        (
            "Soil(seed: 1, size: 32, period_mm: 60, crumbs: (smallest_mm: 9, largest_mm: 2), ground: Dirt)",
            "below the largest",
        ),
        ("Soil(seed: 1, size: 32, period_mm: 60, ground: Mud)", "Mud"),
        ("Soil(seed: 1, size: 32, period_mm: 90000, ground: Dirt)", "crumbs on the tile"),
        (
            "Leaf(seed: 1, size: 64, length_mm: 9, aspect: 0.5, outline: Power(a: 0, b: 1), veins: Parallel(count: 3, midrib: 0.1), pigments: ())",
            "at least 0.001 and below 20",
        ),
        (
            "Leaf(seed: 1, size: 64, length_mm: 9, aspect: 500, outline: Full, veins: Parallel(count: 3, midrib: 0.1), pigments: ())",
            "at most 4096",
        ),
        (
            "Leaf(seed: 1, size: 64, length_mm: 9, aspect: 0.5, outline: Full, margin: Lobed(pairs: 3, rachis: 0.1, terminal: 0.2, terminal_width: 0.3, lean_deg: 86, pointed: 1, teeth: (0, 0)), veins: Parallel(count: 3, midrib: 0.1), pigments: ())",
            "between 0 and 85 degrees",
        ),
        (
            "Leaf(seed: 1, size: 64, length_mm: 3e9, aspect: 0.5, outline: Full, veins: Parallel(count: 3, midrib: 0.1), pigments: ())",
            "at most 100000",
        ),
        (
            "Leaf(seed: 1, size: 64, length_mm: 9, aspect: 0.5, outline: Full, veins: Parallel(count: 3, midrib: 0.1), pigments: (), look: (areoles: (0.00000001, 0.14)))",
            "areoles along the blade: at most 100000",
        ),
        (
            "Leaf(seed: 1, size: 64, length_mm: 9, aspect: 0.5, outline: Full, margin: Lyrate(terminal: 0.3, outline: (1, 1), pairs: 60, lobe: 1, rachis: 0.1, teeth: (3, 0.1), lobe_teeth: (8, 0.1)), veins: Parallel(count: 3, midrib: 0.1), pigments: ())",
            "60 pairs of lobes with that many teeth: at most 11",
        ),
        ("Soil(seed: 1, size: 32, period_mm: 1e12, crumbs: (cover: 0), ground: Dirt)", "at most 100000"),
        (
            "Soil(seed: 1, size: 32, period_mm: 120, ground: Stony(cover: 1, smallest_mm: 0.001, largest_mm: 0.1))",
            "stones on the tile",
        ),
    ] {
        std::fs::write(&path, page).unwrap();
        let message = draw::write(&path).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
        assert!(message.starts_with(&path.display().to_string()), "no path in: {message}");
    }
}

/// Rationale: a recipe whose name does not end in .ron was overwritten by its image. Expected: it is refused, as is a
/// recipe whose image, relief or text file would replace a folder; no file is written then.
#[test]
fn nothing_is_drawn_where_it_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let page = "Soil(seed: 1, size: 32, period_mm: 60, ground: Dirt)";
    let recipe = folder.path().join("y.png");
    std::fs::write(&recipe, page).unwrap();
    let error = draw::write(&recipe).unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().contains("y.png: the name of a texture recipe"), "{error}");
    assert_eq!(std::fs::read_to_string(&recipe).unwrap(), page);
    let recipe = folder.path().join("a.ron");
    std::fs::write(&recipe, page).unwrap();
    for name in ["a.png", "a.height.png", "a.source.md"] {
        let taken = folder.path().join(name);
        std::fs::create_dir(&taken).unwrap();
        let error = draw::write(&recipe).unwrap_err();
        assert!(
            error.exit_code() == 2 && error.to_string().contains(&format!("{name}: this is not a file")),
            "{error}"
        );
        std::fs::remove_dir(&taken).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "{name}: files were written");
    }
}

/// Rationale: extreme recipes must terminate without a hang or panic.
#[test]
fn odd_leaves_are_drawn_too() {
    for aspect in ["0.01", "0.5", "3"] {
        for (outline, rest) in [
            ("Power(a: 0.1, b: 5)", "veins: Pinnate(pairs: 9, angle_deg: 170, midrib: 0.3, fine: 40)"),
            (
                "Full",
                "margin: Lyrate(terminal: 0, outline: (9, 0.1), pairs: 9, lobe: 1, rachis: 0, teeth: (90, 1)), veins: Pinnate(pairs: 3, angle_deg: 90, midrib: 0, fine: 30)",
            ),
            (
                "Full",
                "margin: Lobed(pairs: 12, rachis: 0, terminal: 0.01, terminal_width: 0, lean_deg: 85, pointed: 1, teeth: (8, 1)), veins: Pinnate(pairs: 0, angle_deg: 0, midrib: 0, fine: 30)",
            ),
            (
                "Power(a: 1, b: 1)",
                "margin: Toothed(count: 60, depth: 1), notch: Some(1), veins: Parallel(count: 40, midrib: 1)",
            ),
        ] {
            let page = format!(
                "#![enable(unwrap_variant_newtypes)]
                 (seed: 1, size: 48, length_mm: 9, aspect: {aspect}, outline: {outline}, {rest}, pigments: (chlorophyll: 0),
                  relief: Some(range_mm: 1, furrow_mm: 9, blister_mm: 9))"
            );
            let recipe = Recipe::Leaf(Box::new(ron::from_str(&page).unwrap_or_else(|e| panic!("{page}: {e}"))));
            let drawn: GeneratedTexture = draw::draw(&recipe).unwrap();
            assert_eq!(drawn.rgba.len(), drawn.width as usize * drawn.height as usize * 4);
        }
    }
}

/// A synthetic photograph of a leaf: three stops underexposed, redder than the leaf, lit from one side, with veins, a
/// highlight, noise, colours averaged over blocks of 8 as in JPEG, and an edge that fades over several pixels.
fn photograph() -> (u32, Vec<u8>) {
    const SIDE: u32 = 160;
    let mut state = 7_u64;
    let mut noise = || {
        state = furrow_base::sampling::rng::mix(state);
        (state >> 40) as f32 / (1_u64 << 24) as f32 - 0.5
    };
    let mut pixels = Vec::new();
    for y in 0..SIDE {
        for x in 0..SIDE {
            let (u, v) = (x as f32 / SIDE as f32 - 0.5, y as f32 / SIDE as f32 - 0.5);
            let light = 0.12 * (1.0 + 1.1 * u) * (1.0 + 0.4 * v);
            let vein = if (u + 0.3 * v.abs()).rem_euclid(0.12) < 0.012 || u.abs() < 0.01 { 1.5 } else { 1.0 };
            let shine = 0.5 * (-((u - 0.2).powi(2) + (v + 0.15).powi(2)) / 0.002).exp();
            let block = 1.0 + 0.06 * (((x / 8 * 37 + y / 8 * 61) % 11) as f32 / 10.0 - 0.5);
            let value = |band: f32, tint: f32| {
                let linear = band * light * vein * tint + 0.12 * shine;
                // The sRGB curve, approximately.
                linear.max(0.0).powf(1.0 / 2.2) * 255.0
            };
            let rgb = [value(0.10, block), value(0.14, 1.0), value(0.03, 2.0 - block)]
                .map(|c| (c + 6.0 * noise()).clamp(0.0, 255.0) as u8);
            // An ellipse whose edge fades over about five pixels, on a table.
            let inside = ((1.0 - (u / 0.32).hypot(v / 0.45)) * 12.0 + 0.5).clamp(0.0, 1.0);
            let table = [200.0, 195.0, 190.0];
            let mixed = |k: usize| (f32::from(rgb[k]) * inside + table[k] * (1.0 - inside)) as u8;
            pixels.extend([mixed(0), mixed(1), mixed(2), (255.0 * inside) as u8]);
        }
    }
    (SIDE, pixels)
}

/// Rationale: the exposure and white balance of a leaf photograph are unknown, and an image three stops underexposed
/// would give a black leaf. Expected: used as a species' texture, the blade's mean equals the pigments' reflectance in
/// each band, within 2 % in R, G, B and 6 % in near infrared, and the blade transmits light. Its veins stay paler than
/// the blade and its lit side brighter. With `calibrated: true` the image's own values are kept.
#[test]
fn a_photograph_is_exposed_as_the_pigments_say() {
    use furrow_base::math::Spectrum;
    use furrow_field::assemble::{self, Options};
    use furrow_render::material::Material;
    let folder = tempfile::tempdir().unwrap();
    let (side, pixels) = photograph();
    let picture = Texture::from_rgba8(side, side, &pixels, ColorSpace::Srgb);
    image::save_buffer(folder.path().join("leaf.png"), &pixels, side, side, image::ColorType::Rgba8).unwrap();
    let of = |calibrated: &str| {
        let species = format!(
            r#"Species(name: "photographed", eppo: "TEST", role: Weed, chlorophyll_sd: 0,
                materials: {{
                    "leaf": Leaf(texture: "leaf.png", roughness: 0.4{calibrated}),
                    "stalk": Leaf(roughness: 0.4),
                }},
                plant: (form: Rosette, kinds: {{"leaf": (shape: Sheet(outline: Power(a: 0.6, b: 0.6)))}}, stages: [
                    (bbch: 12, days: 9, hypocotyl_mm: 3, stem_mm: 1, layers: [
                        (kind: "leaf", leaves: 2, blade_mm: 60, width_mm: 30, stalk_mm: 10, angle_deg: 60),
                    ]),
                ]),
            )"#
        );
        std::fs::write(folder.path().join("species.ron"), species).unwrap();
        let page = r#"Field(
            camera: Pinhole(size: (16, 12), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.5)),
            lights: [Constant(radiance: (1, 1, 1, 1))],
            plants: [(species: "species.ron", growth: Bbch(12))],
        )"#;
        std::fs::write(folder.path().join("field.ron"), page).unwrap();
        assemble::field(&folder.path().join("field.ron"), &Options::default()).unwrap()
    };
    let opaque = |x: u32, y: u32| picture.texel(x, y)[3] >= 0.5;
    let mean = |calibrated: &str| {
        let field = of(calibrated);
        let blade = field.scene.parts.iter().find(|p| p.mask.is_some()).expect("a blade");
        let Material::Leaf(leaf) = &field.scene.materials[blade.material as usize] else { panic!("not a leaf") };
        let material = Material::Leaf(leaf.clone());
        let swatch = material.swatch();
        assert_eq!(swatch.size, Some((side, side)));
        let (mut sum, mut passed, mut n) = (Spectrum::ZERO, Spectrum::ZERO, 0.0);
        for (x, y) in (0..side * side).map(|i| (i % side, i / side)).filter(|(x, y)| opaque(*x, *y)) {
            sum += swatch.texel(x, y).reflectance;
            passed += swatch.texel(x, y).transmittance;
            n += 1.0;
        }
        let bright = |x: u32, y: u32| swatch.texel(x, y).reflectance.luminance();
        // The midrib relative to the blade beside it, and the lit side relative to the dark one.
        let contrast = (bright(80, 60) / bright(77, 60), bright(112, 84) / bright(50, 84));
        (sum * (1.0 / n), passed * (1.0 / n), contrast)
    };
    let wanted = furrow_optics::optics::Pigments::default().bands();
    let (matched, passed, contrast) = mean("");
    for k in 0..4 {
        let off = matched.0[k] / wanted.reflectance.0[k] - 1.0;
        assert!(off.abs() < if k < 3 { 0.02 } else { 0.06 }, "band {k}: {matched:?}, {:?}", wanted.reflectance);
        let off = passed.0[k] - wanted.transmittance.0[k];
        assert!(off.abs() < 0.05, "band {k}: {passed:?}, {:?}", wanted.transmittance);
    }
    assert!(contrast.0 > 1.1 && contrast.1 > 1.2, "{contrast:?}");
    let (own, ..) = mean(", calibrated: true");
    let mut dark = [0.0_f32; 3];
    let mut n = 0.0;
    for (x, y) in (0..side * side).map(|i| (i % side, i / side)).filter(|(x, y)| opaque(*x, *y)) {
        for (sum, value) in dark.iter_mut().zip(picture.texel(x, y)) {
            *sum += value;
        }
        n += 1.0;
    }
    for k in 0..3 {
        assert!((own.0[k] / (dark[k] / n) - 1.0).abs() < 0.02, "band {k}: {own:?} {dark:?}");
    }
    assert!(own.0.y < 0.3 * matched.0.y, "{own:?} {matched:?}: the photograph must be dark");
}
