//! Training, calibration and evaluation: functions that read datasets and run folders and write run folders and reports.

use super::data::{AugmentScale, Photos, Pick, Resize, Selection, Store, resize};
use super::enlarge::classes_at;
use super::ensemble::Ensemble;
use super::fit::calibrate::calibrate;
use super::fit::checkpoint::Checkpoint;
use super::fit::hyper::NormalizationMode;
use super::fit::logits;
use super::fit::warnings::warnings;
use super::fit::{self, Callbacks, Data, Plan};
use super::measure::{Evaluation, Prediction, Report};
use super::net::plants::{has_plants, is_of_plants};
use super::net::{Extras, Parameter, film, fitting, plants};
use super::run::{self, Identity, ModelCard, Results, TrainedModel};
use super::torch::{Model, Placement, Precision, device, guarded, multiscale};
use super::weights;
use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};
use furrow_dataset::model::classes::Classes;
use furrow_dataset::model::split::Split;
use furrow_output::remove_unfinished;
use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Device, threads and memory to use. Results depend on them only in the last bits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Machine {
    /// Device: `cpu`, `cuda` or `cuda:1`.
    pub device: String,
    /// Number of threads that load images.
    pub loaders: usize,
    /// Largest size of the cache of decoded images, bytes.
    pub memory: u64,
}

impl Default for Machine {
    /// Returns the CPU with one loader thread and 4 GiB of cache.
    fn default() -> Self {
        Self { device: "cpu".into(), loaders: 1, memory: 4 << 30 }
    }
}

impl Machine {
    /// Finds the device, and parses `precision` (`f32`, `bf16` or `auto`) for it.
    pub fn place(&self, precision: &str) -> Result<Placement> {
        let device = device::find(&self.device)?;
        Ok(Placement { device, precision: Precision::named(precision, device).map_err(Error::input)? })
    }
}

/// Trains a plan into a folder. An interrupted training is resumed; for a complete one, its results are returned. `begin` is the
/// folder of a run whose weights the training starts from.
pub fn fit(
    plan: &Plan,
    begin: Option<&Path>,
    machine: &Machine,
    folder: &Path,
    callbacks: &Callbacks<'_>,
) -> Result<Results> {
    train(plan, &[], begin, None, machine, folder, callbacks)
}

/// Like [`fit()`], for a network of the named crops: its model card lists them.
pub fn fit_crops(
    plan: &Plan,
    crops: &[String],
    begin: Option<&Path>,
    machine: &Machine,
    folder: &Path,
    callbacks: &Callbacks<'_>,
) -> Result<Results> {
    train(plan, crops, begin, None, machine, folder, callbacks)
}

/// Returns the run to start from. Its network, normalization, and numbers of bands and classes must be those of the plan.
fn begun(plan: &Plan, run: &Path) -> Result<TrainedModel> {
    let TrainedModel { card, values } = TrainedModel::open(run)?;
    let normalization = NormalizationMode::of(&card.normalization).name();
    let is = [("network", card.network.name()), ("normalization", normalization)];
    let asked = [plan.network.name(), plan.hyper.normalization.name()];
    if let Some(((flag, is), asked)) = is.iter().zip(asked).find(|((_, is), asked)| is != asked) {
        let what = format!("a training with {flag} {asked} cannot start from a run with {flag} {is}");
        return Err(Error::misuse(what).in_file(run).help(format!("--{flag} {is}")));
    }
    let fit = fitting(plan.network, plan.shape.bands.len(), plan.classes.len(), &values);
    fit.map(drop)
        .map_err(|error| error.in_file(run).help("--bands and --classes must have the same number as in the run"))?;
    Ok(TrainedModel { card, values })
}

/// Returns an error if no image of the store has plant numbers.
fn check_plants(train: &Store) -> Result<()> {
    for place in 0..train.len() {
        if train.get(place)?.plants.iter().any(|plant| *plant > 0) {
            return Ok(());
        }
    }
    Err(Error::misuse("the training images have no plant numbers, only classes")
        .help("name rendered images with --set, or imported ones that number their plants (PhenoBench, COCO)"))
}

