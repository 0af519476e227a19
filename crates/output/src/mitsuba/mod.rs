//! Export of a scene to Mitsuba 3 (Jakob et al. 2022, <https://mitsuba-renderer.org>), to validate this renderer
//! against another one, to compare their speed, and to use fields there.
//!
//! Contents of the folder:
//!
//! | file | contents |
//! |---|---|
//! | `scene.xml` | the scene in R, G, B with Mitsuba's own plugins only; `scene.xml -D spp=256` sets the samples |
//! | `scene-nir.xml` | the same in near infrared, as grey |
//! | `scene-exact.xml` | like `scene.xml`, with exactly this renderer's scattering; needs the plugins of `tests/mitsuba/bsdfs.py` |
//! | `meshes/*.ply` | surfaces of one material and plant each; the shape's id is `CLASS-PLANT-NUMBER` |
//! | `textures/*` | opacity (PNG); reflectance, transmittance, relief, sun and sky (OpenEXR, raw numbers) |
//!
//! Lengths are in centimetres. Mitsuba offsets rays from surfaces by 9·10⁻⁵ of (1 + the largest coordinate), which
//! would be a tenth of a millimetre and more in metres, but is 30 µm in this unit. The offset of this renderer is 0.25
//! µm, so contacts finer than 30 µm are lost there.
//!
//! Only `volpath` lets masked surfaces cast correct shadows; `path` treats them as solid. Paths of this renderer end
//! after 12 surfaces, which is `max_depth` 13 there. Textures are exported on the mip level that the camera sees of
//! each organ and read by every ray ([`fix_levels`] does the same in this renderer).
//!
//! The table in `surface.rs` lists which materials are exported exactly and which approximately; approximations in a
//! scene are returned as warnings and noted in the files. The camera's reconstruction filter is exact for `Box`.
//! `Gaussian`, convolved with the pixel, is exported as the Gaussian of the same variance. Mitsuba has no lens
//! distortion and only square pixels.

mod files;
mod level;
mod light;
mod mean;
mod ply;
mod scattering;
mod surface;
mod xml;

use super::png::{self, ImageData};
use super::{Export, unsupported};
use files::{Band, Files, Plugins, SCALE, matrix};
use furrow_base::Result;
use furrow_base::geometry::{AlphaMask, Mesh};
use furrow_base::math::{Spectrum, ToInt};
use furrow_render::film::Filter;
use furrow_render::integrator::PathTracer;
use furrow_render::material::Varies;
use furrow_render::scene::{Part, Scene};
pub use level::{Leveled, fix_levels};
use light::Lights;
use mean::Averages;
pub use mean::{Crossing, Directions, Pair};
use rayon::prelude::*;
use scattering::ScatteringMap;
pub use scattering::relief;
use std::collections::hash_map::Entry;
use std::collections::{BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;
use surface::Surface;
use xml::Element;

/// Number of shapes whose materials are sampled at once, on all threads; more would need more memory.
const SAMPLED: usize = 64;

/// Parts with the same material, mask and plant, which become one shape.
struct Group {
    name: String,
    /// Material index in [`Leveled`].
    material: u32,
    mask: Option<Arc<AlphaMask>>,
    mesh: Mesh,
    colors: Option<Vec<Spectrum>>,
}

/// Properties shared by the parts of one shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    class: &'static str,
    plant: u32,
    /// Index of the levelled material, or its roughness and film if the vertices hold the colour.
    look: Result<u32, [u32; 4]>,
    /// Address of the mask.
    mask: usize,
}

