//! Tests of the ground as a whole: invariants across its parts.

use super::*;
use furrow_base::geometry::Mesh;
use furrow_base::math::{ToFloat, ToInt, Vec3};
use furrow_base::ron_file::{Num, Vary};
use furrow_optics::texture::ground::GroundMaps;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Wavy layers with different heights and colours.
struct Waves(f32, [f32; 3]);

impl LayerMaps for Waves {
    fn height(&self, uv: Vec2) -> f32 {
        0.5 + 0.5 * (std::f32::consts::TAU * self.0 * uv.x).sin() * (std::f32::consts::TAU * self.0 * uv.y).cos()
    }
    fn albedo(&self, _: Vec2) -> [f32; 3] {
        self.1
    }
}

const MAPS: [Waves; 2] = [Waves(20.0, [1.0, 0.0, 0.0]), Waves(7.0, [0.0, 1.0, 0.0])];

fn page() -> SoilDesc {
    ron::from_str(
        r#"(layers: [
            (albedo: "a", height: "b", size_m: 0.3, height_mm: (-1, 1)),
            (albedo: "c", height: "d", size_m: 0.4, height_mm: (4, 8)),
        ], stones: [(cover: 0.03)], litter: (straw_cover: 0.02, sticks_per_m2: 20))"#,
    )
    .unwrap()
}

fn site(size: f32) -> Site {
    Site {
        area: Rect::new(-size, -size, size, size),
        grid_m: 0.001,
        margin_m: 0.5,
        growth: 1.3,
        level_m: f32::INFINITY,
        smallest_mm: 0.0,
        rows: None,
    }
}

fn stream() -> Stream {
    Stream::of(21, 4, Purpose::Soil, 0)
}

fn ground(desc: &SoilDesc, size: f32) -> Ground {
    Ground::new(desc, &[], &MAPS, &site(size), &stream()).unwrap()
}

fn root(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

/// Returns the connected components of a mesh.
fn bodies(mesh: &Mesh) -> Vec<Vec<Vec3>> {
    let mut parent: Vec<usize> = (0..mesh.positions.len()).collect();
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| root(&mut parent, i.to_usize()));
        parent[b] = a;
        parent[c] = a;
    }
    let mut all: BTreeMap<usize, Vec<Vec3>> = BTreeMap::new();
    for i in 0..mesh.positions.len() {
        let r = root(&mut parent, i);
        all.entry(r).or_default().push(mesh.positions[i]);
    }
    all.into_values().collect()
}

/// Returns the clods of all groups: the lowest moisture level of each, which is that of its top, and its vertices.
fn whole_clods(groups: &[Clods]) -> Vec<(usize, Vec<Vec3>)> {
    // Parts of a clod in several groups share vertices.
    let mut vertices: BTreeMap<[u32; 3], (u32, usize)> = BTreeMap::new();
    let mut all = Mesh::default();
    for Clods { mesh, moisture, .. } in groups {
        let mut index = Vec::new();
        for p in &mesh.positions {
            let next = all.positions.len().to_u32();
            let known = vertices.entry(p.to_array().map(f32::to_bits)).or_insert((next, *moisture));
            known.1 = known.1.min(*moisture);
            index.push(known.0);
            if known.0 == next {
                all.positions.push(*p);
            }
        }
        all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| index[i.to_usize()])));
    }
    let level = |p: &Vec3| vertices[&p.to_array().map(f32::to_bits)].1;
    let of = |body: Vec<Vec3>| (body.iter().map(level).min().unwrap(), body);
    bodies(&all).into_iter().map(of).collect()
}

#[test]
fn heights_are_those_of_the_mesh_and_continuous_over_the_seam() {
    let ground = ground(&page(), 0.06);
    let mesh = ground.mesh(&InView::ALL);
    assert_eq!(mesh.fault(), None);
    for t in mesh.triangles.iter().step_by(97) {
        let [a, b, c] = t.map(|i| mesh.positions[i.to_usize()]);
        assert!((b - a).cross(c - a).z > 0.0);
        let p = a * 0.2 + b * 0.5 + c * 0.3;
        assert!((ground.height(p.x, p.y) - p.z).abs() < 2e-5, "{p} {}", ground.height(p.x, p.y));
    }
    // Every inner edge belongs to two triangles, so there is no crack between the fine and the coarse ground.
    let mut edges = BTreeMap::new();
    for t in &mesh.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    let border = 2 * (ground.grid.columns() - 1 + ground.grid.rows() - 1);
    assert_eq!(edges.values().filter(|n| **n == 1).count(), border);
    assert!(edges.values().all(|n| *n <= 2));
    for k in 0..200 {
        let y = -0.07 + 0.0007 * k.to_f32();
        for x in [-0.06, 0.06] {
            assert!((ground.height(x - 1e-5, y) - ground.height(x + 1e-5, y)).abs() < 1e-4);
        }
    }
    let (lo, hi) = mesh.bounds().unwrap();
    assert!(lo.x < -0.55 && hi.y > 0.55);
}

