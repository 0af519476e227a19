//! Description of a species' plant in the species file, and the stage of one plant.

use super::flower_desc::FlowerDesc;
use super::inflorescence_check;
use super::kind::LeafKind;
use super::senescence::SenescenceDesc;
use super::stage::{MOST_SHOOTS, StageDesc, Tilt};
use super::twine::TwineDesc;
use furrow_base::math::ToFloat;
use furrow_base::ron_file::{self, NonNegative, Num, Positive, Signed, Step, Vary};
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;

/// Calls a macro with the list of growth forms. Each is a name in species files and a file with a `grow(&Growth) ->
/// Vec<Organ>`.
macro_rules! forms {
    ($call:ident) => {
        $call! {
            /// All leaves on one crown at the soil.
            Rosette => rosette,
            /// Whorls of sessile leaves on a square stem.
            Whorl => whorl,
            /// Stalked leaves on an upright stem, or on several stems from one place (`tillers`).
            Erect => erect,
            /// A rosette of finely divided leaves.
            Dissected => dissected,
            /// Grass: sheaths, arching blades in two ranks, tillers.
            Tuft => tuft,
            /// Stout grass: one shoot of rolled sheaths with large arching blades in two ranks.
            Cane => cane,
            /// Main shoot and side shoots from its lowest axils; stems too long for their width lie on the soil.
            Runner => runner,
        }
    };
}
pub(super) use forms;

