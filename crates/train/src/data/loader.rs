//! The data loader: threads that prepare batches ahead of the network.
//!
//! Step s uses images s·b to s·b + b − 1 of an endless list, which contains all images in a new random order in each epoch. A batch
//! depends only on the seed and the step, so a resumed run gets the same batches, with any number of threads.

use super::bands::Band;
use super::crop::Crop;
use super::fourier;
use super::order::BatchSettings;
use super::photos::{Photos, Views};
use super::plants;
use super::store::Store;
use furrow_base::math::ToInt;
use furrow_base::sampling::{Purpose, Stream};
use furrow_base::supervise::supervised;
use furrow_base::{Error, Result};
use std::borrow::Cow;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};

/// Batch of images with labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch {
    /// Number of images.
    pub images: usize,
    /// Pixels of the crops, `images × height × width × bands`, normalized.
    pub pixels: Vec<f32>,
    /// Class of each pixel, `images × height × width`; 255 for no label.
    pub labels: Vec<u8>,
    /// Species named as the crops of each image, as indices in the network's list; empty for crops of any kind.
    pub crops: Vec<Vec<u8>>,
    /// Targets of the plant decoder, images × [`plants::PLANES`] × height × width; empty unless the examples have plant numbers.
    pub plants: Vec<f32>,
}

/// Iterator over the inputs of steps (by default batches), in the order of the steps.
pub struct Loader<T = Batch> {
    workers: Vec<Receiver<Result<T>>>,
    next: usize,
}

/// Number of batches that each thread may prepare ahead.
const AHEAD: usize = 2;

impl Loader {
    /// Starts to load the batches of the steps `from..to` with `threads` threads. The store must contain an image. The threads end
    /// when the loader is dropped.
    pub fn start(store: &Arc<Store>, order: &BatchSettings, from: u64, to: u64, threads: usize) -> Result<Self> {
        let maker = || {
            let (store, order) = (Arc::clone(store), order.clone());
            let mut epochs = Epochs { seed: order.seed, current: None };
            move |step| make(&store, &order, step, &mut epochs)
        };
        Self::of(maker, from, to, threads)
    }
}

impl Loader<Views> {
    /// Starts to load crops of photographs for the steps `from..to`. There must be at least one photograph.
    pub fn photos(photos: &Arc<Photos>, order: &BatchSettings, from: u64, to: u64, threads: usize) -> Result<Self> {
        let maker = || {
            let (photos, order) = (Arc::clone(photos), order.clone());
            move |step| Ok(photos.views(&order, step))
        };
        Self::of(maker, from, to, threads)
    }
}

impl<T: Send + 'static> Loader<T> {
    /// Starts the threads; a panic in one is the error of its step. `maker` creates, for each thread, the function that prepares the input of a step.
    fn of<M>(maker: impl Fn() -> M, from: u64, to: u64, threads: usize) -> Result<Self>
    where
        M: FnMut(u64) -> Result<T> + Send + 'static,
    {
        let threads = threads.max(1).to_u64();
        let begin = |thread: u64| {
            let (sender, receiver) = sync_channel(AHEAD);
            let mut make = maker();
            let work = move || {
                for step in (from + thread..to).step_by(threads.to_usize()) {
                    let made = supervised(|| make(step)).map_err(|bug| bug.within(format!("step {step}")));
                    let made = made.and_then(|made| made);
                    let failed = made.is_err();
                    // A failed send means that the loader was dropped.
                    if sender.send(made).is_err() || failed {
                        return;
                    }
                }
            };
            std::thread::Builder::new().name("loader".into()).spawn(work).map_err(Error::no_thread)?;
            Ok(receiver)
        };
        Ok(Self { workers: (0..threads).map(begin).collect::<Result<_>>()?, next: 0 })
    }
}

impl<T> Iterator for Loader<T> {
    type Item = Result<T>;

