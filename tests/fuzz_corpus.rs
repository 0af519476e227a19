//! The fuzzer's corpus as an ordinary test: every file of `fuzz/corpus`, unchanged and slightly damaged, is read or
//! refused.
//!
//! Rationale: faults found by the fuzzer must not return, and nobody fuzzes before each change. Expected: no panic, no
//! hang. Source: `fuzz/src/targets.rs`, the targets of the fuzzer itself.

#[path = "../fuzz/src/targets.rs"]
mod targets;

use furrow_base::sampling::{Purpose, Stream};

/// Number of damaged variants of each file.
const BENT: u64 = 200;

#[test]
fn every_file_of_the_corpus_is_read_or_refused() {
    for (name, run) in targets::TARGETS {
        let folder = std::path::Path::new("fuzz/corpus").join(name);
        let files = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        let mut files: Vec<_> = files.map(|e| e.expect("an entry").path()).collect();
        files.sort();
        assert!(!files.is_empty(), "{name} has no corpus");
        for (number, file) in files.iter().enumerate() {
            let whole = std::fs::read(file).expect("a file");
            run(&whole);
            for k in 0..BENT {
                run(&bent(&whole, &mut Stream::of(1, number as u64, Purpose::Test, k)));
            }
        }
    }
}

/// Returns the bytes with a few of them changed, with a piece removed, or truncated.
fn bent(bytes: &[u8], stream: &mut Stream) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    if bytes.is_empty() {
        return bytes;
    }
    match stream.index(3) {
        0 => bytes.truncate(stream.index(bytes.len())),
        1 => {
            let from = stream.index(bytes.len());
            let to = (from + 1 + stream.index(16)).min(bytes.len());
            bytes.drain(from..to);
        }
        _ => {
            for _ in 0..=stream.index(4) {
                let at = stream.index(bytes.len());
                bytes[at] = stream.index(256) as u8;
            }
        }
    }
    bytes
}
