//! `train export`.

use clap::ValueEnum;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_train::average::average;
use furrow_train::crop::exported;
use furrow_train::deploy::{onnx, torchscript};
use furrow_train::fit::settings::parse_size;
use furrow_train::run::{self, TrainedModel};
use furrow_train::zoo;
use std::path::PathBuf;

/// Arguments of `train export`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of a run, or name of a network that ships (`train zoo`).
    run: PathBuf,
    /// File format.
    #[arg(long, value_name = "NAME", default_value = "onnx")]
    format: Format,
    /// Output file, or output folder for `half`; by default network.onnx, network.pt or half in the run's folder.
    #[arg(long, value_name = "PATH")]
    out: Option<PathBuf>,
    /// Image size of a TorchScript export; by default the network's training size. ONNX exports take images of any size.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Run whose weights are averaged with those of RUN; may be given several times. Runs must agree in network, classes, bands and
    /// sizes, and should start from the same weights (`train fit --init`): means of other networks are useless.
    #[arg(long, value_name = "RUN")]
    average: Vec<PathBuf>,
    /// Crop that the exported network is for, by any name of its species; may be given several times. The network must take the crop as
    /// an input. Without it, or with auto, the exported network labels every crop species as crop.
    #[arg(long = "crop", value_name = "NAME")]
    crops: Vec<String>,
}

/// Export format.
#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// ONNX, for ONNX Runtime and others.
    Onnx,
    /// TorchScript, for libtorch and PyTorch; bands, classes and size are written to a JSON file beside it.
    Torchscript,
    /// Run folder with weights in half precision: half the size, for archiving and distribution.
    Half,
}

/// Writes the network.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let trained = exported(average(TrainedModel::open(&args.run)?, &args.average)?, &args.crops)?;
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
        return Err(Error::misuse("--size applies to TorchScript exports only").help("leave --size out"));
    }
    match args.format {
        Format::Onnx => {
            cli::check_file(&out)?;
            onnx::write(&trained, &out)?;
            Ok(vec![out])
        }
        Format::Torchscript => {
            cli::check_file(&out)?;
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
