//! Weights as safetensors files, which any trainer reads. The header holds one entry of Furrow: a checksum over everything, and
//! a text.

use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};
use furrow_output::write_atomically;
use half::{bf16, f16};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::path::Path;

/// Single-precision tensor, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Name.
    pub name: String,
    /// Size along each axis; empty for a scalar.
    pub shape: Vec<usize>,
    /// Values.
    pub values: Vec<f32>,
}

impl Array {
    /// Converts a tensor of a file. Returns `None` unless it holds floating-point numbers of 16, 32 or 64 bits.
    fn of(name: String, view: &TensorView<'_>) -> Option<Self> {
        let bytes = view.data();
        let values = match view.dtype() {
            Dtype::F32 => bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
            Dtype::F16 => bytes.as_chunks().0.iter().map(|b| f16::from_le_bytes(*b).to_f32()).collect(),
            Dtype::BF16 => bytes.as_chunks().0.iter().map(|b| bf16::from_le_bytes(*b).to_f32()).collect(),
            Dtype::F64 => bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b).to_f32()).collect(),
            _ => return None,
        };
        Some(Self { name, shape: view.shape().to_vec(), values })
    }

    /// Returns the array rounded to half precision: 11 significant bits; values above 65504 become infinite.
    #[must_use]
    pub fn halved(&self) -> Self {
        Self { values: self.values.iter().map(|v| f16::from_f32(*v).to_f32()).collect(), ..self.clone() }
    }
}

/// Number format of the values in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stored {
    /// Single precision: four bytes each.
    Single,
    /// Half precision: two bytes each. Values of [`Array::halved`] are stored without loss.
    Half,
}

impl Stored {
    fn of(self, values: &[f32]) -> Vec<u8> {
        match self {
            Self::Single => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            Self::Half => values.iter().flat_map(|v| f16::from_f32(*v).to_le_bytes()).collect(),
        }
    }

    fn dtype(self) -> Dtype {
        match self {
            Self::Single => Dtype::F32,
            Self::Half => Dtype::F16,
        }
    }
}

/// The only key in the header's metadata. Several keys would be written in the arbitrary order of a hash map.
const KEY: &str = "furrow";

/// Writes arrays with a text, atomically and in single precision. Equal content gives equal bytes.
pub fn write(path: &Path, arrays: &[Array], text: &str) -> Result<()> {
    write_atomically(path, &encode(path, arrays, text, Stored::Single)?)
}

/// Encodes arrays and a text as the bytes of a file. `path` is only used in errors.
pub fn encode(path: &Path, arrays: &[Array], text: &str, stored: Stored) -> Result<Vec<u8>> {
    let bytes: Vec<Vec<u8>> = arrays.iter().map(|a| stored.of(&a.values)).collect();
    let fault = |e: &dyn std::fmt::Display| unusable(path, &format!("it cannot be written: {e}"));
    let mut views = Vec::new();
    for (array, bytes) in arrays.iter().zip(&bytes) {
        let view = TensorView::new(stored.dtype(), array.shape.clone(), bytes).map_err(|e| fault(&e))?;
        views.push((array.name.as_str(), view));
    }
    let header = HashMap::from([(KEY.to_owned(), format!("{}\n{text}", checksum(arrays, text)))]);
    safetensors::serialize(views, &Some(header)).map_err(|e| fault(&e))
}

/// Reads a file that [`write()`] wrote: its arrays, sorted by name, and its text.
///
/// # Errors
/// If the file is damaged or was written by another program.
pub fn read(path: &Path) -> Result<(Vec<Array>, String)> {
    let damaged = |e: &dyn std::fmt::Display| {
        Error::damaged(format!("this is not a weights file of `train`, or it is damaged: {e}"))
            .help("restore it or train again, with another --out")
            .in_file(path)
    };
    let bytes = furrow_base::input::contents(path).map_err(Error::reading(path))?;
    let (_, header) = SafeTensors::read_metadata(&bytes).map_err(|e| damaged(&e))?;
    let text =
        header.metadata().as_ref().and_then(|m| m.get(KEY)).ok_or_else(|| damaged(&"its `furrow` entry is missing"))?;
    let (sum, text) = text.split_once('\n').ok_or_else(|| damaged(&"its checksum is missing"))?;
    let arrays = arrays(&bytes).map_err(|what| damaged(&what))?;
    if sum != checksum(&arrays, text) {
        return Err(damaged(&"its weights do not match their checksum"));
    }
    Ok((arrays, text.to_owned()))
}

/// Reads a file of another program and returns its arrays, sorted by name. Arrays of other types than floating-point numbers are
/// skipped.
pub fn read_foreign(path: &Path) -> Result<Vec<Array>> {
    let bytes = furrow_base::input::contents(path).map_err(Error::reading(path))?;
    let all = SafeTensors::deserialize(&bytes);
    let fault = |e: &dyn std::fmt::Display| {
        unusable(path, &format!("this is not a safetensors file: {e}"))
            .help("convert a PyTorch file with safetensors.torch.save_file(torch.load(FILE, weights_only=True), OUT)")
    };
    let all = all.map_err(|e| fault(&e))?;
    let mut arrays: Vec<Array> = all.tensors().into_iter().filter_map(|(name, view)| Array::of(name, &view)).collect();
    arrays.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(arrays)
}

/// Returns all arrays of a file, sorted by name, or a description of its first defect.
fn arrays(bytes: &[u8]) -> Result<Vec<Array>, String> {
    let all = SafeTensors::deserialize(bytes).map_err(|e| e.to_string())?;
    let array = |(name, view): (String, TensorView<'_>)| {
        let words = format!("`{name}` holds no floating-point numbers");
        Array::of(name, &view).ok_or(words)
    };
    let mut arrays = all.tensors().into_iter().map(array).collect::<Result<Vec<_>, _>>()?;
    arrays.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(arrays)
}

