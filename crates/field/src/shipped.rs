//! Species that ship with the program, and the names that a scene file can use for them.

use super::aliases;
use super::desc::SpeciesDesc;
use furrow_base::input::shipped;
use furrow_base::ron_file::nearest;
use furrow_base::{Error, Result};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Fewest letters of a word of a name in another language that finds a species: `de` and `des` say nothing.
const SHORTEST_WORD: usize = 4;

/// A species that ships with the program.
pub struct Shipped {
    /// Path of the species file.
    pub file: PathBuf,
    /// Parsed species file.
    pub desc: SpeciesDesc,
}

impl Shipped {
    /// Returns the name of the species file without `.ron`.
    pub fn stem(&self) -> String {
        self.file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Returns the names that identify the species: file name without `.ron`, EPPO code, English name, scientific name,
    /// and its names in other languages.
    pub fn names(&self) -> Vec<String> {
        let SpeciesDesc { name, scientific, eppo, .. } = &self.desc;
        let own = [self.stem(), eppo.clone(), name.clone(), scientific.clone()];
        own.into_iter().chain(self.other_names().iter().map(|name| (*name).to_owned())).collect()
    }

    /// Returns the names that the species file does not have: in other languages, older scientific ones, other EPPO codes.
    pub fn other_names(&self) -> &'static [&'static str] {
        aliases::of(&self.stem())
    }

    /// Returns `true` if this is one of the names, regardless of case, signs and accents.
    fn is_called(&self, name: &str) -> bool {
        self.names().iter().any(|own| aliases::same(own, name))
    }

    /// Returns `true` if `word` is one of the words of the English name, such as `thistle` in "creeping thistle", or of
    /// another name. Only the English name is split at hyphens: a sow-thistle is no thistle.
    fn has_word(&self, word: &str) -> bool {
        let english = self.desc.name.split(|c: char| !c.is_alphanumeric() && c != '\'');
        let others = aliases::of(&self.stem()).iter().filter(|name| name.contains(' '));
        let others = others.flat_map(|name| name.split(' ')).filter(|own| own.chars().count() >= SHORTEST_WORD);
        english.chain(others).any(|own| aliases::same(own, word))
    }
}

/// Species files that cannot be read, each with its error.
type Faults = Vec<(PathBuf, Error)>;

/// Reads all species that ship with the program. Returns them in the order of their file names, and the files that cannot be read.
pub fn all_species() -> Result<(Vec<Shipped>, Faults)> {
    let (mut all, mut faults) = (Vec::new(), Vec::new());
    let read = |file: PathBuf| (SpeciesDesc::read(&file), file);
    for (desc, file) in shipped::species_files()?.into_par_iter().map(read).collect::<Vec<_>>() {
        match desc {
            Ok(desc) => all.push(Shipped { file, desc }),
            Err(fault) => faults.push((file, fault)),
        }
    }
    Ok((all, faults))
}

/// Finds the file of the species with this name: `cirsium`, `cirsium.ron`, `CIRAR`, `creeping thistle`, `Cirsium arvense`, or a
/// word that occurs in the English name of no other species, `thistle`; or by a name in another language,
/// `Ackerkratzdistel`. Returns `None` if `name` is the name of some other file, and an error if it is not a file name and
/// no species has that name.
pub fn species(name: &str) -> Result<Option<PathBuf>> {
    let (wanted, is_file) = name.strip_suffix(".ron").map_or((name, false), |stem| (stem, true));
    let file_matches = |file: &&PathBuf| {
        let stem = file.file_stem().unwrap_or_default();
        if is_file { stem == wanted } else { stem.eq_ignore_ascii_case(wanted) }
    };
    if let Some(file) = shipped::species_files()?.iter().find(file_matches) {
        SpeciesDesc::read(file)?;
        return Ok(Some(file.clone()));
    }
    if is_file {
        return Ok(None);
    }
    let (all, faults) = all_species()?;
    match called(&all, wanted).as_slice() {
        [one] => Ok(Some(one.file.clone())),
        [] if Path::new(wanted).extension().is_some() => Ok(None),
        [] => {
            // The wanted species may be in a file that cannot be read.
            if let Some((_, fault)) = faults.into_iter().next() {
                return Err(fault);
            }
            Err(unknown(&all, wanted))
        }
        several => Err(ambiguous(several, wanted)),
    }
}

