//! Where and how networks are computed.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use tch::Device;

/// How numbers are held while a network is computed; weights are always kept in single precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Precision {
    /// 32 bits.
    #[serde(rename = "f32")]
    Single,
    /// 16 bits, 8 of them exponent: twice as fast where the device multiplies them.
    #[serde(rename = "bf16")]
    Bf16,
}

impl Precision {
    /// Reads `f32`, `bf16` or `auto`, which is bf16 where the device multiplies it.
    pub fn named(text: &str, device: Device) -> Result<Self, String> {
        match text {
            "bf16" => Ok(Self::Bf16),
            "auto" if device.is_cuda() || std::is_x86_feature_detected!("avx512bf16") => Ok(Self::Bf16),
            "f32" | "auto" => Ok(Self::Single),
            _ => Err(format!("there is no precision `{text}`: write auto, f32 or bf16")),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "f32",
            Self::Bf16 => "bf16",
        }
    }
}

/// A device and the precision on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Where {
    /// The device.
    pub device: Device,
    /// The precision.
    pub precision: Precision,
}

/// Set for the program that was started once more with CUDA in it.
const AGAIN: &str = "FURROW_CUDA_LOADED";
/// What registers CUDA's kernels when it is loaded.
const CUDA: &str = "libtorch_cuda.so";

/// Finds the device `cpu`, `cuda` or `cuda:1`.
///
/// The program links only libtorch's CPU half, so that nobody downloads CUDA who does not use it. For a GPU the other half,
/// from a torch of the same version on `LD_LIBRARY_PATH`, must be in the process before the first call of libtorch: the program
/// replaces itself by one that the loader gave it to.
pub fn find(name: &str) -> Result<Device> {
    let wrong = || Error::misuse(format!("there is no device `{name}`: write cpu, cuda or cuda:1"));
    let number = match name.split_once(':') {
        None if name == "cpu" => return Ok(Device::Cpu),
        None if name == "cuda" => 0,
        Some(("cuda", number)) => number.parse().map_err(|_| wrong())?,
        _ => return Err(wrong()),
    };
    let missing = |what: String| {
        Error::missing(format!("{name}: {what}")).help(format!(
            "LD_LIBRARY_PATH must name the folder of a {CUDA} of torch 2.11.0, such as \
             VENV/lib/python3.11/site-packages/torch/lib after `pip install torch==2.11.0`"
        ))
    };
    if std::env::var_os(AGAIN).is_none() {
        // The loader would complain about what it does not find, and go on.
        let folders = std::env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
        if !std::env::split_paths(&folders).any(|folder| folder.join(CUDA).is_file()) {
            return Err(missing(format!("there is no {CUDA} on LD_LIBRARY_PATH")));
        }
        return Err(start_again());
    }
    let devices = tch::Cuda::device_count();
    if (number as i64) < devices {
        return Ok(Device::Cuda(number));
    }
    Err(missing(format!("libtorch sees {devices} CUDA devices")))
}

/// Replaces the process by the same with CUDA's kernels in it; returns only where that fails.
fn start_again() -> Error {
    use std::os::unix::process::CommandExt;
    let mut preload = OsString::from(CUDA);
    if let Some(others) = std::env::var_os("LD_PRELOAD").filter(|o| !o.is_empty()) {
        preload.push(":");
        preload.push(others);
    }
    let program = match std::env::current_exe() {
        Ok(program) => program,
        Err(e) => return Error::io("train".as_ref())(e),
    };
    let e = std::process::Command::new(&program)
        .args(std::env::args_os().skip(1))
        .env("LD_PRELOAD", preload)
        .env(AGAIN, "1")
        .exec();
    Error::io(&program)(e)
}

/// Uses so many threads for computing: part of what decides the last bits on a CPU.
pub fn set_threads(threads: usize) {
    tch::set_num_threads(threads as i32);
}
