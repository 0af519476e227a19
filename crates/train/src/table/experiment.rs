//! Validated experiments: names are resolved and numbers are in range.

use super::desc::{ExperimentDesc, Named, PartDesc, ScaleDesc, SetDesc};
use super::names::{slug, unknown};
use crate::baseline::Kind;
use crate::data::margin::MOST;
use crate::data::select::MOST_REPEATS;
use crate::data::{Band, Pick};
use crate::fit::{Plan, Settings};
use crate::net::{Network, Pretrained};
use furrow_base::ron_file::{RonFile, Step, choose};
use furrow_base::sampling::Sampler;
use furrow_base::{Error, Result};
use furrow_dataset::model::classes::Classes;
use furrow_dataset::model::recipe::{self, Recipe};
use furrow_dataset::model::split::Shares;
use furrow_field::ablation::EDITS;
use std::path::{Path, PathBuf};

/// Validated experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Networks without duplicates; at least one.
    pub networks: Vec<Network>,
    /// Colour baselines.
    pub baselines: Vec<Kind>,
    /// Seeds without duplicates; at least one.
    pub seeds: Vec<u64>,
    /// Hyper-parameters, classes and input shape; each row sets network, images, seed and machine.
    pub plan: Plan,
    /// Datasets by name.
    pub sets: Vec<(String, Source)>,
    /// Training sets, at least one.
    pub train: Vec<TrainSet>,
    /// Test sets, at least one.
    pub test: Vec<TestSet>,
    /// Name of the training set that the others are compared with.
    pub against: Option<String>,
    /// Name of the selected scale.
    pub scale: Option<String>,
}

/// Source of the images of a dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// Rendered.
    Scene {
        /// Scene file.
        file: PathBuf,
        /// Number of images.
        count: u64,
        /// Width and height, pixels.
        size: (u32, u32),
        /// Samples per pixel.
        spp: u32,
        /// Seed that replaces the scene's.
        seed: Option<u64>,
        /// Name of the ablation edit, if any.
        edit: Option<&'static str>,
        /// Shares of training, validation and test set.
        split: Shares,
    },
    /// Existing dataset.
    Dataset {
        /// Folder of the dataset.
        folder: PathBuf,
        /// Number of images.
        count: u64,
    },
    /// Real images; the command line gives their folder.
    Real {
        /// Description of the images.
        about: String,
    },
}

/// Selection of images of a dataset.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageSelection {
    /// Index of the dataset in [`Experiment::sets`].
    pub set: usize,
    /// Images to use.
    pub pick: Pick,
    /// Dilation of the label masks, pixels of the dataset's images; negative erodes them.
    pub margin: f32,
    /// Oversampling: number of times that each image is in an epoch.
    pub repeat: u32,
}

/// Training set with its validation set.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainSet {
    /// Name in the tables.
    pub name: String,
    /// Folder name.
    pub slug: String,
    /// Training images.
    pub from: Vec<ImageSelection>,
    /// Validation images.
    pub validation: Vec<ImageSelection>,
    /// The experiment's plan with the hyper-parameters of this training set.
    pub plan: Plan,
}

/// Test set.
#[derive(Clone, Debug, PartialEq)]
pub struct TestSet {
    /// Name in the tables.
    pub name: String,
    /// Base name of its evaluation files.
    pub slug: String,
    /// Images to evaluate on.
    pub part: ImageSelection,
}

impl Experiment {
    /// Reads and validates an experiment file, at one of its scales.
    pub fn read(path: &Path, scale: Option<&str>) -> Result<Self> {
        Self::of(&RonFile::read(path)?, scale)
    }

    /// Validates an experiment file that is in memory, at one of its scales.
    pub fn of(page: &RonFile, scale: Option<&str>) -> Result<Self> {
        let desc: ExperimentDesc = page.parse_all()?;
        Checker { page, desc: &desc }.experiment(scale)
    }

    /// Returns the indices of the datasets that a training set and its validation set use, without duplicates.
    pub fn sets_of(&self, train: &TrainSet) -> Vec<usize> {
        let mut all: Vec<usize> = train.from.iter().chain(&train.validation).map(|p| p.set).collect();
        all.sort_unstable();
        all.dedup();
        all
    }
}

struct Checker<'a> {
    page: &'a RonFile,
    desc: &'a ExperimentDesc,
}

