//! Files of images in tar archives, named as the package `webdataset` groups them: `000123.rgb.png` is `images/000123/rgb.png` of the
//! dataset, `000123` its key.

use std::io::{self, Write};

/// Bytes of a tar archive's blocks: a file begins with one, its header, and fills whole ones.
pub(crate) const BLOCK: u64 = 512;

/// Adds a file of an image, by its path below the dataset's folder.
pub(crate) fn append(archive: &mut tar::Builder<impl Write>, path: &str, bytes: &[u8]) -> io::Result<()> {
    archive.append(&header(path, bytes.len() as u64)?, bytes)
}

/// The name in an archive of an image's file.
pub(crate) fn entry_name(path: &str) -> String {
    path.trim_start_matches("images/").replace('/', ".")
}

/// A file's header, which tells nothing of this machine.
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
    fn an_archive_tells_nothing_of_its_machine() {
        let header = header("images/000000/rgb.png", 3).unwrap();
        assert_eq!(header.path().unwrap().to_str(), Some("000000.rgb.png"));
        let numbers = (header.mtime().unwrap(), header.uid().unwrap(), header.gid().unwrap(), header.mode().unwrap());
        assert_eq!(numbers, (0, 0, 0, 0o644));
        assert_eq!((header.username().unwrap(), header.groupname().unwrap()), (Some(""), Some("")));
    }
}
