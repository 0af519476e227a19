//! Pairing of images, and their labels and near infrared.
//!
//! An image is a file, or a folder with `rgb.png` or `rgb.jpg`; `nir.png` or `nir.jpg` and `semantics.png` next to it
//! belong to it. Any other folder holds several images, below `images/` if it has that folder. They are the folders
//! with `rgb` (datasets, renders), named by the folder; otherwise every PNG and JPEG, named by its file, with labels
//! below `labels/`. Names have no extension, so a JPEG may be paired with a PNG.
//!
//! Files that a dataset's recipe omits are not read.

use furrow_base::{Error, Result};
use furrow_dataset::model::image_files::photograph_in;
use furrow_dataset::model::recipe::{FILE, Recipe};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

/// File name extensions of images.
const PICTURES: [&str; 3] = ["png", "jpg", "jpeg"];
/// Largest number of names listed in a warning or error.
const MOST_NAMES: usize = 3;

/// Two images of the same scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pair {
    /// Name of both images.
    pub name: String,
    /// Reference image.
    pub a: PathBuf,
    /// Test image.
    pub b: PathBuf,
    /// Near infrared of both, if both have it.
    pub nir: Option<(PathBuf, PathBuf)>,
    /// Labels: the classes of the pixels.
    pub labels: Option<PathBuf>,
}

/// Pairs to compare.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pairs {
    /// Name of the reference: the end of its path, long enough to distinguish it from the test.
    pub a: String,
    /// Name of the test.
    pub b: String,
    /// Pairs by name; at least one.
    pub pairs: Vec<Pair>,
    /// Names that exist only in the reference.
    pub only_a: Vec<String>,
    /// Names that exist only in the test.
    pub only_b: Vec<String>,
}

/// Single image, or several by name.
enum Source {
    One(PathBuf),
    Many(BTreeMap<String, PathBuf>),
}

impl Pairs {
    /// Finds the pairs of two images or two folders. `labels` is a file or folder of labels; by default they are
    /// searched next to `a`. Returns an error if nothing can be paired, or if `labels` is given but no pair has labels.
    pub fn find(a: &Path, b: &Path, labels: Option<&Path>) -> Result<Self> {
        let (recipe_a, recipe_b) = (recipe_of(a), recipe_of(b));
        let (of_a, of_b) = (source(a, recipe_a.as_ref())?, source(b, recipe_b.as_ref())?);
        let infrared = |a: &Path, b: &Path| {
            Some((beside_rgb(a, "nir", recipe_a.as_ref())?, beside_rgb(b, "nir", recipe_b.as_ref())?))
        };
        if let Some(labels) = labels {
            there(labels)?;
        }
        let (name_a, name_b) = names(a, b);
        let mut found = Self { a: name_a, b: name_b, pairs: Vec::new(), only_a: Vec::new(), only_b: Vec::new() };
        match (of_a, of_b) {
            (Source::One(one), Source::One(other)) => {
                let name = stem(&one);
                let labels = match labels {
                    Some(given) => given_to_one(given, &one),
                    None => beside_one(&one),
                };
                found.pairs.push(Pair { name, nir: infrared(&one, &other), a: one, b: other, labels });
            }
            (Source::Many(of_a), Source::Many(mut of_b)) => {
                for (name, one) in of_a {
                    let Some(other) = of_b.remove(&name) else {
                        found.only_a.push(name);
                        continue;
                    };
                    let labels = match labels {
                        Some(given) => given_to_many(given, &name),
                        None => beside(&one).or_else(|| first([a.join("labels").join(format!("{name}.png"))])),
                    };
                    found.pairs.push(Pair { name, nir: infrared(&one, &other), a: one, b: other, labels });
                }
                found.only_b.extend(of_b.into_keys());
            }
            (one, _) => {
                let (one, many) = if matches!(one, Source::One(_)) { (a, b) } else { (b, a) };
                return Err(Error::misuse(format!(
                    "{} is a single image, {} is a folder of images",
                    one.display(),
                    many.display()
                ))
                .help("compare two images or two folders"));
            }
        }
        found.check(labels)?;
        Ok(found)
    }

    fn check(&self, labels: Option<&Path>) -> Result<()> {
        if self.pairs.is_empty() {
            return Err(Error::input(format!("no image of {} has a partner in {}", self.a, self.b)).help(format!(
                "images are paired by their names below the folder, without the extension; \
                 the first has {}, the second {}",
                name_list(&self.only_a),
                name_list(&self.only_b)
            )));
        }
        match labels {
            Some(labels) if self.pairs.iter().all(|pair| pair.labels.is_none()) => {
                Err(Error::input(format!("there are no labels of {} in it", self.pairs[0].name))
                    .in_file(labels)
                    .help("they are PNG files with the images' names, or semantics.png in folders with these names"))
            }
            _ => Ok(()),
        }
    }

    /// Returns warnings about omitted images, one sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let alone = |names: &[String], of: &str, other: &str| {
            let what = if names.len() == 1 { "is an image without a partner" } else { "are images without partners" };
            (!names.is_empty()).then(|| format!("{} of {of} {what} in {other}: {}", names.len(), name_list(names)))
        };
        let bare: Vec<String> =
            self.pairs.iter().filter(|pair| pair.labels.is_none()).map(|pair| pair.name.clone()).collect();
        let unlabelled = (!bare.is_empty() && bare.len() < self.pairs.len()).then(|| {
            format!(
                "pairs excluded from class means because they have no labels: {} ({})",
                bare.len(),
                name_list(&bare)
            )
        });
        [alone(&self.only_a, &self.a, &self.b), alone(&self.only_b, &self.b, &self.a), unlabelled]
            .into_iter()
            .flatten()
            .collect()
    }
}

