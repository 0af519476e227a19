//! The command that renders one image of a dataset again.

use crate::model::recipe::Recipe;
use furrow_base::shell::quoted;
use furrow_render::settings::Engine;
use maud::{Markup, html};

/// Placeholder for the number of the field.
const INDEX: &str = "INDEX";
/// Placeholder for the number of the light.
const LIGHT: &str = "LIGHT";
/// Placeholder for the number of the image.
const IMAGE: &str = "IMAGE";

/// Returns the field for the number of an image, and the command that renders it with `trace`, in the dataset's folder.
/// Empty for datasets whose images `trace` does not render one by one: imported, labels only, ablations, drives and days.
pub(super) fn section(recipe: &Recipe) -> Markup {
    let Some(command) = command(recipe) else { return html! {} };
    let last = recipe.count.saturating_sub(1);
    html! {
        p.again {
            label { "Render image " input #again type="number" min="0" max=(last) value="0"; " again, in the folder of the dataset:" }
        }
        pre {
            code #command data-command=(command) data-lights=(recipe.lights()) {
                ([INDEX, LIGHT, IMAGE].iter().fold(command.clone(), |command, number| command.replace(number, "0")))
            }
        }
    }
}

fn command(recipe: &Recipe) -> Option<String> {
    let made = recipe.rendering().ok()?;
    if made.labels_only || made.edit.is_some() || recipe.has_sequences() {
        return None;
    }
    let mut words = vec!["trace".to_owned()];
    let mut option = |name: &str, value: &dyn ToString| words.extend([name.to_owned(), value.to_string()]);
    option("--scene", &made.scene);
    option("--seed", &made.seed);
    option("--index", &INDEX);
    if recipe.lights() > 1 {
        option("--light", &LIGHT);
    }
    option("--width", &made.width);
    option("--height", &made.height);
    option("--spp", &made.spp);
    if made.engine != Engine::Trace {
        option("--engine", &made.engine.name());
    }
    if !made.without.is_empty() {
        option("--without", &made.without.iter().map(|technique| technique.name()).collect::<Vec<_>>().join(","));
    }
    // The preset sets the maximum depth.
    if let Some(preset) = made.quality {
        option("--quality", &preset.name());
    } else if let Some(depth) = made.max_depth {
        option("--max-depth", &depth);
    }
    if let Some(clamp) = made.clamp {
        option("--clamp", &clamp);
    }
    words.extend(made.denoise.then(|| "--denoise".to_owned()));
    words.extend(["--out".to_owned(), format!("out/{IMAGE}")]);
    Some(words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" "))
}
