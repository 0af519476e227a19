//! `trace catalogue`: renders every species at every growth stage, from above and from the side, with scale bars, for
//! inspection.
//!
//! Each species is one sheet with one column per stage: above, the camera looks straight down; below, from about 30°
//! above the ground. All images of a column show the same plant. The sheet's PNG comment records what it was rendered
//! from; a sheet that would come out the same is kept.

mod contact_sheet;
mod page;
mod view;

use crate::quality::threads;
use contact_sheet::{Bar, Column, ContactSheet, Layout, Thumbnail};
use furrow_base::geometry::Window;
use furrow_base::input::shipped;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec3};
use furrow_base::sampling::Points;
use furrow_base::{Error, Result};
use furrow_cli::cli::{self, signal::Signals};
use furrow_field::species_text::SpeciesFile;
use furrow_field::{Field, assemble};
use furrow_output::ImageData;
use furrow_render::accel::EmbreeAccel;
use furrow_render::integrator::{PathTracer, World};
use furrow_render::render::{self, RenderMonitor, Settings};
use page::{Entry, PlantView, Stage};
use std::path::{Path, PathBuf};
use view::{VIEW_DEG, View};

/// Camera distance, metres, above which the field is detailed only to pixel size, because a tall plant covers a large
/// area.
const FAR: f32 = 3.0;

/// Folder of species files within the working directory, if present.
const SPECIES: &str = "scenes/species";

/// Catalogue options.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder for the sheets and for catalogue.html.
    #[arg(long, value_name = "DIR", default_value = "out/catalogue")]
    out: PathBuf,
    /// Only these species, by any name that scene files accept: "sugar beet,cleavers", BEAVX, Klettenlabkraut.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    species: Vec<String>,
    /// Folder of the species files. Default: scenes/species, or the shipped species if there is no such folder.
    #[arg(long, value_name = "DIR")]
    species_dir: Option<PathBuf>,
    /// Samples per pixel.
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=4096))]
    spp: u32,
    /// Width and height of each image in pixels.
    #[arg(long, default_value_t = 320, value_parser = clap::value_parser!(u32).range(64..=2048))]
    size: u32,
    /// Seed of the plants.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of threads; 0 for one per core. The files do not depend on it.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// Print nothing but errors and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

/// Returns the file of a species in a folder, by the name of the file or by any name that finds a shipped species.
fn page_of(folder: &Path, name: &str) -> Result<PathBuf> {
    let own = folder.join(name).with_extension("ron");
    if own.exists() {
        return Ok(own);
    }
    let found = furrow_field::shipped::species(name);
    let named = found.as_ref().ok().and_then(|file| file.as_ref()?.file_name().map(|file| folder.join(file)));
    if let Some(file) = named.filter(|file| file.exists()) {
        return Ok(file);
    }
    // The error about the file names the nearest file, that about the name the nearest name.
    cli::check_species(&own).map_err(|error| {
        if error.advice().is_some_and(|help| help.contains("mean")) { error } else { found.err().unwrap_or(error) }
    })?;
    Ok(own)
}

/// Renders the sheets that are missing or would differ, then writes the page. Returns their paths.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    cli::check_folder(&args.out)?;
    let pages = args.pages()?;
    let pool = render::pool(args.threads)?;
    let (mut entries, mut paths) = (Vec::new(), Vec::new());
    for page in &pages {
        let (path, entry) = pool.install(|| args.species(page, signals))?;
        paths.push(path);
        entries.push(entry);
    }
    let html = args.out.join("catalogue.html");
    furrow_output::write_atomically(&html, page::html(&entries).as_bytes())?;
    paths.push(html);
    Ok(paths)
}

impl Args {
    /// Selected species files, sorted by name.
    fn pages(&self) -> Result<Vec<PathBuf>> {
        let folder = self.folder()?;
        if !self.species.is_empty() {
            return self.species.iter().map(|name| page_of(&folder, name.trim())).collect();
        }
        let entries = std::fs::read_dir(&folder).map_err(Error::reading(&folder))?;
        let mut pages: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
        pages.retain(|p| p.extension().is_some_and(|e| e == "ron"));
        pages.sort();
        if pages.is_empty() {
            let error =
                Error::input("there is no species file in this folder").help("the shipped ones are in scenes/species");
            return Err(error.in_file(&folder));
        }
        Ok(pages)
    }

