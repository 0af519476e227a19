//! `trace watch`: a page on this machine that shows a scene file's field while the file is written.
//!
//! | file | idea |
//! |---|---|
//! | `session` | what is asked for and what is shown, shared by all threads |
//! | `worker` | the thread that grows and renders; a newer wish cancels an older one |
//! | `sheet` | small pictures of the first twelve indices |
//! | `files` | which files a scene file names, and a thread that is told when one of them is saved |
//! | `sliders` | the numbers of the file as sliders, put in its text for a look or written into it |
//! | `picture` | pixels of the four views, and what one pixel shows |
//! | `guard` | who may ask: token, `Host` and `Origin` |
//! | `server`, `answer` | requests and what is answered |
//! | `tev` | the picture in another program |
//! | `page.html`, `page.css`, `page.js` | the page |

mod answer;
mod files;
mod guard;
mod picture;
mod server;
mod session;
mod sheet;
mod sliders;
mod tev;
mod worker;

use crate::field::{MemoryArgs, scene_file};
use crate::quality::{samples, threads};
use clap::ValueEnum;
use furrow::cli::{self, signal::Signals};
use furrow::job::Threads;
use furrow::{Error, Result};
use guard::Guard;
use server::Server;
use session::{Session, Wish};
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use worker::Worker;

/// A scene file to watch, and where its page is.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Scene file (RON); it is rendered again whenever it, or a file that it names, is saved.
    #[arg(value_name = "FILE", value_parser = scene_file())]
    scene: PathBuf,
    /// Which field of the distribution is shown first.
    #[arg(long, default_value_t = 0)]
    index: u64,
    /// Seed, instead of the scene file's.
    #[arg(long)]
    seed: Option<u64>,
    /// Width of the picture in pixels, at most the camera's own; the field of view stays.
    #[arg(long, default_value_t = 400, value_parser = clap::value_parser!(u32).range(16..=4096))]
    width: u32,
    /// Samples a pixel after which the picture is left as it is.
    #[arg(long, default_value_t = 64, value_parser = samples())]
    spp: u32,
    /// A photograph, PNG or JPEG, shown beside the picture at the same pixel scale.
    #[arg(long, value_name = "FILE")]
    photo: Option<PathBuf>,
    /// Also send each picture to a program that runs already.
    #[arg(long, value_enum, value_name = "PROGRAM")]
    display: Option<Display>,
    /// Port of the page; a free one unless given.
    #[arg(long, default_value_t = 0)]
    port: u16,
    /// Address to listen on. The default is reached from this machine alone; any other lets whoever reaches it and knows the
    /// page's address see the pictures, unencrypted, and write values into the scene file. `ssh -L` is the safer way.
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    host: IpAddr,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Threads; 0 for one on each core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
}

/// A program that shows pictures.
#[derive(Clone, Copy, ValueEnum)]
enum Display {
    /// tev, linear radiance in R, G, B and NIR, at 127.0.0.1:14158.
    Tev,
}

/// How long a render is waited for in the end.
const PATIENCE: Duration = Duration::from_secs(1);

/// Serves the page until a signal comes.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    cli::check_scene(&args.scene)?;
    let photo = args.photo.as_deref().map(answer::Photo::read).transpose()?;
    let threads = Threads::new(args.threads)?;
    let stop = signals.heed();
    let wish = Wish { index: args.index, seed: args.seed, width: args.width, ..Wish::default() };
    let session = Arc::new(Session::new(args.scene.clone(), wish, args.spp));
    session.show(|shown| shown.photo = photo.is_some());
    let guard = Guard::new(args.host)?;
    let mut server = Server::open(args.host, args.port, guard, session.clone(), photo)?;
    server.tell();
    let files = files::watch(session.clone())?;
    let tev = args.display.map(|Display::Tev| tev::Tev::default());
    let worker = Worker::new(session.clone(), files, (&threads, args.memory.bytes), tev)?;
    let thread = std::thread::Builder::new()
        .name("render".into())
        .spawn(move || worker.run())
        .map_err(|e| Error::failed(format!("cannot start a thread: {e}")))?;
    server.serve(stop);
    session.end();
    // It may be growing a field, which comes to its end by itself, and need not be waited for: nothing is written.
    let begin = Instant::now();
    while !thread.is_finished() && begin.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(20));
    }
    Err(Error::stopped("stopped watching"))
}