/// Path of a value in the experiment file.
type At<'a> = &'a [Step<'a>];

impl Checker<'_> {
    /// Returns an error that underlines the value at a path.
    fn fault(&self, at: At<'_>, what: impl AsRef<str>, help: impl AsRef<str>) -> Error {
        self.page.blame(at, Error::input(what.as_ref()).help(help.as_ref()))
    }

    fn experiment(&self, scale: Option<&str>) -> Result<Experiment> {
        let desc = self.desc;
        self.names(&desc.sets, "sets", "set")?;
        self.names(&desc.scales, "scales", "scale")?;
        let chosen = scale.map(|name| self.scale(name)).transpose()?;
        let other = chosen.map(|(_, s)| s);
        let mut learn = Plan::default();
        self.settings(&desc.hyperparameters, &[Step::Field("hyperparameters")], &mut learn)?;
        for (i, (_, scale)) in desc.scales.0.iter().enumerate() {
            // Scales that are not selected are checked as well, so that errors show before hours are spent on another scale.
            let at = [Step::Field("scales"), Step::Item(i)];
            let mut plan = learn.clone();
            self.settings(&scale.hyperparameters, &[at[0], at[1], Step::Field("hyperparameters")], &mut plan)?;
            self.at_scale(scale, &at)?;
            if chosen.is_some_and(|(k, _)| k == i) {
                learn = plan;
            }
        }
        let networks = match other.and_then(|s| s.networks.as_ref()) {
            Some(names) => names,
            None => &desc.networks,
        };
        let at = |field: &'static str, own: bool| match chosen {
            Some((i, _)) if own => vec![Step::Field("scales"), Step::Item(i), Step::Field(field)],
            _ => vec![Step::Field(field)],
        };
        let networks = self.networks(networks, &at("networks", other.is_some_and(|s| s.networks.is_some())))?;
        let seeds = other.and_then(|s| s.seeds.as_ref()).unwrap_or(&desc.seeds);
        self.seeds(seeds, &at("seeds", other.is_some_and(|s| s.seeds.is_some())))?;
        let sets = self.sets(other, (learn.shape.width, learn.shape.height))?;
        let train = self.train(&sets, &learn)?;
        Ok(Experiment {
            networks,
            baselines: self.baselines(&learn)?,
            seeds: seeds.clone(),
            plan: learn,
            against: self.against(&train)?,
            train,
            test: self.test(&sets)?,
            sets,
            scale: scale.map(str::to_owned),
        })
    }

    fn scale(&self, name: &str) -> Result<(usize, &ScaleDesc)> {
        let scales = &self.desc.scales;
        match scales.find(name) {
            Some(i) => Ok((i, &scales.0[i].1)),
            None => Err(Error::input(format!("the experiment has no scale `{name}`"))
                .in_file(&self.page.path)
                .help(choose("scales", &scales.names(), name))),
        }
    }

    /// Checks names that become folder names: they must be unique, and not paths.
    fn names<T>(&self, named: &Named<T>, field: &str, what: &str) -> Result<()> {
        for (i, name) in named.names().into_iter().enumerate() {
            let at = [Step::Field(field), Step::Item(i)];
            let good = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
            if name.is_empty() || name.starts_with('.') || !name.chars().all(good) {
                return Err(self.fault(
                    &at,
                    format!("`{name}` is not a valid name of a {what}"),
                    "write letters, digits, - and _, as in \"synthetic-d\"",
                ));
            }
            if named.find(name) != Some(i) {
                return Err(self.fault(
                    &at,
                    format!("the {what} `{name}` is given twice"),
                    "give each a name of its own",
                ));
            }
        }
        Ok(())
    }

    fn networks(&self, names: &[String], at: At<'_>) -> Result<Vec<Network>> {
        if names.is_empty() {
            return Err(self.fault(at, "there is no network", "give at least one, such as [\"basic-segnet\"]"));
        }
        let known: Vec<&str> = Network::ALL.iter().map(|n| n.name()).collect();
        let mut networks = Vec::new();
        for (i, name) in names.iter().enumerate() {
            let at = [at, &[Step::Item(i)]].concat();
            let network = Network::named(name).map_err(|_| self.unknown(&at, "network", &known, name))?;
            if networks.contains(&network) {
                return Err(self.fault(&at, format!("the network `{name}` is given twice"), "keep one of them"));
            }
            networks.push(network);
        }
        Ok(networks)
    }

    fn baselines(&self, learn: &Plan) -> Result<Vec<Kind>> {
        let at = [Step::Field("baselines")];
        let fits = learn.classes == Classes::default() && learn.shape.bands.starts_with(&Band::RGB);
        let Some(names) = &self.desc.baselines else { return Ok(if fits { Kind::ALL.to_vec() } else { Vec::new() }) };
        if !fits && !names.is_empty() {
            let help = "leave out either `baselines`, or `classes` and `bands`";
            return Err(self.fault(&at, "baselines support only soil, crop and weed in colour images", help));
        }
        let mut kinds = Vec::new();
        for (i, name) in names.iter().enumerate() {
            let at = [at[0], Step::Item(i)];
            let known = Kind::ALL.map(Kind::name);
            let kind = Kind::named(name).ok_or_else(|| self.unknown(&at, "baseline", &known, name))?;
            if kinds.contains(&kind) {
                return Err(self.fault(&at, format!("the baseline `{name}` is given twice"), "keep one of them"));
            }
            kinds.push(kind);
        }
        Ok(kinds)
    }

    fn seeds(&self, seeds: &[u64], at: At<'_>) -> Result<()> {
        if seeds.is_empty() {
            return Err(self.fault(at, "there is no seed", "give at least one, such as [1]"));
        }
        match seeds.iter().enumerate().find(|(i, seed)| seeds[..*i].contains(seed)) {
            Some((i, seed)) => {
                let at = [at, &[Step::Item(i)]].concat();
                Err(self.fault(&at, format!("the seed {seed} is given twice"), "keep one of them"))
            }
            None => Ok(()),
        }
    }

    /// Applies hyper-parameters of the file to a plan.
    fn settings(&self, settings: &Settings, at: At<'_>, plan: &mut Plan) -> Result<()> {
        settings.apply(plan).map_err(|invalid| {
            self.fault(&[at, &[Step::Field(invalid.field)]].concat(), invalid.message, invalid.help)
        })?;
        // Paths are relative to the folder of the experiment file.
        if let (Some(text), Pretrained::File(path)) = (&settings.pretrained, &mut plan.hyper.pretrained) {
            *path = self.page.need_file(text)?;
        }
        Ok(())
    }

    fn sets(&self, scale: Option<&ScaleDesc>, seen: (u32, u32)) -> Result<Vec<(String, Source)>> {
        let mut sets = Vec::new();
        for (i, (name, desc)) in self.desc.sets.0.iter().enumerate() {
            let at = |field| [Step::Field("sets"), Step::Item(i), Step::Field(field)];
            let source = match desc {
                SetDesc::Real { about } => Source::Real { about: about.clone() },
                SetDesc::Dataset { path } => {
                    let folder = self.page.resolve(path);
                    if !folder.join(recipe::FILE).is_file() {
                        let help = "paths are relative to the experiment file; `trace ablate` and `trace dataset` make datasets";
                        return Err(self.fault(&at("path"), format!("there is no dataset in `{path}`"), help));
                    }
                    Source::Dataset { count: Recipe::read(&folder)?.count, folder }
                }
                SetDesc::Scene { file, count, size, spp, seed, edit, split: (train, val, test) } => {
                    self.page.need_file(file)?;
                    self.count(*count, &at("count"))?;
                    self.spp(*spp, &at("spp"))?;
                    let split = Shares::parse(&format!("{train},{val},{test}"))
                        .map_err(|help| self.fault(&at("split"), "these are not valid shares", help))?;
                    if let Some(size) = size {
                        self.image_size(*size, &at("size"))?;
                    }
                    let edit = edit.as_deref().map(|name| self.edit(name, &at("edit"))).transpose()?;
                    let size = scale.and_then(|s| s.size).or(*size).unwrap_or(seen);
                    let (count, spp) =
                        (scale.and_then(|s| s.count).unwrap_or(*count), scale.and_then(|s| s.spp).unwrap_or(*spp));
                    Source::Scene { file: self.page.resolve(file), count, size, spp, seed: *seed, edit, split }
                }
            };
            sets.push((name.clone(), source));
        }
        Ok(sets)
    }

    fn at_scale(&self, scale: &ScaleDesc, at: At<'_>) -> Result<()> {
        let at = |field| [at, &[Step::Field(field)]].concat();
        scale.count.map_or(Ok(()), |n| self.count(n, &at("count")))?;
        scale.spp.map_or(Ok(()), |n| self.spp(n, &at("spp")))?;
        scale.size.map_or(Ok(()), |s| self.image_size(s, &at("size")))?;
        scale.networks.as_ref().map_or(Ok(()), |n| self.networks(n, &at("networks")).map(drop))?;
        scale.seeds.as_ref().map_or(Ok(()), |s| self.seeds(s, &at("seeds")))
    }

    fn count(&self, count: u64, at: At<'_>) -> Result<()> {
        if (1..=99_999_999).contains(&count) {
            return Ok(());
        }
        Err(self.fault(at, format!("{count} images cannot be rendered"), "write a number from 1 to 99999999"))
    }

    fn edit(&self, name: &str, at: At<'_>) -> Result<&'static str> {
        let known: Vec<&str> = EDITS.iter().map(|edit| edit.name).collect();
        known.iter().find(|known| **known == name).copied().ok_or_else(|| self.unknown(at, "edit", &known, name))
    }

    fn spp(&self, spp: u32, at: At<'_>) -> Result<()> {
        if (1..=Sampler::MAX_SAMPLES).contains(&spp) {
            return Ok(());
        }
        let help = format!("write a number from 1 to {}", Sampler::MAX_SAMPLES);
        Err(self.fault(at, format!("{spp} samples per pixel are out of range"), help))
    }

    fn image_size(&self, (width, height): (u32, u32), at: At<'_>) -> Result<()> {
        if [width, height].iter().all(|n| (1..=16384).contains(n)) {
            return Ok(());
        }
        Err(self.fault(at, format!("an image cannot have {width} × {height} pixels"), "write sides from 1 to 16384"))
    }

    fn part(&self, desc: &PartDesc, otherwise: Pick, at: At<'_>, sets: &[(String, Source)]) -> Result<ImageSelection> {
        let step = |field| [at, &[Step::Field(field)]].concat();
        if desc.repeat == 0 {
            return Err(self.fault(
                &step("repeat"),
                "`repeat: 0` would leave these images out of training",
                "write 1 or more",
            ));
        }
        if desc.repeat > MOST_REPEATS {
            let what = format!("an image cannot be {} times in an epoch", desc.repeat);
            return Err(self.fault(&step("repeat"), what, format!("write 1 to {MOST_REPEATS}")));
        }
        let margin = desc.dilate_px.unwrap_or(0.0);
        if margin.is_nan() || margin.abs() > MOST {
            let what = format!("masks cannot be dilated by {margin} pixels");
            return Err(self.fault(&step("dilate_px"), what, format!("write a number from -{MOST} to {MOST}")));
        }
        let (set, pick) = self.images(&desc.set, desc.images.as_deref(), otherwise, at, sets)?;
        Ok(ImageSelection { set, pick, margin, repeat: desc.repeat })
    }

    /// Resolves a dataset and a selection of its images; without `images` the selection is `otherwise`.
    fn images(
        &self,
        name: &str,
        images: Option<&str>,
        otherwise: Pick,
        at: At<'_>,
        sets: &[(String, Source)],
    ) -> Result<(usize, Pick)> {
        let step = |field| [at, &[Step::Field(field)]].concat();
        let names = self.desc.sets.names();
        let set = self.desc.sets.find(name).ok_or_else(|| self.unknown(&step("set"), "set", &names, name))?;
        let Some(images) = images else { return Ok((set, otherwise)) };
        let pick = Pick::parse(images).map_err(|words| {
            let (what, help) = words.split_once(": ").unwrap_or((&words, "write 0..10"));
            self.fault(&step("images"), what, help)
        })?;
        if let Source::Scene { count, .. } | Source::Dataset { count, .. } = &sets[set].1
            && let Pick::Range(_, most) | Pick::Random(most) = pick
            && most > *count
        {
            let help = "select fewer images here or make more in the set; a range excludes its last number";
            return Err(self.fault(&step("images"), format!("`{name}` has {count} images, too few for this"), help));
        }
        Ok((set, pick))
    }

    fn train(&self, sets: &[(String, Source)], plan: &Plan) -> Result<Vec<TrainSet>> {
        use furrow_dataset::model::split::Split::{Train, Val};
        let mut all: Vec<TrainSet> = Vec::new();
        for (i, desc) in self.desc.train.iter().enumerate() {
            let at = [Step::Field("train"), Step::Item(i)];
            let step = |field| [at[0], at[1], Step::Field(field)];
            let slug = self.title(&desc.name, all.iter().map(|t| t.slug.as_str()), &step("name"))?;
            if desc.from.is_empty() {
                return Err(self.fault(
                    &step("from"),
                    "the training set has no images",
                    "give a dataset: [(set: \"NAME\")]",
                ));
            }
            let parts = |parts: &[PartDesc], field: &'static str, otherwise| -> Result<Vec<ImageSelection>> {
                let one = |(k, part): (usize, &PartDesc)| {
                    let at = [at[0], at[1], Step::Field(field), Step::Item(k)];
                    self.part(part, otherwise, &at, sets)
                };
                parts.iter().enumerate().map(one).collect()
            };
            let from = parts(&desc.from, "from", Pick::Split(Train))?;
            let validation = if let Some(validation) = &desc.validation {
                parts(validation, "validation", Pick::Split(Val))?
            } else {
                let open = desc.from.iter().zip(&from).filter(|(desc, _)| desc.images.is_none());
                open.map(|(_, part)| ImageSelection { pick: Pick::Split(Val), repeat: 1, ..part.clone() }).collect()
            };
            let plan = self.own_plan(&desc.hyperparameters, &step("hyperparameters"), plan)?;
            all.push(TrainSet { name: desc.name.clone(), slug, from, validation, plan });
        }
        if all.is_empty() {
            let help = "give at least one: [(name: \"Real\", from: [(set: \"NAME\")])]";
            return Err(self.fault(&[Step::Field("train")], "there is no training set", help));
        }
        Ok(all)
    }

    /// Returns the experiment's plan with the hyper-parameters of one training set. Those that decide what is evaluated cannot differ.
    fn own_plan(&self, own: &Settings, at: At<'_>, plan: &Plan) -> Result<Plan> {
        let fixed = [("classes", own.classes.is_some()), ("bands", own.bands.is_some()), ("size", own.size.is_some())];
        if let Some((name, _)) = fixed.iter().find(|(_, given)| *given) {
            let what = format!("`{name}` cannot differ between training sets: all are evaluated on the same test sets");
            return Err(self.fault(
                &[at, &[Step::Field(name)]].concat(),
                what,
                "write it in `hyperparameters` of the experiment",
            ));
        }
        let mut plan = plan.clone();
        self.settings(own, at, &mut plan)?;
        Ok(plan)
    }

    fn test(&self, sets: &[(String, Source)]) -> Result<Vec<TestSet>> {
        let mut all: Vec<TestSet> = Vec::new();
        for (i, desc) in self.desc.test.iter().enumerate() {
            let at = [Step::Field("test"), Step::Item(i)];
            let step = |field| [at[0], at[1], Step::Field(field)];
            let slug = self.title(&desc.name, all.iter().map(|t| t.slug.as_str()), &step("name"))?;
            let (set, pick) = self.images(&desc.set, desc.images.as_deref(), Pick::All, &at, sets)?;
            all.push(TestSet {
                name: desc.name.clone(),
                slug,
                part: ImageSelection { set, pick, margin: 0.0, repeat: 1 },
            });
        }
        if all.is_empty() {
            let help = "give at least one: [(name: \"Test\", set: \"NAME\")]";
            return Err(self.fault(&[Step::Field("test")], "there is no test set", help));
        }
        Ok(all)
    }

    /// Returns the name of the training set that the others are compared with.
    fn against(&self, train: &[TrainSet]) -> Result<Option<String>> {
        let Some(name) = &self.desc.against else { return Ok(None) };
        if train.iter().any(|t| t.name == *name) {
            return Ok(Some(name.clone()));
        }
        let known: Vec<&str> = train.iter().map(|t| t.name.as_str()).collect();
        Err(self.unknown(&[Step::Field("against")], "training set", &known, name))
    }

    /// Returns the folder name of a title; fails if it is empty or another title has the same.
    fn title<'a>(&self, name: &str, mut others: impl Iterator<Item = &'a str>, at: At<'_>) -> Result<String> {
        let slug = slug(name);
        if slug.is_empty() {
            let help = "the name becomes a folder name: write letters or digits";
            return Err(self.fault(at, format!("`{name}` has no letter and no digit"), help));
        }
        if others.any(|other| other == slug) {
            let help = "give each a name of its own; case and punctuation do not count";
            return Err(self.fault(at, format!("there is another `{name}`"), help));
        }
        Ok(slug)
    }

    fn unknown(&self, at: At<'_>, what: &str, known: &[&str], found: &str) -> Error {
        let (message, help) = unknown(what, known, found);
        self.fault(at, message, help)
    }
}
