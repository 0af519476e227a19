//! Image files in tar archives, with names that the package `webdataset` groups by image: the file
//! `images/000123/rgb.png` of the dataset is the member `000123.rgb.png`, with the key `000123`.

use furrow_base::math::ToInt;
use std::io::{self, Write};

/// Block size of tar archives, bytes. A file starts with a header of one block, and its contents are padded to whole
/// blocks.
pub(crate) const BLOCK: u64 = 512;

/// Adds a file of an image to an archive; `path` is relative to the dataset's folder.
pub(crate) fn append(archive: &mut tar::Builder<impl Write>, path: &str, bytes: &[u8]) -> io::Result<()> {
    archive.append(&header(path, bytes.len().to_u64())?, bytes)
}

/// Returns the name of an image's file in an archive.
pub(crate) fn entry_name(path: &str) -> String {
    path.trim_start_matches("images/").replace('/', ".")
}

/// Returns the header of a file, without information about this machine.
fn header(path: &str, bytes: u64) -> io::Result<tar::Header> {
    let mut header = tar::Header::new_ustar();
    header.set_path(entry_name(path))?;
    header.set_size(bytes);
    header.set_entry_type(tar::EntryType::Regular);
    header.set_mode(0o644);
    header.set_uid(0);
    header.set_gid(0);
    header.set_mtime(0);
    header.set_cksum();
    Ok(header)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_archive_names_nothing_of_its_machine() {
        let header = header("images/000000/rgb.png", 3).unwrap();
        assert_eq!(header.path().unwrap().to_str(), Some("000000.rgb.png"));
        let numbers = (header.mtime().unwrap(), header.uid().unwrap(), header.gid().unwrap(), header.mode().unwrap());
        assert_eq!(numbers, (0, 0, 0, 0o644));
        assert_eq!((header.username().unwrap(), header.groupname().unwrap()), (Some(""), Some("")));
    }
}
