//! Tools of the system tests.
#![allow(dead_code, reason = "no test uses all of them")]

pub(crate) mod chi2;
