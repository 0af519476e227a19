//! Lights of a field: those that the scene file lists, with each `OneOf` replaced by the list that the field draws from it.

use furrow_base::ron_file::RonFile;
use furrow_base::ron_file::Step;
use furrow_base::sampling::Stream;
use furrow_base::{Error, Result};
use furrow_optics::light::{LightDesc, one_of_inside};
use serde::{Deserialize, Serialize};

/// Choice that a field has drawn for one `OneOf([[…], […]])` among the scene file's lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lighting {
    /// Index of the `OneOf` among the scene file's lights, from 0.
    pub place: usize,
    /// Index of the drawn list, from 0.
    pub drawn: usize,
    /// Number of lists to choose from.
    pub of: usize,
}

/// A light of the field and its path in the scene file.
pub(super) struct SceneLight<'a> {
    pub(super) desc: &'a LightDesc,
    pub(super) at: Vec<Step<'static>>,
}

impl Lighting {
    /// Draws one list of each `OneOf`, from the random stream of its index, and replaces the `OneOf` by the list's lights. Returns an
    /// error that points into the scene file if a list is empty or nested.
    pub(super) fn draw<'a>(
        page: &RonFile,
        lights: &'a [LightDesc],
        stream: impl Fn(usize) -> Stream,
    ) -> Result<(Vec<Self>, Vec<SceneLight<'a>>)> {
        let (mut all, mut listed) = (Vec::new(), Vec::new());
        for (place, desc) in lights.iter().enumerate() {
            let at = vec![Step::Field("lights"), Step::Item(place)];
            let LightDesc::OneOf(lists) = desc else {
                listed.push(SceneLight { desc, at });
                continue;
            };
            let at = [at, vec![Step::Item(0)]].concat();
            check(page, lists, &at)?;
            let drawn = stream(place).index(lists.len());
            all.push(Self { place, drawn, of: lists.len() });
            let inner = |k| [&at[..], &[Step::Item(drawn), Step::Item(k)]].concat();
            listed.extend(lists[drawn].iter().enumerate().map(|(k, desc)| SceneLight { desc, at: inner(k) }));
        }
        Ok((all, listed))
    }
}

