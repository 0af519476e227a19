//! Images decoded once, the noise they are drawn with, and the maps derived from them.

pub mod noise;
