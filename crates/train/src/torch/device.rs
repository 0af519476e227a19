//! Device and precision of networks.

use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use tch::Device;

/// Number format of the forward and backward pass. Weights are always stored in single precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Precision {
    /// 32 bits.
    #[serde(rename = "f32")]
    Single,
    /// 16 bits with an 8-bit exponent: twice as fast on devices that support it.
    #[serde(rename = "bf16")]
    Bf16,
}

impl Precision {
    /// Parses `f32`, `bf16` or `auto`, which is bf16 if the device supports it.
    pub fn named(text: &str, device: Device) -> Result<Self, String> {
        match text {
            "bf16" => Ok(Self::Bf16),
            "auto" if device.is_cuda() || std::is_x86_feature_detected!("avx512bf16") => Ok(Self::Bf16),
            "f32" | "auto" => Ok(Self::Single),
            _ => Err(format!("there is no precision `{text}`: write auto, f32 or bf16")),
        }
    }

    /// Returns the name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "f32",
            Self::Bf16 => "bf16",
        }
    }
}

/// Device and precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Device.
    pub device: Device,
    /// Precision.
    pub precision: Precision,
}

/// Environment variable that is set in the process that was restarted with CUDA.
const AGAIN: &str = "FURROW_CUDA_LOADED";
/// Library that registers the CUDA kernels when it is loaded.
const CUDA: &str = "libtorch_cuda.so";

/// Finds the device `cpu`, `cuda` or `cuda:1`.
///
/// The program links only the CPU part of libtorch, so that users without a GPU need not download CUDA. For a GPU, the CUDA part (of the
/// same version of torch, on `LD_LIBRARY_PATH`) must be loaded before the first call of libtorch. So the program restarts itself with
/// that library preloaded.
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
        // Checked here because the dynamic loader only warns about a missing library and continues.
        let folders = std::env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
        if !std::env::split_paths(&folders).any(|folder| folder.join(CUDA).is_file()) {
            return Err(missing(format!("there is no {CUDA} on LD_LIBRARY_PATH")));
        }
        return Err(start_again());
    }
    let devices = tch::Cuda::device_count();
    if number.to_i64() < devices {
        return Ok(Device::Cuda(number));
    }
    Err(missing(format!("libtorch sees {devices} CUDA devices")))
}

/// Restarts the process with the CUDA library preloaded. Returns only if that fails.
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

/// Sets the number of compute threads. On a CPU it affects the last bits of results.
pub fn set_threads(threads: usize) {
    tch::set_num_threads(threads.to_i32());
}