/// Returns the species that the network of a plan takes as the crop: those of the run that it starts from, then the others of its
/// training set. None for an ordinary network.
fn species(plan: &Plan, train: &Store, begin: Option<&TrainedModel>) -> Result<Vec<String>> {
    if plan.hyper.name_crops == 0.0 {
        return Ok(Vec::new());
    }
    if plan.classes != Classes::default() {
        return Err(Error::misuse(format!("--name-crops: the classes are {}, not soil, crop and weed", plan.classes))
            .help("leave out --classes or --name-crops"));
    }
    let mut species = begin.map_or_else(Vec::new, |begin| begin.card.species.clone());
    let more = train.species().into_iter().filter(|name| !species.contains(name)).collect::<Vec<_>>();
    species.extend(more);
    match species.len() {
        0 => Err(Error::misuse("--name-crops: the training images list no species")
            .help("name rendered images with --set, or leave --name-crops out")),
        1..=run::MOST_SPECIES => Ok(species),
        n => {
            Err(Error::misuse(format!("--name-crops: {n} species are too many: the maximum is {}", run::MOST_SPECIES))
                .help("use fewer datasets"))
        }
    }
}

/// Like [`fit`]; `crops` are listed in the model card, and a self-training also takes the photographs without labels.
pub(super) fn train(
    plan: &Plan,
    crops: &[String],
    begin: Option<&Path>,
    photos: Option<Photos>,
    machine: &Machine,
    folder: &Path,
    callbacks: &Callbacks<'_>,
) -> Result<Results> {
    guarded(|| {
        plan.hyper.check(&plan.shape).map_err(|invalid| invalid.of_flag())?;
        let place = machine.place(&plan.precision)?;
        device::set_threads(plan.threads);
        let open = |selections: &[Selection], otherwise| {
            Store::open(
                selections,
                otherwise,
                plan.seed,
                &plan.classes,
                &plan.shape,
                plan.plants.is_some(),
                machine.memory,
            )
        };
        let train = open(&plan.train, Pick::Split(Split::Train))?;
        let val = open(&plan.val, Pick::Split(Split::Val))?;
        if train.is_empty() {
            return Err(Error::misuse("there is no training image")
                .help("name datasets with --set DIR, or other images of them with DIR@all"));
        }
        // Training datasets need not contain validation images, but a dataset given with --val must.
        if val.is_empty() && plan.val.iter().any(|selection| !plan.train.contains(selection)) {
            return Err(Error::misuse("there is no validation image in the datasets of --val")
                .help("name other images of them with --val DIR@all, or leave --val out"));
        }
        if plan.hyper.logit_adjustment > 0.0 && !plan.classes.begins_with_soil() {
            return Err(Error::misuse("logit adjustment corrects for frequent soil, and the first class is not soil")
                .help("name soil first in --classes, or leave --logit-adjustment out"));
        }
        let refine = plan.hyper.refine;
        refine.check(&plan.classes, &plan.shape.bands).map_err(|what| {
            Error::misuse(format!("--refine {}: {what}", refine.name()))
                .help("name soil first in --classes and red, green and blue in --bands, or leave --refine out")
        })?;
        let begin = match begin {
            Some(_) if !plan.hyper.pretrained.is_none() => {
                return Err(Error::misuse("a run to start from and pretrained weights exclude each other")
                    .help("--init starts from all weights of a run, --pretrained only sets the encoder: give one"));
            }
            Some(run) => Some(begun(plan, run)?),
            None => None,
        };
        let species = species(plan, &train, begin.as_ref())?;
        let train = train.with_species(&species);
        let (bands, classes) = (plan.shape.bands.len(), plan.classes.len());
        let begin = match begin {
            Some(begin) => begin.values,
            None => plan.hyper.pretrained.begin(plan.network, &plan.shape.bands, classes, plan.seed)?,
        };
        let begin_with = (!begin.is_empty()).then(|| weights::hash(&begin));
        let begin = match begin_with {
            Some(_) => film::completed(plan.network, bands, classes, begin, species.len(), plan.seed),
            None => begin,
        };
        let begin = if plan.plants.is_some() {
            plants::completed(plan.network, bands, classes, begin, plan.seed)
        } else {
            begin
        };
        let plan = Plan { begin_with, species, ..plan.clone() };
        let identity = Identity::of(&plan, &train, &val)?;
        // Reads one image, so that missing bands are reported before the folder is claimed.
        train.get(0)?;
        if plan.plants.is_some() {
            check_plants(&train)?;
        }
        if !val.is_empty() {
            val.get(0)?;
        }
        // Records of other programs may contain pixel sizes outside the valid range of a model card.
        let pixel_mm = match plan.hyper.augment_scale {
            AugmentScale::PixelMm(lo, hi) => Some((lo * hi).sqrt()),
            AugmentScale::Relative | AugmentScale::Auto => train.pixel_mm()?,
        };
        let pixel_mm = pixel_mm.filter(|mm| run::PIXEL_MM.contains(mm));
        let pixels = plan.hyper.augment_scale.of(|| train.pixel_sizes_mm())?;
        identity.claim(folder)?;
        remove_unfinished(folder)?;
        if let Some(results) = run::results(folder)? {
            // A complete training is not repeated, so its damage must not pass in silence.
            TrainedModel::open(folder)?;
            return Ok(results);
        }
        let hash = identity.hash()?;
        for words in warnings(&plan, train.distinct(), pixels.as_ref()) {
            (callbacks.warn)(&words);
        }
        if plan.plants.is_none() && has_plants(&begin) {
            (callbacks.warn)(
                "the plant decoder of the initial network is kept as it is; `train plants` trains it for the new network",
            );
        }
        let data = Data { train: Arc::new(train), val, photos: photos.map(Arc::new), pixels, loaders: machine.loaders };
        let mut outcome = fit::train(&plan, &hash, &data, &begin, place, folder, callbacks)?;
        if plan.hyper.calibrate > 0 {
            let model = Model::with(plan.network, plan.shape.bands.len(), plan.classes.len(), &outcome.values, place)?;
            outcome.values = calibrate(&model, &data.train, &outcome.normalization, plan.hyper.calibrate)?;
        }
        if plan.hyper.logit_adjustment > 0.0 {
            logits::adjust(&mut outcome.values, &data.train, plan.classes.len(), plan.hyper.logit_adjustment)?;
        }
        if plan.plants.is_none() {
            // The plant decoder of the run that the training starts from; it goes on reading the encoder.
            outcome.values.extend(begin.iter().filter(|array| is_of_plants(&array.name)).cloned());
        }
        let extras = Extras::of(&outcome.values);
        let list = extras.parameters(plan.network, bands, classes);
        let card = ModelCard {
            furrow: env!("CARGO_PKG_VERSION").into(),
            network: plan.network,
            parameters: list.iter().filter(|p| p.role.is_trainable()).map(Parameter::len).sum(),
            input: plan.shape.clone(),
            normalization: outcome.normalization,
            resize: plan.hyper.resize.clone(),
            refine: plan.hyper.refine,
            pixel_mm,
            classes: plan.classes.clone(),
            crops: crops.to_vec(),
            species: plan.species.clone(),
            plants: extras.plants,
            weights: run::WEIGHTS.into(),
            weights_sha256: weights::hash(&outcome.values),
            plan_sha256: hash,
        };
        TrainedModel { card, values: outcome.values }.write(folder)?;
        let results = Results {
            steps: outcome.steps,
            best_step: outcome.history.best().map(|pass| pass.step),
            ended: outcome.ended.into(),
            images_per_second: (outcome.steps * plan.hyper.accumulate).to_f64() * plan.hyper.batch.to_f64()
                / outcome.seconds.max(1e-9),
            history: outcome.history,
            seconds: outcome.seconds,
        };
        run::write_json(&folder.join(run::RESULT), &results)?;
        Checkpoint::remove(folder)?;
        Ok(results)
    })
}

