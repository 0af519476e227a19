//! Statistics of a dataset's records, accumulated record by record, so that memory does not depend on the number of
//! images.

use crate::model::record::{Plant, Record};
use furrow_base::math::ToFloat;
use furrow_grow::soil::SoilRecord;
use furrow_optics::light::LightRecord;
use furrow_optics::sensor::CameraRecord;
use furrow_render::scene::tag::Class;
use furrow_report::Tally;
use std::collections::{BTreeMap, BTreeSet};

/// Largest number of suns in the chart, spread over the images.
pub(super) const MOST_SUNS: u64 = 600;

/// Crop and weed.
pub(super) const PLANTS: [Class; 2] = [Class::Crop, Class::Weed];

/// One tally for crop, one for weed.
pub(super) type Pair = [Tally; 2];

/// Statistics of all images.
pub(super) struct Statistics {
    /// Number of images added so far; `of` is the number in the dataset.
    pub(super) images: u64,
    of: u64,
    /// Number of images by width and height.
    pub(super) sizes: BTreeMap<(u32, u32), u64>,
    /// Number of pixels by class; `ignored` is the number without a label.
    pub(super) pixels: [u64; Class::ALL.len()],
    pub(super) ignored: u64,
    /// Fraction of each image covered by each class, percent.
    pub(super) shares: [Tally; Class::ALL.len()],
    /// Number of plants with at least one visible pixel in each image.
    pub(super) plants: Pair,
    /// Number of visible pixels of each plant and of each leaf.
    pub(super) plant_pixels: Pair,
    pub(super) leaf_pixels: Pair,
    /// Visible fraction within the frame of each plant and each leaf, percent; includes fully hidden ones.
    pub(super) plant_visible: Pair,
    pub(super) leaf_visible: Pair,
    /// Number of fully hidden plants, and number of plants cut by the frame.
    pub(super) hidden: u64,
    pub(super) cut: u64,
    /// Growth stage, age and height of each visible plant.
    pub(super) bbch: Pair,
    pub(super) age_days: Pair,
    pub(super) height_cm: Pair,
    /// Species by number in the dataset's table; 0 is an unknown species.
    pub(super) species: BTreeMap<u16, Species>,
    /// Sampled conditions of the images.
    pub(super) light: Light,
    pub(super) soil: Soil,
    pub(super) camera: Camera,
    /// Number of images with each warning.
    pub(super) warnings: BTreeMap<String, u64>,
}

/// Statistics of a species.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Species {
    /// Number of visible plants, of their pixels, and of images that show the species.
    pub(super) plants: u64,
    pub(super) pixels: u64,
    pub(super) images: u64,
    /// Lowest and highest BBCH stage.
    pub(super) bbch: Option<(u32, u32)>,
}

/// Statistics of the lights.
pub(super) struct Light {
    /// Number of lights of each kind.
    pub(super) kinds: BTreeMap<String, u64>,
    /// Azimuth and elevation in degrees and cloud cover of at most [`MOST_SUNS`] suns.
    pub(super) suns: Vec<[f64; 3]>,
    pub(super) elevation_deg: Tally,
    pub(super) cloud: Tally,
    pub(super) turbidity: Tally,
    /// Irradiance on the ground from all lights, mean of R, G, B, W·m⁻²·nm⁻¹.
    pub(super) irradiance: Tally,
}

/// Statistics of the soil.
pub(super) struct Soil {
    pub(super) moisture: Tally,
    pub(super) roughness_mm: Tally,
    pub(super) straw: Tally,
    pub(super) clods: Tally,
    /// Sum over all images of each layer's fraction, by layer name.
    pub(super) layers: BTreeMap<String, f64>,
}

/// Statistics of the cameras.
pub(super) struct Camera {
    pub(super) height_m: Tally,
    /// Angle between the optical axis and the downward vertical, degrees.
    pub(super) tilt_deg: Tally,
    /// Size of a pixel on the ground vertically below the camera: height / focal length, mm.
    pub(super) pixel_mm: Tally,
}

impl Statistics {
    /// Returns `true` if plants are labelled, and not only classes.
    pub(super) fn has_plants(&self) -> bool {
        self.species.values().any(|s| s.plants > 0) || self.pixels[1..].iter().all(|n| *n == 0)
    }

    /// Creates empty statistics for a dataset of `of` images.
    pub(super) fn new(of: u64) -> Self {
        let pair = |one: fn() -> Tally| [one(), one()];
        Self {
            images: 0,
            of,
            sizes: BTreeMap::new(),
            pixels: [0; Class::ALL.len()],
            ignored: 0,
            shares: std::array::from_fn(|_| Tally::percents()),
            plants: pair(Tally::whole),
            plant_pixels: pair(Tally::sizes),
            leaf_pixels: pair(Tally::sizes),
            plant_visible: pair(Tally::percents),
            leaf_visible: pair(Tally::percents),
            hidden: 0,
            cut: 0,
            bbch: pair(Tally::whole),
            age_days: pair(|| Tally::linear(0.0, 1000.0, 0.5)),
            height_cm: pair(|| Tally::linear(0.0, 1000.0, 0.1)),
            species: BTreeMap::new(),
            light: Light {
                kinds: BTreeMap::new(),
                suns: Vec::new(),
                elevation_deg: Tally::linear(-90.0, 90.0, 0.5),
                cloud: Tally::percents(),
                turbidity: Tally::linear(0.0, 100.0, 0.05),
                irradiance: Tally::linear(0.0, 200.0, 0.01),
            },
            soil: Soil {
                moisture: Tally::percents(),
                roughness_mm: Tally::linear(0.0, 500.0, 0.05),
                straw: Tally::linear(0.0, 100.0, 0.02),
                clods: Tally::linear(0.0, 1e6, 50.0),
                layers: BTreeMap::new(),
            },
            camera: Camera {
                height_m: Tally::linear(0.0, 50.0, 0.002),
                tilt_deg: Tally::linear(0.0, 180.0, 0.05),
                pixel_mm: Tally::linear(0.0, 50.0, 0.002),
            },
            warnings: BTreeMap::new(),
        }
    }

