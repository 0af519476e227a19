//! Scene files of requests, kept until the text or a file that they name changes.

use furrow_base::input::shipped;
use furrow_base::ron_file::{RonFile, from_json};
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_field::ablation::Edit;
use furrow_field::desc::FieldDesc;
use furrow_job::SceneFile;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Name of the file in errors about a scene that is given as JSON.
const UNNAMED: &str = "<scene>";

/// A scene file, by its path or as JSON.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneSource {
    /// The scene file, or the name of a shipped one.
    pub(super) file: Option<PathBuf>,
    /// A scene as JSON.
    pub(super) scene: Option<serde_json::Value>,
    /// Folder that the paths of a scene as JSON are relative to.
    #[serde(default)]
    pub(super) folder: PathBuf,
}

impl SceneSource {
    /// Returns the source of a scene file on disk.
    pub(super) fn of(file: PathBuf) -> Self {
        Self { file: Some(file), scene: None, folder: PathBuf::new() }
    }

    /// Returns the path of the scene file.
    pub(super) fn path(&self) -> PathBuf {
        self.file.clone().map_or_else(|| self.folder.join(UNNAMED), shipped::scene_file)
    }

    /// Returns the checked text of the scene file.
    pub(super) fn text(&self) -> Result<String> {
        let page = self.page()?;
        page.parse_all::<FieldDesc>()?;
        Ok(page.text)
    }

    fn page(&self) -> Result<RonFile> {
        let path = self.path();
        Ok(match (&self.scene, &self.file) {
            (Some(scene), None) => RonFile { path, text: from_json::<FieldDesc>("Field", scene) },
            (None, Some(_)) => {
                cli::check_scene(&path)?;
                RonFile::read(&path)?
            }
            _ => return Err(Error::misuse("a request names either a file or a scene").help("see `trace serve --help`")),
        })
    }

    /// Returns the text with absolute paths of the files that it names, so that it can be saved anywhere.
    pub(super) fn absolute_text(&self) -> Result<String> {
        let page = RonFile { path: self.path(), text: self.text()? };
        let full = |name: &str| {
            let file = page.resolve(name);
            let file = file.is_file().then(|| std::path::absolute(file).ok()).flatten()?;
            Some(file.to_string_lossy().into_owned())
        };
        Ok(page.replace_quoted(full).unwrap_or(page.text))
    }
}

/// Size and modification time of a file; `None` if it does not exist.
type Stamp = Option<(u64, SystemTime)>;

fn stamp(file: &Path) -> Stamp {
    let about = file.metadata().ok()?;
    Some((about.len(), about.modified().ok()?))
}

/// The scene file of the last request.
#[derive(Default)]
pub(super) struct Kept {
    known: Option<(PathBuf, &'static str, String, SceneFile)>,
    /// The files that were read for it, as they were.
    files: Vec<(PathBuf, Stamp)>,
}

impl Kept {
    /// Returns the scene file of a request with an edit. What did not change since the last request is not read again.
    pub(super) fn scene(&mut self, source: &SceneSource, edit: &'static Edit) -> Result<SceneFile> {
        // Parsed below, where an error contains all mistakes.
        let RonFile { path, text } = source.page()?;
        let scene = match self.known.take() {
            Some((known_path, name, known, scene)) if (&known_path, name) == (&path, edit.name) => {
                let same = known == text && self.files.iter().all(|(file, before)| stamp(file) == *before);
                if same { scene } else { scene.reread(Some(&text))? }
            }
            _ => SceneFile::of_text(&path, &text, edit)?,
        };
        self.known = Some((path, edit.name, text, scene.clone()));
        self.files.clear();
        Ok(scene)
    }

    /// Notes the files that were read for the scene file.
    pub(super) fn read(&mut self, files: &[PathBuf]) {
        self.files = files.iter().map(|file| (file.clone(), stamp(file))).collect();
    }
}