/// Returns the vertices of all triangles of some meshes, as bits.
fn triangles<'a>(meshes: impl Iterator<Item = &'a Mesh>) -> BTreeSet<[[u32; 3]; 3]> {
    let bits = |corner: Vec3| corner.to_array().map(f32::to_bits);
    meshes.flat_map(|mesh| (0..mesh.triangles.len().to_u32()).map(move |i| mesh.corners(i).map(bits))).collect()
}

/// Returns the triangles west of a line.
fn west(triangles: &BTreeSet<[[u32; 3]; 3]>, line: f32) -> BTreeSet<[[u32; 3]; 3]> {
    triangles.iter().filter(|t| t.iter().all(|corner| f32::from_bits(corner[0]) < line)).copied().collect()
}

/// Rationale: most of the ground along a long oblique drive is out of view and wastes memory. Expected: there its mesh
/// has far fewer triangles, with the same vertices; no inner edge has a triangle on one side only, and none faces down;
/// in view it is the mesh of the whole ground. The strip in the west is in view.
#[test]
fn ground_out_of_view_has_few_triangles_and_no_crack() {
    let ground = ground(&page(), 0.2);
    let seen = InView::of(ground.area(), 0.0, |_| 0.0, |p| (p.x + 0.15).max(0.0));
    let (whole, mesh) = (ground.mesh(&InView::ALL), ground.mesh(&seen));
    assert_eq!(mesh.fault(), None);
    assert!(mesh.triangles.len() * 100 < whole.triangles.len() * 65, "{}", mesh.triangles.len());
    let (all, some) = (triangles(std::iter::once(&whole)), triangles(std::iter::once(&mesh)));
    assert_eq!(west(&all, -0.15), west(&some, -0.15));
    let corners: BTreeSet<[u32; 3]> = all.into_iter().flatten().collect();
    assert!(some.iter().flatten().all(|corner| corners.contains(corner)));
    let mut edges = BTreeMap::new();
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.positions[i.to_usize()]);
        assert!((b - a).cross(c - a).z > 0.0);
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    let border = 2 * (ground.grid.columns() - 1 + ground.grid.rows() - 1);
    assert_eq!(edges.values().filter(|n| **n == 1).count(), border);
    assert!(edges.values().all(|n| *n <= 2));
}

/// Rationale: each clod rests on those placed before, so none may be missing from the pile. Expected: the pile does not
/// depend on the view; the clods in view have meshes, bit-identical, and few others do.
#[test]
fn clods_out_of_view_are_laid_and_not_made() {
    let ground = ground(&page(), 0.2);
    let lay = |seen: &InView| {
        let mut pile = Pile::new(&ground);
        let clods = clods(&ground, &mut pile, &Canopy::none(&ground), seen);
        (triangles(clods.iter().map(|group| &group.mesh)), pile)
    };
    let (all, whole) = lay(&InView::ALL);
    let (some, pile) = lay(&InView::of(ground.area(), 0.0, |_| 0.0, |p| (p.x + 0.15).max(0.0)));
    for k in 0..400 {
        let p = vec2(-0.2 + 0.02 * (k % 20).to_f32(), -0.2 + 0.02 * (k / 20).to_f32());
        assert_eq!(pile.at(p), whole.at(p), "{p}");
    }
    assert!(some.len() * 10 < all.len() * 7, "{} of {}", some.len(), all.len());
    assert!(some.is_subset(&all));
    assert_eq!(west(&all, -0.15), west(&some, -0.15));
}

#[test]
fn one_blend_drives_colour_and_height_and_sums_to_one() {
    let mut page = page();
    page.relief.rms_mm = Vary::fixed(0.0);
    page.relief.tilt_deg = Vary::fixed(0.0);
    page.clods.over_5mm_per_m2 = Vary::fixed(0.0);
    page.blend.scale_m = Vary::fixed(0.05);
    (page.pigments.iron, page.pigments.lime) = (Vary::fixed(0.0), Vary::fixed(0.0));
    let ground = ground(&page, 0.1);
    let baked = ground.bake(&MAPS, 0.0005);
    let (mut low, mut high) = (0, 0);
    for j in (0..baked.height).step_by(7) {
        for i in (0..baked.width).step_by(7) {
            let k = j * baked.width + i;
            let sum: u32 = baked.weights[k].iter().map(|w| u32::from(*w)).sum();
            assert!((254..=256).contains(&sum), "{:?}", baked.weights[k]);
            // The layers are pure red and green, so the colour shows the weights, up to the local brightness.
            let [r, g, ..] = GroundMaps::decode(baked.albedo[k]).to_array();
            let second = f32::from(baked.weights[k][1]) / 255.0;
            assert!((g / (r + g) - second).abs() < 0.02);
            let p = baked.origin + (vec2(i.to_f32(), j.to_f32()) + 0.5) * baked.texel_m;
            let h = ground.height(p.x, p.y) * 1e3;
            assert!(h > -1.1 * (1.0 - second) + 3.8 * second - 0.6 && h < 1.1 * (1.0 - second) + 8.2 * second + 0.6);
            low += i32::from(second < 0.1);
            high += i32::from(second > 0.9);
        }
    }
    assert!(low > 50 && high > 50, "{low} {high}");
}