/// Returns the SHA-256 over names, shapes and values, independent of the order of the arrays.
pub fn hash(arrays: &[Array]) -> String {
    let mut sorted: Vec<&Array> = arrays.iter().collect();
    sorted.sort_by(|a, b| a.name.cmp(&b.name));
    let mut sha = Sha256::new();
    for array in sorted {
        sha.update(format!("{} {:?}\n", array.name, array.shape));
        for v in &array.values {
            sha.update(v.to_le_bytes());
        }
    }
    hex::encode(sha.finalize())
}

/// Combines the weight hashes of several networks, in their order, into one hash. A single hash is returned unchanged.
pub fn hash_together(hashes: &[String]) -> String {
    match hashes {
        [one] => one.clone(),
        all => hex::encode(Sha256::digest(all.concat())),
    }
}

/// Returns the SHA-256 over the arrays and the text.
fn checksum(arrays: &[Array], text: &str) -> String {
    hex::encode(Sha256::new().chain_update(hash(arrays)).chain_update(text).finalize())
}

fn unusable(path: &Path, what: &str) -> Error {
    Error::input(what).in_file(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::error::Kind;

    fn arrays() -> Vec<Array> {
        let array = |name: &str, shape: &[usize], values: &[f32]| Array {
            name: name.into(),
            shape: shape.into(),
            values: values.into(),
        };
        vec![array("a", &[2, 3], &[1.0, 2.0, 3.0, -4.0, 5.5, f32::MIN_POSITIVE]), array("b", &[], &[7.0])]
    }

    /// Expected: half precision keeps 11 bits and takes two bytes per value; a rounded value is stored exactly; a value that is too
    /// large becomes infinite. Source: IEEE 754 binary16.
    #[test]
    fn half_precision_takes_half_of_the_bytes_and_keeps_what_was_rounded() {
        let path = Path::new("w.safetensors");
        let values: Vec<f32> = (0..4096).map(|i| (i.to_f32() * 0.731).sin() * 1.001_f32.powi(i - 2048)).collect();
        let fine = [Array { name: "a".into(), shape: vec![4096], values }];
        let coarse = fine.each_ref().map(Array::halved);
        for (a, b) in fine[0].values.iter().zip(&coarse[0].values) {
            assert!((a - b).abs() <= a.abs() / 2048.0 + 3e-8, "{a} {b}");
        }
        assert_eq!(coarse.each_ref().map(Array::halved), coarse);
        let (single, half) =
            (encode(path, &coarse, "", Stored::Single).unwrap(), encode(path, &coarse, "", Stored::Half).unwrap());
        assert_eq!(single.len() - half.len(), 2 * 4096);
        let folder = tempfile::tempdir().unwrap();
        for bytes in [single, half] {
            let path = folder.path().join("w.safetensors");
            std::fs::write(&path, bytes).unwrap();
            assert_eq!(read(&path).unwrap().0, coarse);
        }
        let far = Array { name: "b".into(), shape: vec![2], values: vec![1e9, -1e9] };
        assert_eq!(far.halved().values, [f32::INFINITY, f32::NEG_INFINITY]);
    }

    /// Expected: a file of another program is read in any floating-point type; integers are skipped. Source: IEEE 754 and bfloat16,
    /// whose bits are the upper half of single precision.
    #[test]
    fn foreign_weights_are_read_in_every_floating_point_type() {
        let bytes: [(&str, Dtype, Vec<u8>); 5] = [
            ("a", Dtype::F32, (-1.5_f32).to_le_bytes().into()),
            ("b", Dtype::F16, f16::from_f32(-1.5).to_le_bytes().into()),
            ("c", Dtype::BF16, ((-1.5_f32).to_bits() >> 16).to_le_bytes()[..2].into()),
            ("d", Dtype::F64, (-1.5_f64).to_le_bytes().into()),
            ("e", Dtype::I64, 3_i64.to_le_bytes().into()),
        ];
        let view = |(name, dtype, bytes)| (name, TensorView::new(dtype, vec![1], bytes).unwrap());
        let views = bytes.iter().map(|(name, dtype, bytes)| view((*name, *dtype, bytes.as_slice())));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("foreign.safetensors");
        std::fs::write(&path, safetensors::serialize(views, &None).unwrap()).unwrap();
        let found = read_foreign(&path).unwrap();
        let found: Vec<(&str, f32)> = found.iter().map(|a| (a.name.as_str(), a.values[0])).collect();
        assert_eq!(found, [("a", -1.5), ("b", -1.5), ("c", -1.5), ("d", -1.5)]);
    }

    #[test]
    fn weights_come_back_and_damage_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("w.safetensors");
        write(&path, &arrays(), "{\"step\": 3}\nsecond line").unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(read(&path).unwrap(), (arrays(), "{\"step\": 3}\nsecond line".to_owned()));
        write(&path, &arrays(), "{\"step\": 3}\nsecond line").unwrap();
        assert_eq!(bytes, std::fs::read(&path).unwrap());
        for at in [0, 20, bytes.len() / 2, bytes.len() - 2] {
            let mut broken = bytes.clone();
            broken[at] ^= 4;
            std::fs::write(&path, &broken).unwrap();
            assert_eq!(read(&path).unwrap_err().kind(), Kind::Damaged, "byte {at}");
        }
        std::fs::write(&path, &bytes[..bytes.len() - 5]).unwrap();
        assert!(read(&path).is_err());
    }
}
