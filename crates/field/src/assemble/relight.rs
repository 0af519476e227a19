//! Gives a built field another of its lights.

use super::drawn;
use super::illumination::{DARK, DrawnLights, LightAddress};
use super::{Field, Options, Source};
use crate::library::Library;
use furrow_base::Result;
use std::sync::PoisonError;

impl Source {
    /// Gives a field, which was built with the same options, another of its lights: lights and their records, exposure times of moving
    /// cameras, and the sensor. Nothing depends on the light that the field had before. After an error, the field is unchanged.
    ///
    /// The ground is the same for all lights: its extent allows for the exposure time under the field's own light, and a margin of some
    /// centimetres for the others.
    pub fn relight(&self, field: &mut Field, options: &Options, light: u64) -> Result<()> {
        let mut library = self.library.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let at = LightAddress { light, ..field.light_address() };
        let drawn = self.lights_of(at, options, &mut library);
        let lit = self.located(drawn, &library, options)?;
        *self.library.lock().unwrap_or_else(PoisonError::into_inner) = library;
        field.light = light;
        lit.expose(&self.desc.sensor, at, &mut field.captures);
        field.take(field.capture);
        field.warnings.retain(|warning| warning != DARK);
        if let Some(dark) = lit.warning().filter(|_| options.scan.is_none()) {
            field.warnings.insert(0, dark);
        }
        field.conditions.sensor = at.sensor(&self.desc.sensor).record();
        field.scene.lights = lit.lights;
        (field.conditions.lights, field.conditions.lighting) = (lit.records, lit.lighting);
        Ok(())
    }

    fn lights_of(&self, at: LightAddress, options: &Options, library: &mut Library) -> Result<DrawnLights> {
        let (page, desc) = (self.page(), &self.desc);
        let today = drawn::day(page, desc, library, options, (at.seed, at.index))?;
        DrawnLights::draw(page, desc, library, at, today.as_ref())
    }
}

#[cfg(test)]
mod tests {
    use crate::assemble::{Field, Options, Source};
    use furrow_base::math::{Spectrum, ToFloat};
    use furrow_optics::light::{Light, LightRecord};
    use std::path::Path;

    const DAY: &str = "Overcast(illuminance_klx: Uniform(5, 25))";
    const FLASH: &str = "Constant(radiance: (Uniform(0, 1), 1, 1, 1))";

    fn source(lights: &str, camera: &str) -> Source {
        let view = "size: (8, 8), intrinsics: FieldOfView(horizontal_deg: 40)";
        let text = format!(
            "Field(seed: 5, camera: Pinhole({view}, pose: Nadir(height_m: Uniform(1, 2)){camera}), lights: [{lights}], \
             sensor: (exposure: Auto(level: Uniform(0.1, 0.2)), sharpen: (amount: Uniform(0, 1))))"
        );
        Source::of_text(Path::new("page.ron"), &text).unwrap()
    }

    fn shining(field: &Field) -> Vec<Spectrum> {
        field.scene.lights.iter().map(Light::horizontal_irradiance).collect()
    }

    /// Expected: a field under light k does not depend on its lights before; number 0 is its own; camera and samples stay, lights
    /// and sensor differ; lists of a `OneOf` and values within them are drawn as fields draw them. Source: the binomial
    /// distribution, and the mean of a uniform distribution; bounds of four standard deviations.
    #[test]
    fn each_light_is_drawn_anew_and_nothing_else() {
        let source = source(&format!("OneOf([[{DAY}], [{FLASH}]])"), "");
        let options = Options { index: 3, ..Options::default() };
        let own = source.field(&options).unwrap();
        let (mut field, mut skipping) = (source.field(&options).unwrap(), source.field(&options).unwrap());
        let (mut days, mut red) = (0.0, Vec::new());
        for light in 1..401 {
            source.relight(&mut field, &options, light).unwrap();
            if light % 50 == 0 {
                source.relight(&mut skipping, &options, light).unwrap();
                assert_eq!((&field.conditions, shining(&field)), (&skipping.conditions, shining(&skipping)));
            }
            assert!(
                field.conditions.lights != own.conditions.lights && field.conditions.sensor != own.conditions.sensor
            );
            assert_eq!((field.scene.camera, field.sample_seed()), (own.scene.camera, own.sample_seed()));
            match &field.conditions.lights[..] {
                [LightRecord::Constant(flash)] => red.push(f64::from(flash.radiance_w_m2_sr_nm.to_array()[0])),
                _ => days += 1.0,
            }
        }
        let (mean, number) = (red.iter().sum::<f64>() / red.len().to_f64(), red.len().to_f64());
        assert!((days - 200.0_f64).abs() < 4.0 * 10.0, "{days}");
        assert!((mean - 0.5).abs() < 4.0 * (1.0 / 12.0 / number).sqrt(), "{mean}");
        source.relight(&mut field, &options, 0).unwrap();
        assert_eq!((&field.conditions, shining(&field)), (&own.conditions, shining(&own)));
    }

    /// Expected: a moving camera is exposed for as long as each light needs, and a light that is not there is warned of.
    #[test]
    fn exposure_follows_the_light() {
        let source = source(
            "OneOf([[Constant(radiance: (0.1, 0.1, 0.1, 0.1))], [Constant(radiance: (0.2, 0.2, 0.2, 0.2))]])",
            ", motion: (speed_m_s: 1)",
        );
        let options = Options::default();
        let mut field = source.field(&options).unwrap();
        let mut times = std::collections::BTreeMap::<usize, Vec<f32>>::new();
        for light in 0..20 {
            source.relight(&mut field, &options, light).unwrap();
            let time = field.scene.camera.exposure();
            assert_eq!(time, field.conditions.camera.motion.as_ref().unwrap().exposure_s);
            times.entry(field.conditions.lighting[0].drawn).or_default().push(time);
        }
        let mean = |list: usize| times[&list].iter().map(|t| t.ln()).sum::<f32>() / times[&list].len().to_f32();
        assert!(times.len() == 2 && mean(0) > mean(1), "{times:?}");
        assert!(field.warnings.is_empty(), "{:?}", field.warnings);
    }
}