/// Returns the English name and the EPPO code of the shipped species that a scene file finds by this name; `None` if none or
/// several have it.
pub fn identity(name: &str) -> Option<[&'static str; 2]> {
    static ALL: OnceLock<Vec<Shipped>> = OnceLock::new();
    let all = ALL.get_or_init(|| all_species().map(|(all, _)| all).unwrap_or_default());
    match called(all, name).as_slice() {
        [one] => Some([&one.desc.name, &one.desc.eppo]),
        _ => None,
    }
}

/// Returns `true` if several species have this name, or a name with this word.
pub fn is_ambiguous(name: &str) -> Result<bool> {
    let is_file = shipped::species_files()?.iter().any(|file| file.file_stem().is_some_and(|stem| stem == name));
    Ok(!is_file && called(&all_species()?.0, name).len() > 1)
}

/// Endings of plurals in English, French, Spanish and German.
const PLURALS: [&str; 4] = ["es", "s", "en", "n"];

/// Returns the species that have this name; if there is none, those of which it is the plural, or that have a name with this word.
pub fn called<'a>(all: &'a [Shipped], wanted: &str) -> Vec<&'a Shipped> {
    let exact = |name: &str| all.iter().filter(|species| species.is_called(name)).collect::<Vec<_>>();
    let singulars = PLURALS.iter().filter_map(|ending| wanted.strip_suffix(ending));
    let long = singulars.filter(|name| name.chars().count() >= SHORTEST_WORD);
    let found = std::iter::once(wanted).chain(long).map(exact).find(|found| !found.is_empty());
    found.unwrap_or_else(|| all.iter().filter(|species| species.has_word(wanted)).collect())
}

/// Returns the error about a name that no species has.
fn unknown(all: &[Shipped], wanted: &str) -> Error {
    let words = |species: &Shipped| species.desc.name.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let mut names: Vec<String> = all.iter().flat_map(|species| [species.names(), words(species)].concat()).collect();
    names.retain(|name| !name.is_empty());
    let near = nearest(&names, wanted).map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
    Error::input(format!("no built-in species is called `{wanted}`"))
        .help(format!("{near}`trace species` lists them; a species file of your own ends in .ron"))
}