/// Writes `scene`, whose materials have been `leveled`, into `folder`. Scattering that the format lacks is averaged over
/// `directions`; `text` is stored in the files as their provenance. `scene.xml` is written last, so its presence means
/// that the export is complete.
pub fn write(folder: &Path, scene: &Scene, leveled: &Leveled, directions: &Directions, text: &str) -> Result<Export> {
    let mut files = Files::new(folder);
    let mut warnings = camera_warnings(scene);
    let groups = groups(scene, leveled)?;
    let lights = Lights::write(&scene.lights, &mut files)?;
    warnings.extend(unsupported(&scene.lights));
    if lights.has_lamps() && lights.has_sky() {
        warnings.push("with lamps in the scene the camera does not see the sky".into());
    }
    let mut masks: HashMap<usize, String> = HashMap::new();
    let mut lost = BTreeSet::new();
    let mut surfaces = Vec::with_capacity(groups.len());
    let mut averages = Averages::new(directions);
    for groups in groups.chunks(SAMPLED) {
        let look = |group: &Group| ScatteringMap::of(&leveled.materials[group.material.to_usize()]);
        let looks: Vec<ScatteringMap> = groups.par_iter().map(look).collect();
        for (group, look) in groups.iter().zip(&looks) {
            let mask = group.mask.as_ref().map(|m| mask_file(m, text, &mut masks, &mut files)).transpose()?;
            let factor = Surface::corner_factor(look, directions);
            let colors: Option<Vec<Spectrum>> = group.colors.as_ref().map(|c| c.iter().map(|s| *s * factor).collect());
            let surface = match colors {
                Some(_) => Surface::of_corners(look, &group.name, directions, &mut files)?,
                None => Surface::write(look, &group.name, mask, &mut averages, &mut files)?,
            };
            surface.warnings(&group.name, &mut lost);
            files.write(&mesh_file(&group.name), &ply::encode(&group.mesh, colors.as_deref()))?;
            surfaces.push(surface);
        }
    }
    warnings.extend(summary(&lost));
    let notes = if warnings.is_empty() { String::new() } else { format!("\n\n{}", warnings.join("\n")) };
    let whole =
        ExportContext { scene, groups: &groups, surfaces: &surfaces, lights: &lights, notes: format!("{text}{notes}") };
    let documents = [
        ("scene-exact.xml", Band::Color, Plugins::Own),
        ("scene-nir.xml", Band::Nir, Plugins::BuiltIn),
        ("scene.xml", Band::Color, Plugins::BuiltIn),
    ];
    let paths = files.finish(&documents.map(|(name, band, plugins)| (name, whole.document(band, plugins))))?;
    Ok(Export { paths, warnings, amount: None })
}