    fn next(&mut self) -> Option<Self::Item> {
        let worker = &self.workers[self.next % self.workers.len()];
        self.next += 1;
        worker.recv().ok()
    }
}

/// Random orders of the images, one for each epoch; the last one is cached.
struct Epochs {
    seed: u64,
    current: Option<(u64, Vec<usize>)>,
}

impl Epochs {
    /// Returns the image at the position `place` of the endless list.
    fn at(&mut self, place: u64, images: usize) -> usize {
        let (epoch, within) = (place / images.to_u64(), place % images.to_u64());
        if self.current.as_ref().is_none_or(|(e, _)| *e != epoch) {
            let mut stream = Stream::of(self.seed, epoch, Purpose::Training, 1);
            let mut order: Vec<usize> = (0..images).collect();
            for i in (1..images).rev() {
                order.swap(i, stream.index(i + 1));
            }
            self.current = Some((epoch, order));
        }
        self.current.as_ref().map_or(0, |(_, order)| order[within.to_usize()])
    }
}

fn make(store: &Store, order: &BatchSettings, step: u64, epochs: &mut Epochs) -> Result<Batch> {
    let shape = store.shape();
    let colour: Vec<bool> = shape.bands.iter().map(Band::is_color).collect();
    let crop = Crop { image: (shape.width, shape.height), size: order.crop_size, rare: order.rare, ground: None };
    let mut batch = Batch { images: order.batch, ..Batch::default() };
    for slot in 0..order.batch.to_u64() {
        let place = step * order.batch.to_u64() + slot;
        let image = epochs.at(place, store.len());
        let mut example = store.get(image)?;
        if order.augment.fourier {
            let mut stream = Stream::of(order.seed, place, Purpose::Training, 5);
            let other = store.get(stream.index(store.len()))?;
            let restyled = fourier::restyled(&example, &other, crop.image, &mut stream);
            example = restyled.map_or(example, Cow::Owned);
        }
        let named = order.naming.map_or_else(Vec::new, |naming| {
            naming.name(example.to_mut(), &mut Stream::of(order.seed, place, Purpose::Training, 6))
        });
        batch.crops.push(named);
        let crop = Crop { ground: order.pixels.as_ref().map(|pixels| pixels.at(image)), ..crop };
        let mut stream = Stream::of(order.seed, place, Purpose::Training, 2);
        let found = order.augment.apply(&example, &crop, &colour, &order.normalization, &mut stream);
        batch.plants.extend(plants::targets(&found.plants, crop.size.0.to_usize()));
        batch.pixels.extend(found.pixels);
        batch.labels.extend(found.labels);
    }
    Ok(batch)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_epoch_holds_every_image_once_in_another_order() {
        let mut epochs = Epochs { seed: 5, current: None };
        let epoch = |epochs: &mut Epochs, e: u64| (0..7).map(|i| epochs.at(e * 7 + i, 7)).collect::<Vec<_>>();
        let (first, second) = (epoch(&mut epochs, 0), epoch(&mut epochs, 1));
        assert_ne!(first, second);
        assert_eq!(first, epoch(&mut epochs, 0));
        for mut order in [first, second] {
            order.sort_unstable();
            assert_eq!(order, [0, 1, 2, 3, 4, 5, 6]);
        }
    }

    /// Expected: the steps before the panic arrive, then its error, then nothing; the loader never waits.
    #[test]
    fn a_panic_is_the_error_of_its_step() {
        let maker = || {
            |step: u64| {
                assert_ne!(step, 3, "no leaf");
                Ok(step)
            }
        };
        let mut loader = Loader::of(maker, 0, 100, 1).unwrap();
        assert!((0..3).all(|step| loader.next().unwrap().unwrap() == step));
        let error = loader.next().unwrap().unwrap_err().to_string();
        assert!(error.starts_with("step 3: the program failed: ") && error.contains("no leaf"), "{error}");
        assert!(loader.next().is_none());
    }
}