    /// Folder of the species files.
    fn folder(&self) -> Result<PathBuf> {
        match &self.species_dir {
            Some(given) => Ok(given.clone()),
            None if Path::new(SPECIES).is_dir() => Ok(SPECIES.into()),
            None => Ok(shipped::folder()?.join(SPECIES)),
        }
    }

    /// Renders one species. Returns the path of its sheet, and its entry on the page.
    fn species(&self, page: &Path, signals: &Signals) -> Result<(PathBuf, Entry)> {
        let file = SpeciesFile::read(page)?;
        let desc = file.parse()?;
        let mut stages = Vec::new();
        for stage in &desc.plant.stages {
            let bare = self.field(page, stage.bbch, None)?;
            let plant = bare.plants.first().cloned();
            let plant = plant.ok_or_else(|| Error::input("no plant grows").in_file(page))?;
            stages.push((plant, View::both(&points(&bare)), bare.provenance()));
        }
        let path = self.out.join(page.file_stem().unwrap_or_default()).with_extension("png");
        let (spp, size) = (self.spp, self.size);
        let layout = Layout { rows: view::KINDS, size: size.to_usize() };
        let from: Vec<&str> = stages.iter().map(|(.., of)| of.as_str()).collect();
        let from = format!("{}\nspp: {spp}\nsize: {size}\ntext: stages and bars\nview: the plant", from.join("\n"));
        let kept = std::fs::read(&path).is_ok_and(|old| contains(&old, from.as_bytes()));
        if !kept {
            let mut columns = Vec::new();
            for (plant, views, _) in &stages {
                let thumbnail = |view| Ok((self.shoot(page, plant.bbch, view, signals)?, bar(view, size.to_usize())));
                let thumbnails = views.iter().map(thumbnail).collect::<Result<Vec<(Thumbnail, Bar)>>>()?;
                columns.push(Column { words: format!("BBCH {}", plant.bbch), thumbnails });
            }
            let sheet = layout.compose(&columns);
            let (width, height) = (sheet.width.to_u32(), sheet.height.to_u32());
            furrow_output::write_png(&path, width, height, &ImageData::Rgb(&sheet.pixels), &from)?;
        }
        if !self.quiet {
            furrow_cli::message!("{}: {} stages{}", page.display(), stages.len(), if kept { ", kept" } else { "" });
        }
        let (width, height, pixels) = furrow_output::read_rgb(&path)?;
        let sheet = ContactSheet { width: width.to_usize(), height: height.to_usize(), pixels };
        let stages = stages.into_iter().enumerate().map(|(i, (plant, views, _))| {
            let look = |(k, view): (usize, &View)| {
                let thumbnail = layout.part(&sheet, (i, k));
                Ok(PlantView {
                    jpeg: furrow_output::encode_jpeg(size, size, &thumbnail, 88)?,
                    width_mm: view.width_mm(),
                })
            };
            let plant_views = views.iter().enumerate().map(look).collect::<Result<Vec<PlantView>>>()?;
            Ok(Stage { plant, plant_views })
        });
        let stages = stages.collect::<Result<Vec<Stage>>>()?;
        Ok((path, Entry { desc, stages }))
    }

