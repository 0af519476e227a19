//! Hyper-parameters as a user writes them: flags of `train fit`, and `hyperparameters` of an experiment file.
//!
//! Both are parsed into the same struct and applied to a plan with [`Settings::apply`]. A field that is left out keeps the value of
//! the plan, initially that of [`Plan::default`].

use super::class_weights::ClassWeights;
use super::hyper::{Invalid, LossFunction, NormalizationMode, OptimiserKind, SIDES, check_size};
use super::plan::Plan;
use super::schedule::Schedule;
use crate::data::{Augment, AugmentScale, Band, Resize};
use crate::net::Pretrained;
use crate::refine::Refine;
use furrow_base::ron_file;
use furrow_dataset::model::classes::Classes;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Hyper-parameters of a training. A field that is left out keeps its value, initially the default.
///
/// ```
/// use furrow_train::fit::{Plan, Settings};
/// let text = r#"(optimiser: Some("sgd"), class_weights: Some("sqrt"), augment: Some("flip,rotate"))"#;
/// let settings: Settings = ron::from_str(text).unwrap();
/// let mut plan = Plan::default();
/// settings.apply(&mut plan).unwrap();
/// assert_eq!((plan.hyper.rate, plan.hyper.steps), (0.05, 2000));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, clap::Args, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default, rename = "Hyperparameters")]
#[schemars(transform = tell_defaults)]
pub struct Settings {
    /// Classes, separated by semicolons, each with its labels as for datasets: "soil; beet=BEAVX; other=crop,weed; ignore=stone".
    #[arg(long, value_name = "CLASSES", default_value = default_of("classes"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"soil; beet=crop; other=weed\""))]
    pub classes: Option<String>,
    /// Input bands: rgb, rgbn, or names separated by commas.
    #[arg(long, value_name = "BANDS", default_value = default_of("bands"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"rgbn\""))]
    pub bands: Option<String>,
    /// Width and height that images are resized to, pixels, each from 32 to 8192.
    #[arg(long, value_name = "WxH", default_value = default_of("size"), value_parser = parse_size)]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(480, 360)"))]
    pub size: Option<(u32, u32)>,
    /// Size of the random crop of each training image, at most the size of the images; by default whole images. Small crops make steps
    /// fast and keep the size of small plants.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(320, 256)"))]
    pub crop_size: Option<(u32, u32)>,
    /// Fraction of crops that contain a pixel of a class drawn with a probability inverse to its frequency (oversampling): otherwise
    /// few crops contain small plants. No effect without a crop size.
    #[arg(long, value_name = "SHARE", default_value = default_of("rare_crops"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "0.25"))]
    pub rare_crops: Option<f64>,
    /// Largest number of training steps.
    #[arg(long, value_name = "N", default_value = default_of("steps"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "1500"))]
    pub steps: Option<u64>,
    /// Batch size: images per forward pass, 1 to 1024.
    #[arg(long, value_name = "N", default_value = default_of("batch"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "4"))]
    pub batch: Option<usize>,
    /// Gradient accumulation: batches per step, 1 to 1024. A step uses their mean gradient. This equals one larger batch, except that
    /// batch norms and the soft Dice loss are computed for each batch separately.
    #[arg(long, value_name = "N", default_value = default_of("accumulate"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "4"))]
    pub accumulate: Option<u64>,
    /// Optimiser: sgd or adam.
    #[arg(long, value_name = "NAME", default_value = default_of("optimiser"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"adam\""))]
    pub optimiser: Option<String>,
    /// Learning rate at the start; the default depends on the optimiser.
    #[arg(long, value_name = "RATE", help = rate_help())]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "0.002"))]
    pub rate: Option<f64>,
    /// Weight decay, from 0 to below 1.
    #[arg(long, value_name = "SHARE", default_value = default_of("decay"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "0.0005"))]
    pub decay: Option<f64>,
    /// Learning-rate schedule: poly, cosine or constant.
    #[arg(long, value_name = "NAME", default_value = default_of("schedule"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"cosine\""))]
    pub schedule: Option<String>,
    /// Loss: entropy (cross-entropy), or dice (cross-entropy plus soft Dice loss, which gives rare classes equal weight).
    #[arg(long, value_name = "NAME", default_value = default_of("loss"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"entropy\""))]
    pub loss: Option<String>,
    /// Class weights of the loss: median (median-frequency weights), sqrt (their square root), annealed (the square root, annealed
    /// to 1 over the first half of the steps), or none.
    #[arg(long, value_name = "NAME", default_value = default_of("class_weights"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"annealed\""))]
    pub class_weights: Option<String>,
    /// Number of training images on which class biases are calibrated after the last step for the best mean IoU: losses that favour
    /// small plants make a network over-predict them. 0 for none.
    #[arg(long, value_name = "N", default_value = default_of("calibrate"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "40"))]
    pub calibrate: Option<u64>,
    /// Factor of the post-hoc logit adjustment after the last step, which corrects scores for the frequency of the first class: 0 (none)
    /// to 2. 0.5 suits photographs unlike the training images, where networks miss parts of plants. The first class must be soil; not
    /// together with `calibrate`, which sets the same biases.
    #[arg(long, value_name = "TAU", default_value = default_of("logit_adjustment"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "0.5"))]
    pub logit_adjustment: Option<f64>,
    /// Initial weights of the encoder: none (random weights), imagenet (weights of EfficientNet-Lite0, for lite-unet), or a safetensors
    /// file with the array names of torchvision's resnet18 (unet) or vgg16_bn (segnet), or of timm's vit_small_patch14_dinov2
    /// (vit-unet).
    #[arg(long, value_name = "NAME", default_value = default_of("pretrained"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"none\""))]
    pub pretrained: Option<String>,
    /// Number of steps at the start that train only the decoder, with a frozen encoder.
    #[arg(long, value_name = "N", default_value = default_of("freeze"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "100"))]
    pub freeze: Option<u64>,
    /// Learning rate of the encoder as a fraction of the decoder's, 0 to 1.
    #[arg(long, value_name = "SHARE", default_value = default_of("encoder_rate"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "0.1"))]
    pub encoder_rate: Option<f64>,
    /// Decay of an exponential moving average (EMA) of the weights, such as 0.998. The averaged weights are validated and kept instead
    /// of the last step's. 0 for none.
    #[arg(long, value_name = "DECAY", default_value = default_of("ema"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "0.99"))]
    pub ema: Option<f64>,
    /// Fraction of the training images in which a species is named as the crop, 0 to 1; the network then takes the crop as an input
    /// (`train predict --crop`). Any species of an image may be named, also a weed; all other plants are weeds. Needs rendered images
    /// and the classes soil, crop and weed. 0 for an ordinary network.
    #[arg(long, value_name = "SHARE", default_value = default_of("name_crops"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "0.75"))]
    pub name_crops: Option<f64>,
    /// Sizes that images are resized to for prediction: stretch (to the training size), or lengths of the longer side, separated by
    /// commas. With lengths, the aspect ratio is kept and probabilities are averaged over the sizes.
    #[arg(long, value_name = "SIDES", default_value = default_of("resize"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"480,640,960\""))]
    pub resize: Option<String>,
    /// Refinement of predictions after training, names separated by commas, or none: colour (pixels of similar colour in an image tend
    /// to be of the same kind, plant or soil), plants (connected plant pixels are of one class), separate (plants are those of the plant
    /// decoder, not connected pixels; needs plants), rows (crop rows and plant sizes also decide between crop and weed; needs plants),
    /// appearance (appearance features also decide, learnt from all images of a field; needs rows). The first class must be soil.
    #[arg(long, value_name = "NAMES", default_value = default_of("refine"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"colour,plants,rows,appearance\""))]
    pub refine: Option<String>,
    /// Data augmentation: all, none, or some of flip, rotate, scale, crop, colour, blur, noise, separated by commas. Not part of all are
    /// erase (random erasing: patches of one colour labelled as soil), jpeg (compression), and fourier (style of another training image:
    /// amplitudes of its lowest frequencies).
    #[arg(long, value_name = "NAMES", default_value = default_of("augment"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"all,erase\""))]
    pub augment: Option<String>,
    /// Range of the augmentation `scale`: relative (factors of 1/1.5 to 1.5), auto or millimetres such as 0.3..2. The last two make the
    /// pixel size on the ground log-uniform, at the size that images are resized to, and need training images that record their
    /// cameras: auto between the 5th and 95th percentile of the training images, 0.3..2 between 0.3 and 2 mm.
    #[arg(long, value_name = "RANGE", default_value = default_of("augment_scale"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"0.3..2\""))]
    pub augment_scale: Option<String>,
    /// Input normalization: band (each band of an image by its mean and standard deviation, which removes exposure and white balance),
    /// image (all bands of an image together, which removes exposure), or fixed (each band by those of the training set).
    #[arg(long, value_name = "NAME", default_value = default_of("normalization"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"image\""))]
    pub normalization: Option<String>,
    /// Steps between two validation passes, each followed by a checkpoint.
    #[arg(long, value_name = "N", default_value = default_of("validate_every"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "50"))]
    pub validate_every: Option<u64>,
    /// Number of validation passes without improvement after which training ends early.
    #[arg(long, value_name = "N", default_value = default_of("patience"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "20"))]
    pub patience: Option<u64>,
}

