//! `train zoo`.

use furrow_base::Result;
use furrow_cli::cli;
use furrow_train::data::Band;
use furrow_train::zoo;
use std::path::PathBuf;

/// Prints the networks that ship: name, architecture, bands, classes, pixel size and description. Damaged ones are reported as errors after
/// the others.
pub(crate) fn run() -> Result<Vec<PathBuf>> {
    let row = |network: &zoo::Shipped| {
        let card = &network.model.card;
        let bands: Vec<&str> = card.input.bands.iter().map(Band::name).collect();
        let pixel = card.pixel_mm.map_or_else(|| "pixels of any size".to_owned(), |mm| format!("pixels of {mm:.1} mm"));
        [
            network.name.clone(),
            card.network.name().to_owned(),
            bands.join(","),
            card.classes.names().join(","),
            pixel,
            network.about.clone(),
        ]
    };
    let (whole, damaged): (Vec<_>, Vec<_>) = zoo::all()?.into_iter().partition(Result::is_ok);
    let rows: Vec<[String; 6]> = whole.iter().flatten().map(row).collect();
    cli::print_rows(&rows)?;
    let mut damaged: Vec<_> = damaged.into_iter().filter_map(Result::err).collect();
    let Some(last) = damaged.pop() else { return Ok(Vec::new()) };
    for error in &damaged {
        furrow_cli::message!("error: {error}");
    }
    Err(last)
}