/// Returns the trained model with its class biases calibrated for the best mean intersection over union on `images` images of
/// the selections.
pub fn calibrated(
    trained: &TrainedModel,
    on: &[Selection],
    images: u64,
    precision: &str,
    threads: usize,
    machine: &Machine,
) -> Result<TrainedModel> {
    guarded(|| {
        let card = &trained.card;
        let place = machine.place(precision)?;
        device::set_threads(threads);
        let model = Model::with(card.network, card.input.bands.len(), card.classes.len(), &trained.values, place)?;
        let store = Store::open(on, Pick::Split(Split::Train), 0, &card.classes, &card.input, false, 0)?;
        if store.is_empty() {
            return Err(Error::misuse("there is no image to calibrate on").help("name other images, such as DIR@all"));
        }
        let values = calibrate(&model, &store, &card.normalization, images)?;
        let card = ModelCard { weights_sha256: weights::hash(&values), ..card.clone() };
        Ok(TrainedModel { card, values })
    })
}

/// Image and its prediction, as [`evaluate`] passes them to its callback.
pub struct Predicted<'a> {
    /// Index of the image in the selection.
    pub place: usize,
    /// Image before normalization.
    pub example: &'a super::data::Example,
    /// Width and height, pixels: the network's size if images are stretched to it, otherwise the image's own size.
    pub size: (u32, u32),
    /// Predicted class of each pixel.
    pub predicted: &'a [u8],
}

