//! How large an OpenEXR file says it is, before anything of that size is taken.

use exr::compression::Compression;
use exr::meta::MetaData;
use std::io::{Cursor, Read, Seek};

/// Bytes of decoded pixels at most.
const LARGEST: u64 = 4 << 30;
/// Bytes that one byte of a file may stand for: deflate has at most 1032; the wavelets and blocks of the other methods have no such bound, and
/// this is far above what pictures come to.
const DEFLATED: u64 = 1100;
const OTHERWISE: u64 = 16384;

/// Pixels across and down of a file's first layer; `None` where it is no OpenEXR file.
pub(super) fn size(source: impl Read + Seek) -> Option<(usize, usize)> {
    let meta = MetaData::read_from_buffered(source, false).ok()?;
    meta.headers.first().map(|header| (header.layer_size.0, header.layer_size.1))
}

/// An error in words where the file tells of more pixels than its bytes can hold, or than are taken.
pub(crate) fn check(bytes: &[u8]) -> Result<(), String> {
    let meta =
        MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| format!("it cannot be read: {e}"))?;
    let (mut all, mut most) = (0u64, 0u64);
    for header in &meta.headers {
        let (w, h) = (header.layer_size.0 as u64, header.layer_size.1 as u64);
        all = all.saturating_add(w.saturating_mul(h).saturating_mul(header.channels.bytes_per_pixel as u64));
        let ratio = match header.compression {
            Compression::Uncompressed
            | Compression::RLE
            | Compression::ZIP1
            | Compression::ZIP16
            | Compression::PXR24 => DEFLATED,
            _ => OTHERWISE,
        };
        most = most.max(ratio.saturating_mul(bytes.len() as u64));
    }
    let told = meta.headers.first().map_or((0, 0), |header| (header.layer_size.0, header.layer_size.1));
    if all > most.min(LARGEST) {
        return Err(format!(
            "it tells of {} × {} pixels, {:.1} GiB: more than its {} bytes can hold, or than are taken",
            told.0,
            told.1,
            all as f64 / f64::from(1 << 30),
            bytes.len()
        ));
    }
    Ok(())
}
