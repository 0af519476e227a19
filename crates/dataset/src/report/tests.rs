//! Conditions in the report: an image with every kind of condition contributes to every statistic.

use super::statistics::Statistics;
use crate::model::record::Record;
use crate::model::split::Split;
use furrow_base::math::Spectrum;
use furrow_field::assemble::{Options, field_of};
use furrow_field::record::Conditions;
use furrow_optics::light::{ConstantRecord, EnvironmentMapRecord, LampRecord, LightRecord, OvercastRecord};

/// Returns the conditions of a field with a sun, soil and camera.
fn conditions() -> Conditions {
    let text = r#"Field(
        seed: 3,
        camera: Pinhole(
            size: (16, 12),
            intrinsics: Millimetres(focal_mm: 4, pixel_um: 300),
            pose: LookAt(position_m: (0, -0.05, 0.5), target_m: (0, 0, 0)),
        ),
        lights: [Daylight(sun: Angles(elevation_deg: 40, azimuth_deg: 100), turbidity: 3, cloud: 0.25)],
        soil: (
            layers: [(albedo: "dirt.png", height: "dirt.height.png", size_m: 0.5, height_mm: (-2, 2))],
            relief: (rms_mm: 2),
            moisture: (mean: 0.5),
            clods: (over_5mm_per_m2: 100),
            litter: (straw_cover: 0.01, sticks_per_m2: 0, bits_per_m2: 0),
        ),
    )"#;
    field_of(text, &Options::default()).unwrap().conditions
}

fn record(conditions: Option<Conditions>) -> Record {
    Record {
        index: 0,
        name: "000000".into(),
        source: None,
        split: Split::Train,
        capture: None,
        light: None,
        width: 16,
        height: 12,
        classes: Vec::new(),
        ignored: 0,
        plants: Vec::new(),
        conditions,
        canopy: None,
        exposure: None,
        sampling: None,
        quality: None,
        warnings: Vec::new(),
    }
}

#[test]
fn every_condition_that_the_report_shows_is_counted() {
    let record = record(Some(conditions()));
    // Converted to JSON and back, as from disk.
    let record: Record = serde_json::from_slice(&serde_json::to_vec(&record).unwrap()).unwrap();
    let mut found = Statistics::new(1);
    found.add(&record);
    let (light, soil, camera) = (&found.light, &found.soil, &found.camera);
    for (name, histogram, mean) in [
        ("elevation_deg", &light.elevation_deg, 40.0),
        ("cloud", &light.cloud, 25.0),
        ("turbidity", &light.turbidity, 3.0),
        ("moisture", &soil.moisture, 50.0),
        ("roughness_mm", &soil.roughness_mm, 2.0),
        ("straw", &soil.straw, 1.0),
        ("clods", &soil.clods, 100.0),
        ("height_m", &camera.height_m, 0.5),
        ("tilt_deg", &camera.tilt_deg, 0.1_f64.atan().to_degrees()),
        ("pixel_mm", &camera.pixel_mm, 1000.0 * 0.5 * 0.3 / 4.0),
    ] {
        assert_eq!(histogram.n(), 1, "{name}");
        assert!((histogram.mean() - mean).abs() < 1e-4 * mean, "{name}: {}", histogram.mean());
    }
    assert!(light.irradiance.n() == 1 && light.irradiance.mean() > 0.1);
    assert_eq!((light.suns.len(), light.kinds["daylight"], soil.layers["dirt.png"]), (1, 1, 1.0));
    let charts = super::light(&found).into_iter().chain(super::soil(&found));
    let page: String = charts.map(maud::PreEscaped::into_string).collect();
    for key in ["sun_elevation_deg", "irradiance", "cloud", "turbidity", "moisture", "roughness_mm", "clods", "straw"] {
        assert!(page.contains(&format!("data-key=\"{key}\"")), "{key}");
    }
    // Imported images have no conditions and do not contribute.
    found.add(&self::record(None));
    assert_eq!((found.images, found.light.cloud.n(), found.camera.height_m.n()), (2, 1, 1));
}

#[test]
fn conditions_come_back_from_json_with_every_kind_of_light() {
    let s = Spectrum::new(0.1, 0.2, 0.3, 0.4);
    let mut of = conditions();
    of.lights.extend([
        LightRecord::Overcast(OvercastRecord { illuminance_klx: 0.1, irradiance_w_m2_nm: s }),
        LightRecord::Constant(ConstantRecord { radiance_w_m2_sr_nm: s, irradiance_w_m2_nm: s }),
        LightRecord::EnvironmentMap(EnvironmentMapRecord {
            file: "a.hdr".into(),
            scale: 0.1,
            rotate_deg: 0.7,
            irradiance_w_m2_nm: s,
        }),
        LightRecord::Lamp(LampRecord {
            size_m: [0.1; 2],
            round: true,
            position_m: [0.1, 0.2, 0.3],
            direction: [0.0, 0.0, -1.0],
            radiance_w_m2_sr_nm: s,
            power_w_nm: s,
            irradiance_w_m2_nm: s,
        }),
    ]);
    for light in &of.lights {
        assert_eq!(serde_json::to_value(light).unwrap()["kind"], light.kind());
    }
    let record = record(Some(of));
    let text = serde_json::to_string(&record).unwrap();
    assert_eq!(serde_json::from_str::<Record>(&text).unwrap(), record);
}

#[test]
fn a_field_that_is_missing_is_an_error_not_an_empty_report() {
    let mut value = serde_json::to_value(record(Some(conditions()))).unwrap();
    let moisture = value.pointer_mut("/conditions/soil/moisture").unwrap().as_object_mut().unwrap();
    let mean = moisture.remove("mean").unwrap();
    moisture.insert("average".into(), mean);
    let error = serde_json::from_value::<Record>(value).unwrap_err().to_string();
    assert!(error.contains("missing field `mean`"), "{error}");
}