/// Returns one warning per kind of loss, with one surface's name and the number of others.
fn summary(lost: &BTreeSet<(&'static str, String)>) -> Vec<String> {
    let kinds: BTreeSet<&str> = lost.iter().map(|(what, _)| *what).collect();
    let line = |what: &str| {
        let names: Vec<&String> = lost.iter().filter(|(w, _)| *w == what).map(|(_, name)| name).collect();
        let others = if names.len() > 1 { format!(" and {} more", names.len() - 1) } else { String::new() };
        format!("{}{others}: {what}", names[0])
    };
    kinds.into_iter().map(line).collect()
}

/// Groups the parts that share material, mask and plant, in the order of their first part.
fn groups(scene: &Scene, leveled: &Leveled) -> Result<Vec<Group>> {
    let mut groups: Vec<Group> = Vec::new();
    let mut known: HashMap<Key, usize> = HashMap::new();
    let parts = scene.parts.iter().zip(&leveled.of_parts);
    for (part, &index) in parts.filter(|(p, _)| !p.mesh.triangles.is_empty()) {
        let material = &leveled.materials[index.to_usize()];
        let colors = (material.varies() == Varies::Place).then(|| scattering::colors(material, &part.in_world()));
        let look = match &colors {
            None => Ok(index),
            Some(_) => Err(surface::rough(&ScatteringMap::of(material))?),
        };
        let key = Key { class: part.tag.class.name(), plant: part.tag.plant, look, mask: address(part) };
        match known.entry(key) {
            Entry::Occupied(place) => {
                let group = &mut groups[*place.get()];
                group.mesh.append(&part.in_world());
                if let (Some(all), Some(more)) = (&mut group.colors, colors) {
                    all.extend(more);
                }
            }
            Entry::Vacant(place) => {
                let number = *place.insert(groups.len());
                groups.push(Group {
                    name: format!("{}-{}-{number}", key.class, key.plant),
                    material: index,
                    mask: part.mask.clone(),
                    mesh: part.in_world().into_owned(),
                    colors,
                });
            }
        }
    }
    Ok(groups)
}

/// Masks are shared, so the address identifies a mask.
fn address(part: &Part) -> usize {
    part.mask.as_ref().map_or(0, |m| Arc::as_ptr(m).addr())
}

fn mesh_file(name: &str) -> String {
    format!("meshes/{name}.ply")
}

/// Writes the image of a mask once and returns its path.
fn mask_file(
    mask: &Arc<AlphaMask>,
    text: &str,
    known: &mut HashMap<usize, String>,
    files: &mut Files<'_>,
) -> Result<String> {
    let address = Arc::as_ptr(mask).addr();
    if let Some(name) = known.get(&address) {
        return Ok(name.clone());
    }
    let name = format!("textures/mask-{}.png", known.len());
    let (w, h) = mask.size();
    let opaque = |i: u32| if mask.texel((i % w).to_i32(), (i / w).to_i32()) { 255 } else { 0 };
    let pixels: Vec<u8> = (0..w * h).map(opaque).collect();
    files.write(&name, &png::encode(w, h, &ImageData::Gray(&pixels), text)?)?;
    known.insert(address, name.clone());
    Ok(name)
}

fn camera_warnings(scene: &Scene) -> Vec<String> {
    let camera = &scene.camera;
    let [fx, fy, cx, cy] = camera.intrinsics();
    let mut warnings = Vec::new();
    if !camera.distortion().is_none() {
        warnings.push("the lens distortion is omitted: Mitsuba's cameras have none".into());
    }
    if camera.blurs() || camera.rolls() {
        warnings.push("the camera is static: its motion is omitted".into());
    }
    if (fx / fy - 1.0).abs() > 1e-6 {
        warnings.push(format!("pixels {:.4} times as high as wide are exported as square", fx / fy));
    }
    let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
    if camera.aperture().is_some() && (cx != 0.5 * w || cy != 0.5 * h) {
        warnings.push("the optical axis is moved to the image's middle: Mitsuba's thin lens supports no other".into());
    }
    if scene.filter.filter() != Filter::Box {
        warnings.push("the reconstruction filter is exported as a Gaussian of the same variance".into());
    }
    warnings
}

/// Data for all documents.
struct ExportContext<'a> {
    scene: &'a Scene,
    groups: &'a [Group],
    surfaces: &'a [Surface],
    lights: &'a Lights,
    notes: String,
}