/// Returns an error for an empty `OneOf`, an empty list, and a `OneOf` inside a list.
fn check(page: &RonFile, lists: &[Vec<LightDesc>], at: &[Step<'_>]) -> Result<()> {
    let fault = |to: &[Step<'_>], error: Error| Err(page.blame(&[at, to].concat(), error));
    if lists.is_empty() {
        let help = "OneOf([[Daylight(…)], [Lamp(…), Lamp(…)]])";
        return fault(&[], Error::input("this list is empty: there is nothing to choose from").help(help));
    }
    for (i, list) in lists.iter().enumerate() {
        if list.is_empty() {
            let help = "write at least one light in it; Constant(radiance: (0, 0, 0, 0)) is dark";
            return fault(&[Step::Item(i)], Error::input("this list has no lights").help(help));
        }
        if let Some(k) = list.iter().position(|light| matches!(light, LightDesc::OneOf(_))) {
            return fault(&[Step::Item(i), Step::Item(k)], one_of_inside());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::Field;
    use crate::assemble::{self, Options};
    use furrow_base::Result;
    use furrow_base::math::{Spectrum, ToFloat, ToInt};
    use furrow_base::ron_file::RonFile;
    use furrow_base::sampling::{Purpose, Stream};
    use furrow_optics::light::{LightDesc, LightRecord};

    const LAMPS: &str = "Constant(radiance: (Uniform(1, 2), 1, 1, 1)), Constant(radiance: (Uniform(3, 4), 1, 1, 1))";
    const DAY: &str = "Overcast(illuminance_klx: Uniform(5, 25))";
    const FLASH: &str = "Constant(radiance: (1, Uniform(0, 1), 1, 1))";

    fn text(lights: &str) -> String {
        let camera = "Pinhole(size: (8, 8), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 1))";
        format!("Field(\n  seed: 5,\n  camera: {camera},\n  lights: [{lights}],\n)")
    }

    fn field(lights: &str, index: u64) -> Result<Field> {
        assemble::field_of(&text(lights), &Options { index, ..Options::default() })
    }

    /// Expected: all lists are drawn equally often, two `OneOf` of a scene file are independent, and the record matches the drawn lists.
    /// Source: the binomial distribution; bounds of four standard deviations.
    #[test]
    fn each_list_is_drawn_as_often_as_the_others() {
        let red = |r: f32| format!("[Constant(radiance: ({r}, 0, 0, 0))]");
        let lights = format!("OneOf([{}, {}, {}]), OneOf([{}, {}])", red(1.0), red(2.0), red(3.0), red(1.0), red(2.0));
        let mut seen = [[0_i32; 2]; 3];
        for index in 0..900 {
            let of = field(&lights, index).unwrap().conditions;
            let places: Vec<_> = of.lighting.iter().map(|l| (l.place, l.of)).collect();
            assert_eq!(places, [(0, 3), (1, 2)]);
            let [first, second] = [of.lighting[0].drawn, of.lighting[1].drawn];
            let reds: Vec<_> = of.lights.iter().map(radiance).map(|l| l.to_array()[0]).collect();
            assert_eq!(reds, [first.to_f32() + 1.0, second.to_f32() + 1.0]);
            seen[first][second] += 1;
        }
        // 900 / 6 ± 4 √(900 · 1/6 · 5/6).
        assert!(seen.as_flattened().iter().all(|n| (n - 150).abs() < 45), "{seen:?}");
    }

    fn radiance(of: &LightRecord) -> Spectrum {
        let LightRecord::Constant(of) = of else { panic!("{of:?}") };
        of.radiance_w_m2_sr_nm
    }

    /// Expected: the numbers of the drawn list, and of the lights after it, equal those of a scene file with that list written out. A
    /// scene file without `OneOf` draws its lights from the same streams as before `OneOf` existed.
    #[test]
    fn the_lights_stand_there_as_if_written_so() {
        for index in 0..12 {
            let of = field(&format!("{FLASH}, OneOf([[{LAMPS}], [{DAY}]]), {FLASH}"), index).unwrap().conditions;
            let drawn = [LAMPS, DAY][of.lighting[0].drawn];
            let plain = field(&format!("{FLASH}, {drawn}, {FLASH}"), index).unwrap().conditions;
            assert_eq!(of.lights, plain.lights);
            assert!(plain.lighting.is_empty() && serde_json::to_value(&plain).unwrap().get("lighting").is_none());
            for (i, desc) in [DAY, FLASH].into_iter().enumerate() {
                let desc: LightDesc = RonFile::of(desc).parse().unwrap();
                let mut stream = Stream::of(5, index, Purpose::Page, 1 + i.to_u64());
                let (record, _) = desc.draw(&mut stream, &mut |_, _| unreachable!()).unwrap();
                assert_eq!(field(&format!("{DAY}, {FLASH}"), index).unwrap().conditions.lights[i], record);
            }
        }
    }

    #[test]
    fn lists_that_nothing_can_be_drawn_from_are_shown_in_their_places() {
        for (lights, place, why) in [
            ("OneOf([])", "4:18", "this list is empty: there is nothing to choose from"),
            ("OneOf([[Overcast()], []])", "4:33", "this list has no lights"),
            ("OneOf([[Overcast()], [OneOf([[Overcast()]])]])", "4:34", "inside another"),
            (
                r#"OneOf([[Overcast(), Daylight(sun: At(latitude_deg: 50.6, longitude_deg: 7, utc: "2016-05-27T23:30:00Z"))]])"#,
                "4:32",
                "below the horizon",
            ),
        ] {
            let message = field(lights, 0).err().map(|e| e.to_string()).unwrap_or_default();
            assert!(message.contains(&format!("page.ron:{place}")) && message.contains(why), "{message}");
            assert!(message.contains("\n help: "), "{message}");
        }
        let alone: LightDesc = RonFile::of("OneOf([[Overcast()]])").parse().unwrap();
        assert!(alone.build(&mut Stream::of(1, 0, Purpose::Test, 0)).is_err());
    }

    /// Rationale: all images of a dataset have the same scene hash, whichever list each of them drew. Expected: every field lists the
    /// environment maps of all lists.
    #[test]
    fn the_files_of_all_lists_belong_to_every_field() {
        let folder = tempfile::tempdir().unwrap();
        for (name, value) in [("day.hdr", 128), ("dusk.hdr", 64)] {
            let mut bytes = b"#?RADIANCE\n\n-Y 8 +X 16\n".to_vec();
            bytes.extend(std::iter::repeat_n([value, value, value, 129], 128).flatten());
            std::fs::write(folder.path().join(name), bytes).unwrap();
        }
        let page = folder.path().join("page.ron");
        let pictures = r#"OneOf([[EnvironmentMap(file: "day.hdr")], [EnvironmentMap(file: "dusk.hdr")]])"#;
        std::fs::write(&page, text(pictures)).unwrap();
        let fields: Vec<Field> =
            (0..8).map(|index| assemble::field(&page, &Options { index, ..Options::default() }).unwrap()).collect();
        for field in &fields {
            assert_eq!(field.hash, fields[0].hash);
            assert_eq!(field.files.len(), 3, "{:?}", field.files);
        }
        assert!(fields.iter().any(|f| f.conditions.lights != fields[0].conditions.lights));
        std::fs::write(&page, text(&pictures.replace("dusk", "night"))).unwrap();
        for index in 0..4 {
            let message = assemble::field(&page, &Options { index, ..Options::default() }).err().unwrap().to_string();
            assert!(message.contains("there is no file `night.hdr`"), "{message}");
        }
    }
}