#[test]
fn the_baked_maps_and_the_mesh_together_have_the_slopes_of_the_whole_relief() {
    let mut page = page();
    page.layers.truncate(1);
    page.layers[0].height_mm = (Num::new(-0.2), Num::new(0.2));
    page.relief.rms_mm = Vary::fixed(0.0);
    page.relief.tilt_deg = Vary::fixed(0.0);
    page.clods.over_5mm_per_m2 = Vary::fixed(0.0);
    let maps = [Waves(150.0, [0.2; 3])];
    let site = Site { grid_m: 0.002, ..site(0.05) };
    let ground = Ground::new(&page, &[], &maps, &site, &stream()).unwrap();
    let baked = ground.bake(&maps, 0.0001);
    let height = |p: Vec2| ground.blend.displacement([1.0, 0.0, 0.0, 0.0], ground.blend.heights(&maps, p));
    let mut off = 0.0;
    let mut n = 0.0;
    for k in (0..baked.slope.len()).step_by(1009) {
        let (i, j) = (k % baked.width, k / baked.width);
        let inner = |i: usize, n: usize| i > n / 8 && i < 7 * n / 8;
        if !inner(i, baked.width) || !inner(j, baked.height) {
            continue;
        }
        let p = baked.origin + (vec2(i.to_f32(), j.to_f32()) + 0.5) * baked.texel_m;
        let d = 1e-4;
        let exact = (height(p + vec2(d, 0.0)) - height(p - vec2(d, 0.0))) / (2.0 * d);
        let normal = ground.normal(p.x, p.y);
        let both = -normal.x / normal.z + f32::from(baked.slope[k][0]) / GroundMaps::SLOPE_STEPS;
        off += (both - exact).abs();
        n += 1.0;
    }
    assert!(off / n < 0.02, "{}", off / n);
}

#[test]
fn the_same_address_gives_the_same_ground_and_a_larger_area_holds_it() {
    let page = page();
    let (a, b) = (ground(&page, 0.05), ground(&page, 0.05));
    assert_eq!(a.mesh(&InView::ALL), b.mesh(&InView::ALL));
    assert_eq!(a.bake(&MAPS, 0.0005), b.bake(&MAPS, 0.0005));
    let large = ground(&page, 0.08);
    for k in 0..400 {
        let (x, y) = (-0.04 + 0.004 * (k % 20).to_f32(), -0.04 + 0.004 * (k / 20).to_f32());
        assert!((a.height(x, y) - large.height(x, y)).abs() < 2e-4);
    }
    let other = Ground::new(&page, &[], &MAPS, &site(0.05), &Stream::of(21, 5, Purpose::Soil, 0)).unwrap();
    assert_ne!(a.height(0.0, 0.0), other.height(0.0, 0.0));
}

/// Expected: all hues occur at all brightnesses; without a spread all clods are grey. Near infrared varies with the
/// brightness only.
#[test]
fn clods_differ_in_hue_as_much_as_their_page_says() {
    let ratios = |sigma: f64| {
        let mut page = page();
        page.clods.hue_sigma = Num::new(sigma);
        (page.pigments.iron, page.pigments.humus) = (Vary::fixed(0.0), Vary::fixed(0.0));
        let ground = ground(&page, 0.3);
        let groups = clods(&ground, &mut Pile::new(&ground), &Canopy::none(&ground), &InView::ALL);
        let ratio = |c: &Clods| {
            let [r, g, b, n] = c.tint.to_array();
            assert!((r * g / (n * n) - 1.0).abs() < 1e-4, "{:?}", c.tint);
            ((g / r).ln(), (g / b).ln(), c.mesh.triangles.len())
        };
        groups.iter().map(ratio).collect::<Vec<_>>()
    };
    assert!(ratios(0.0).iter().all(|(green, yellow, _)| green.abs() < 1e-5 && yellow.abs() < 1e-5));
    let drawn = ratios(0.05);
    let number: f32 = drawn.iter().map(|r| r.2.to_f32()).sum();
    for of in [|r: &(f32, f32, usize)| r.0, |r: &(f32, f32, usize)| r.1] {
        let mean = drawn.iter().map(|r| of(r) * r.2.to_f32()).sum::<f32>() / number;
        let sd = (drawn.iter().map(|r| (of(r) - mean).powi(2) * r.2.to_f32()).sum::<f32>() / number).sqrt();
        assert!(mean.abs() < 0.02 && (0.03..0.06).contains(&sd), "{mean} ± {sd}");
    }
}

