//! Licences and sources of all dependencies of the programs and their tests.
//!
//! Rationale: redistributors of a program must comply with the licences of everything in it. Expected: each dependency
//! comes from crates.io and is available under licences of the list in `deny.toml`, and each listed licence is needed
//! by some dependency. Source: `cargo metadata`.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Returns the allowed licences, from `deny.toml`.
fn allowed() -> BTreeSet<String> {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/deny.toml")).expect("deny.toml");
    let list = text.split("\nallow = [").nth(1).and_then(|rest| rest.split(']').next()).expect("a list");
    list.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

/// Returns whether an SPDX expression is satisfied by these licences. AND is treated as binding less tightly than OR,
/// which can only refuse more; `/` is the old notation for OR.
fn can_be_met(expression: &str, allowed: &BTreeSet<String>) -> bool {
    let expression = expression.replace('/', " OR ");
    let name = |part: &str| part.trim_matches(['(', ')', ' ']).to_owned();
    expression.split(" AND ").all(|all| all.split(" OR ").any(|one| allowed.contains(&name(one))))
}

#[test]
fn every_dependency_has_an_allowed_licence_and_comes_from_crates_io() {
    let mut metadata = Command::new(env!("CARGO"));
    metadata.args(["metadata", "--format-version", "1", "--locked", "--all-features"]);
    metadata.args(["--filter-platform", "x86_64-unknown-linux-gnu"]).current_dir(env!("CARGO_MANIFEST_DIR"));
    let output = metadata.output().expect("cargo");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let list = |value: &serde_json::Value| value.as_array().expect("a list").clone();
    let used: BTreeSet<String> =
        list(&metadata["resolve"]["nodes"]).iter().map(|node| node["id"].to_string()).collect();
    let packages = list(&metadata["packages"]);
    let packages: Vec<_> = packages.iter().filter(|package| used.contains(&package["id"].to_string())).collect();
    assert!(packages.len() > 100, "{}", packages.len());

    let ours = |package: &serde_json::Value| package["name"].as_str().is_some_and(|name| name.starts_with("furrow"));
    let crates_io = "registry+https://github.com/rust-lang/crates.io-index";
    let elsewhere = packages.iter().filter(|p| !ours(p) && p["source"] != crates_io);
    assert_eq!(elsewhere.map(|p| p["id"].to_string()).collect::<Vec<_>>(), Vec::<String>::new());

    let refused = |allowed: &BTreeSet<String>| -> Vec<String> {
        let refused = packages.iter().filter(|p| !p["license"].as_str().is_some_and(|of| can_be_met(of, allowed)));
        refused.map(|p| format!("{} {}: {}", p["name"], p["version"], p["license"])).collect()
    };
    let allowed = allowed();
    assert_eq!(refused(&allowed), Vec::<String>::new(), "choose another, or allow its licence in deny.toml");
    for licence in &allowed {
        let others = allowed.iter().filter(|other| *other != licence).cloned().collect();
        assert!(!refused(&others).is_empty(), "nothing needs {licence}: take it from deny.toml");
    }
}

/// Rationale: the fuzzer is built separately and rarely, so a lock file older than `Cargo.toml` goes unnoticed, and
/// unlocked dependencies resolve to the newest version. Expected: the library's entry in the fuzzer's lock file names
/// every non-optional dependency of `Cargo.toml`. Source: both files.
#[test]
fn the_lock_file_of_the_fuzzer_names_what_the_library_is_built_of() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let lock = std::fs::read_to_string(root.join("fuzz/Cargo.lock")).expect("a lock file");
    let mut checked = 0;
    for entry in lock.split("[[package]]\n") {
        let Some(krate) = entry.strip_prefix("name = \"furrow-").and_then(|rest| rest.split('"').next()) else {
            continue;
        };
        let Ok(manifest) = std::fs::read_to_string(root.join("crates").join(krate).join("Cargo.toml")) else {
            continue;
        };
        let section = manifest.split("\n[dependencies]\n").nth(1).and_then(|rest| rest.split("\n[").next());
        let lines = section.unwrap_or_default().lines();
        let always = lines.filter(|line| line.ends_with(".workspace = true"));
        let asked: BTreeSet<&str> = always.filter_map(|line| line.strip_suffix(".workspace = true")).collect();
        let listed = entry.lines().filter_map(|line| line.strip_prefix(" \""));
        let named: BTreeSet<&str> = listed.filter_map(|line| line.split(['"', ' ']).next()).collect();
        assert!(asked.is_subset(&named), "{krate}: {asked:?} and {named:?}; build the fuzzer: sh fuzz/run.sh 1");
        checked += 1;
    }
    assert!(checked > 8, "{checked}");
}

#[test]
fn expressions_are_met_by_one_of_several_and_all_of_several() {
    let allowed = ["MIT", "ISC"].map(str::to_owned).into();
    for met in ["MIT", "MIT/Apache-2.0", "GPL-3.0-only OR MIT", "(MIT OR GPL-3.0-only) AND ISC", "ISC AND MIT"] {
        assert!(can_be_met(met, &allowed), "{met}");
    }
    for not in [
        "GPL-3.0-only",
        "",
        "MIT AND GPL-3.0-only",
        "(MIT OR ISC) AND GPL-3.0-only",
        "MIT-0",
        "Apache-2.0/GPL-3.0-only",
    ] {
        assert!(!can_be_met(not, &allowed), "{not}");
    }
}
