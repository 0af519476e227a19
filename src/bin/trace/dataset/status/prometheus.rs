//! Progress of a dataset as Prometheus metrics: `trace dataset status --prometheus`.
//!
//! Source of the format: Prometheus documentation, "Exposition formats", text format 0.0.4.

use furrow_base::math::ToFloat;
use furrow_dataset::make::status::Status;
use std::fmt::Write;
use std::path::Path;

/// Returns all metrics as text. Numbers that are not known yet are left out.
pub(super) fn metrics(folder: &Path, status: &Status) -> String {
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let label = escaped(&folder.to_string_lossy());
    let all = [
        ("furrow_images", "gauge", "Images of the dataset", Some(status.images.to_f64())),
        ("furrow_images_done", "gauge", "Images that are complete", Some(status.done.to_f64())),
        ("furrow_images_failed", "gauge", "Images that ended with an error", Some(status.failures.len().to_f64())),
        ("furrow_runs_active", "gauge", "Runs that are rendering", Some(status.working.to_f64())),
        (
            "furrow_images_per_hour",
            "gauge",
            "Images per hour of all active runs",
            if status.working > 0 { status.images_per_hour } else { Some(0.0) },
        ),
        ("furrow_seconds_left", "gauge", "Estimated time until all images are complete", status.left_s),
        ("furrow_core_seconds_total", "counter", "Core seconds of finished runs", Some(status.core_s)),
        ("furrow_peak_memory_bytes", "gauge", "Largest memory of a run", status.peak_bytes.map(ToFloat::to_f64)),
    ];
    let mut text = String::new();
    for (name, kind, help, value) in all {
        if let Some(value) = value {
            // Writing to a string does not fail.
            let _ =
                writeln!(text, "# HELP {name} {help}.\n# TYPE {name} {kind}\n{name}{{dataset=\"{label}\"}} {value}");
        }
    }
    text
}

/// Escapes a label's value.
fn escaped(value: &str) -> String {
    value.replace('\\', r"\\").replace('"', "\\\"").replace('\n', r"\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn label_values_are_escaped() {
        assert_eq!(escaped("/a\\b \"c\"\nd"), r#"/a\\b \"c\"\nd"#);
    }
}
