//! Images and training of a network for a named crop: the recipe of the network that ships, in two sizes.
//!
//! `docs/results/networks.md`, "Drier soils, and logit adjustment", has the trials behind it (network I): few steps, an average of the
//! weights and an encoder that moves little, because networks that train longer know the renderer better and photographs worse.

use crate::data::{Pick, Selection};
use crate::fit::{Plan, Settings};
use crate::net::Network;
use crate::zoo::ANY_FIELD;
use furrow_base::Result;
use furrow_base::math::ToFloat;
use furrow_dataset::model::split::{Shares, Split};
use furrow_dataset::{Order, model};
use furrow_render::settings::{Quality, RenderOptions};
use std::path::Path;

/// Network that the recipe was made for.
pub const NETWORK: Network = Network::LiteUnet;
/// Width and height of the images, pixels.
pub const SIZE: (u32, u32) = (480, 360);
/// Size of the crops of a step, pixels.
const CROP: (u32, u32) = (320, 256);
/// Shares of the training and test sets: nine of ten images are trained on. Few images are divided by [`FEW`].
const SPLIT: [u32; 3] = [9, 0, 1];
/// Shares for fewer than ten images.
const FEW: [u32; 3] = [2, 0, 1];
/// Core seconds of a training step of [`NETWORK`] with the recipe's crops, for the cost estimate: 300 steps took 2.4 minutes on two
/// cores that were compiling (`docs/results/archive.md`).
const STEP_CORE_S: f64 = 1.0;

/// Size of the work: images, samples and steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recipe {
    /// Number of rendered images; a tenth of them is held out for the evaluation.
    pub images: u64,
    /// Samples per pixel.
    pub spp: u32,
    /// Training steps.
    pub steps: u64,
    /// Width and height of the images, pixels.
    pub size: (u32, u32),
    /// Network.
    pub network: Network,
}

impl Recipe {
    /// Less than ten minutes on two cores by the estimate: 36 images to train on and 4 to evaluate.
    pub const QUICK: Self = Self { images: 40, spp: 4, steps: 300, size: SIZE, network: NETWORK };
    /// Less than an hour on two cores by the estimate: 360 images to train on and 40 to evaluate.
    pub const USUAL: Self = Self { images: 400, spp: 8, steps: 600, ..Self::QUICK };

    /// Returns the order of the dataset of the scene file.
    pub fn order(&self, scene: &Path) -> Order {
        Order {
            width: Some(self.size.0),
            height: Some(self.size.1),
            split: Shares(if self.images < 10 { FEW } else { SPLIT }),
            options: RenderOptions::path_traced(Quality::spp(self.spp)),
            ..Order::new(scene, self.images)
        }
    }

    /// Returns the plan of the training on the dataset in the folder `data`.
    ///
    /// # Errors
    /// If the network does not support the size of the images.
    pub fn plan(&self, data: &Path, precision: &str, threads: usize) -> Result<Plan> {
        let own = |text: &str| Some(text.to_owned());
        let mut settings = Settings {
            size: Some(self.size),
            batch: Some(4),
            steps: Some(self.steps),
            rate: Some(0.002),
            ema: Some(0.99),
            augment: own("all,erase"),
            class_weights: own("annealed"),
            normalization: own("image"),
            logit_adjustment: Some(0.5),
            // The network knows the crop: rows and connected plants would overrule it.
            refine: own("colour,smooth"),
            ..Settings::default()
        };
        if self.size == SIZE {
            settings.crop_size = Some(CROP);
            settings.rare_crops = Some(0.3);
            settings.resize = own("480,640,960");
        }
        if self.network == NETWORK {
            settings.encoder_rate = Some(0.1);
        }
        let train = vec![Selection { pick: Some(Pick::Split(Split::Train)), ..Selection::of(data) }];
        let mut plan = Plan { network: self.network, train, precision: precision.into(), threads, ..Plan::default() };
        settings.apply(&mut plan).map_err(|invalid| invalid.of_flag())?;
        Ok(plan)
    }

    /// Returns the run whose weights the training starts from: the network for any field, which knows leaves and soils of many more images
    /// than the recipe renders. `None` for a network of another kind, which starts from random weights.
    pub fn begin(&self) -> Option<&'static Path> {
        (self.network == NETWORK).then(|| Path::new(ANY_FIELD))
    }

    /// Returns the images that are held out for the evaluation of the dataset in the folder `data`.
    pub fn held_out(data: &Path) -> Selection {
        Selection { pick: Some(Pick::Split(Split::Test)), ..Selection::of(data) }
    }

    /// Returns `true` if the dataset in the folder `data` is complete.
    pub fn is_rendered(data: &Path) -> bool {
        data.join(model::recipe::MANIFEST).is_file()
    }

    /// Returns the estimated core seconds of the training.
    pub fn training_core_s(&self) -> f64 {
        STEP_CORE_S * self.steps.to_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToInt;

    /// Rationale: the recipe is that of a measured network. Expected: its settings, 36 images of the quick one to train on, and no
    /// refinement that votes over the network.
    #[test]
    fn the_recipe_is_that_of_the_network_that_ships() {
        for (recipe, images) in [(Recipe::QUICK, 36), (Recipe::USUAL, 360)] {
            let order = recipe.order(Path::new("scene.ron"));
            let train = (0..order.count).filter(|k| order.split.of(*k) == Split::Train).count();
            let test = (0..order.count).filter(|k| order.split.of(*k) == Split::Test).count();
            assert_eq!((train, test.to_u64()), (images, recipe.images - images.to_u64()));
            let plan = recipe.plan(Path::new("data"), "f32", 2).unwrap();
            assert_eq!(
                (plan.hyper.refine.name(), plan.hyper.resize.name()),
                ("colour,smooth".into(), "480,640,960".into())
            );
            assert_eq!((plan.hyper.crop_size, plan.hyper.pretrained.name()), (Some(CROP), "none".into()));
            assert!(recipe.begin().is_some());
        }
    }
}
