//! What a field is and what it says of itself.
//!
//! Rationale: people learn from what is written beside the images, so it must be what was drawn, in the units it names.
//! Expected: a season is shared by all plants of a field; records agree with the scene that was built from the same numbers.

mod common;

use common::program::field;
use furrow::scene::build::Options;
use furrow::scene::{Field, PlantRecord};

/// A row of beets among cleavers on a bare plane, by what their growths are.
fn meadow(beet: &str, cleavers: &str, index: u64) -> Field {
    let text = format!(
        r#"Field(
            seed: 4,
            camera: Pinhole(size: (32, 24), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.8)),
            lights: [Constant(radiance: (1, 1, 1, 1))],
            crops: [(species: "scenes/species/sugar_beet.ron", growth: {beet}, rows: (in_row_m: 0.15))],
            weeds: [(species: "scenes/species/galium.ron", growth: {cleavers}, spread: (per_m2: 40))],
        )"#
    );
    field(&text, &Options { index, ..Options::default() })
}

fn of(field: &Field, eppo: &str) -> Vec<PlantRecord> {
    field.plants.iter().filter(|p| p.eppo == eppo).cloned().collect()
}

#[test]
fn all_plants_of_a_field_share_its_season() {
    let mut seen = [0, 0];
    for index in 0..12 {
        let field = meadow("Either([Bbch(10), Bbch(16)])", "Either([AgeDays(3), AgeDays(25)])", index);
        let late = field.plants[0].bbch == 16;
        seen[usize::from(late)] += 1;
        let (beets, cleavers) = (of(&field, "BEAVX"), of(&field, "GALAP"));
        assert!(!beets.is_empty() && !cleavers.is_empty());
        assert!(beets.iter().all(|p| p.bbch == if late { 16 } else { 10 }), "field {index}");
        assert!(cleavers.iter().all(|p| p.age_days == if late { 25.0 } else { 3.0 }), "field {index}");
    }
    assert!(seen[0] > 1 && seen[1] > 1, "{seen:?}: one season never comes");
}

#[test]
fn a_list_of_growths_moves_nothing_else() {
    let growth = "AgeDays(Uniform(8, 30))";
    let (plain, listed) = (meadow(growth, growth, 2), meadow(growth, &format!("Either([{growth}, {growth}])"), 2));
    assert!(plain.plants.len() > 5);
    assert_eq!(plain.plants, listed.plants);
    let other = meadow(growth, "Either([AgeDays(5), AgeDays(6)])", 2);
    assert_eq!(of(&plain, "BEAVX"), of(&other, "BEAVX"));
    assert_ne!(of(&plain, "GALAP"), of(&other, "GALAP"));
}
