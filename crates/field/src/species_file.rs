//! Reads species files. The file that `like` names and the table of leaves that `leaves` names are merged into one text.

use super::desc::SpeciesDesc;
use super::library::Library;
use super::species_text::SpeciesFile;
use furrow_base::input::shipped;
use furrow_base::ron_file::{self, RonFile, Spliced, Step};
use furrow_base::{Error, Result};
use furrow_grow::plant::table::{LeafTable, NoRows};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Fields that are never inherited through `like`.
const OWN: [&str; 5] = ["name", "scientific", "eppo", "role", "like"];

/// Fields whose values are paths.
const PATHS: [&str; 2] = ["texture", "leaves"];

/// Maximum length of a chain of `like` references, in files.
const MOST: usize = 8;

impl SpeciesDesc {
    /// Reads a species file, including the file named by `like` and its table of leaves.
    pub fn read(path: &Path) -> Result<Self> {
        let file = SpeciesFile::read(path)?;
        file.parse()
    }
}

impl SpeciesFile {
    /// Reads a species file. The files that it names may be in any folder.
    pub fn read(path: &Path) -> Result<Self> {
        Library::default().species_file(path)
    }
}

impl Library {
    /// Reads the species file at `path`.
    pub(super) fn species_file(&mut self, path: &Path) -> Result<SpeciesFile> {
        let own = self.inherited(path, &mut Vec::new())?;
        Ok(SpeciesFile(self.with_table(own)?))
    }

    /// Reads a species file and merges it over the file that its `like` names. `heirs` are the files that lead here through
    /// `like`; they serve to detect cycles.
    fn inherited(&mut self, path: &Path, heirs: &mut Vec<PathBuf>) -> Result<Spliced> {
        let page = self.page(path)?;
        let own = Spliced::of(page.clone());
        let Some(at) = own.find(&[Step::Field("like")]) else { return Ok(own) };
        page.check_syntax()?;
        let like = literal(&page, &at, "like: \"capsella.ron\"")?;
        let full = self.need_or_shipped(&page, &like, shipped_file, shipped::species_files)?;
        heirs.push(real(path));
        if heirs.contains(&real(&full)) {
            let message = format!("`{like}` leads back to this file through `like`");
            return Err(page.about_bytes(at, message, "leave `like` out of one of them"));
        }
        if heirs.len() >= MOST {
            let message = format!("more than {MOST} files are chained by `like`");
            return Err(page.about_bytes(at, message, "let `like` name the file that defines most of the species"));
        }
        let base = self.inherited(&full, heirs)?;
        base.page.check_syntax().map_err(|error| base.locate(error))?;
        if !base.page.text[base.find(&[]).unwrap_or(0..0)].starts_with("Species") {
            let help = "name a species file: it starts with Species(";
            return Err(page.about_bytes(at, format!("`{like}` is not a species file"), help));
        }
        // The base file's folder, relative to this file's folder, so that the base file's paths are checked against the same scope.
        let beside = Path::new(&like).parent().unwrap_or(Path::new("")).to_path_buf();
        let folder = if full == page.resolve(&like) { beside } else { folder_of(&full)? };
        let base = base.moved(&folder, &PATHS);
        let base = if writes_layers(&own) { base.without(&plant(&base), "leaves") } else { base };
        let all = own.over(&base, &OWN);
        let whole = all.find(&[]).unwrap_or(0..0);
        Ok(all.without(&whole, "like"))
    }

    /// Inserts the rows of the table of leaves into the text, as `layers` of its stages.
    fn with_table(&mut self, own: Spliced) -> Result<Spliced> {
        let Some(at) = own.find(&[Step::Field("plant"), Step::Field("leaves")]) else { return Ok(own) };
        let located = |error| own.locate(error);
        own.page.check_syntax().map_err(located)?;
        let name = literal(&own.page, &at, "leaves: \"capsella.csv\"").map_err(located)?;
        let full = self.need(&own.page, &name).map_err(located)?;
        let page = RonFile::read_as(&full, ".csv")?;
        self.page_of(&full, &page.text);
        let table = LeafTable::read(&page)?;
        let stages = stages(&own).map_err(located)?;
        let codes: Vec<u32> = stages.iter().map(|(code, _)| *code).collect();
        let layers = table.layers(&codes)?.map_err(|NoRows(code)| {
            let place = stages.iter().find(|(known, _)| *known == code).map_or(0..1, |(_, place)| place.clone());
            let message = format!("the table of leaves has no row for BBCH {code}");
            located(own.page.about_bytes(
                place.start..place.start + 1,
                message,
                "add its rows: the first stage must list all its leaves",
            ))
        })?;
        let mut out = own.clone();
        // From the last stage to the first, so that earlier byte offsets stay valid.
        for ((_, place), parts) in stages.iter().zip(layers).rev() {
            let parts: Vec<_> = parts.into_iter().map(|(text, at)| (text, &page, at)).collect();
            out = with_layers(&out, place, &at, &parts)?;
        }
        let plant = plant(&out);
        Ok(out.without(&plant, "leaves"))
    }
}

