//! `train export`.

use clap::ValueEnum;
use furrow::train::deploy::{onnx, torchscript};
use furrow::train::fit::settings::parse_size;
use furrow::train::run::{self, TrainedModel};
use furrow::train::zoo;
use furrow::{Error, Result, cli};
use std::path::PathBuf;

/// Which network, as what.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the run, or the name of a network that ships (`train zoo`).
    run: PathBuf,
    /// What is written.
    #[arg(long, value_name = "NAME", default_value = "onnx")]
    format: Format,
    /// The file, or the folder of `half`; network.onnx, network.pt or half in the run's folder unless given.
    #[arg(long, value_name = "PATH")]
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
    /// A folder like the run's with weights in half precision: half as large, for keeping and passing on.
    Half,
}

/// Writes the network.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let trained = TrainedModel::open(&args.run)?;
    let usual = match args.format {
        Format::Onnx => "network.onnx",
        Format::Torchscript => "network.pt",
        Format::Half => "half",
    };
    if args.out.is_none() {
        zoo::needs_out(&args.run, usual)?;
    }
    let out = args.out.clone().unwrap_or_else(|| args.run.join(usual));
    if out.is_dir() && !matches!(args.format, Format::Half) {
        return Err(Error::misuse("this is a folder")
            .in_file(&out)
            .help(format!("give --out a file, such as {}", out.join(usual).display())));
    }
    if args.size.is_some() && !matches!(args.format, Format::Torchscript) {
        return Err(Error::misuse("only a TorchScript is for pictures of one size").help("leave --size out"));
    }
    match args.format {
        Format::Onnx => {
            onnx::write(&trained, &out)?;
            Ok(vec![out])
        }
        Format::Torchscript => {
            let input = &trained.card.input;
            torchscript::write(&trained, args.size.unwrap_or((input.width, input.height)), &out)?;
            let facts = torchscript::facts_path(&out);
            Ok(vec![out, facts])
        }
        Format::Half => {
            cli::check_folder(&out)?;
            run::check_untaken(&out)?;
            trained.write_half(&out)?;
            Ok(vec![out])
        }
    }
}
