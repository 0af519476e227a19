//! Denoising with Intel's Open Image Denoise: with its library in this process, or with its program `oidnDenoise` if
//! the library is missing or cannot be loaded.
//!
//! Albedo and normals are denoised first, each separately, and then guide the denoising of radiance as noise-free
//! features. R, G and B are denoised together, NIR as a grey image with its own albedo. On one machine, equal films
//! give equal bits for any number of threads, also between library and program of the same version. Another instruction
//! set may round differently. Source: Open Image Denoise 2.5.1, documentation, "Prefiltering".
//!
//! | file | contents |
//! |---|---|
//! | `picture.rs` | input of one denoising step |
//! | `library.rs` | the library and its devices, kept during the run |
//! | `oidn/` | the library's C interface |
//! | `program.rs` | the program, which is started for each image and exchanges files |

mod library;
mod noisy_image;
mod oidn;
mod program;

use furrow_base::math::Spectrum;
use furrow_base::{Error, Result};
use furrow_render::film::{Film, Pixel};
use library::Library;
use noisy_image::{Kind, NoisyImage, Rgb};
use program::Program;
use std::path::PathBuf;

/// Available denoiser. Clones share what is loaded.
#[derive(Clone, Debug)]
pub struct Denoiser(Way);

#[derive(Clone, Debug)]
enum Way {
    Library(Library),
    Program(Program),
}

impl Denoiser {
    /// Finds a denoiser. With the variable `OIDN_DIR`, it searches for the library in that folder's `lib` and then for
    /// the program in its `bin`. Otherwise it uses the system loader and the `PATH`. Returns an [`Error::missing`] with
    /// both reasons if neither is found.
    pub fn find() -> Result<Self> {
        // An empty folder in OIDN_DIR is a mistake, so no other denoiser is tried.
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
                "--denoise needs Open Image Denoise: {reason}; and there is no program {program} {place}"
            ))
            .help(
                "python3 -m venv oidn && oidn/bin/pip install --no-deps pyoidn==2.5.1.0\n       \
                 export OIDN_DIR=$(echo $PWD/oidn/lib/python3*/site-packages/pyoidn/oidn)",
            )
        })
    }

    /// Returns the denoised film, computed on `threads` threads (0: all). The variance is dropped because it is unknown
    /// after denoising.
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

/// One film being denoised.
struct Job<'a> {
    way: &'a Way,
    film: &'a Film,
    threads: usize,
}

impl Job<'_> {
    /// Denoises one feature, which `of` extracts from each pixel.
    fn clean(&self, kind: Kind<'_>, of: impl Fn(&Pixel) -> Rgb) -> Result<Vec<Rgb>> {
        let noisy: Vec<Rgb> = self.film.pixels.iter().map(of).collect();
        let size = [self.film.window.width(), self.film.window.height()];
        let picture = NoisyImage { size, noisy: &noisy, kind };
        match self.way {
            Way::Library(library) => library.denoise(&picture, self.threads),
            Way::Program(program) => program.denoise(&picture, self.threads),
        }
    }
}
