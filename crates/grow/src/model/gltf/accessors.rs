//! Numbers in the buffers of a glTF file. Every index and byte range is checked.

use super::super::document::{Document, FLOAT, SparseBytes, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT, item};
use super::super::files::Files;
use super::super::parts::MOST_TRIANGLES;
use super::super::settle::ModelError;
use super::super::uri::{Target, follow};
use furrow_base::math::{ToFloat, ToInt};
use std::borrow::Cow;

/// Component type of signed 8-bit numbers.
const BYTE: u32 = 5120;
/// Component type of signed 16-bit numbers.
const SHORT: u32 = 5122;
/// Largest number of elements of an accessor without bytes of its own.
const MOST_ZEROS: usize = 3 * MOST_TRIANGLES;

/// Buffers of a file, and the document that describes them.
pub(super) struct Accessors<'a> {
    document: &'a Document,
    buffers: Vec<Cow<'a, [u8]>>,
}

/// Elements of an accessor, tightly packed.
struct Elements {
    bytes: Vec<u8>,
    component_type: u32,
    normalized: bool,
}

impl<'a> Accessors<'a> {
    /// Reads all buffers; `own` is the binary chunk of a GLB file.
    pub(super) fn open(
        document: &'a Document,
        own: Option<&'a [u8]>,
        files: &mut Files<'_>,
    ) -> Result<Self, ModelError> {
        let mut buffers = Vec::new();
        for (i, buffer) in document.buffers.iter().enumerate() {
            let data: Cow<'a, [u8]> = match &buffer.uri {
                None => match own {
                    Some(own) if i == 0 => own.into(),
                    _ => {
                        let meshopt = "EXT_meshopt_compression";
                        let only = if document.extensions_used.iter().any(|name| name == meshopt) {
                            format!(": its data is compressed with {meshopt}, which cannot be read")
                        } else {
                            String::new()
                        };
                        return Err(ModelError {
                            what: format!("buffer {i} has no bytes{only}"),
                            help: "export it without compression and extensions",
                        });
                    }
                },
                Some(uri) => match follow(uri)? {
                    Target::Bytes(data) => data.into(),
                    Target::File(name) => files.named(&name)?.into(),
                },
            };
            if data.len() < buffer.byte_length {
                return Err(format!("buffer {i} has {} of its {} bytes", data.len(), buffer.byte_length).into());
            }
            buffers.push(data);
        }
        Ok(Self { document, buffers })
    }

    /// Returns the bytes of a buffer view; `None` if it reaches past its buffer.
    pub(super) fn view(&self, view: usize) -> Result<Option<&[u8]>, ModelError> {
        let view = item(&self.document.buffer_views, view, "buffer view")?;
        let buffer = item(&self.buffers, view.buffer, "buffer")?;
        Ok(view.byte_offset.checked_add(view.byte_length).and_then(|end| buffer.get(view.byte_offset..end)))
    }

    /// Returns the elements of an accessor as single-precision numbers.
    pub(super) fn floats<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>, ModelError> {
        let Elements { bytes, component_type, normalized } = self.elements(index, N)?;
        let one = |whole: f32, most: f32| if normalized { (whole / most).max(-1.0) } else { whole };
        let component = |e: &[u8], i: usize| match component_type {
            BYTE => one(f32::from(e[i].cast_signed()), 127.0),
            UNSIGNED_BYTE => one(f32::from(e[i]), 255.0),
            SHORT => one(f32::from(half(e, i).cast_signed()), 32767.0),
            UNSIGNED_SHORT => one(f32::from(half(e, i)), 65535.0),
            UNSIGNED_INT => word(e, i).to_f32(),
            _ => f32::from_bits(word(e, i)),
        };
        let size = N * width(component_type).unwrap_or(1);
        Ok(bytes.chunks_exact(size).map(|e| std::array::from_fn(|i| component(e, i))).collect())
    }

    /// Returns the elements of an accessor as indices.
    pub(super) fn whole<const N: usize>(&self, index: usize) -> Result<Vec<[u32; N]>, ModelError> {
        let Elements { bytes, component_type, .. } = self.elements(index, N)?;
        integers(&bytes, component_type)
            .ok_or_else(|| format!("accessor {index} holds indices that are not integers").into())
    }

    /// Returns the elements of an accessor: those of its buffer view, or zeros, overridden by its sparse ones.
    fn elements(&self, index: usize, components: usize) -> Result<Elements, ModelError> {
        let accessor = item(&self.document.accessors, index, "accessor")?;
        let words = |what: &str| format!("accessor {index} {what}");
        let kind = match components {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        if accessor.kind != kind {
            return Err(words(&format!("holds {} where {kind} is needed", accessor.kind)).into());
        }
        let unknown = || words(&format!("has the unknown component type {}", accessor.component_type));
        let size = components * width(accessor.component_type).ok_or_else(unknown)?;
        let mut bytes = match accessor.buffer_view {
            Some(view) => {
                let stride = item(&self.document.buffer_views, view, "buffer view")?.byte_stride.unwrap_or(size);
                if stride < size {
                    return Err(words(&format!("has elements of {size} bytes every {stride} bytes")).into());
                }
                let data = self.view(view)?.and_then(|data| data.get(accessor.byte_offset..));
                packed(data, (accessor.count, size, stride)).ok_or_else(|| words("reaches past its bytes"))?
            }
            None if accessor.count > MOST_ZEROS => return Err(words("has too many elements").into()),
            None => vec![0; accessor.count * size],
        };
        if let Some(sparse) = &accessor.sparse {
            let part = |of: &SparseBytes, size: usize| {
                let data = self.view(of.buffer_view)?.and_then(|data| data.get(of.byte_offset..));
                let packed = packed(data, (sparse.count, size, size));
                packed.ok_or_else(|| ModelError::from(words("has sparse elements past their bytes")))
            };
            let kind = sparse.indices.component_type.unwrap_or_default();
            let places = part(&sparse.indices, width(kind).ok_or_else(unknown)?)?;
            let places =
                integers::<1>(&places, kind).ok_or_else(|| words("has sparse indices that are not integers"))?;
            let values = part(&sparse.values, size)?;
            for ([place], value) in places.into_iter().zip(values.chunks_exact(size)) {
                let at = place.to_usize().checked_mul(size).and_then(|at| bytes.get_mut(at..)?.get_mut(..size));
                at.ok_or_else(|| words("has a sparse element past its end"))?.copy_from_slice(value);
            }
        }
        Ok(Elements { bytes, component_type: accessor.component_type, normalized: accessor.normalized })
    }
}

