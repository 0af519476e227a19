//! `train export`.

use clap::ValueEnum;
use furrow::train::deploy::{onnx, torchscript};
use furrow::train::fit::settings::parse_size;
use furrow::train::run::TrainedModel;
use furrow::{Error, Result};
use std::path::PathBuf;

/// Which network, as what.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the run.
    run: PathBuf,
    /// What is written.
    #[arg(long, value_name = "NAME", default_value = "onnx")]
    format: Format,
    /// The file; network.onnx or network.pt in the run's folder unless given.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Size of the pictures that a TorchScript is for; the network's own unless given. ONNX takes any.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
}

/// A way to write a network down.
#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// ONNX, for ONNX Runtime and others.
    Onnx,
    /// TorchScript, for libtorch and PyTorch; a JSON file beside it tells bands, classes and size.
    Torchscript,
}

/// Writes the network.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let trained = TrainedModel::open(&args.run)?;
    let usual = match args.format {
        Format::Onnx => "network.onnx",
        Format::Torchscript => "network.pt",
    };
    let out = args.out.clone().unwrap_or_else(|| args.run.join(usual));
    if out.is_dir() {
        return Err(Error::misuse("this is a folder")
            .in_file(&out)
            .help(format!("give --out a file, such as {}", out.join(usual).display())));
    }
    match (args.format, args.size) {
        (Format::Onnx, Some(_)) => {
            Err(Error::misuse("an ONNX graph takes pictures of any size").help("leave --size out"))
        }
        (Format::Onnx, None) => {
            onnx::write(&trained, &out)?;
            Ok(vec![out])
        }
        (Format::Torchscript, size) => {
            let input = &trained.card.input;
            torchscript::write(&trained, size.unwrap_or((input.width, input.height)), &out)?;
            let facts = torchscript::facts_path(&out);
            Ok(vec![out, facts])
        }
    }
}
