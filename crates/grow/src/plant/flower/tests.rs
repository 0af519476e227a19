//! Flowers against closed forms: numbers of parts, sizes and maximum numbers of triangles.

use super::*;
use crate::plant::organ::{Organ, OrganKind};
use furrow_base::geometry::Mesh;
use furrow_base::math::{Frame, ToFloat, Vec3};
use furrow_base::sampling::Purpose;

const SIZE: f32 = 0.03;

/// Builds one upright flower at the origin with the given opening.
fn draw(text: &str, opening: f32, seed: u64) -> (FlowerDesc, Vec<Organ>) {
    let desc: FlowerDesc = ron::from_str(text).unwrap();
    assert_eq!(desc.check(), Ok(()));
    let mut pen = FlowerMesher::new(0.9e-3);
    let bloom = Bloom { base: Vec3::ZERO, frame: Frame::about(Vec3::Z), size: SIZE, opening };
    grow(&desc, &bloom, &mut pen, &mut Stream::of(seed, 0, Purpose::Test, 1));
    let organs = pen.finish();
    for organ in &organs {
        assert_eq!(organ.mesh.fault(), None);
        assert_eq!(organ.leaf, 0);
    }
    let triangles: usize = organs.iter().map(|o| o.mesh.triangles.len()).sum();
    assert!(triangles.to_f64() <= desc.most_triangles(), "{triangles} of {}", desc.most_triangles());
    (desc, organs)
}

fn of<'a>(organs: &'a [Organ], material: &str) -> &'a Mesh {
    &organs.iter().find(|o| o.material == material).unwrap_or_else(|| panic!("no {material}")).mesh
}

const CROSS: &str = r#"Corolla(rings: [(count: 4, length: 0.6, aspect: 0.5, material: "sepal"), (count: 4, aspect: 0.6, material: "petal")],
    stamens: 6, centre_material: "ovary")"#;
const DAISY: &str = r#"Head(disc: 0.4, dome: 0.6, florets: 150, young: 0.4, young_material: "closed", receptacle_material: "receptacle",
    rings: [(count: 21, length: 0.4, aspect: 0.3, cup_deg: -5, material: "bract"), (count: 13, aspect: 0.3, cup_deg: 0, bend_deg: 0, material: "ray")])"#;

/// Expected: the numbers of sheets and anthers equal those of the description.
#[test]
fn a_flower_has_its_petals_sepals_and_stamens() {
    for seed in 0..10 {
        let (_, organs) = draw(CROSS, 1.0, seed);
        assert!(organs.iter().all(|o| o.kind == OrganKind::Flower));
        assert_eq!(of(&organs, "petal").pieces().len(), 4);
        assert_eq!(of(&organs, "sepal").pieces().len(), 4);
        assert_eq!(of(&organs, "anther").pieces().len(), 6);
        // The ovary and six filaments.
        assert_eq!(of(&organs, "ovary").pieces().len(), 7);
    }
}

/// Expected: a closed flower is a bud without anthers, narrower than an open one and taller than wide.
#[test]
fn a_closed_flower_is_a_bud() {
    for seed in 0..10 {
        let (_, organs) = draw(CROSS, 0.0, seed);
        assert!(organs.iter().all(|o| o.kind == OrganKind::Bud && o.material != "anther"));
        let (lo, hi) = of(&organs, "petal").bounds().unwrap();
        assert!((hi - lo).truncate().max_element() < 0.8 * SIZE && hi.z > 0.2 * SIZE, "{lo} {hi}");
    }
}

/// Expected: n florets with the fraction `young` closed, and one dome below them; the given number of rays. Ray tips
/// are at the head's radius, with a variation of 5 % (three standard deviations), and rays without bend are flat. The
/// outermost floret is at √((n − ½)/n) of the disc's radius. Source: Vogel 1979.
#[test]
fn a_head_has_its_florets_and_rays_where_vogel_puts_them() {
    for seed in 0..10 {
        let (_, organs) = draw(DAISY, 1.0, seed);
        assert!(organs.iter().all(|o| o.kind == OrganKind::Head));
        assert_eq!(of(&organs, "ray").pieces().len(), 13);
        assert_eq!(of(&organs, "bract").pieces().len(), 21);
        assert_eq!(of(&organs, "closed").pieces().len(), 60);
        assert_eq!(of(&organs, "disc").pieces().len(), 91);
        let far = |mesh: &Mesh| mesh.positions.iter().fold(0.0_f32, |r, p| r.max(p.truncate().length()));
        let share = far(of(&organs, "ray")) / (0.5 * SIZE);
        assert!((0.9..1.15).contains(&share), "{share}");
        let spacing = (std::f32::consts::PI / 150.0_f32).sqrt();
        let disc = far(of(&organs, "disc")) / (0.2 * SIZE);
        assert!((0.95..1.0 + 2.0 * spacing).contains(&disc), "{disc}");
    }
}

