//! `trace stream`: writes images with their labels to stdout for another program, as they are rendered.

use crate::dataset::order::{ContentArgs, RenderingArgs};
use crate::dataset::render::WorkArgs;
use crate::field::{MemoryArgs, SceneArgs};
use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};
use furrow_cli::cli::signal::Signals;
use furrow_dataset::deliver::stream::{ImageStream, Listener};
use furrow_dataset::make::generate::Shard;
use furrow_dataset::make::plan::Order;
use furrow_dataset::model::classes::Classes;
use furrow_dataset::model::labelling::Labelling;
use furrow_dataset::{MOST_IMAGES, Set};
use furrow_field::ablation::{Edit, FULL};
use std::cell::Cell;
use std::io::{self, BufWriter, IsTerminal};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Images to render, and options.
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Number of the first image.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..MOST_IMAGES))]
    first: u64,
    /// Number of images, including those of other shards. Default: unlimited, until the reader closes the pipe.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MOST_IMAGES))]
    count: Option<u64>,
    /// Render the images of the fields whose number modulo N equals k, for N parallel readers.
    #[arg(long, value_name = "k/N", default_value = "0/1", value_parser = Shard::parse)]
    shard: Shard,
    /// Classes as for `trace dataset`. If they include organs or objects on the ground, images have a parts.png.
    #[arg(long, value_name = "CLASSES", value_parser = Classes::parse)]
    classes: Option<Classes>,
    #[command(flatten)]
    content: ContentArgs,
    #[command(flatten)]
    look: RenderingArgs,
    /// Apply one edit to every field, by name; `trace ablate --list` lists them.
    #[arg(long, value_name = "NAME")]
    edit: Option<String>,
    #[command(flatten)]
    work: WorkArgs,
}

const AFTER: &str = "\
Examples:
  trace stream --scene field --width 324 --spp 16 | python3 train.py    images on demand for a program
  trace stream --scene field --count 100 --keep none > d.tar            100 images in one file
  trace stream --scene field --shard 1/4 | …                            the second of four readers
  trace stream --scene field --first 2 --count 1 --spp 16 | tar -t      the files of an image

Files are byte-identical to those of `trace dataset`, named for the Python package webdataset: 000002.rgb.png,
000002.record.json. Images are written in the order of their numbers. The reader sets the pace: at most two finished images for each one in
progress wait for it. When it closes the pipe, the program ends with exit code 0 at its next write.";

/// Interval between progress lines.
const EVERY: Duration = Duration::from_secs(30);

/// Writes the images to stdout, where nothing else may be written.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    if io::stdout().is_terminal() {
        return Err(Error::misuse("stdout is a terminal, which cannot show a tar archive")
            .help("let a program read it (`trace stream … | PROGRAM`), or write it to a file (`> images.tar`)"));
    }
    args.scene.check()?;
    let stream = ImageStream::begin(&args.order()?, args.first)?;
    for warning in &stream.warnings {
        furrow_cli::message!("warning: {warning}");
    }
    let begin = Instant::now();
    let (images, last) = (Cell::new(0_u64), Cell::new(begin));
    let warn = |words: &str| furrow_cli::message!("warning: {words}");
    let done = |index: u64| {
        images.set(images.get() + 1);
        if !args.work.quiet && last.get().elapsed() >= EVERY {
            last.set(Instant::now());
            furrow_cli::message!("image {} written; {}", Set::name(index), rate(images.get(), begin));
        }
    };
    let listener = Listener { warn: &warn, done: &done, stop: signals.catch() };
    // A large buffer, because archives are written in small pieces.
    let out = BufWriter::with_capacity(1 << 20, io::stdout());
    let written = stream.write(&args.work.of(args.shard, args.memory.bytes), out, &listener);
    if !args.work.quiet {
        furrow_cli::message!(
            "{} images in {:.1} s: {}",
            images.get(),
            begin.elapsed().as_secs_f64(),
            rate(images.get(), begin)
        );
    }
    written.map(|_| Vec::new())
}

/// Formats a rate in images per hour.
fn rate(images: u64, begin: Instant) -> String {
    format!("{:.0} images per hour", 3600.0 * images.to_f64() / begin.elapsed().as_secs_f64().max(1e-9))
}

impl Args {
    /// Describes the images as the order of a dataset.
    fn order(&self) -> Result<Order> {
        let count = self.count.unwrap_or(MOST_IMAGES - self.first);
        let mut order = Order {
            assigned: self.scene.set.values.clone(),
            seed: self.scene.seed,
            width: self.scene.width,
            height: self.scene.height,
            labelling: Labelling { classes: self.classes.clone(), ..Labelling::default() },
            options: self.look.options(),
            labels_only: self.look.labels_only,
            lights: self.look.lights,
            edit: self.edit.as_deref().map_or(Ok(&FULL), Edit::named)?,
            memory: self.memory.bytes,
            ..Order::new(self.scene.path(), count)
        };
        self.content.enter(&mut order)?;
        Ok(order)
    }
}