/// Returns the first names of a list.
pub(super) fn name_list(names: &[String]) -> String {
    let first = names.iter().take(MOST_NAMES).map(String::as_str).collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(MOST_NAMES) {
        0 => first,
        more => format!("{first} and {more} more"),
    }
}

pub(super) fn there(path: &Path) -> Result<()> {
    if path.exists() {
        return Ok(());
    }
    Err(Error::input("there is no such file or folder")
        .in_file(path)
        .help("use a PNG or JPEG, a folder of such files, a rendered image or a dataset"))
}

/// Returns the recipe of the dataset that a path belongs to: its folder, `images`, an image folder or a file in one.
pub(super) fn recipe_of(path: &Path) -> Option<Recipe> {
    let whole = std::fs::canonicalize(path).ok()?;
    let leads_there = |folder: &Path| {
        let below = whole.strip_prefix(folder).is_ok_and(|rest| rest == Path::new("") || rest.starts_with("images"));
        below && folder.join(FILE).is_file()
    };
    let dataset = whole.ancestors().take(4).find(|folder| leads_there(folder))?;
    Recipe::read(dataset).ok()
}

fn source(path: &Path, recipe: Option<&Recipe>) -> Result<Source> {
    there(path)?;
    if path.is_file() {
        return Ok(Source::One(path.into()));
    }
    if let Some(rendered) = photograph_in(path, "rgb", recipe) {
        return Ok(Source::One(rendered));
    }
    let images = path.join("images");
    let mut found = BTreeMap::new();
    walk(if images.is_dir() { &images } else { path }, "", recipe, &mut found)?;
    if found.is_empty() {
        return Err(Error::input("there is no PNG or JPEG in this folder")
            .in_file(path)
            .help("use an image, a folder of images, a rendered image or a dataset"));
    }
    Ok(Source::Many(found))
}

/// Collects the images below a folder by their names relative to it; in a dataset, only files that belong to its
/// images.
pub(super) fn walk(
    folder: &Path,
    prefix: &str,
    recipe: Option<&Recipe>,
    found: &mut BTreeMap<String, PathBuf>,
) -> Result<()> {
    let entries = std::fs::read_dir(folder).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
    for entry in entries.map_err(Error::reading(folder))? {
        let path = entry.path();
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with('.') {
            continue;
        }
        let (name, picture) = if let Some(rendered) = photograph_in(&path, "rgb", recipe) {
            (name, rendered)
        } else if path.is_dir() {
            walk(&path, &format!("{prefix}{name}/"), recipe, found)?;
            continue;
        } else if path.extension().is_some_and(|e| PICTURES.iter().any(|p| e.eq_ignore_ascii_case(p))) {
            (stem(&path), path)
        } else {
            continue;
        };
        let name = format!("{prefix}{name}");
        if let Some(other) = found.insert(name.clone(), picture.clone()) {
            return Err(Error::input(format!("{} and {} are both called {name}", other.display(), picture.display()))
                .help("images are paired by their names without the extension; move one away"));
        }
    }
    Ok(())
}

pub(super) fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the file next to `rgb.png` (or `rgb_denoised.png`) in which `other` replaces `rgb` in the name.
pub(super) fn beside_rgb(picture: &Path, other: &str, recipe: Option<&Recipe>) -> Option<PathBuf> {
    let rest = stem(picture).strip_prefix("rgb")?.to_owned();
    photograph_in(picture.parent()?, &format!("{other}{rest}"), recipe)
}

/// Returns `semantics.png` next to `rgb.png` and its derived images.
pub(super) fn beside(picture: &Path) -> Option<PathBuf> {
    stem(picture).starts_with("rgb").then(|| first([picture.with_file_name("semantics.png")])).flatten()
}

fn beside_one(picture: &Path) -> Option<PathBuf> {
    let file = format!("{}.png", stem(picture));
    let folder = picture.parent().filter(|folder| folder.ends_with("images"));
    beside(picture).or_else(|| first([folder?.with_file_name("labels").join(file)]))
}

fn given_to_one(given: &Path, picture: &Path) -> Option<PathBuf> {
    let file = format!("{}.png", stem(picture));
    first([given.to_path_buf(), given.join("semantics.png"), given.join(file)])
}

fn given_to_many(given: &Path, name: &str) -> Option<PathBuf> {
    let file = format!("{name}.png");
    let rendered = format!("{name}/semantics.png");
    first([
        given.join(&rendered),
        given.join("images").join(rendered),
        given.join("labels").join(&file),
        given.join(file),
    ])
}

/// Returns the first path that is a file.
pub(super) fn first<const N: usize>(paths: [PathBuf; N]) -> Option<PathBuf> {
    paths.into_iter().find(|path| path.is_file())
}

/// Returns the shortest ends of two paths that distinguish them; output files contain no more of a path.
pub(super) fn names(a: &Path, b: &Path) -> (String, String) {
    let parts = |path: &Path| -> Vec<String> {
        let whole = std::fs::canonicalize(path).unwrap_or_else(|_| path.into());
        let names = whole.components().filter(|c| matches!(c, Component::Normal(_)));
        names.map(|c| c.as_os_str().to_string_lossy().into_owned()).collect()
    };
    let (a, b) = (parts(a), parts(b));
    let end = |parts: &[String], n: usize| parts[parts.len().saturating_sub(n)..].join("/");
    let most = a.len().max(b.len()).max(1);
    let apart = (1..=most).find(|n| end(&a, *n) != end(&b, *n)).unwrap_or(1);
    (end(&a, apart), end(&b, apart))
}