/// Returns the path of the built-in species file with this file name, if there is one.
fn shipped_file(name: &str) -> Result<Option<PathBuf>> {
    let is_file = Path::new(name).extension().is_some_and(|extension| extension == "ron");
    if is_file { super::shipped::species(name) } else { Ok(None) }
}

/// Adds layers from the table to one stage. `table` is the byte range of the value that names the table.
fn with_layers(
    own: &Spliced,
    stage: &Range<usize>,
    table: &Range<usize>,
    parts: &[(String, &RonFile, Range<usize>)],
) -> Result<Spliced> {
    let text = &own.page.text;
    let inside = |field| own.value_in(stage, field);
    if let Some(layers) = inside("layers") {
        // Layers inherited through `like` are replaced; layers in the same file as the table are an error.
        if own.source_at(layers.start).path == own.source_at(table.start).path {
            let error = own.page.about_bytes(
                layers.start..layers.start + 1,
                "this stage lists layers, but the table of leaves defines them too",
                "remove `layers` here, or `leaves`, which names the table",
            );
            return Err(own.locate(error));
        }
        return Ok(own.with(layers, parts));
    }
    // Insert after the opening bracket of the stage.
    let open = stage.start + text[stage.clone()].find('(').map_or(0, |open| open + 1);
    let (_, page, at) = &parts[0];
    let mut all = vec![("layers: ".to_owned(), *page, at.clone())];
    all.extend_from_slice(parts);
    all.push((", ".to_owned(), *page, at.clone()));
    Ok(own.with(open..open, &all))
}

/// Returns the BBCH code and the byte range of each stage.
fn stages(own: &Spliced) -> Result<Vec<(u32, Range<usize>)>> {
    let mut all = Vec::new();
    while let Some(place) = own.find(&[Step::Field("plant"), Step::Field("stages"), Step::Item(all.len())]) {
        let code = own.value_in(&place, "bbch").and_then(|at| own.page.text[at].trim().parse().ok());
        let Some(code) = code else {
            let help = "write (bbch: 10, days: 4, hypocotyl_mm: 8, stem_mm: 1)";
            return Err(own.page.about_bytes(place.start..place.start + 1, "this stage has no BBCH code", help));
        };
        all.push((code, place));
    }
    Ok(all)
}

/// Returns the byte range of the value of `plant`; empty if there is none.
fn plant(own: &Spliced) -> Range<usize> {
    own.find(&[Step::Field("plant")]).unwrap_or(0..0)
}

/// Returns `true` if a file lists the layers of its leaves itself, without a table.
fn writes_layers(own: &Spliced) -> bool {
    let at = |step| own.find(&[Step::Field("plant"), step]);
    let Some(stages) = at(Step::Field("stages")) else { return false };
    at(Step::Field("leaves")).is_none() && own.page.text[stages].contains("layers")
}

/// Parses the string literal at the byte range `at`.
fn literal(page: &RonFile, at: &Range<usize>, example: &str) -> Result<String> {
    ron_file::parse_in(&page.text[at.clone()])
        .map_err(|_| page.about_bytes(at.clone(), "a file name is expected here", format!("write {example}")))
}

/// Returns the absolute path of a file's folder.
fn folder_of(file: &Path) -> Result<PathBuf> {
    let full = std::path::absolute(file).map_err(Error::reading(file))?;
    Ok(full.parent().unwrap_or(Path::new("")).to_path_buf())
}