/// Returns the error about a name that several species have.
fn ambiguous(several: &[&Shipped], wanted: &str) -> Error {
    let names: Vec<&str> = several.iter().map(|species| species.desc.name.as_str()).collect();
    Error::input(format!("several species are called `{wanted}`")).help(format!("write {}", names.join(" or ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names that two species share; the error lists both.
    const SHARED: [&str; 2] = ["BRSOX", "Brassica oleracea"];

    /// Expected: every shipped species has further names, and none of them is a name of another one, but for [`SHARED`].
    #[test]
    fn no_name_means_two_species() {
        let all = all_species().unwrap().0;
        let stems: Vec<String> = all.iter().map(Shipped::stem).collect();
        assert_eq!(stems, aliases::ALIASES.map(|(stem, _)| stem));
        for one in &all {
            for other in all.iter().filter(|other| other.file != one.file) {
                let twice = one.names().into_iter().find(|a| other.is_called(a) && !SHARED.contains(&a.as_str()));
                assert_eq!(twice, None, "{} and {}", one.stem(), other.stem());
            }
        }
    }

    #[test]
    fn every_name_of_a_species_leads_to_its_file() {
        let all = all_species().unwrap().0;
        for species in &all {
            for name in species.names() {
                assert!(!name.is_empty(), "{}", species.file.display());
                let found: Vec<String> = called(&all, &name).into_iter().map(Shipped::stem).collect();
                assert!(found.contains(&species.stem()), "{name}: {found:?}");
                assert!(found.len() == 1 || SHARED.contains(&name.as_str()), "{name}: {found:?}");
            }
        }
        let stem = |name| species(name).unwrap().map(|file| file.file_stem().unwrap().to_str().unwrap().to_owned());
        for name in ["cirsium", "cirsium.ron", "CIRAR", "cirar", "Cirsium arvense", "creeping thistle", "thistle"] {
            assert_eq!(stem(name).as_deref(), Some("cirsium"), "{name}");
        }
        for (name, file) in [
            ("corn", "maize"),
            ("Canola", "rape"),
            ("lambsquarters", "chenopodium"),
            ("Zuckerrübe", "sugar_beet"),
            ("zuckerruebe", "sugar_beet"),
            ("betterave sucriere", "sugar_beet"),
            ("Shepherds-purse", "capsella"),
            ("trigo", "wheat"),
            ("haricot vert", "bean"),
            ("haricots verts", "bean"),
            ("spring onion", "onion"),
            ("winter barley", "barley"),
            ("Beta vulgaris var. altissima", "sugar_beet"),
            ("mustard", "sinapis"),
            ("PHSVN", "bean"),
            ("horvw", "barley"),
            ("BEAVA", "sugar_beet"),
        ] {
            assert_eq!(stem(name).as_deref(), Some(file), "{name}");
        }
        assert_eq!((stem("thistle.ron"), stem("a.glb")), (None, None));
    }

    /// Rationale: near infrared separates leaves from soil, so no species may have leaves of an unnatural colour. Expected: the NDVI of
    /// the pigments of every blade except cotyledons is within the range of measured leaves. Lettuce is left out: it is paler than the
    /// measured one, 0.58 instead of 0.65. Source: `tests/ref/measured_ndvi.csv`, which has no stems and no cotyledons.
    #[test]
    fn blades_have_the_ndvi_of_measured_leaves() {
        use furrow_grow::plant::OrganKind;
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/ref/measured_ndvi.csv");
        let text = std::fs::read_to_string(path).unwrap();
        let line = text.lines().find(|line| line.starts_with("leaf,")).unwrap();
        let leaf: Vec<f32> = line.split(',').skip(1).map(|n| n.parse().unwrap()).collect();
        let mut wrong = Vec::new();
        for species in all_species().unwrap().0.iter().filter(|species| species.desc.eppo != "LACSA") {
            for (name, kind) in &species.desc.plant.kinds {
                if kind.organ != OrganKind::Blade {
                    continue;
                }
                let material = if kind.material.is_empty() { name } else { &kind.material };
                let [red, _, _, infrared] = species.desc.materials[material].pigments.bands().reflectance.to_array();
                let ndvi = (infrared - red) / (infrared + red);
                if !(leaf[0]..leaf[1]).contains(&ndvi) {
                    wrong.push(format!("{} {material}: {ndvi:.3}", species.desc.name));
                }
            }
        }
        assert!(wrong.is_empty(), "{wrong:?}");
    }

    #[test]
    fn unknown_and_ambiguous_names_are_reported() {
        let message = |name| species(name).unwrap_err().to_string();
        assert!(message("thistel").contains("did you mean"), "{}", message("thistel"));
        assert!(message("grass").contains("barnyard grass or annual meadow-grass"), "{}", message("grass"));
        for (name, both) in
            [("foxtail", "write black-grass or green foxtail"), ("BRSOX", "write white cabbage or cauliflower")]
        {
            assert!(message(name).ends_with(both), "{}", message(name));
            assert!(is_ambiguous(name).unwrap() && !is_ambiguous("thistle").unwrap(), "{name}");
        }
    }
}
