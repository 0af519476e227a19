//! Refuses, before a network runs, images for which it would take more memory than the machine has.

use super::{Model, Precision};
use crate::net::{Footprint, Parameter};
use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};
use furrow_field::estimate::{gib, usual_memory};

/// Memory of an inference relative to the values that are held at once: libtorch reorders copies, and freed blocks are kept.
/// Measured with all six networks on images of 640 to 2048 pixels: 1.2 to 1.9.
const INFERENCE: f64 = 1.75;
/// Copies of the parameters during a training: values, gradients, moments of the optimiser, best values, and the checkpoint
/// while it is written. Measured with U-Nets of 14 and 25 million parameters.
const COPIES: f64 = 18.0;

impl Model {
    /// Returns an error if inference of `images` images of this width and height would take too much memory.
    pub fn check_inference(&self, images: usize, size: (u32, u32)) -> Result<()> {
        let values = INFERENCE * self.footprint(size).peak * images.to_f64() * self.bytes();
        self.check(values, size, "use smaller images, --resize with shorter sides, or a smaller --batch")
    }

    /// Returns an error if training on `images` images of this width and height at once would take too much memory.
    pub fn check_training(&self, images: usize, size: (u32, u32)) -> Result<()> {
        let Footprint { peak, all } = self.footprint(size);
        let values = (all + peak) * images.to_f64() * self.bytes();
        let parameters: usize = self.list.iter().map(Parameter::len).sum();
        let whole = values + COPIES * parameters.to_f64() * 4.0;
        self.check(whole, size, "use a smaller --batch or --size; --accumulate keeps the number of images of a step")
    }

    fn footprint(&self, size: (u32, u32)) -> Footprint {
        Footprint::of(self.network, self.bands, self.classes, self.has_plants, size)
    }

    /// Returns the size of a value, bytes.
    fn bytes(&self) -> f64 {
        match self.place.precision {
            Precision::Single => 4.0,
            Precision::Bf16 => 2.0,
        }
    }

    fn check(&self, bytes: f64, (width, height): (u32, u32), help: &str) -> Result<()> {
        let limit = usual_memory().to_f64();
        // The memory of a GPU is not known here; libtorch reports its end.
        if self.place.device.is_cuda() || bytes <= limit {
            return Ok(());
        }
        let (network, needed, limit) = (self.network.name(), gib(bytes), gib(limit));
        let words = format!(
            "{network} would take about {needed} of memory for images of {width} × {height} pixels; the limit is {limit}"
        );
        Err(Error::input(words).help(help))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::net::Network;
    use crate::torch::Placement;
    use tch::Device;

    /// Expected: usual images pass; those that no machine can hold are refused with exit code 2 before anything is computed.
    #[test]
    fn images_beyond_the_memory_are_refused() {
        let place = Placement { device: Device::Cpu, precision: Precision::Single };
        for network in Network::ALL {
            let model = Model::new(*network, 3, 3, 1, place);
            assert!(model.check_inference(1, (480, 360)).is_ok() && model.check_training(1, (64, 64)).is_ok());
            for refused in [model.check_inference(1000, (65536, 65536)), model.check_training(1000, (8192, 8192))] {
                let error = refused.unwrap_err();
                assert_eq!(error.exit_code(), 2);
                assert!(error.message().starts_with(network.name()) && error.advice().is_some(), "{error}");
            }
        }
    }
}