    /// Builds a field with one plant: on bare ground if it is rendered, otherwise without ground.
    fn field(&self, page: &Path, bbch: u32, view: Option<&View>) -> Result<Field> {
        let text = |path: &Path| format!("{:?}", path.to_string_lossy());
        let none = || (VIEW_DEG, "Nadir(height_m: 1)".to_owned(), String::new());
        let (angle, pose, soil) = view.map_or_else(none, |view| {
            // A shipped texture, because the species file may be anywhere.
            let layer = r#"(albedo: "dirt.png", height: "dirt.height.png", size_m: 0.5, height_mm: (-0.6, 0.6))"#;
            let bare = "relief: (rms_mm: 0.4, tilt_deg: 0), moisture: (mean: 0.25), clods: (over_5mm_per_m2: 0), \
                        litter: (straw_cover: 0, sticks_per_m2: 0, bits_per_m2: 0)";
            // The camera is nearly as far away horizontally, and the ground behind the plant is visible too.
            let far = if view.distance > FAR {
                format!("reach_m: {}, detail: ByPixel,", (3.0 * view.distance).min(100.0))
            } else {
                "detail: Full,".to_owned()
            };
            (view.angle_deg, view.pose(), format!("{far} soil: (layers: [{layer}], {bare}),"))
        });
        let size = self.size;
        let scene = format!(
            "Field(
                camera: Pinhole(size: ({size}, {size}), intrinsics: FieldOfView(horizontal_deg: {angle}), pose: {pose}),
                lights: [Daylight(sun: Angles(elevation_deg: 52, azimuth_deg: 215), turbidity: 3, cloud: 0.35)],
                {soil}
                plants: [(species: {}, growth: Bbch({bbch}))],
            )",
            text(page)
        );
        assemble::field_of(&scene, &assemble::Options { seed: Some(self.seed), ..Default::default() })
    }

    /// Renders one image.
    fn shoot(&self, page: &Path, bbch: u32, view: &View, signals: &Signals) -> Result<Thumbnail> {
        let field = self.field(page, bbch, Some(view))?;
        let geometry = EmbreeAccel::build(&field.scene.surfaces(), self.threads.max(1).to_u32())?;
        let world = World::new(&field.scene, &geometry);
        let window = Window::full(self.size, self.size);
        let settings = Settings { spp: self.spp, seed: field.sample_seed(), window, points: Points::Sobol };
        let watch = RenderMonitor { done: &|_| {}, stop: signals.catch() };
        let film = render::render(&world, &PathTracer::default(), &settings, &watch)?;
        Ok(field.photograph(&film).rgb.as_chunks::<3>().0.to_vec())
    }
}

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|w| w == part)
}

/// Vertex positions of all plants of a field.
fn points(field: &Field) -> Vec<Vec3> {
    let plants = field.scene.parts.iter().filter(|part| part.tag.plant > 0);
    plants.flat_map(|part| &part.mesh.positions).copied().collect()
}

/// Scale bar of a round length for an image of `size` pixels.
fn bar(view: &View, size: usize) -> Bar {
    let mm = page::round_length(page::LONGEST * view.width_mm());
    Bar { pixels: (size.to_f32() * mm / view.width_mm()).round_to::<usize>(), words: format!("{mm} mm") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: tall plants were cut off from above, where the camera was among their leaves. Expected: no border
    /// pixel shows the plant, and the plant extends nearly to the border, even if its only blade points away.
    #[test]
    fn whole_plants_are_in_the_picture() {
        let args = Args {
            out: PathBuf::new(),
            species: Vec::new(),
            species_dir: None,
            spp: 1,
            size: 64,
            seed: 3,
            threads: 1,
            quiet: true,
        };
        for (name, bbch) in
            [("maize", 63), ("sunflower", 65), ("wheat", 65), ("sugar_beet", 65), ("galium", 15), ("poa", 11)]
        {
            let page = PathBuf::from(SPECIES).join(name).with_extension("ron");
            let points = points(&args.field(&page, bbch, None).unwrap());
            for view in View::both(&points) {
                let field = args.field(&page, bbch, Some(&view)).unwrap();
                let geometry = EmbreeAccel::build(&field.scene.surfaces(), 1).unwrap();
                let window = Window::full(args.size, args.size);
                let labels = render::label(&geometry, &field.scene.parts, &field.scene.camera, window);
                let at = |k: usize| ((k % 64), (k / 64));
                let is: Vec<(usize, usize)> = (0..64 * 64).filter(|k| labels.tags[*k].plant > 0).map(at).collect();
                let what = format!("{name} {bbch} from {}°", view.elevation_deg);
                assert!(is.iter().all(|(x, y)| (1..63).contains(x) && (1..63).contains(y)), "{what}: cut off");
                let away = |(x, y): &(usize, usize)| x.abs_diff(32).max(y.abs_diff(32));
                assert!(is.iter().map(away).max().unwrap_or(0) >= 24, "{what}: small");
            }
        }
    }
}
