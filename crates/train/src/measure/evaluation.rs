//! Evaluation of a set of images, one after the other. Only the counts of each image are kept in memory.

use super::bootstrap;
use super::boundary::{Boundary, TOLERANCE};
use super::confusion::Confusion;
use super::instances::Instances;
use super::report::{BoundaryScores, ClassBoundary, ClassSizes, ImageScores, Report, Seconds};
use super::scores::{Measures, Scores, mean};
use super::size::Sizes;
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_dataset::model::sample::IGNORE;

/// Seed of the bootstrap. It is fixed, so that equal predictions give equal reports.
const SEED: u64 = 0;

/// Prediction and ground truth of one image.
#[derive(Clone, Copy, Debug)]
pub struct Prediction<'a> {
    /// Name of the image.
    pub name: &'a str,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// True class of each pixel; 255 for no label.
    pub truth: &'a [u8],
    /// Predicted class of each pixel.
    pub predicted: &'a [u8],
    /// Plant number of each pixel, 0 for none, if the dataset has plant numbers.
    pub plants: Option<&'a [u32]>,
    /// Predicted plant of each pixel, 0 for none, if the prediction separates plants.
    pub separated: Option<&'a [u32]>,
    /// Duration of the prediction, seconds.
    pub seconds: Option<f64>,
}

/// Counts of one image.
#[derive(Clone, Debug, PartialEq)]
pub struct EvaluatedImage {
    pub(super) name: String,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) ignored: u64,
    pub(super) seconds: Option<f64>,
    pub(super) confusion: Confusion,
    boundaries: Vec<Boundary>,
    sizes: Sizes,
    instances: Option<Instances>,
}

/// Evaluation of a set of images in progress.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    pub(super) classes: Vec<String>,
    pub(super) plants: Vec<bool>,
    pub(super) images: Vec<EvaluatedImage>,
    pub(super) boundaries: Vec<Boundary>,
    pub(super) sizes: Sizes,
}

impl Evaluation {
    /// Returns an evaluation without images. `classes` are the names of 1 to 255 classes, in the order of their numbers; the first is
    /// soil, the others are plants.
    pub fn new<S: Into<String>>(classes: impl IntoIterator<Item = S>) -> Self {
        let classes: Vec<String> = classes.into_iter().map(Into::into).collect();
        let plants = (0..classes.len()).map(|class| class > 0).collect();
        Self::with_plants(classes, plants)
    }

    /// Returns an evaluation without images; `plants` is `true` for each class that is a plant.
    pub fn with_plants(classes: Vec<String>, plants: Vec<bool>) -> Self {
        let n = classes.len();
        assert!((1..=usize::from(IGNORE)).contains(&n) && plants.len() == n, "{n} classes, {} given", plants.len());
        Self { classes, plants, images: Vec::new(), boundaries: vec![Boundary::default(); n], sizes: Sizes::new(n) }
    }

    /// Evaluates an image and adds it.
    pub fn add(&mut self, prediction: &Prediction<'_>) -> Result<()> {
        let image = self.evaluate(prediction)?;
        self.push(image);
        Ok(())
    }

    /// Evaluates an image without adding it, so that several threads can evaluate; [`Self::push`] adds it. Images may be added in any
    /// order.
    pub fn evaluate(&self, prediction: &Prediction<'_>) -> Result<EvaluatedImage> {
        let Prediction { name, width, height, truth, predicted, plants, separated, seconds } = *prediction;
        let wrong = |what: String| Error::input(format!("{name}: {what}"));
        let (w, h) = (width.to_usize(), height.to_usize());
        let maps = [
            ("truth", truth.len()),
            ("prediction", predicted.len()),
            ("plant map", plants.map_or(w * h, <[u32]>::len)),
            ("predicted plant map", separated.map_or(w * h, <[u32]>::len)),
        ];
        if let Some((map, n)) = maps.into_iter().find(|(_, n)| *n != w * h) {
            return Err(wrong(format!("the {map} has {n} pixels, an image of {w} × {h} has {}", w * h)));
        }
        let mut confusion = Confusion::new(self.classes.len());
        confusion.add(truth, predicted).map_err(|e| wrong(e.to_string()))?;
        Ok(EvaluatedImage {
            name: name.to_owned(),
            width,
            height,
            ignored: truth.len().to_u64() - confusion.total(),
            seconds,
            boundaries: Boundary::of(self.classes.len(), w, h, truth, predicted),
            instances: plants
                .zip(separated)
                .map(|(plants, separated)| Instances::of(plants, separated, |at| truth[at] != IGNORE)),
            sizes: Sizes::of(&self.plants, (w, h), truth, predicted, plants),
            confusion,
        })
    }