/// Returns the canonical path of a file, or the path unchanged if the file cannot be resolved.
fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::input::Scope;
    use furrow_base::ron_file::{NonNegative, Vary};

    const BASE: &str = r#"Species(name: "base", scientific: "Basis", eppo: "BASIS", role: Crop,
    materials: {
        "leaf": Leaf(texture: "../pictures/leaf.png", pigments: (chlorophyll: 40)),
        "stalk": Leaf(),
    },
    plant: (
        form: Rosette,
        kinds: {"leaf": (shape: Sheet(outline: Power(a: 0.5, b: 1)))},
        stages: [(bbch: 10, days: 3, hypocotyl_mm: 5, stem_mm: 1), (bbch: 12, days: 9, hypocotyl_mm: 5, stem_mm: 2)],
        leaves: "base.csv",
    ),
)"#;
    const TABLE: &str = "leaf,stage,kind,blade_mm,width_mm,petiole_mm,angle_deg\n1,10,leaf,10,5,2,60..70\n1,12,,20,9,4,\n2,12,leaf,12,6,3,40\n";

    /// Creates a folder with the base file, its table and these files.
    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("a")).unwrap();
        for (name, text) in [("a/base.ron", BASE), ("a/base.csv", TABLE)].iter().chain(files) {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        folder
    }

    fn message_of(files: &[(&str, &str)]) -> String {
        let folder = folder(files);
        let error = SpeciesDesc::read(&folder.path().join("own.ron")).unwrap_err();
        error.to_string().replace(&format!("{}/", folder.path().display()), "")
    }

    const OWN: &str = r#"Species(name: "own", eppo: "OWNSP", role: Weed, like: "a/base.ron", "#;

    /// Rationale: a species file with `like` writes only what differs. Expected: its own names and role, everything else from the base
    /// file, paths that still resolve to the same files, and the layers of the base file's table.
    #[test]
    fn a_species_takes_what_it_does_not_write() {
        let own = format!("{OWN}materials: {{\"leaf\": Leaf(pigments: (chlorophyll: 30))}}, plant: (form: Erect))");
        let folder = folder(&[("own.ron", &own)]);
        let desc = SpeciesDesc::read(&folder.path().join("own.ron")).unwrap();
        assert_eq!(
            (desc.name.as_str(), desc.scientific.as_str(), desc.role),
            ("own", "", super::super::desc::Role::Weed)
        );
        assert_eq!(desc.textures().collect::<Vec<_>>(), ["a/../pictures/leaf.png"]);
        assert_eq!(desc.plant.form, furrow_grow::plant::Form::Erect);
        let sizes: Vec<Vec<Vary<NonNegative<10_000>>>> =
            desc.plant.stages.iter().map(|s| s.layers.iter().map(|l| l.blade_mm.clone()).collect()).collect();
        let fixed = Vary::<NonNegative<10_000>>::fixed;
        assert_eq!(sizes, [vec![fixed(10.0)], vec![fixed(20.0), fixed(12.0)]]);
        assert_eq!((desc.like, desc.plant.leaves), (None, String::new()));
        assert!((desc.materials["leaf"].pigments.chlorophyll.get() - 30.0).abs() < 1e-9);
    }

    /// Expected: layers that a file lists itself replace an inherited table, and its own table replaces inherited layers.
    #[test]
    fn layers_and_tables_of_the_heir_come_first() {
        let stages = "stages: [(bbch: 10, days: 3, hypocotyl_mm: 5, stem_mm: 1, layers: [(kind: \"leaf\", blade_mm: 7, width_mm: 3, angle_deg: 50)])]";
        let first = format!("{OWN}plant: ({stages}))");
        let second = r#"Species(name: "two", eppo: "TWOSP", role: Weed, like: "own.ron", plant: (leaves: "two.csv"))"#;
        let table = "leaf,stage,kind,blade_mm,width_mm,angle_deg\n1,10,leaf,8,5,60\n";
        let folder = folder(&[("own.ron", &first), ("two.ron", second), ("two.csv", table)]);
        let blade = |name: &str| {
            let desc = SpeciesDesc::read(&folder.path().join(name)).unwrap();
            desc.plant.stages[0].layers[0].blade_mm.clone()
        };
        assert_eq!((blade("own.ron"), blade("two.ron")), (Vary::fixed(7.0), Vary::fixed(8.0)));
    }

    /// Rationale: an error points at the faulty text, whichever file holds it. Expected: file, line and column.
    #[test]
    fn errors_are_reported_in_the_file_that_has_them() {
        let own = format!("{OWN})");
        let other = BASE.replace("chlorophyll: 40", "chlorophyll: -40");
        for (files, begin) in [
            (vec![("own.ron", own.as_str()), ("a/base.ron", &other)], "a/base.ron:3:79: "),
            (vec![("own.ron", &own), ("a/base.csv", &TABLE.replace("20,9", "20,-9"))], "a/base.csv:3:10: "),
            (vec![("own.ron", &own), ("a/base.csv", &TABLE.replace("2,12,leaf", "2,12,leav"))], "a/base.csv:4:6: "),
            (vec![("own.ron", &own), ("a/base.csv", &TABLE.replace("12", "14"))], "a/base.csv:3:3: "),
            (
                vec![
                    ("own.ron", &own),
                    ("a/base.csv", "leaf,stage,kind,blade_mm,width_mm,angle_deg\n1,12,leaf,8,5,60\n"),
                ],
                "a/base.ron:9:",
            ),
            (vec![("own.ron", &own), ("a/base.ron", "Species(name: 3")], "a/base.ron:1:"),
            (vec![("own.ron", &own), ("a/base.ron", "Field()")], "own.ron:1:55: `a/base.ron` is not a species file"),
            (vec![("own.ron", &OWN.replace("a/base", "a/bse"))], "own.ron:1:"),
            (vec![("own.ron", &format!("{OWN}plant: (forn: Erect))"))], "own.ron:1:77: unknown field `forn`"),
            (
                vec![(
                    "own.ron",
                    &format!("{OWN}plant: (kinds: {{\"leaf\": (shape: Sheet(outline: Power(a: 0.7, b: 1e-30)))}}))"),
                )],
                "own.ron:1:133: 1e-30 is out of range: it must be at least 0.001",
            ),
            (
                vec![("own.ron", "Species(like: \"a/base.ron\")")],
                "own.ron:1:27: fields `name`, `eppo`, `role` of Species are missing",
            ),
            (
                vec![("own.ron", &own), ("a/base.ron", r#"Species(like: "../own.ron")"#)],
                "a/base.ron:1:15: `../own.ron` leads back to this file",
            ),
        ] {
            let words = message_of(&files);
            assert!(words.starts_with(begin), "{begin}: {words}");
        }
    }

    /// Rationale: a misspelt material would have no effect, without any message. Expected: an error at its name; no error for materials
    /// that the base file defines and this species does not use.
    #[test]
    fn a_material_that_nothing_is_made_of_is_refused() {
        let message_of = |own: &str, base: &str| {
            let folder = folder(&[("own.ron", own), ("a/base.ron", base)]);
            let page = RonFile { path: folder.path().join("field.ron"), text: "Field()".to_owned() };
            let error = Library::default().species(&page, "own.ron").err().unwrap();
            error.to_string().replace(&format!("{}/", folder.path().display()), "")
        };
        let words = message_of(&format!("{OWN}materials: {{\"leav\": Leaf(), \"stalk\": Leaf()}})"), BASE);
        let begin = "own.ron:1:81: no leaf, stem or flower is made of the material `leav`";
        assert!(words.starts_with(begin) && words.contains("did you mean `leaf`"), "{words}");
        let idle = BASE.replace("\"stalk\": Leaf()", "\"stalk\": Leaf(), \"petal\": Leaf()");
        // The only fault is the missing image file.
        let words = message_of(&format!("{OWN})"), &idle);
        assert!(words.contains("there is no file `a/../pictures/leaf.png`"), "{words}");
    }

    /// Rationale: an error suggests the nearest known name, and a folder of the same name does not hide a built-in species. Expected:
    /// the built-in file.
    #[test]
    fn files_that_ship_are_found_behind_folders_and_suggested() {
        let folder = folder(&[("own.ron", &OWN.replace("a/base.ron\", ", "capsela.ron\")"))]);
        let error = SpeciesDesc::read(&folder.path().join("own.ron")).unwrap_err();
        assert!(error.message().contains("there is no file `capsela.ron`"), "{error}");
        assert!(error.advice().unwrap().starts_with("did you mean `capsella.ron`, which ships?"), "{error}");
        std::fs::create_dir(folder.path().join("potato")).unwrap();
        let page = RonFile { path: folder.path().join("field.ron"), text: "Field()".to_owned() };
        let find = crate::shipped::species;
        let found = Library::default().need_or_shipped(&page, "potato", find, shipped::species_files).unwrap();
        assert_eq!(found, shipped::folder().unwrap().join("scenes/species/potato.ron"));
    }

    /// Rationale: a species file from an untrusted source must not read anything outside its folder. Expected: an error if its `like`
    /// names a file outside.
    #[test]
    fn a_file_from_elsewhere_is_like_none_outside_its_folder() {
        let folder = folder(&[
            ("a/own.ron", r#"Species(name: "own", eppo: "OWNSP", role: Weed, like: "../out.ron")"#),
            ("out.ron", BASE),
        ]);
        let scope = Scope::Below { folder: folder.path().join("a"), help: "stay" };
        let error = Library::within(scope).species_file(&folder.path().join("a/own.ron")).err().unwrap();
        assert!(error.message().contains("does not lie in the folder"), "{error}");
    }
}