/// Returns the default of a field as a user would write it; empty if the field has no default.
pub fn default_of(field: &str) -> &'static str {
    static DEFAULTS: LazyLock<BTreeMap<&'static str, String>> = LazyLock::new(|| defaults().into_iter().collect());
    DEFAULTS.get(field).map_or("", String::as_str)
}

/// Returns every field that has a default, with the default as a user would write it.
pub fn defaults() -> Vec<(&'static str, String)> {
    let Plan { classes, shape, hyper, .. } = Plan::default();
    let bands: Vec<&str> = shape.bands.iter().map(Band::name).collect();
    let bands = if shape.bands == Band::RGB { "rgb".to_owned() } else { bands.join(",") };
    vec![
        ("classes", classes.to_string()),
        ("bands", bands),
        ("size", format!("{}x{}", shape.width, shape.height)),
        ("rare_crops", hyper.rare_crops.to_string()),
        ("steps", hyper.steps.to_string()),
        ("batch", hyper.batch.to_string()),
        ("accumulate", hyper.accumulate.to_string()),
        ("optimiser", hyper.optimiser.name().into()),
        ("decay", hyper.decay.to_string()),
        ("schedule", hyper.schedule.name().into()),
        ("loss", hyper.loss.name().into()),
        ("class_weights", hyper.class_weights.name().into()),
        ("calibrate", hyper.calibrate.to_string()),
        ("logit_adjustment", hyper.logit_adjustment.to_string()),
        ("pretrained", hyper.pretrained.name()),
        ("freeze", hyper.freeze.to_string()),
        ("encoder_rate", hyper.encoder_rate.to_string()),
        ("ema", hyper.ema.to_string()),
        ("name_crops", hyper.name_crops.to_string()),
        ("resize", hyper.resize.name()),
        ("refine", hyper.refine.name()),
        ("augment", hyper.augment.to_string()),
        ("augment_scale", hyper.augment_scale.name()),
        ("normalization", hyper.normalization.name().into()),
        ("validate_every", hyper.validate_every.to_string()),
        ("patience", hyper.patience.to_string()),
    ]
}