/// Expected: two ranks on opposite sides of the rachis, so an ear of wheat is flat; the given number of spikelets and
/// length of awns.
#[test]
fn an_ear_has_its_spikelets_in_two_ranks() {
    let ear = r#"Spike(spikelets: 18, ranks: 2, florets: 3, width: 0.14, angle_deg: 20, awn: 0.5, material: "ear", awn_material: "awn")"#;
    for seed in 0..10 {
        let (_, organs) = draw(ear, 1.0, seed);
        assert!(organs.iter().all(|o| o.kind == OrganKind::Ear));
        assert_eq!(of(&organs, "ear").pieces().len(), 18 * 3 + 1);
        assert_eq!(of(&organs, "awn").pieces().len(), 18 * 3);
        let high = of(&organs, "awn").bounds().unwrap().1.z / SIZE;
        assert!((1.2..1.7).contains(&high), "{high}");
    }
}

/// Expected: a pod has the given length, width and thickness; its notch shortens the middle only; a berry's width is
/// its size.
#[test]
fn fruits_have_their_measures() {
    let pod = r#"Pod(outline: Power(a: 1.0, b: 1.0), aspect: 0.5, flat: 0.4, style: 0, material: "pod")"#;
    let (_, organs) = draw(pod, 1.0, 0);
    let (lo, hi) = of(&organs, "pod").bounds().unwrap();
    let mut across = [(hi - lo).x, (hi - lo).y];
    across.sort_by(f32::total_cmp);
    assert!(((hi - lo).z / SIZE - 1.0).abs() < 1e-3);
    assert!((across[1] / SIZE - 0.5).abs() < 0.02 && (across[0] / SIZE - 0.2).abs() < 0.02, "{across:?}");
    let heart =
        r#"Pod(outline: Power(a: 1.0, b: 0.15), aspect: 0.9, flat: 0.3, notch: 0.3, style: 0, material: "pod")"#;
    let (_, organs) = draw(heart, 1.0, 0);
    let mesh = of(&organs, "pod");
    let high = |near: bool| {
        let inside = |p: &&Vec3| (p.x.hypot(p.y) < 0.1 * SIZE) == near;
        mesh.positions.iter().filter(inside).fold(0.0_f32, |z, p| z.max(p.z))
    };
    assert!(high(true) < 0.95 * SIZE && high(false) <= 1.001 * SIZE, "{} {}", high(true), high(false));
    let (_, organs) = draw("Berry(aspect: 1.1, sepals: 5)", 1.0, 0);
    assert!(organs.iter().all(|o| o.kind == OrganKind::Berry));
    let (lo, hi) = of(&organs, "berry").bounds().unwrap();
    assert!(((hi - lo).x / SIZE - 1.0).abs() < 0.02 && ((hi - lo).z / SIZE - 1.1).abs() < 0.02);
    assert_eq!(of(&organs, "sepal").pieces().len(), 5);
}

/// Expected: a poppy's capsule including the disc has the given length and width and is widest above its middle; 8 to
/// 14 rays lie on the disc and almost span it. All of it is a pod.
#[test]
fn a_capsule_bears_its_stigma() {
    for seed in 0..20 {
        let (_, organs) = draw("Capsule(aspect: 0.8, disc: 0.75)", 1.0, seed);
        assert!(organs.iter().all(|o| o.kind == OrganKind::Pod));
        let body = of(&organs, "pod");
        let (lo, hi) = body.bounds().unwrap();
        assert!((hi.z / SIZE - 1.0).abs() < 1e-3 && ((hi - lo).x / SIZE - 0.8).abs() < 0.03, "{lo} {hi}");
        let far = |p: &Vec3| p.truncate().length();
        let widest = body.positions.iter().max_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
        assert!((0.5..0.8).contains(&(widest.z / SIZE)), "{widest}");
        let stigma = of(&organs, "stigma");
        assert!((8..=14).contains(&stigma.pieces().len()), "{}", stigma.pieces().len());
        let reach = stigma.positions.iter().map(far).fold(0.0, f32::max) / (0.5 * 0.75 * 0.8 * SIZE);
        assert!((0.95..1.2).contains(&reach), "{reach}");
        assert!(stigma.positions.iter().all(|p| p.z > 0.85 * SIZE));
    }
}

/// Expected: the given numbers of silks and husks; a tassel has its rachis and branches, all covered with spikelets.
#[test]
fn maize_has_its_silks_and_its_tassel() {
    let (_, organs) = draw("Cob(width: 0.25, husks: 5, silks: 40)", 1.0, 1);
    assert_eq!(of(&organs, "silk").pieces().len(), 40);
    assert_eq!(of(&organs, "husk").pieces().len(), 6);
    let tassel = "Panicle(branches: 8, branch: 0.5, angle_deg: 40, bend_deg: 60, spikelets: 50, spikelet: 0.03)";
    let (_, organs) = draw(tassel, 1.0, 1);
    assert!(organs.iter().all(|o| o.kind == OrganKind::Tassel));
    let pieces = of(&organs, "husk").pieces().len();
    // The central spike bears 60 % of 50, the branches between 0.65 × 0.85 and 1 × 1.1 of half of 50, less their bare 6 %.
    assert!((9 + 30 + 8 * 12..=9 + 30 + 8 * 26).contains(&pieces), "{pieces}");
}

/// Expected: a flower with too many triangles is refused with a message.
#[test]
fn a_flower_that_is_too_large_is_refused() {
    let rays = "Head(disc: 0.4, florets: 900000, rings: [])";
    let desc: FlowerDesc = ron::from_str(rays).unwrap();
    assert!(desc.check().unwrap_err().0.contains("triangles"));
}
