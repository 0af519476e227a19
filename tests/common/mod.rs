//! Shared by the system tests.
#![allow(dead_code)]

pub mod scenes;