    /// Adds an image that [`Self::evaluate`] returned.
    pub fn push(&mut self, image: EvaluatedImage) {
        self.boundaries.iter_mut().zip(&image.boundaries).for_each(|(sum, one)| sum.merge(one));
        self.sizes.merge(&image.sizes);
        self.images.push(image);
    }

    /// Returns the number of images.
    pub fn len(&self) -> usize {
        self.images.len()
    }

    /// Returns whether there are no images.
    pub fn is_empty(&self) -> bool {
        self.images.is_empty()
    }

    /// Returns the report, with images sorted by name. The order of their addition has no effect.
    pub fn finish(mut self) -> Report {
        self.images.sort_by(|a, b| a.name.cmp(&b.name));
        report(&self)
    }
}

/// Computes the report of an evaluation whose images are sorted.
fn report(found: &Evaluation) -> Report {
    let n = found.classes.len();
    let matrices: Vec<Confusion> = found.images.iter().map(|image| image.confusion.clone()).collect();
    let mut confusion = Confusion::new(n);
    for matrix in &matrices {
        confusion.merge(matrix);
    }
    let scores = Scores::of(&confusion, &found.plants);
    let flat = |matrix: &Confusion| Scores::of(matrix, &found.plants).values().copied().collect::<Vec<_>>();
    let mut drawn = bootstrap::intervals(&matrices, SEED, flat);
    drawn.resize(scores.values().count(), None);
    let intervals = Measures::from_values(n, drawn).expect("`drawn` was resized to the number of scores");
    let boundaries: Vec<ClassBoundary> = found.boundaries.iter().map(class_boundary).collect();
    Report {
        classes: found.classes.clone(),
        pixels: confusion.total(),
        ignored: found.images.iter().map(|image| image.ignored).sum(),
        confusion,
        scores,
        intervals,
        boundary: BoundaryScores {
            tolerance: TOLERANCE,
            mean_f_score: mean(boundaries.iter().map(|b| b.f_score)),
            classes: boundaries,
        },
        sizes: (0..n)
            .filter(|class| found.plants[*class])
            .map(|class| ClassSizes { class: found.classes[class].clone(), bins: found.sizes.bins(class) })
            .collect(),
        instances: found.images.iter().filter_map(|image| image.instances).reduce(|mut sum, image| {
            sum.merge(&image);
            sum
        }),
        seconds: seconds(found.images.iter().filter_map(|image| image.seconds).collect()),
        images: found.images.iter().map(|image| image_scores(image, &found.plants)).collect(),
    }
}

fn class_boundary(pixels: &Boundary) -> ClassBoundary {
    ClassBoundary { f_score: pixels.f_score(), precision: pixels.precision(), recall: pixels.recall(), pixels: *pixels }
}

fn seconds(mut all: Vec<f64>) -> Option<Seconds> {
    all.sort_by(f64::total_cmp);
    let n = all.len();
    (n > 0).then(|| Seconds {
        images: n.to_u64(),
        mean: all.iter().sum::<f64>() / n.to_f64(),
        median: f64::midpoint(all[(n - 1) / 2], all[n / 2]),
    })
}

fn image_scores(image: &EvaluatedImage, plants: &[bool]) -> ImageScores {
    let scores = Scores::of(&image.confusion, plants);
    ImageScores {
        name: image.name.clone(),
        width: image.width,
        height: image.height,
        ignored: image.ignored,
        ious: scores.classes.iter().map(|c| c.iou).collect(),
        mean_iou: scores.mean_iou,
        vegetation_iou: scores.vegetation.iou,
        seconds: image.seconds,
    }
}