#[test]
fn nothing_floats_and_nothing_is_wholly_buried() {
    let mut page = page();
    // Sparse, so that all clods lie on the ground and not on each other.
    page.clods.over_5mm_per_m2 = Vary::fixed(400.0);
    page.clods.min_mm = Num::new(5.0);
    page.crumbs.amount = Vary::fixed(0.0);
    let ground = ground(&page, 0.3);
    let mut pile = Pile::new(&ground);
    let groups = clods(&ground, &mut pile, &Canopy::none(&ground), &InView::ALL);
    for Clods { tint, mesh, .. } in &groups {
        assert_eq!(mesh.fault(), None);
        assert!(tint.0.min_element() > 0.4 && tint.0.max_element() < 2.0, "{tint:?}");
    }
    // Components of a few vertices are the rim of a body whose buried side was left out.
    let all: Vec<_> = whole_clods(&groups).into_iter().filter(|(_, body)| body.len() > 6).collect();
    assert!(all.len() > 60, "{}", all.len());
    for (_, body) in &all {
        let above = |p: &Vec3| p.z - ground.height(p.x, p.y);
        let (lo, hi) = body.iter().map(above).fold((f32::MAX, f32::MIN), |(l, h), z| (l.min(z), h.max(z)));
        assert!(hi > 0.0, "buried by {hi}");
        assert!(lo < 0.5e-3, "floats by {lo} of {hi}");
    }
    let mut pile = Pile::new(&ground);
    let mut things = stones(&page.stones, &ground, &mut pile, &stream());
    things.extend(litter(&page.litter, &ground, &mut Pile::new(&ground), &stream()));
    let mut touching = 0;
    for thing in &things {
        assert_eq!(thing.mesh.fault(), None);
        let above = |p: &Vec3| p.z - ground.height(p.x, p.y);
        let (lo, hi) =
            thing.mesh.positions.iter().map(above).fold((f32::MAX, f32::MIN), |(l, h), z| (l.min(z), h.max(z)));
        assert!(hi > 0.0, "{:?} buried by {hi}", thing.kind);
        touching += usize::from(lo < 0.1e-3);
        assert!(thing.mesh.positions.iter().all(|p| p.distance(thing.centre) < 1.8 * thing.radius + 0.01));
    }
    // A few pieces lie across others.
    assert!(things.len() > 40 && touching * 100 > things.len() * 93, "{touching} of {}", things.len());
}

/// Rationale: ten million clods for an outdated preview delay the current one. Expected: once the flag is raised
/// nothing is placed.
#[test]
fn nothing_is_laid_on_a_pile_that_is_given_up() {
    let page = page();
    let ground = ground(&page, 0.15);
    let outdated = Arc::new(AtomicBool::new(false));
    let mut pile = Pile::new(&ground).until(Some(&outdated));
    let lay = |pile: &mut Pile| {
        let clods = clods(&ground, pile, &Canopy::none(&ground), &InView::ALL).len();
        let stones = stones(&page.stones, &ground, pile, &stream()).len();
        [clods, stones, litter(&page.litter, &ground, pile, &stream()).len()]
    };
    assert!(lay(&mut pile).iter().all(|count| *count > 0));
    outdated.store(true, Ordering::Relaxed);
    assert_eq!(lay(&mut pile), [0; 3]);
}

#[test]
fn a_seedbed_stays_within_its_budget_and_keeps_stems_clear() {
    let mut page = page();
    page.layers.truncate(1);
    page.clods.over_5mm_per_m2 = Vary::fixed(12000.0);
    page.clods.exponent = Vary::fixed(3.3);
    let maps = [Plain { albedo: [0.2, 0.15, 0.1], height: 0.5 }];
    let site = Site {
        area: Rect::new(0.0, 0.0, 0.3, 0.2),
        grid_m: 0.001,
        margin_m: 0.1,
        growth: 1.3,
        level_m: f32::INFINITY,
        smallest_mm: 0.0,
        rows: None,
    };
    let ground = Ground::new(&page, &[], &maps, &site, &stream()).unwrap();
    let stem = vec2(0.15, 0.1);
    let mut canopy = Canopy::none(&ground);
    canopy.add(&sheet(stem - 0.004, stem + 0.004, ground.height(stem.x, stem.y)));
    let groups = clods(&ground, &mut Pile::new(&ground), &canopy, &InView::ALL);
    let triangles: usize = groups.iter().map(|g| g.mesh.triangles.len()).sum();
    let per_view = triangles.to_f32() / 0.06 * 0.325;
    assert!(per_view > 3e5 && per_view < 1.5e6, "{per_view}");
    assert!(groups.len() >= 5);
    for Clods { mesh, .. } in &groups {
        assert!(mesh.positions.iter().all(|p| p.truncate().distance(stem) > 0.003));
        assert!(mesh.uvs.iter().all(|t| t.cmpge(Vec2::ZERO).all() && t.cmple(Vec2::ONE).all()));
    }
    assert_eq!(groups, clods(&ground, &mut Pile::new(&ground), &canopy, &InView::ALL));
}