    /// Adds the record of an image.
    pub(super) fn add(&mut self, record: &Record) {
        *self.sizes.entry((record.width, record.height)).or_default() += 1;
        let pixels = f64::from(record.width) * f64::from(record.height);
        self.ignored += record.ignored;
        for share in &record.classes {
            let class = share.class as usize;
            self.pixels[class] += share.pixels;
            self.shares[class].add(100.0 * share.pixels.to_f64() / pixels);
        }
        for (k, class) in PLANTS.into_iter().enumerate() {
            let of_class = || record.plants.iter().filter(|p| p.class == class);
            self.plants[k].add(of_class().filter(|p| p.seen.pixels > 0).count().to_f64());
            of_class().for_each(|plant| self.add_plant(k, plant));
        }
        let here: BTreeSet<u16> = record.seen().map(|plant| plant.kind).collect();
        for kind in here {
            self.species.entry(kind).or_default().images += 1;
        }
        record.warnings.iter().for_each(|words| *self.warnings.entry(words.clone()).or_default() += 1);
        if let Some(conditions) = &record.conditions {
            self.add_lights(&conditions.lights);
            if let Some(soil) = &conditions.soil {
                self.soil.add(soil);
            }
            self.camera.add(&conditions.camera);
        }
        self.images += 1;
    }

    fn add_plant(&mut self, class: usize, plant: &Plant) {
        let seen = &plant.seen;
        if seen.unoccluded.is_some() {
            self.plant_visible[class].add(100.0 * seen.visible_fraction());
        }
        for leaf in plant.leaves.iter().filter(|l| l.seen.unoccluded.is_some()) {
            self.leaf_visible[class].add(100.0 * leaf.seen.visible_fraction());
        }
        if seen.pixels == 0 {
            self.hidden += 1;
            return;
        }
        self.cut += u64::from(seen.inside_fraction() < 1.0);
        self.plant_pixels[class].add(f64::from(seen.pixels));
        for leaf in plant.leaves.iter().filter(|l| l.seen.pixels > 0) {
            self.leaf_pixels[class].add(f64::from(leaf.seen.pixels));
        }
        let species = self.species.entry(plant.kind).or_default();
        species.plants += 1;
        species.pixels += u64::from(seen.pixels);
        if let Some(grown) = &plant.grown {
            self.bbch[class].add(f64::from(grown.bbch));
            self.age_days[class].add(f64::from(grown.age_days));
            self.height_cm[class].add(f64::from(grown.height_m) * 100.0);
            let (least, most) = species.bbch.unwrap_or((grown.bbch, grown.bbch));
            species.bbch = Some((least.min(grown.bbch), most.max(grown.bbch)));
        }
    }

    fn add_lights(&mut self, lights: &[LightRecord]) {
        let light = &mut self.light;
        let mut ground = 0.0;
        for one in lights {
            *light.kinds.entry(one.kind().to_owned()).or_default() += 1;
            let given = match one {
                LightRecord::Daylight(day) => vec![day.sun_irradiance_w_m2_nm, day.sky_irradiance_w_m2_nm],
                other => vec![other.irradiance_w_m2_nm()],
            };
            for spectrum in given {
                ground += spectrum.to_array().into_iter().take(3).map(f64::from).sum::<f64>() / 3.0;
            }
            let LightRecord::Daylight(day) = one else { continue };
            light.elevation_deg.add(day.sun_elevation_deg);
            // Takes every n-th image, so that the chart has at most `MOST_SUNS` suns.
            if self.images.is_multiple_of(self.of.div_ceil(MOST_SUNS).max(1)) {
                light.suns.push([day.sun_azimuth_deg, day.sun_elevation_deg, f64::from(day.cloud)]);
            }
            light.cloud.add(100.0 * f64::from(day.cloud));
            light.turbidity.add(day.turbidity);
        }
        if !lights.is_empty() {
            light.irradiance.add(ground);
        }
    }
}

impl Soil {
    fn add(&mut self, soil: &SoilRecord) {
        self.moisture.add(100.0 * f64::from(soil.moisture.mean));
        self.roughness_mm.add(soil.relief.rms_mm.into());
        self.straw.add(100.0 * f64::from(soil.litter.straw_cover));
        self.clods.add(soil.clods.over_5mm_per_m2.into());
        for layer in &soil.layers {
            *self.layers.entry(layer.name.clone()).or_default() += f64::from(layer.share);
        }
    }
}

impl Camera {
    fn add(&mut self, camera: &CameraRecord) {
        let height = camera.position_m[2];
        self.height_m.add(height);
        let down = camera.world_to_camera[2][2];
        self.tilt_deg.add((-down).clamp(-1.0, 1.0).acos().to_degrees());
        if camera.fx_px > 0.0 {
            self.pixel_mm.add(1000.0 * height / camera.fx_px);
        }
    }
}