/// Evaluates a trained model or ensemble on the images of a dataset, one after the other. Each image and its prediction are
/// passed to `seen`. If `stop` is set, the evaluation ends with an error.
pub fn evaluate(
    trained: &Ensemble,
    on: &Selection,
    precision: &str,
    threads: usize,
    machine: &Machine,
    stop: &AtomicBool,
    seen: &mut dyn FnMut(&Predicted<'_>) -> Result<()>,
) -> Result<Report> {
    guarded(|| {
        let card = &trained.card;
        let place = machine.place(precision)?;
        device::set_threads(threads);
        let models = trained.models(place)?;
        let store = Store::open(std::slice::from_ref(on), Pick::All, 0, &card.classes, &card.input, true, 0)?;
        let trained_at = (card.input.width, card.input.height);
        let mut evaluation = Evaluation::new(card.classes.names());
        let open = |place| -> Result<_> {
            if stop.load(Ordering::Relaxed) {
                return Err(Error::interrupted());
            }
            let (size, example) = match card.resize {
                Resize::Stretch => (trained_at, store.get(place)?),
                _ => store.whole(place).map(|(size, example)| (size, Cow::Owned(example)))?,
            };
            let sizes = card.resize.sizes(trained_at, size)?;
            let inputs = resize::inputs(&example.planes, size, &sizes, &card.normalization);
            Ok((size, example, inputs))
        };
        let (refine, bands) = (card.refine, &card.input.bands);
        let pictures = multiscale::training_images(refine, store.len()).into_iter();
        let appearance =
            multiscale::learn(&models, refine, bands, pictures.map(|place| Ok((open(place)?.2, Vec::new()))))?;
        for place in 0..store.len() {
            let (size, example, inputs) = open(place)?;
            let begun = Instant::now();
            let numbered = example.plants.iter().any(|plant| *plant > 0);
            let mut scores = multiscale::scores(&models, refine, numbered, &inputs)?;
            scores.refine(refine, &inputs, bands, appearance.as_ref());
            let seconds = Some(begun.elapsed().as_secs_f64());
            let predicted = classes_at(&scores.values, scores.size, size);
            let (width, height) = size;
            let plants = numbered.then_some(example.plants.as_slice());
            let (name, truth) = (example.name.as_str(), example.labels.as_slice());
            let separated = plants.map(|_| scores.plants(&predicted, size));
            let separated = separated.as_deref();
            let predicted = predicted.as_slice();
            evaluation.add(&Prediction { name, width, height, truth, predicted, plants, separated, seconds })?;
            seen(&Predicted { place, example: &example, size, predicted })?;
        }
        Ok(evaluation.finish())
    })
}