/// Returns `count` elements of `size` bytes, one every `stride` bytes; `None` if the data are too short.
fn packed(data: Option<&[u8]>, (count, size, stride): (usize, usize, usize)) -> Option<Vec<u8>> {
    let data = data?;
    if count == 0 {
        return Some(Vec::new());
    }
    let needed = (count - 1).checked_mul(stride)?.checked_add(size)?;
    let data = data.get(..needed)?;
    Some(data.chunks(stride).flat_map(|element| &element[..size]).copied().collect())
}

/// Returns integers of this component type; `None` if it is none of unsigned integers.
fn integers<const N: usize>(bytes: &[u8], component_type: u32) -> Option<Vec<[u32; N]>> {
    let component = |e: &[u8], i: usize| match component_type {
        UNSIGNED_BYTE => u32::from(e[i]),
        UNSIGNED_SHORT => u32::from(half(e, i)),
        _ => word(e, i),
    };
    let unsigned = [UNSIGNED_BYTE, UNSIGNED_SHORT, UNSIGNED_INT].contains(&component_type);
    let size = N * width(component_type).filter(|_| unsigned)?;
    Some(bytes.chunks_exact(size).map(|e| std::array::from_fn(|i| component(e, i))).collect())
}

/// Returns the bytes of a component.
fn width(component_type: u32) -> Option<usize> {
    match component_type {
        BYTE | UNSIGNED_BYTE => Some(1),
        SHORT | UNSIGNED_SHORT => Some(2),
        UNSIGNED_INT | FLOAT => Some(4),
        _ => None,
    }
}

fn half(bytes: &[u8], i: usize) -> u16 {
    u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]])
}

fn word(bytes: &[u8], i: usize) -> u32 {
    u32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
}
