//! Kinds of scene parts (soil, debris, organs, models): the finest label.

use furrow_base::math::ToInt;
use furrow_grow::plant::OrganKind;
use furrow_grow::soil::DebrisKind;

/// Kind of a scene part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// The ground and its clods.
    Soil,
    /// Debris on the ground: stones, straw, sticks, bits.
    Debris(DebrisKind),
    /// A model from disk without a name; its organs are not known.
    Model,
    /// A model from disk with a name, by the index of the name in the scene file; below [`Self::MOST_NAMED`].
    Named(u8),
    /// A hedge or tree on the horizon.
    Backdrop,
    /// An organ of a plant.
    Organ(OrganKind),
}

/// Number of the first named model in label maps.
const FIRST_NAMED: u8 = 101;

impl PartKind {
    /// Maximum number of model names in a scene file; their numbers in label maps end at 200.
    pub const MOST_NAMED: usize = 100;

    /// All kinds except named models: number in label maps, name, colour in label maps (RGB), kind. Number 0 marks pixels that
    /// show no part, such as the sky.
    pub const NUMBERED: [(u8, &'static str, [u8; 3], Self); 20] = [
        (1, "soil", [94, 72, 52], Self::Soil),
        (2, "stone", [150, 150, 160], Self::Debris(DebrisKind::Stone)),
        (3, "straw", [214, 190, 110], Self::Debris(DebrisKind::Straw)),
        (4, "stick", [120, 80, 30], Self::Debris(DebrisKind::Stick)),
        (5, "bit", [160, 110, 70], Self::Debris(DebrisKind::Bit)),
        (6, "model", [60, 110, 220], Self::Model),
        (7, "backdrop", [20, 50, 45], Self::Backdrop),
        (11, "blade", [40, 170, 60], Self::Organ(OrganKind::Blade)),
        (12, "petiole", [200, 220, 60], Self::Organ(OrganKind::Petiole)),
        (13, "cotyledon", [120, 220, 150], Self::Organ(OrganKind::Cotyledon)),
        (14, "hypocotyl", [200, 90, 120], Self::Organ(OrganKind::Hypocotyl)),
        (15, "stem", [170, 60, 200], Self::Organ(OrganKind::Stem)),
        (16, "sheath", [0, 150, 150], Self::Organ(OrganKind::Sheath)),
        (17, "flower", [250, 250, 250], Self::Organ(OrganKind::Flower)),
        (18, "bud", [150, 255, 200], Self::Organ(OrganKind::Bud)),
        (19, "head", [255, 210, 0], Self::Organ(OrganKind::Head)),
        (20, "ear", [255, 140, 40], Self::Organ(OrganKind::Ear)),
        (21, "tassel", [180, 120, 255], Self::Organ(OrganKind::Tassel)),
        (22, "pod", [120, 180, 230], Self::Organ(OrganKind::Pod)),
        (23, "berry", [230, 30, 60], Self::Organ(OrganKind::Berry)),
    ];

    /// Returns the colour of each number in label maps, from 0, for a scene with `named` model names. Unused numbers are black.
    pub fn palette(named: usize) -> Vec<[u8; 3]> {
        let named = (0..=u8::MAX).take(named).map(|k| (Self::Named(k).number(), of_name(k)));
        let mut all = Vec::new();
        for (number, color) in Self::NUMBERED.map(|(number, _, color, _)| (number, color)).into_iter().chain(named) {
            let place = usize::from(number);
            all.resize(all.len().max(place + 1), [0; 3]);
            all[place] = color;
        }
        all
    }

    /// Returns the number of this kind in label maps.
    pub fn number(self) -> u8 {
        match self {
            Self::Named(place) => FIRST_NAMED.saturating_add(place),
            kind => Self::NUMBERED.iter().find(|(.., known)| *known == kind).map_or(0, |(number, ..)| *number),
        }
    }

    /// Returns the organ kind, or `None` if this is not an organ.
    pub fn organ(self) -> Option<OrganKind> {
        match self {
            Self::Organ(kind) => Some(kind),
            _ => None,
        }
    }
}

/// Returns the colour of the named model at index `place`: blues and purples that differ from one model to the next.
fn of_name(place: u8) -> [u8; 3] {
    let channel = |step: usize| (40 + (usize::from(place) * step) % 180).to_u8();
    [channel(53), channel(97), 230]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: every kind has its own number, and the organ names agree with [`OrganKind::name`].
    #[test]
    fn every_kind_has_its_number_and_name() {
        let organs = [
            OrganKind::Blade,
            OrganKind::Petiole,
            OrganKind::Cotyledon,
            OrganKind::Hypocotyl,
            OrganKind::Stem,
            OrganKind::Sheath,
            OrganKind::Flower,
            OrganKind::Bud,
            OrganKind::Head,
            OrganKind::Ear,
            OrganKind::Tassel,
            OrganKind::Pod,
            OrganKind::Berry,
        ];
        let debris = [DebrisKind::Stone, DebrisKind::Stick, DebrisKind::Straw, DebrisKind::Bit];
        let all = organs.map(PartKind::Organ).into_iter().chain(debris.map(PartKind::Debris));
        let all: Vec<PartKind> = all.chain([PartKind::Soil, PartKind::Model, PartKind::Backdrop]).collect();
        let mut numbers: Vec<u8> = all.iter().map(|kind| kind.number()).collect();
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers.len(), all.len());
        assert!(!numbers.contains(&0));
        // Named models come after them, and only they need a longer palette.
        assert!(numbers.iter().all(|number| *number < PartKind::Named(0).number()));
        assert_eq!(PartKind::Named(PartKind::MOST_NAMED.to_u8() - 1).number(), 200);
        assert_eq!([0, 2].map(|named| PartKind::palette(named).len()), [24, 103]);
        for (_, name, _, kind) in PartKind::NUMBERED {
            assert!(kind.organ().is_none_or(|organ| organ.name() == name), "{name}");
        }
    }
}