macro_rules! declare {
    ($($(#[$doc:meta])* $name:ident => $file:ident,)*) => {
        /// Growth form of a plant.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
        pub enum Form { $($(#[$doc])* $name,)* }
    };
}
forms!(declare);

/// Plant of a species.
///
/// ```
/// let plant: furrow_grow::plant::PlantDesc = ron::from_str(r#"(
///     form: Rosette,
///     kinds: {
///         "cotyledon": (shape: Sheet(outline: Power(a: 0.45, b: 0.45)), organ: Cotyledon),
///         "leaf": (shape: Sheet(outline: Power(a: 0.55, b: 1.0)), wave: 0.015),
///     },
///     stages: [
///         (bbch: 10, days: 4, hypocotyl_mm: 10, stem_mm: 1.5, layers: [
///             (kind: "cotyledon", leaves: 2, blade_mm: 20, width_mm: 7, stalk_mm: 4, angle_deg: 70),
///         ]),
///         (bbch: 12, days: 15, hypocotyl_mm: 10, stem_mm: 2, layers: [
///             (kind: "cotyledon", leaves: 2, blade_mm: 24, width_mm: 8, stalk_mm: 5, angle_deg: 80),
///             (kind: "leaf", leaves: 2, alpha: 0.5, blade_mm: Uniform(30, 38), width_mm: 20, stalk_mm: 12,
///              angle_deg: Uniform(40, 55), bend_deg: 20, fold_deg: 25),
///         ]),
///     ],
/// )"#).unwrap();
/// assert!(ron::from_str::<furrow_grow::plant::PlantDesc>("(form: Rosette, kinds: {}, stages: [])").is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, schemars::JsonSchema)]
pub struct PlantDesc {
    /// Growth form.
    pub form: Form,
    /// Kinds of leaves, by name. The name is also the default key of the blades' material in the species' `materials`.
    pub kinds: BTreeMap<String, LeafKind>,
    /// Flowers and fruits, by the names that the `inflorescences` of the stages use.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    #[schemars(default)]
    #[schemars(extend("x-example" = "{\"daisy\": Head(disc: 0.4, florets: 200, rings: [])}", "x-beside" = "inflorescences"))]
    pub flowers: BTreeMap<String, FlowerDesc>,
    /// Growth stages, youngest first.
    pub stages: Vec<StageDesc>,
    /// CSV file with the leaves of all stages, in the folder of the species file; the stages then have no `layers`. Its
    /// header names the columns `leaf` (1 for the oldest), `stage` (a BBCH code of `stages`), `kind`, `blade_mm`,
    /// `width_mm`, `angle_deg` and, optionally, `petiole_mm` (of a grass: the sheath), `leaves`, `alpha`, `pitch_deg`,
    /// `bend_deg`, `fold_deg` and `internode_mm`. A cell holds a number or a range (`10..15`); an empty cell keeps the
    /// previous stage's value. `#` starts a comment line.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[schemars(default)]
    #[schemars(extend("x-example" = "\"capsella.csv\""))]
    pub leaves: String,
    /// Age in days at which the crop, at its ordinary spacing, reaches the ground cover of a BBCH code of principal
    /// stage 3: 31 means 10 %, 33 means 30 %, 39 means 90 %. Such a code then selects this age, and the leaves still
    /// follow the stages, by age. Source of the codes: Meier 2001. If empty, all codes are those of the stages.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    #[schemars(default)]
    #[schemars(extend("x-example" = "{31: 32, 33: 44, 39: 60}"))]
    pub cover_days: BTreeMap<u32, Num<NonNegative<1000>>>,
    /// Factor on all sizes of one plant.
    #[schemars(default = "vigour")]
    pub vigour: Vary<Positive<100>>,
    /// Factor on the sizes of one leaf, drawn for each leaf (the random factor r of Di Cicco et al. 2017).
    #[schemars(default = "size")]
    pub size: Vary<Positive<100>>,
    /// Deviation of a leaf's azimuth from its place in the layer.
    #[schemars(default = "azimuth")]
    pub azimuth_deg: Vary<Signed<360>>,
    /// Angle between the axis and the vertical.
    #[schemars(default = "lean")]
    pub lean_deg: Vary<Tilt>,
    /// Two ratios of length to width of a stem of a `Runner` or `Whorl`: above the first it sinks under its own weight,
    /// at the second it lies on the soil.
    #[schemars(default = "lies_at")]
    pub lies_at: (Num<Positive<1000>>, Num<Positive<1000>>),
    /// How shoots of a `Runner` twine upwards, around each other or around an invisible support. If absent, all shoots
    /// creep.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(default)]
    #[schemars(extend("x-example" = "(share: 0.6, radius_mm: Uniform(2, 4), pitch_mm: Uniform(25, 45), height_mm: Uniform(80, 160))"))]
    pub twine: Option<TwineDesc>,
    /// How old leaves yellow, dry and fall.
    #[serde(skip_serializing_if = "SenescenceDesc::is_default")]
    #[schemars(default, extend("x-example" = "(days: Uniform(14, 20))"))]
    pub senescence: SenescenceDesc,
    /// Material of the hypocotyl; if empty, `"stalk"`.
    #[schemars(default)]
    #[schemars(extend("x-example" = "\"leaf\""))]
    pub hypocotyl_material: String,
    /// Material of the stem; if empty, `"stalk"`.
    #[schemars(default)]
    #[schemars(extend("x-example" = "\"leaf\""))]
    pub stem_material: String,
}

/// The fields of [`PlantDesc`] before their cross-checks.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename = "PlantDesc")]
struct Written {
    form: Form,
    #[serde(deserialize_with = "ron_file::entries")]
    kinds: BTreeMap<String, LeafKind>,
    #[serde(default, deserialize_with = "ron_file::entries")]
    flowers: BTreeMap<String, FlowerDesc>,
    stages: Vec<StageDesc>,
    #[serde(default)]
    leaves: String,
    #[serde(default)]
    cover_days: BTreeMap<u32, Num<NonNegative<1000>>>,
    #[serde(default = "vigour")]
    vigour: Vary<Positive<100>>,
    #[serde(default = "size")]
    size: Vary<Positive<100>>,
    #[serde(default = "azimuth")]
    azimuth_deg: Vary<Signed<360>>,
    #[serde(default = "lean")]
    lean_deg: Vary<Tilt>,
    #[serde(default = "lies_at")]
    lies_at: (Num<Positive<1000>>, Num<Positive<1000>>),
    #[serde(default)]
    twine: Option<TwineDesc>,
    #[serde(default)]
    senescence: SenescenceDesc,
    #[serde(default)]
    hypocotyl_material: String,
    #[serde(default)]
    stem_material: String,
}

fn vigour() -> Vary<Positive<100>> {
    Vary::uniform(0.94, 1.06)
}

fn size() -> Vary<Positive<100>> {
    Vary::uniform(0.93, 1.07)
}

fn azimuth() -> Vary<Signed<360>> {
    Vary::uniform(-10.0, 10.0)
}

fn lean() -> Vary<Tilt> {
    Vary::uniform(0.0, 5.0)
}

/// Gives every stage without layers the layers of the stage before.
fn kept(mut stages: Vec<StageDesc>) -> Vec<StageDesc> {
    for i in 1..stages.len() {
        if stages[i].layers.is_empty() {
            let (before, later) = stages.split_at_mut(i);
            later[0].layers.clone_from(&before[i - 1].layers);
        }
    }
    stages
}

fn lies_at() -> (Num<Positive<1000>>, Num<Positive<1000>>) {
    (Num::new(40.0), Num::new(105.0))
}

impl<'de> Deserialize<'de> for PlantDesc {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        ron_file::from_raw(deserializer, |raw| {
            let w: Written = ron_file::parse_in(raw)?;
            let desc = Self {
                form: w.form,
                kinds: w.kinds,
                flowers: w.flowers,
                stages: kept(w.stages),
                leaves: w.leaves,
                cover_days: w.cover_days,
                vigour: w.vigour,
                size: w.size,
                azimuth_deg: w.azimuth_deg,
                lean_deg: w.lean_deg,
                lies_at: w.lies_at,
                twine: w.twine,
                senescence: w.senescence,
                hypocotyl_material: w.hypocotyl_material,
                stem_material: w.stem_material,
            };
            desc.check_at().map_err(|(at, message, help)| ron_file::inside(raw, &at, message, help))?;
            Ok(desc)
        })
    }
}

impl PlantDesc {
    /// Returns an error message if fields contradict each other. A species file that was read has passed this check.
    pub fn check(&self) -> Result<(), String> {
        self.check_at().map_err(|(_, message, _)| message)
    }

    /// Runs the check of [`PlantDesc::check`]. An error holds the place in the species file, the message and a hint.
    fn check_at(&self) -> Result<(), (Vec<Step<'static>>, String, String)> {
        use Step::{Field, Item};
        if self.stages.is_empty() {
            let help = "write (bbch: 10, days: 4, hypocotyl_mm: 8, stem_mm: 1, layers: […])";
            return Err((vec![Field("stages")], "a plant needs at least one stage".into(), help.into()));
        }
        if self.lies_at.0.get() >= self.lies_at.1.get() {
            let message = "a stem must start to sink at a smaller ratio than it lies down at".into();
            return Err((vec![Field("lies_at")], message, "write (40, 105): the second ratio is the larger".into()));
        }
        if let Some((name, field)) = self.kinds.iter().find_map(|(name, kind)| Some((name, kind.unordered()?))) {
            let message =
                format!("{field} of the kind \"{name}\" must rise between 0 and 1, with one position for each");
            return Err((vec![Field("kinds")], message, format!("write {field}: [0.2, 0.5, 0.8]")));
        }
        for (i, stage) in self.stages.iter().enumerate() {
            let mut at = vec![Field("stages"), Item(i), Field("layers")];
            let leaves: f64 = stage.layers.iter().map(|l| l.leaves.get()).sum();
            if leaves > 1000.0 {
                let message = format!("{leaves} leaves at BBCH {}: a plant may have at most 1000", stage.bbch);
                return Err((at, message, "write fewer layers, or fewer leaves in each".into()));
            }
            for (field, shoots) in [("tillers", &stage.tillers), ("branches", &stage.branches)] {
                let most = shoots.largest().round();
                if most > MOST_SHOOTS.to_f64() {
                    let at = vec![Field("stages"), Item(i), Field(field)];
                    let message = format!("up to {most} side shoots at BBCH {}", stage.bbch);
                    let help =
                        format!("a shoot bears at most {MOST_SHOOTS}: bound the distribution, max: {MOST_SHOOTS}");
                    return Err((at, message, help));
                }
            }
            if let Some(k) = stage.layers.iter().position(|l| !self.kinds.contains_key(&l.kind)) {
                at.extend([Item(k), Field("kind")]);
                let kind = &stage.layers[k].kind;
                let known: Vec<&str> = self.kinds.keys().map(String::as_str).collect();
                let message = format!("no kind of leaf is called \"{kind}\"");
                return Err((at, message, ron_file::choose("kinds", &known, kind)));
            }
        }
        for (name, flower) in &self.flowers {
            flower
                .check()
                .map_err(|(message, help)| (vec![Field("flowers")], format!("\"{name}\": {message}"), help))?;
        }
        (0..self.stages.len())
            .try_for_each(|i| inflorescence_check::stage((&self.flowers, &self.kinds), &self.stages, i))?;
        let days: Vec<f64> = self.cover_days.values().map(|d| d.get()).collect();
        if days.windows(2).any(|pair| pair[1] <= pair[0]) {
            let message = "a higher BBCH code must have a later day of ground cover".into();
            return Err((
                vec![Field("cover_days")],
                message,
                "write {31: 32, 33: 44}: days increase with the codes".into(),
            ));
        }
        for (i, pair) in self.stages.windows(2).enumerate() {
            let [from, to] = pair else { continue };
            let wrong = |field: Step<'static>, what: &str, help: &str| {
                let at = vec![Field("stages"), Item(i + 1), field];
                Err((at, format!("between BBCH {} and {}: {what}", from.bbch, to.bbch), help.to_owned()))
            };
            if to.bbch <= from.bbch {
                return wrong(Field("bbch"), "stages must rise in bbch and in days", "write the youngest stage first");
            }
            if to.days.get() <= from.days.get() {
                return wrong(Field("days"), "stages must rise in bbch and in days", "write the youngest stage first");
            }
            if to.layers.len() < from.layers.len() {
                return wrong(Field("layers"), "layers are lost", "write blade_mm: 0 for a leaf that has died");
            }
            let differs = |k: &usize| {
                let (a, b) = (&from.layers[*k], &to.layers[*k]);
                a.kind != b.kind || a.leaves != b.leaves
            };
            if let Some(k) = (0..from.layers.len()).find(differs) {
                let at = vec![Field("stages"), Item(i + 1), Field("layers"), Item(k)];
                let message = format!(
                    "between BBCH {} and {}: a layer changes its kind or its number of leaves",
                    from.bbch, to.bbch
                );
                return Err((at, message, "new layers come after those of the stage before".into()));
            }
        }
        Ok(())
    }

    /// Returns the keys in the species' `materials` that the organs of this plant use, sorted.
    pub fn materials(&self) -> Vec<String> {
        let own = |s: &str| if s.is_empty() { "stalk".to_owned() } else { s.to_owned() };
        let mut keys = vec![own(&self.hypocotyl_material), own(&self.stem_material)];
        for (name, kind) in &self.kinds {
            keys.push(if kind.material.is_empty() { name.clone() } else { kind.material.clone() });
            keys.push(kind.stalk_material.clone());
        }
        keys.extend(self.flowers.values().flat_map(FlowerDesc::materials).map(str::to_owned));
        let axes = self.stages.iter().flat_map(|stage| &stage.inflorescences);
        keys.extend(axes.map(|axis| axis.material.clone()).filter(|material| !material.is_empty()));
        keys.sort();
        keys.dedup();
        keys
    }

    /// Returns the days after emergence of the first and of the last stage.
    pub fn days(&self) -> (f32, f32) {
        let day = |s: Option<&StageDesc>| s.map_or(0.0, |s| s.days.f32());
        (day(self.stages.first()), day(self.stages.last()))
    }
}

/// Growth stage of a plant, by age or by BBCH code.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// Days after emergence. An age outside the range of the species file's stages is clamped to the nearest stage.
    Age(f32),
    /// BBCH code. Where the species file gives ages of ground cover (see [`PlantDesc::cover_days`]) the code selects
    /// that age, else the stage. Between two stages of the species file their values are interpolated.
    Bbch(u32),
}