/// Writes the defaults into the schema, in the syntax of an experiment file.
fn tell_defaults(schema: &mut schemars::Schema) {
    let Some(fields) = schema.get_mut("properties").and_then(serde_json::Value::as_object_mut) else { return };
    for (name, default) in defaults() {
        let written = match (name, default.parse::<f64>()) {
            ("size", _) => format!("({})", default.replace('x', ", ")),
            (_, Ok(_)) => default,
            _ => format!("{default:?}"),
        };
        if let Some(field) = fields.get_mut(name).and_then(serde_json::Value::as_object_mut) {
            field.insert(ron_file::DEFAULT.into(), written.into());
        }
    }
}

fn rate_help() -> String {
    let each = OptimiserKind::ALL.map(|kind| format!("{} with {}", kind.default_rate(), kind.name()));
    format!("Learning rate at the start [default: {}]", each.join(", "))
}

/// Parses a size such as `480x360`.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    sides
        .filter(|(w, h)| SIDES.contains(w) && SIDES.contains(h))
        .ok_or_else(|| format!("write it as 480x360; sides from {} to {}", SIDES.start(), SIDES.end()))
}

/// Parses the text, if there is one, and stores the result in `to`. A parse error becomes an [`Invalid`] about `field`; its text is
/// split at the first `: ` into message and help.
fn word<T>(
    field: &'static str,
    text: Option<&String>,
    to: &mut T,
    parse: impl Fn(&str) -> Result<T, String>,
) -> Result<(), Invalid> {
    if let Some(text) = text {
        *to = parse(text).map_err(|words| match words.split_once(": ") {
            Some((message, help)) => Invalid { field, message: message.into(), help: help.into() },
            None => Invalid { field, message: format!("`{text}` is not valid here"), help: words },
        })?;
    }
    Ok(())
}

fn number<T: Copy>(value: Option<T>, to: &mut T) {
    if let Some(value) = value {
        *to = value;
    }
}

