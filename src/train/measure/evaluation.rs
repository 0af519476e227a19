//! A set of images, judged one by one: of each only its sums are kept.

use super::boundary::Boundary;
use super::confusion::Confusion;
use super::report::{self, Report};
use super::size::Sizes;
use crate::dataset::sample::IGNORE;
use crate::{Error, Result};

/// What was answered on one image, and what is true.
#[derive(Clone, Copy, Debug)]
pub struct Answer<'a> {
    /// Name of the image.
    pub name: &'a str,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// True class of each pixel; 255 is no label.
    pub truth: &'a [u8],
    /// Predicted class of each pixel.
    pub predicted: &'a [u8],
    /// Number of each pixel's plant, 0 of none, where the set tells plants apart.
    pub plants: Option<&'a [u16]>,
    /// How long the answer took, seconds.
    pub seconds: Option<f64>,
}

/// One image, judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    pub(super) name: String,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) ignored: u64,
    pub(super) seconds: Option<f64>,
    pub(super) confusion: Confusion,
    boundaries: Vec<Boundary>,
    sizes: Sizes,
}

/// Adds up how well a set of images was answered.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    pub(super) classes: Vec<String>,
    pub(super) plants: Vec<bool>,
    pub(super) images: Vec<Judged>,
    pub(super) boundaries: Vec<Boundary>,
    pub(super) sizes: Sizes,
}

impl Evaluation {
    /// Of no image yet. `classes` are the names of the classes in the order of their numbers, 1 to 255; the first is soil, the others
    /// are plants.
    pub fn new<S: Into<String>>(classes: impl IntoIterator<Item = S>) -> Self {
        let classes: Vec<String> = classes.into_iter().map(Into::into).collect();
        let plants = (0..classes.len()).map(|class| class > 0).collect();
        Self::with_plants(classes, plants)
    }

    /// The same where other classes than the first are no plants: `plants` tells for each whether it is one.
    pub fn with_plants(classes: Vec<String>, plants: Vec<bool>) -> Self {
        let n = classes.len();
        assert!((1..=usize::from(IGNORE)).contains(&n) && plants.len() == n, "{n} classes, {} told", plants.len());
        Self { classes, plants, images: Vec::new(), boundaries: vec![Boundary::default(); n], sizes: Sizes::new(n) }
    }

    /// Judges an image and counts it.
    pub fn add(&mut self, answer: &Answer<'_>) -> Result<()> {
        let judged = self.judge(answer)?;
        self.push(judged);
        Ok(())
    }

    /// Judges an image without counting it, so that several threads can: [`Self::push`] counts it. Images may come in any order.
    pub fn judge(&self, answer: &Answer<'_>) -> Result<Judged> {
        let Answer { name, width, height, truth, predicted, plants, seconds } = *answer;
        let wrong = |what: String| Error::input(format!("{name}: {what}"));
        let (w, h) = (width as usize, height as usize);
        let maps = [
            ("truth", truth.len()),
            ("prediction", predicted.len()),
            ("map of plants", plants.map_or(w * h, <[u16]>::len)),
        ];
        if let Some((map, n)) = maps.into_iter().find(|(_, n)| *n != w * h) {
            return Err(wrong(format!("the {map} has {n} pixels, an image of {w} × {h} has {}", w * h)));
        }
        let mut confusion = Confusion::new(self.classes.len());
        confusion.add(truth, predicted).map_err(|e| wrong(e.to_string()))?;
        Ok(Judged {
            name: name.to_owned(),
            width,
            height,
            ignored: truth.len() as u64 - confusion.total(),
            seconds,
            boundaries: Boundary::of(self.classes.len(), w, h, truth, predicted),
            sizes: Sizes::of(&self.plants, (w, h), truth, predicted, plants),
            confusion,
        })
    }

    /// Counts an image that was judged here.
    pub fn push(&mut self, image: Judged) {
        self.boundaries.iter_mut().zip(&image.boundaries).for_each(|(sum, one)| sum.merge(one));
        self.sizes.merge(&image.sizes);
        self.images.push(image);
    }

    /// All images that were counted.
    pub fn len(&self) -> usize {
        self.images.len()
    }

    /// Whether no image was counted.
    pub fn is_empty(&self) -> bool {
        self.images.is_empty()
    }

    /// What came out, images sorted by name: the same whatever the order in which they came.
    pub fn finish(mut self) -> Report {
        self.images.sort_by(|a, b| a.name.cmp(&b.name));
        report::of(&self)
    }
}
