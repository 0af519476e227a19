//! GLB container: a header, a JSON chunk and a binary chunk. Source: glTF 2.0 specification, section 4.

use furrow_base::math::{ToFloat, ToInt};

const MAGIC: &[u8; 4] = b"glTF";
const JSON: &[u8; 4] = b"JSON";
const BIN: &[u8; 4] = b"BIN\0";

/// Returns `true` if the bytes start with the GLB magic number.
pub(super) fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Returns the JSON chunk and the binary chunk of a GLB file, or an error message.
pub(super) fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let number = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let (Some(version), Some(length)) = (number(4), number(8)) else {
        return Err("the file ends within its header".into());
    };
    if version != 2 {
        return Err(format!("it is glTF {version}; only glTF 2.0 can be read"));
    }
    let length = length.to_usize();
    let Some(bytes) = bytes.get(..length) else {
        return Err(format!("the file ends too early: {} of {length} bytes", bytes.len()));
    };
    let (mut at, mut json, mut own) = (12, None, None);
    while at + 8 <= length {
        let size = number(at).unwrap_or(0).to_usize();
        let kind = &bytes[at + 4..at + 8];
        let Some(data) = bytes[at + 8..].get(..size) else {
            return Err("a chunk is longer than the file".into());
        };
        if kind == JSON && json.is_none() {
            json = Some(data);
        } else if kind == BIN && own.is_none() {
            own = Some(data);
        }
        // Chunks start at multiples of four bytes; unknown ones are skipped.
        at += 8 + size.next_multiple_of(4);
    }
    json.map(|json| (json, own)).ok_or_else(|| "it has no JSON chunk".into())
}

/// Builds a GLB file from a document and its buffer. Returns an error message if the file would be too large.
pub fn join(mut json: Vec<u8>, mut own: Vec<u8>) -> Result<Vec<u8>, String> {
    json.resize(json.len().next_multiple_of(4), b' ');
    own.resize(own.len().next_multiple_of(4), 0);
    let length = 12 + 8 + json.len() + 8 + own.len();
    let Ok(total) = u32::try_from(length) else {
        return Err(format!("{:.1} GB do not fit into a GLB file, whose limit is 4.3 GB", length.to_f64() / 1e9));
    };
    let mut bytes = Vec::with_capacity(length);
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&2_u32.to_le_bytes());
    bytes.extend_from_slice(&total.to_le_bytes());
    for (kind, data) in [(JSON, json), (BIN, own)] {
        bytes.extend_from_slice(&data.len().to_u32().to_le_bytes());
        bytes.extend_from_slice(kind);
        bytes.extend_from_slice(&data);
    }
    Ok(bytes)
}
