//! `trace watch`: a local web page that shows a scene file's field while the file is edited.
//!
//! | file | idea |
//! |---|---|
//! | `session` | requested and displayed state, shared by all threads |
//! | `worker` | thread that builds and renders; a newer request cancels an older one |
//! | `sheet` | thumbnails of the first twelve indices |
//! | `files` | files named by a scene file, and a thread that is notified when one of them is saved |
//! | `sliders` | numbers of the file as sliders, applied to its text for a preview or written into it |
//! | `picture` | images of the four views, and inspection of single pixels |
//! | `guard` | access control: token, `Host` and `Origin` |
//! | `server`, `answer` | requests and responses |
//! | `http` | parsing of requests, with limits on size and time |
//! | `tev` | display of the image in another program |
//! | `page.html`, `page.css`, `page.js` | the page |

mod answer;
mod contact_sheet;
mod files;
mod guard;
mod http;
mod live_image;
mod server;
mod session;
mod sliders;
mod tev;
mod worker;

use crate::field::{MemoryArgs, SetArgs, scene_file};
use crate::quality::{samples, threads};
use clap::ValueEnum;
use furrow_base::{Error, Result};
use furrow_cli::cli::{self, signal::Signals};
use furrow_job::Threads;
use guard::Guard;
use server::Server;
use session::{PageRequest, Session};
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use worker::Worker;

/// The scene file to watch, and options of its page.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Scene file (RON). It is rendered again whenever it, or a file that it names, is saved.
    #[arg(value_name = "FILE", value_parser = scene_file())]
    scene: PathBuf,
    #[command(flatten)]
    set: SetArgs,
    /// Index of the field shown first.
    #[arg(long, default_value_t = 0)]
    index: u64,
    /// Seed that overrides the scene file's.
    #[arg(long)]
    seed: Option<u64>,
    /// Image width in pixels, at most that of the camera. The field of view is unchanged.
    #[arg(long, default_value_t = 400, value_parser = clap::value_parser!(u32).range(16..=4096))]
    width: u32,
    /// Samples per pixel at which the image is complete.
    #[arg(long, default_value_t = 64, value_parser = samples())]
    spp: u32,
    /// Photograph, PNG or JPEG, shown next to the image at the same pixel scale.
    #[arg(long, value_name = "FILE")]
    photo: Option<PathBuf>,
    /// Also send each image to a running program.
    #[arg(long, value_enum, value_name = "PROGRAM")]
    display: Option<Display>,
    /// Port of the page. Default: a free one.
    #[arg(long, default_value_t = 0)]
    port: u16,
    /// Address to listen on. The default is reachable only from this machine. With any other, everyone who can reach it
    /// and knows the page's address can see the images, unencrypted, and write values into the scene file. `ssh -L` is
    /// safer.
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    host: IpAddr,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Number of threads; 0 for one per core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
}

/// A program that displays images.
#[derive(Clone, Copy, ValueEnum)]
enum Display {
    /// tev, linear radiance in R, G, B and NIR, at 127.0.0.1:14158.
    Tev,
}

/// How long to wait for a rendering at the end.
const PATIENCE: Duration = Duration::from_millis(500);

/// Serves the page until a signal arrives.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    cli::check_scene(&args.scene)?;
    let photo = args.photo.as_deref().map(answer::Photo::read).transpose()?;
    let threads = Threads::new(args.threads)?;
    let stop = signals.catch();
    let wish = PageRequest { index: args.index, seed: args.seed, width: args.width, ..PageRequest::default() };
    let session = Arc::new(Session::new(args.scene.clone(), args.set.values.clone(), wish, args.spp));
    session.show(|shown| shown.photo = photo.is_some());
    let guard = Guard::new(args.host)?;
    let server = Server::open(args.host, args.port, guard, session.clone(), photo)?;
    server.print_address();
    let files = files::watch(session.clone())?;
    let tev = args.display.map(|Display::Tev| tev::Tev::default());
    let worker = Worker::new(session.clone(), files, (&threads, args.memory.bytes), tev)?;
    let thread =
        std::thread::Builder::new().name("render".into()).spawn(move || worker.run()).map_err(Error::no_thread)?;
    server.serve(stop)?;
    session.end();
    // It may be building a field. There is no need to wait for that, because nothing is written.
    let begin = Instant::now();
    while !thread.is_finished() && begin.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(20));
    }
    Err(Error::stopped("stopped watching"))
}
