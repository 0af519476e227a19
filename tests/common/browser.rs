//! A headless browser for tests of HTML pages.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Finds Chromium by the executable names in use on different systems.
///
/// Prints a note and returns `None` if none is installed; with `FURROW_REQUIRE_PEERS=1` it panics instead.
pub fn browser() -> Option<PathBuf> {
    let works = |name: &&str| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success());
    let found = ["chromium", "chromium-browser", "google-chrome"].into_iter().find(works).map(PathBuf::from);
    if found.is_none() {
        let required = std::env::var_os("FURROW_REQUIRE_PEERS").is_some_and(|v| v == "1");
        assert!(!required, "no Chromium: apt-get install chromium");
        eprintln!("skipped: no Chromium");
    }
    found
}

/// Opens `page` in a window of the given width and returns the JSON that a script in the page stored in
/// `document.body.dataset.probe`. `folder` holds the browser's profile. Panics if the browser's console reports
/// anything.
pub fn probe(browser: &Path, folder: &Path, page: &Path, width: i64) -> Value {
    let profile = folder.join(format!("profile-{width}"));
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--hide-scrollbars"])
        .arg("--dump-dom")
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("--window-size={width},900"))
        .arg(format!("file://{}", page.display()))
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    let console: Vec<&str> = message.lines().filter(|l| l.contains("CONSOLE")).collect();
    assert_eq!(console, Vec::<&str>::new(), "the browser's console");
    let dom = String::from_utf8_lossy(&output.stdout);
    let probe = dom.split("data-probe=\"").nth(1).and_then(|rest| rest.split('"').next());
    serde_json::from_str(&probe.unwrap_or_else(|| panic!("{message}")).replace("&quot;", "\"")).unwrap()
}