impl ExportContext<'_> {
    fn document(&self, band: Band, plugins: Plugins) -> String {
        let default = |name: &'static str, value: &str| Element::new("default").with("name", name).with("value", value);
        let mut root = Element::new("scene").with("version", "3.0.0").comment(&self.notes).inside([
            default("spp", "64"),
            default("rr_depth", "5"),
            default("sun_weight", "16"),
            self.integrator(),
            self.sensor(band),
        ]);
        root = root.inside(self.lights.elements(band));
        for (group, surface) in self.groups.iter().zip(self.surfaces) {
            root = root.inside([
                surface.element(&format!("material-{}", group.name), band, plugins),
                Element::plugin("shape", "ply")
                    .with("id", &group.name)
                    .string("filename", mesh_file(&group.name))
                    .inside([Element::new("ref").with("id", format!("material-{}", group.name))]),
            ]);
        }
        root.document()
    }

    fn integrator(&self) -> Element {
        Element::plugin("integrator", "volpath")
            // Mitsuba counts the edges of a path: one more than its surfaces.
            .integer("max_depth", PathTracer::default().max_depth + 1)
            .integer("rr_depth", "$rr_depth")
            .boolean("hide_emitters", self.lights.has_lamps())
    }

    fn sensor(&self, band: Band) -> Element {
        let camera = &self.scene.camera;
        let [fx, _, cx, cy] = camera.intrinsics();
        let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
        let axes = camera.pose().axes;
        // Mitsuba's camera has x to the left and y up.
        let to_world = matrix([-axes.x_axis, -axes.y_axis, axes.z_axis], camera.pose().position * SCALE);
        let lens = match camera.aperture() {
            Some(lens) => Element::plugin("sensor", "thinlens")
                .float("aperture_radius", lens.radius * SCALE)
                .float("focus_distance", lens.focus * SCALE),
            // Mitsuba adds the offset to a pixel before it generates the ray: the offset from the axis to the image's
            // middle.
            None => Element::plugin("sensor", "perspective")
                .float("principal_point_offset_x", 0.5 - cx / w)
                .float("principal_point_offset_y", 0.5 - cy / h),
        };
        let filter = match self.scene.filter.filter() {
            Filter::Box => Element::plugin("rfilter", "box"),
            // The pixel's own variance is 1/12.
            Filter::Gaussian(sigma) => {
                Element::plugin("rfilter", "gaussian").float("stddev", (sigma * sigma + 1.0 / 12.0).sqrt())
            }
        };
        let film = Element::plugin("film", "hdrfilm")
            .integer("width", camera.width())
            .integer("height", camera.height())
            .string("pixel_format", if band == Band::Color { "rgb" } else { "luminance" })
            .string("component_format", "float32")
            .inside([filter]);
        lens.string("fov_axis", "x")
            .float("fov", 2.0 * (0.5 * w / fx).atan().to_degrees())
            .float("near_clip", 0.01)
            .float("far_clip", 1e9)
            .inside([to_world, film, Element::plugin("sampler", "independent").integer("sample_count", "$spp")])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::{Vec3, vec3};
    use furrow_optics::bsdf::{Bsdf, OrenNayar};
    use furrow_optics::sensor::{Camera, Distortion, Pose};
    use furrow_render::material::Material;
    use furrow_render::scene::tag::{Class, Tag};

    /// Returns a scene with two single-triangle parts for each plant, the second parts after all first ones; plants of
    /// each class are numbered from 1.
    fn field(plants: usize) -> Scene {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let mut mesh = Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() };
        mesh.uvs = vec![furrow_base::math::Vec2::ZERO; 3];
        mesh.normals = vec![Vec3::Z; 3];
        let part = |k: usize| {
            let class = if k.is_multiple_of(2) { Class::Crop } else { Class::Weed };
            let tag = Tag { class, plant: (k / 2 + 1).to_u32(), leaf: 0 };
            Part { mesh: Arc::new(mesh.clone()), mask: None, material: 0, tag, instance: None }
        };
        let parts = (0..plants).chain(0..plants).map(part).collect();
        let pose = Pose::look_at(vec3(0.0, -1.0, 1.0), Vec3::ZERO).unwrap();
        let camera = Camera::new((8, 8), [8.0; 2], [4.0; 2], Distortion::default(), pose).unwrap();
        let materials = vec![Material::Plain(Bsdf::OrenNayar(OrenNayar::new(Spectrum::ONE, 0.0)))];
        Scene { parts, materials, lights: Vec::new(), haze: None, camera, filter: Filter::Box.footprint() }
    }

    /// Rationale: parts are grouped by a hash of their shared properties, in any order. Expected: one shape per plant,
    /// named in the order of the first parts.
    #[test]
    fn parts_of_a_plant_are_one_shape() {
        let few = field(3);
        let few = groups(&few, &Leveled::of(&few)).unwrap();
        let names: Vec<&str> = few.iter().map(|g| g.name.as_str()).collect();
        assert_eq!(names, ["crop-1-0", "weed-1-1", "crop-2-2"]);
        assert!(few.iter().all(|g| g.mesh.triangles.len() == 2));
        let many = field(40_000);
        assert_eq!(groups(&many, &Leveled::of(&many)).unwrap().len(), 40_000);
    }
}