/// Returns a level rectangle at a height.
fn sheet(low: Vec2, high: Vec2, z: f32) -> Mesh {
    let positions = vec![low.extend(z), vec2(high.x, low.y).extend(z), high.extend(z), vec2(low.x, high.y).extend(z)];
    Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }
}

#[test]
fn clods_are_damp_and_dry_as_the_page_says_and_pierce_no_leaf() {
    let mut page = page();
    page.clods.over_5mm_per_m2 = Vary::fixed(4000.0);
    page.clods.min_mm = Num::new(5.0);
    page.clods.damp = Vary::fixed(0.25);
    page.clods.dryness = Vary::fixed(0.75);
    page.clods.loose = Vary::fixed(1.0);
    page.moisture.mean = Vary::fixed(0.8);
    let ground = ground(&page, 0.2);
    let levels = ground.clods_moisture();
    let (dry, damp) = (levels[0], levels[MOISTURE_LEVELS - 1]);
    assert!((dry - 0.2).abs() < 1e-6 && (damp - 0.8).abs() < 1e-6 && levels.is_sorted());
    for (fabric, level) in ground.fabrics(&MAPS, 0.001).iter().zip(levels) {
        let moisture: Vec<f32> = fabric.moisture.iter().map(|m| f32::from(*m) / 255.0).collect();
        let least = moisture.iter().copied().fold(1.0, f32::min);
        // Pores are moister.
        assert!((least - level).abs() < 0.01 && moisture.iter().all(|m| *m < 1.25 * level), "{least} for {level}");
    }
    let leaf = 0.004 + ground.height(0.0, 0.0);
    let mut canopy = Canopy::none(&ground);
    canopy.add(&sheet(Vec2::splat(-0.03), Vec2::splat(0.03), leaf));
    let (mut wet, mut all, mut under, mut far) = (0, 0, 0, 0f32);
    let groups = clods(&ground, &mut Pile::new(&ground), &canopy, &InView::ALL);
    for (level, body) in whole_clods(&groups).into_iter().filter(|(_, body)| body.len() > 6) {
        all += 1;
        wet += i32::from(level == MOISTURE_LEVELS - 1);
        let middle = body.iter().sum::<Vec3>().truncate() / body.len().to_f32();
        let top = body.iter().map(|p| p.z).fold(f32::MIN, f32::max);
        if middle.abs().max_element() < 0.03 {
            under += 1;
            assert!(top < leaf, "{top} {leaf}");
        }
        far = far.max(top - ground.height(middle.x, middle.y));
    }
    assert!((f64::from(wet) / f64::from(all) - 0.25).abs() < 0.05, "{wet} of {all}");
    assert!(under > 2 && far > 0.012, "{under} {far}");
}

#[test]
fn the_trend_is_the_slope_of_a_plane() {
    let mut page = page();
    page.layers.truncate(1);
    page.relief.rms_mm = Vary::fixed(0.0);
    page.relief.tilt_deg = Vary::fixed(9.0);
    page.clods.over_5mm_per_m2 = Vary::fixed(0.0);
    let maps = [Plain { albedo: [0.2, 0.15, 0.1], height: 0.5 }];
    let ground = Ground::new(&page, &[], &maps, &site(0.05), &stream()).unwrap();
    for normal in [ground.trend(0.0, 0.01, 0.02), ground.normal(0.01, 0.0)] {
        assert!((normal.z.acos().to_degrees() - 9.0).abs() < 0.05, "{normal}");
    }
}

#[test]
fn impossible_pages_are_refused_in_words() {
    let try_page =
        |page: &SoilDesc| Ground::new(page, &[], &MAPS, &site(0.02), &stream()).map(|_| ()).unwrap_err().to_string();
    let mut one = page();
    one.layers.truncate(1);
    assert!(try_page(&one).contains("1 layers but 2 were loaded"));
    let mut swapped = page();
    swapped.layers[0].height_mm = (Num::new(2.0), Num::new(-2.0));
    assert!(try_page(&swapped).contains("swap its ends"));
    let mut clods = page();
    clods.clods.max_mm = Num::new(1.0);
    assert!(try_page(&clods).contains("min_mm"));
    let thin = Site { grid_m: 1e-7, ..site(1.0) };
    assert!(Ground::new(&page(), &[], &MAPS, &thin, &stream()).is_err());
}

