//! Fuzzer: runs libFuzzer on the target named by the environment variable `FUZZ`. `run.sh` builds and starts it.
#![no_main]

mod targets;

use std::sync::OnceLock;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    static RUN: OnceLock<fn(&[u8])> = OnceLock::new();
    let run = RUN.get_or_init(|| {
        let name = std::env::var("FUZZ").expect("FUZZ is set to a target");
        targets::TARGETS.iter().find(|(known, _)| *known == name).expect("FUZZ is one of the targets").1
    });
    run(bytes);
});
