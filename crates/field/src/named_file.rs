//! Files that a scene file or a species file names: hashes of their contents, and errors at the place that names them.

use furrow_base::error::{Kind, Place};
use furrow_base::input;
use furrow_base::ron_file::RonFile;
use furrow_base::{Error, Result};
use sha2::{Digest, Sha256};
use std::path::Path;

/// Help text of errors about images that cannot be used.
pub(super) const IMAGE_HELP: &str = "name a PNG or JPEG image, or draw it: trace texture RECIPE.ron";

/// Returns the SHA-256 of a file's contents.
pub(super) fn digest(path: &Path) -> Result<[u8; 32]> {
    let bytes = input::read(path, input::LARGEST).map_err(|refusal| refusal.into_error(path))?;
    Ok(Sha256::digest(&bytes).into())
}

/// Moves an input error about an image or a model to the place in the scene file that names the file. Adds `help` if the error has
/// no help text of its own.
pub(super) fn at_its_place(page: &RonFile, literal: &str, help: &str, error: Error) -> Error {
    match error.place() {
        Some(Place { file, span: None }) if error.kind() == Kind::Input => {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            let message = format!("`{name}` cannot be used: {}", error.message());
            page.about(literal, message, error.advice().unwrap_or(help))
        }
        _ => error,
    }
}