/// Rationale: a clod that tapers below its widest part looks like a pebble on a plane. Expected: near the ground a welded
/// clod is at least as wide as half-way up; a loose one of the same shape is narrower there.
#[test]
fn welded_clods_widen_towards_the_ground() {
    let widths = |loose: f64| {
        let mut page = page();
        page.clods.over_5mm_per_m2 = Vary::fixed(500.0);
        page.clods.exponent = Vary::fixed(1.0);
        page.clods.min_mm = Num::new(14.0);
        page.clods.loose = Vary::fixed(loose);
        page.relief.rms_mm = Vary::fixed(0.0);
        let ground = ground(&page, 0.3);
        let groups = clods(&ground, &mut Pile::new(&ground), &Canopy::none(&ground), &InView::ALL);
        let (mut low, mut middle) = (0.0, 0.0);
        for (_, body) in whole_clods(&groups) {
            let centre = body.iter().sum::<Vec3>().truncate() / body.len().to_f32();
            let top = body.iter().map(|p| p.z - ground.height(p.x, p.y)).fold(0.0, f32::max);
            let wide = |from: f32, to: f32| {
                let inside = body.iter().filter(|p| (from..to).contains(&((p.z - ground.height(p.x, p.y)) / top)));
                inside.map(|p| p.truncate().distance(centre)).fold(0.0, f32::max)
            };
            if body.len() > 100 && top > 0.003 {
                low += wide(0.0, 0.12);
                middle += wide(0.45, 0.55);
            }
        }
        assert!(middle > 0.05, "{middle}");
        low / middle
    };
    let (welded, loose) = (widths(0.0), widths(1.0));
    assert!(welded > 1.0 && welded > loose + 0.08, "{welded} {loose}");
}

/// Expected: the material of clods has pores and slopes at pixels of a quarter of a millimetre, its mean reflectance with
/// them is that of the soil within 7 %, and at pixels of a centimetre it is smooth. Levels differ in moisture only.
#[test]
fn the_material_of_clods_is_porous_and_as_bright_as_the_soil() {
    let mut page = page();
    page.layers.truncate(1);
    let maps = [Plain { albedo: [0.2, 0.15, 0.1], height: 0.5 }];
    let ground = Ground::new(&page, &[], &maps, &site(0.05), &stream()).unwrap();
    let [first, .., last] = ground.fabrics(&maps, 2.5e-4);
    assert!(first.albedo == last.albedo && first.slope == last.slope && first.moisture != last.moisture);
    let n = first.albedo.len().to_f32();
    let slope = |k: usize| Vec2::from(first.slope[k].map(f32::from)) / GroundMaps::SLOPE_STEPS;
    let rms = ((0..first.slope.len()).map(|k| slope(k).length_squared()).sum::<f32>() / n).sqrt();
    assert!((0.2..0.8).contains(&rms), "{rms}");
    let lit = |k: usize| {
        let open = f32::from(first.ao[k]) / 255.0;
        GroundMaps::decode(first.albedo[k]).0.y * open / (1.0 + slope(k).length_squared()).sqrt()
    };
    let mean = (0..first.albedo.len()).map(lit).sum::<f32>() / n;
    assert!((mean / 0.15 - 1.0).abs() < 0.07, "{mean}");
    let [coarse, ..] = ground.fabrics(&maps, 0.01);
    assert!(coarse.slope.iter().flatten().all(|s| s.abs() < 12), "{:?}", coarse.slope);
}

/// Rationale: between dry clods, photographs show dry fines and, where these are few, moist ground. Expected: ground with
/// more fines than the mean is drier and ground with fewer is moister, with about the same mean; moist bases of clods
/// are where fines are few.
#[test]
fn ground_is_dry_under_fines_and_moist_between_them() {
    let mut page = page();
    page.layers.truncate(1);
    (page.moisture.mean, page.moisture.spread) = (Vary::fixed(0.5), Vary::fixed(0.0));
    page.moisture.drying = Num::new(0.0);
    (page.clods.dryness, page.clods.damp) = (Vary::fixed(0.9), Vary::fixed(0.0));
    (page.clods.clustering, page.clods.exponent) = (Vary::fixed(0.7), Vary::fixed(2.7));
    let maps = [Plain { albedo: [0.2, 0.15, 0.1], height: 0.5 }];
    let ground = Ground::new(&page, &[], &maps, &site(0.4), &stream()).unwrap();
    let place = |k: usize| vec2((k % 60).to_f32(), (k / 60).to_f32()) / 75.0 - 0.39;
    let mean = |of: &dyn Fn(Vec2) -> Option<f32>| {
        let some: Vec<f32> = (0..3600).filter_map(|k| of(place(k))).collect();
        some.iter().sum::<f32>() / some.len().to_f32()
    };
    let moisture = |p: Vec2| ground.moisture(p.x, p.y);
    let [few, many] = [-1.0, 1.0].map(|sign| mean(&|p| (sign * ground.fines(p) > 0.1).then(|| moisture(p))));
    assert!(few > many + 0.15, "{few} {many}");
    assert!((mean(&|p| Some(moisture(p))) - 0.5).abs() < 0.06, "{}", mean(&|p| Some(moisture(p))));
    let groups = clods(&ground, &mut Pile::new(&ground), &Canopy::none(&ground), &InView::ALL);
    let under = |level: usize| {
        let of_level = groups.iter().filter(|group| group.moisture == level);
        let fines: Vec<f32> = of_level.flat_map(|g| &g.mesh.positions).map(|p| ground.fines(p.truncate())).collect();
        fines.iter().sum::<f32>() / fines.len().to_f32()
    };
    assert!(under(MOISTURE_LEVELS - 1) < under(0) - 0.05, "{} {}", under(MOISTURE_LEVELS - 1), under(0));
}