impl Settings {
    /// Applies the given values to a plan, and checks the plan. A given optimiser also sets its default learning rate.
    pub fn apply(&self, plan: &mut Plan) -> Result<(), Invalid> {
        word("classes", self.classes.as_ref(), &mut plan.classes, Classes::parse)?;
        word("bands", self.bands.as_ref(), &mut plan.shape.bands, Band::list)?;
        if let Some(size) = self.size {
            check_size("size", size)?;
            (plan.shape.width, plan.shape.height) = size;
        }
        let hyper = &mut plan.hyper;
        if self.crop_size.is_some() {
            hyper.crop_size = self.crop_size;
        }
        word("optimiser", self.optimiser.as_ref(), &mut hyper.optimiser, OptimiserKind::parse)?;
        if self.optimiser.is_some() {
            hyper.rate = hyper.optimiser.default_rate();
        }
        word("schedule", self.schedule.as_ref(), &mut hyper.schedule, Schedule::parse)?;
        word("loss", self.loss.as_ref(), &mut hyper.loss, LossFunction::parse)?;
        word("class_weights", self.class_weights.as_ref(), &mut hyper.class_weights, ClassWeights::parse)?;
        word("augment", self.augment.as_ref(), &mut hyper.augment, Augment::parse)?;
        word("augment_scale", self.augment_scale.as_ref(), &mut hyper.augment_scale, AugmentScale::parse)?;
        word("normalization", self.normalization.as_ref(), &mut hyper.normalization, NormalizationMode::parse)?;
        word("pretrained", self.pretrained.as_ref(), &mut hyper.pretrained, Pretrained::parse)?;
        word("resize", self.resize.as_ref(), &mut hyper.resize, Resize::parse)?;
        word("refine", self.refine.as_ref(), &mut hyper.refine, Refine::parse)?;
        number(self.freeze, &mut hyper.freeze);
        number(self.encoder_rate, &mut hyper.encoder_rate);
        number(self.ema, &mut hyper.ema);
        number(self.name_crops, &mut hyper.name_crops);
        number(self.accumulate, &mut hyper.accumulate);
        number(self.rare_crops, &mut hyper.rare_crops);
        number(self.steps, &mut hyper.steps);
        number(self.batch, &mut hyper.batch);
        number(self.rate, &mut hyper.rate);
        number(self.decay, &mut hyper.decay);
        number(self.calibrate, &mut hyper.calibrate);
        number(self.logit_adjustment, &mut hyper.logit_adjustment);
        number(self.validate_every, &mut hyper.validate_every);
        number(self.patience, &mut hyper.patience);
        plan.hyper.check(&plan.shape).map_err(|invalid| Invalid {
            // If the crop size was set earlier, the fault is in the new image size.
            field: if invalid.field == "crop_size" && self.crop_size.is_none() { "size" } else { invalid.field },
            ..invalid
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: defaults that are defined twice drift apart. Expected: the defaults in `--help`, parsed, give the default plan, and
    /// every field has one except crop size and rate. Source: [`Plan::default`].
    #[test]
    fn defaults_of_the_command_line_are_those_of_the_code() {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            settings: Settings,
        }
        let Line { settings } = clap::Parser::parse_from(["train"]);
        let mut plan =
            Plan { hyper: super::super::Hyperparameters { steps: 7, ..Default::default() }, ..Plan::default() };
        plan.shape.width = 99;
        settings.apply(&mut plan).unwrap();
        assert_eq!(plan, Plan::default());
        assert_eq!((settings.crop_size, settings.rate), (None, None));
        let given = serde_json::to_value(&settings).unwrap();
        let given: Vec<&str> = given.as_object().unwrap().keys().map(String::as_str).collect();
        let mut known: Vec<&str> = defaults().into_iter().map(|(field, _)| field).collect();
        known.sort_unstable();
        assert_eq!(given, known);
    }

    /// Rationale: a crop larger than the image was an error on the command line but silently reduced in an experiment. Expected: an
    /// error for both sources. It is about the crop size, or about the image size if only that was given.
    #[test]
    fn a_crop_that_is_larger_than_the_image_is_an_error() {
        let large = Settings { crop_size: Some((500, 300)), ..Settings::default() };
        let invalid = large.apply(&mut Plan::default()).unwrap_err();
        assert_eq!(invalid.field, "crop_size");
        assert!(invalid.message.contains("500 × 300") && invalid.message.contains("480 × 360"), "{invalid:?}");
        let error = invalid.of_flag();
        assert!(error.to_string().starts_with("--crop-size: a crop of 500 × 300"), "{error}");
        assert_eq!(error.exit_code(), 2);
        let mut plan = Plan::default();
        Settings { crop_size: Some((480, 360)), ..Settings::default() }.apply(&mut plan).unwrap();
        let smaller = Settings { size: Some((240, 180)), ..Settings::default() };
        assert_eq!(smaller.apply(&mut plan.clone()).unwrap_err().field, "size");
        let both = Settings { crop_size: Some((240, 180)), ..smaller };
        both.apply(&mut plan).unwrap();
    }
}
