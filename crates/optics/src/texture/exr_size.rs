//! Size declared in an OpenEXR header, checked before memory of that size is allocated.

use exr::compression::Compression;
use exr::meta::MetaData;
use furrow_base::math::{ToFloat, ToInt};
use std::io::{Cursor, Read, Seek};

/// Largest size of decoded pixels in bytes.
const LARGEST: u64 = 4 << 30;
/// Largest plausible compression ratio. Deflate reaches at most 1032; the wavelet and block methods have no such bound,
/// and their value is far above that of real images.
const DEFLATED: u64 = 1100;
const OTHERWISE: u64 = 16384;

/// Returns width and height of a file's first layer; `None` if it is not an OpenEXR file.
pub(super) fn size(source: impl Read + Seek) -> Option<(usize, usize)> {
    let meta = MetaData::read_from_buffered(source, false).ok()?;
    meta.headers.first().map(|header| (header.layer_size.0, header.layer_size.1))
}

/// Fails with a message if the header declares more pixels than the file's bytes can hold or than the limit allows.
pub fn check(bytes: &[u8]) -> Result<(), String> {
    let meta =
        MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| format!("it cannot be read: {e}"))?;
    let (mut all, mut most) = (0u64, 0u64);
    for header in &meta.headers {
        let (w, h) = (header.layer_size.0.to_u64(), header.layer_size.1.to_u64());
        all = all.saturating_add(w.saturating_mul(h).saturating_mul(header.channels.bytes_per_pixel.to_u64()));
        let ratio = match header.compression {
            Compression::Uncompressed
            | Compression::RLE
            | Compression::ZIP1
            | Compression::ZIP16
            | Compression::PXR24 => DEFLATED,
            _ => OTHERWISE,
        };
        most = most.max(ratio.saturating_mul(bytes.len().to_u64()));
    }
    let header_size = meta.headers.first().map_or((0, 0), |header| (header.layer_size.0, header.layer_size.1));
    if all > most.min(LARGEST) {
        return Err(format!(
            "its header declares {} × {} pixels, {:.1} GiB: more than its {} bytes can hold or above the limit",
            header_size.0,
            header_size.1,
            all.to_f64() / f64::from(1 << 30),
            bytes.len()
        ));
    }
    Ok(())
}
