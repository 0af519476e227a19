//! Exact optical flow and disparity: `NAME.exr`, in single precision.
//!
//! | channels | contents |
//! |---|---|
//! | `next.x`, `next.y` | displacement of the point at a pixel's centre in the next frame of the same camera, pixels right and down |
//! | `next.visible` | 1 if that frame shows the point, 0 if the point is outside the frame or occluded |
//! | `CAMERA.x`, `.y`, `.visible` | the same for the other cameras of the same frame; for a side-by-side stereo pair, disparity is −x |
//!
//! Values are NaN where a pixel shows nothing, or a point behind the other camera. A field's last frame has no `next`,
//! and an image without flow to any other has one channel, `none`, of zeros. If each field has one image per day, there
//! are no files. Lens distortion and rolling shutter of both images are included.
//!
//! Source: the surface at each pixel's centre, as in the labels, and the cameras; nothing is matched.

use super::Format;
use crate::model::recipe::Recipe;
use crate::model::sample::{Flow, Sample};
use crate::File;
use furrow_base::Result;

pub(super) struct Writer;

const FOLDER: &str = "flow";

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        if !self.has_images(recipe) {
            return Ok(Vec::new());
        }
        let record = &sample.record;
        let rendered = sample.rendered(FOLDER)?;
        let mut planes: Vec<(String, Vec<f32>)> = rendered.flows.iter().flat_map(planes).collect();
        if planes.is_empty() {
            planes.push(("none".into(), vec![0.0; sample.pixels()]));
        }
        let bytes = furrow_output::encode_planes(record.width, record.height, planes)?;
        Ok(vec![File { path: format!("{FOLDER}/{}.exr", record.name), bytes }])
    }

    fn has_images(&self, recipe: &Recipe) -> bool {
        recipe.views_a_day() > 1
    }

    fn needs_photograph(&self) -> bool {
        false
    }

    fn needs_flow(&self) -> bool {
        true
    }

    fn warnings(&self, recipe: &Recipe) -> Vec<String> {
        let words = "each field has one image a day, so there is no flow; `drive` in a scene file takes several";
        if self.has_images(recipe) { Vec::new() } else { vec![words.to_owned()] }
    }
}

fn planes(Flow { to, pixels, visible }: &Flow) -> [(String, Vec<f32>); 3] {
    let axis = |i: usize| pixels.iter().map(|moved| moved[i]).collect();
    let seen = visible.iter().map(|visible| f32::from(u8::from(*visible))).collect();
    [(format!("{to}.x"), axis(0)), (format!("{to}.y"), axis(1)), (format!("{to}.visible"), seen)]
}