/// Expected: on slaked ground the small relief has less than 40 % of the height, and fewer than half of the clods are left.
#[test]
fn rain_smooths_the_ground_and_buries_clods() {
    let after = |slaked: f64| {
        let mut page = page();
        page.slaked = Vary::fixed(slaked);
        page.clods.over_5mm_per_m2 = Vary::fixed(3000.0);
        page.relief.rms_mm = Vary::fixed(0.0);
        let ground = ground(&page, 0.15);
        let detail = &ground.fine.detail;
        let mean = detail.iter().sum::<f32>() / detail.len().to_f32();
        let rms = (detail.iter().map(|h| (h - mean).powi(2)).sum::<f32>() / detail.len().to_f32()).sqrt();
        let groups = clods(&ground, &mut Pile::new(&ground), &Canopy::none(&ground), &InView::ALL);
        let bodies: Vec<_> = whole_clods(&groups).into_iter().filter(|(_, body)| body.len() > 6).collect();
        let top = |body: &[Vec3]| body.iter().map(|p| p.z - ground.height(p.x, p.y)).fold(0.0, f32::max);
        let height = bodies.iter().map(|(_, body)| top(body)).sum::<f32>() / bodies.len().to_f32();
        (rms, bodies.len(), height)
    };
    let (tilled, slaked) = (after(0.0), after(1.0));
    assert!(slaked.0 < 0.4 * tilled.0, "{slaked:?} {tilled:?}");
    assert!(slaked.1 * 2 < tilled.1 && slaked.1 > 20, "{slaked:?} {tilled:?}");
}

/// Expected: stubble has the number of stalks that was asked for within a fifth, stands on the ground, and lies along rows:
/// across them, positions are within a quarter of the rows' distance.
#[test]
fn stubble_stands_in_rows() {
    let mut page = page();
    (page.litter.straw_cover, page.litter.sticks_per_m2) = (Vary::fixed(0.0), Vary::fixed(0.0));
    page.litter.bits_per_m2 = Vary::fixed(0.0);
    page.litter.stubble_per_m2 = Vary::fixed(300.0);
    page.litter.stubble_rows_m = Vary::fixed(0.2);
    let ground = ground(&page, 0.5);
    let all = litter(&page.litter, &ground, &mut Pile::new(&ground), &stream());
    assert!((240..360).contains(&all.len()), "{}", all.len());
    for stalk in &all {
        let above = |p: &Vec3| p.z - ground.height(stalk.centre.x, stalk.centre.y);
        let (lo, hi) =
            stalk.mesh.positions.iter().map(above).fold((f32::MAX, f32::MIN), |(l, h), z| (l.min(z), h.max(z)));
        assert!(lo < 0.0 && hi > 0.03, "{lo} {hi}");
    }
    // Resultant length of the phases across the best of 180 directions.
    let along = |degrees: i32| {
        let across = Vec2::from_angle(degrees.to_f32().to_radians());
        let turn = |stalk: &Debris| Vec2::from_angle(std::f32::consts::TAU * stalk.centre.truncate().dot(across) / 0.2);
        all.iter().map(turn).sum::<Vec2>().length() / all.len().to_f32()
    };
    let best = (0..180).map(along).fold(0.0, f32::max);
    assert!(best > 0.7, "{best}");
}

/// Rationale: grains of many colours make a clod look like a rock. Expected: the colour within a clod has less than half of
/// the variation between crumbs on the ground.
#[test]
fn the_soil_within_a_clod_is_mixed() {
    let mut page = page();
    page.layers.truncate(1);
    (page.pigments.iron, page.pigments.lime) = (Vary::fixed(0.3), Vary::fixed(0.0));
    page.clods.tint_sigma = Num::new(0.2);
    page.crumbs.amount = Vary::fixed(1.0);
    let maps = [Plain { albedo: [0.2, 0.15, 0.1], height: 0.5 }];
    let ground = Ground::new(&page, &[], &maps, &site(0.05), &stream()).unwrap();
    let spread = |maps: &GroundMaps| {
        let logs: Vec<f32> = maps.albedo.iter().map(|texel| GroundMaps::decode(*texel).0.y.max(1e-3).ln()).collect();
        let mean = logs.iter().sum::<f32>() / logs.len().to_f32();
        (logs.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / logs.len().to_f32()).sqrt()
    };
    let [within, among] = [spread(&ground.fabrics(&maps, 5e-4)[0]), spread(&ground.bake(&maps, 5e-4))];
    assert!(within < 0.5 * among, "{within} {among}");
}

