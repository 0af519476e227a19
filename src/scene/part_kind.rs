//! What the parts of a scene are: the finest label.

use crate::plant::OrganKind;
use crate::soil::DebrisKind;

/// What a part is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// The ground and its clods.
    Soil,
    /// What lies on the ground.
    Debris(DebrisKind),
    /// A model from disk, of whose organs nothing is known.
    Model,
    /// An organ of a plant.
    Organ(OrganKind),
}

impl PartKind {
    /// All of them with their numbers in label maps, their names, and their colours there: soils brown, organs green, others apart. 0 is nothing at
    /// all, such as the sky.
    pub const NUMBERED: [(u8, &'static str, [u8; 3], Self); 19] = [
        (1, "soil", [94, 72, 52], Self::Soil),
        (2, "stone", [150, 150, 160], Self::Debris(DebrisKind::Stone)),
        (3, "straw", [214, 190, 110], Self::Debris(DebrisKind::Straw)),
        (4, "stick", [120, 80, 30], Self::Debris(DebrisKind::Stick)),
        (5, "bit", [160, 110, 70], Self::Debris(DebrisKind::Bit)),
        (6, "model", [60, 110, 220], Self::Model),
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

    /// Colours of the numbers in label maps, from 0; black where there is none.
    pub fn palette() -> Vec<[u8; 3]> {
        let last = Self::NUMBERED.iter().map(|(number, ..)| usize::from(*number)).max().unwrap_or(0);
        let mut all = vec![[0; 3]; last + 1];
        for (number, _, color, _) in Self::NUMBERED {
            all[usize::from(number)] = color;
        }
        all
    }

    /// Its number in label maps.
    pub fn number(self) -> u8 {
        Self::NUMBERED.iter().find(|(.., kind)| *kind == self).map_or(0, |(number, ..)| *number)
    }

    /// The organ, if it is one.
    pub fn organ(self) -> Option<OrganKind> {
        match self {
            Self::Organ(kind) => Some(kind),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: every kind has a number of its own, and organs have the names that they have elsewhere.
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
        let all: Vec<PartKind> = all.chain([PartKind::Soil, PartKind::Model]).collect();
        let mut numbers: Vec<u8> = all.iter().map(|kind| kind.number()).collect();
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers.len(), all.len());
        assert!(!numbers.contains(&0));
        for (_, name, _, kind) in PartKind::NUMBERED {
            assert!(kind.organ().is_none_or(|organ| organ.name() == name), "{name}");
        }
    }
}
