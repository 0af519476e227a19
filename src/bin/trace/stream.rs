//! `trace stream`: images with their labels to stdout, for a program that reads them as they are made.

use crate::dataset::order::{ContentArgs, LookArgs};
use crate::dataset::render::WorkArgs;
use crate::field::{MemoryArgs, SceneArgs};
use furrow::ablation::{Edit, FULL};
use furrow::cli::signal::Signals;
use furrow::dataset::classes::Classes;
use furrow::dataset::generate::Shard;
use furrow::dataset::labelling::Labelling;
use furrow::dataset::plan::Order;
use furrow::dataset::stream::{ImageStream, Listener};
use furrow::dataset::{MOST_IMAGES, Set};
use furrow::{Error, Result};
use std::cell::Cell;
use std::io::{self, BufWriter, IsTerminal};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Which images, and how they are made.
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
    /// How many images, those of other shards counted. Unless given, it goes on until nobody reads them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MOST_IMAGES))]
    count: Option<u64>,
    /// Make the images of the fields whose number leaves k when divided by N, one shard for each reader.
    #[arg(long, value_name = "k/N", default_value = "0/1", value_parser = Shard::parse)]
    shard: Shard,
    /// Classes as for `trace dataset`: with those of organs or of things on the ground, images have a parts.png.
    #[arg(long, value_name = "CLASSES", value_parser = Classes::parse)]
    classes: Option<Classes>,
    #[command(flatten)]
    content: ContentArgs,
    #[command(flatten)]
    look: LookArgs,
    /// Change one thing of every field, by its name; `trace ablate --list` tells them.
    #[arg(long, value_name = "NAME")]
    edit: Option<String>,
    #[command(flatten)]
    work: WorkArgs,
}

const AFTER: &str = "\
Examples:
  trace stream --scene field --width 324 --spp 16 | python3 train.py    fields as the program asks for them
  trace stream --scene field --count 100 --keep none > d.tar            a hundred images in one file
  trace stream --scene field --shard 1/4 | …                            the second of four readers
  trace stream --scene field --first 2 --count 1 --spp 16 | tar -t      what an image consists of

Files are those that `trace dataset` writes, byte for byte, named as the Python package webdataset groups them: 000002.rgb.png,
000002.record.json. Images come in the order of their numbers. The reader decides how fast: no more than two images for each one under
way wait for it. When it closes the pipe, the program ends with exit code 0 as soon as it has something to write.";

/// Between two lines that tell how far it is.
const EVERY: Duration = Duration::from_secs(30);

/// Writes the images to stdout; nothing else may stand there.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    if io::stdout().is_terminal() {
        return Err(Error::misuse("stdout is a terminal, which cannot show a tar archive")
            .help("let a program read it (`trace stream … | PROGRAM`), or write it to a file (`> images.tar`)"));
    }
    args.scene.check()?;
    let stream = ImageStream::begin(&args.order()?, args.first)?;
    for warning in &stream.warnings {
        furrow::tell!("warning: {warning}");
    }
    let begin = Instant::now();
    let (images, last) = (Cell::new(0_u64), Cell::new(begin));
    let warn = |words: &str| furrow::tell!("warning: {words}");
    let done = |index: u64| {
        images.set(images.get() + 1);
        if !args.work.quiet && last.get().elapsed() >= EVERY {
            last.set(Instant::now());
            furrow::tell!("image {} is written; {}", Set::name(index), rate(images.get(), begin));
        }
    };
    let listener = Listener { warn: &warn, done: &done, stop: signals.heed() };
    // Large, for archives are written in small parts.
    let out = BufWriter::with_capacity(1 << 20, io::stdout());
    let written = stream.write(&args.work.of(args.shard, args.memory.bytes), out, &listener);
    if !args.work.quiet {
        furrow::tell!(
            "{} images in {:.1} s: {}",
            images.get(),
            begin.elapsed().as_secs_f64(),
            rate(images.get(), begin)
        );
    }
    written.map(|_| Vec::new())
}

/// Images an hour, in words.
fn rate(images: u64, begin: Instant) -> String {
    format!("{:.0} images an hour", 3600.0 * images as f64 / begin.elapsed().as_secs_f64().max(1e-9))
}

impl Args {
    /// The images as a dataset's.
    fn order(&self) -> Result<Order> {
        let count = self.count.unwrap_or(MOST_IMAGES - self.first);
        let mut order = Order {
            seed: self.scene.seed,
            width: self.scene.width,
            height: self.scene.height,
            labelling: Labelling { classes: self.classes.clone(), ..Labelling::default() },
            options: self.look.options(),
            labels_only: self.look.labels_only,
            edit: self.edit.as_deref().map_or(Ok(&FULL), Edit::named)?,
            memory: self.memory.bytes,
            ..Order::new(self.scene.path(), count)
        };
        self.content.enter(&mut order)?;
        Ok(order)
    }
}