/// Rationale: fine earth that has filled joints and pores makes clods lower, smoother and wider at the ground. Expected:
/// filled clods rise less above the ground; their widest part is near it even if they are loose; their material has less
/// than half of the slopes, and the same mean reflectance within 2 %.
#[test]
fn fine_earth_fills_joints_and_pores() {
    let maps = [Plain { albedo: [0.2, 0.15, 0.1], height: 0.5 }];
    let state = |filled: f64| {
        let mut page = page();
        page.layers.truncate(1);
        page.clods.filled = Vary::fixed(filled);
        (page.clods.over_5mm_per_m2, page.clods.exponent) = (Vary::fixed(500.0), Vary::fixed(1.0));
        (page.clods.min_mm, page.clods.loose) = (Num::new(14.0), Vary::fixed(1.0));
        (page.crumbs.amount, page.relief.rms_mm) = (Vary::fixed(0.0), Vary::fixed(0.0));
        let ground = Ground::new(&page, &[], &maps, &site(0.3), &stream()).unwrap();
        let groups = clods(&ground, &mut Pile::new(&ground), &Canopy::none(&ground), &InView::ALL);
        let (mut heights, mut low, mut middle) = (0.0, 0.0, 0.0);
        for (_, body) in whole_clods(&groups).into_iter().filter(|(_, body)| body.len() > 100) {
            let centre = body.iter().sum::<Vec3>().truncate() / body.len().to_f32();
            let above = |p: &Vec3| p.z - ground.height(p.x, p.y);
            let top = body.iter().map(above).fold(0.0, f32::max);
            let wide = |from: f32, to: f32| {
                let inside = body.iter().filter(|p| (from..to).contains(&(above(p) / top)));
                inside.map(|p| p.truncate().distance(centre)).fold(0.0, f32::max)
            };
            heights += top;
            low += wide(-0.1, 0.12);
            middle += wide(0.6, 0.7);
        }
        let [first, ..] = ground.fabrics(&maps, 2.5e-4);
        let n = first.albedo.len().to_f32();
        let slope = |k: usize| Vec2::from(first.slope[k].map(f32::from)) / GroundMaps::SLOPE_STEPS;
        let lit = |k: usize| {
            let open = f32::from(first.ao[k]) / 255.0;
            GroundMaps::decode(first.albedo[k]).0.y * open / (1.0 + slope(k).length_squared()).sqrt()
        };
        let mean = |of: &dyn Fn(usize) -> f32| (0..first.albedo.len()).map(of).sum::<f32>() / n;
        (heights, low / middle, mean(&|k| slope(k).length_squared()).sqrt(), mean(&lit))
    };
    let (bare, full) = (state(0.0), state(1.0));
    assert!(bare.0 > 0.1 && full.0 < 0.9 * bare.0, "{bare:?} {full:?}");
    assert!(full.1 > 1.15 * bare.1, "{bare:?} {full:?}");
    assert!(full.2 < 0.5 * bare.2, "{bare:?} {full:?}");
    assert!((full.3 / bare.3 - 1.0).abs() < 0.02, "{bare:?} {full:?}");
}

/// Rationale: a baked pit darkens without anything that casts a shadow, and a crack is deeper than any pit. Expected: cracks
/// lower the mesh by millimetres and leave openness and slopes of the baked maps as they are.
#[test]
fn cracks_are_in_the_mesh_and_not_in_the_maps() {
    let maps = [Plain { albedo: [0.2, 0.15, 0.1], height: 0.5 }];
    let made = |cracks: &str| {
        let mut page = page();
        page.layers.truncate(1);
        page.cracks = ron::from_str(cracks).unwrap();
        let ground = Ground::new(&page, &[], &maps, &site(0.1), &stream()).unwrap();
        let baked = ground.bake(&maps, 2.5e-4);
        (ground, baked)
    };
    let (whole, plain) = made("()");
    let (cracked, baked) = made("(cover: 1, plate_mm: 50, width_mm: 4, depth_mm: 15)");
    let deepest = whole.heights.iter().zip(&cracked.heights).map(|(a, b)| a - b).fold(0.0, f32::max);
    assert!(deepest > 0.005, "{deepest}");
    assert!(plain.ao == baked.ao && plain.slope == baked.slope);
}

/// Expected: a smooth roller crushes most clods and presses the others into the moist ground, so that the ground has less
/// than half as many and none are dry.
#[test]
fn a_roller_crushes_clods_and_presses_the_others_into_the_moist_ground() {
    let rolled = |pressed: f64| {
        let mut page = page();
        page.relief.tools = vec![ron::from_str(&format!("(depth_mm: 0, pressed: {pressed})")).unwrap()];
        page.clods.over_5mm_per_m2 = Vary::fixed(3000.0);
        let ground = ground(&page, 0.15);
        let groups = clods(&ground, &mut Pile::new(&ground), &Canopy::none(&ground), &InView::ALL);
        (whole_clods(&groups).len(), groups.iter().map(|group| group.moisture).min())
    };
    let (tilled, flat) = (rolled(0.0), rolled(0.9));
    assert!(2 * flat.0 < tilled.0, "{tilled:?} {flat:?}");
    assert!(tilled.1 == Some(0) && flat.1 >= Some(2), "{tilled:?} {flat:?}");
}
