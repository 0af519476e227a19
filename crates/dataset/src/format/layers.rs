//! Multi-layer OpenEXR with Cryptomatte: `layers/SPLIT/NAME.exr`, all per-pixel results of the renderer in one file.
//!
//! | channels | contents |
//! |---|---|
//! | `R G B NIR`, `variance.*` | linear radiance, W·m⁻²·sr⁻¹·nm⁻¹, and the variance of that mean; never denoised |
//! | `albedo.*`, `normal.X/Y/Z`, `depth.Z` | means over the samples; depth in metres along the ray |
//! | `id.class`, `id.plant`, `id.leaf`, `id.part` | 32-bit integers at the pixel's centre |
//! | `coverage.soil`, `.crop`, `.weed` | fractions of the pixel's samples; they sum to 1 |
//! | `CryptoClass*`, `CryptoPlant*`, `CryptoLeaf*` | Cryptomattes: objects with soft edges, at least six per pixel |
//!
//! Objects are named `soil`, `crop`, `weed`; `ground`, `plant_7`; `ground`, `plant_7/stem`, `plant_7/leaf_3`, with the
//! numbers of `plants.png` and `leaves.png`.
//!
//! Source: OpenEXR file layout; Cryptomatte specification 1.2.0. Read with OpenEXR 3.5.3 and cryptomatte-api 1.0.0.

use super::Format;
use crate::model::recipe::{ImageOrigin, Recipe};
use crate::model::sample::Sample;
use crate::File;
use furrow_base::{Error, Result};

pub(super) struct Writer;

const FOLDER: &str = "layers";

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let record = &sample.record;
        let rendered = sample.rendered(FOLDER)?;
        let film = rendered.film.as_ref().ok_or_else(|| Error::misuse("layers contain radiance, and this dataset has labels only"))?;
        let text = provenance(recipe, record.index);
        let bytes = furrow_output::encode_layers(film, &rendered.labels, &rendered.tags, &text)?;
        Ok(vec![File { path: format!("{FOLDER}/{}/{}.exr", record.split.name(), record.name), bytes }])
    }

    fn needs_film(&self) -> bool {
        true
    }
}

/// Returns the origin of the image for the file header.
fn provenance(recipe: &Recipe, index: u64) -> String {
    let program = format!("program: furrow {}", recipe.furrow);
    match &recipe.made {
        ImageOrigin::Rendered(made) => format!(
            "{program}\nscene: sha256 {}\nseed: {}\nindex: {index}\nspp: {}\nkernels: {}",
            made.scene_sha256, made.seed, made.spp, made.kernels
        ),
        ImageOrigin::Imported { .. } => program,
    }
}
