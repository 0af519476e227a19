//! URIs of a model's other files: paths, or embedded data.

use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

/// Base64 with or without padding, because writers differ.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Target of a URI.
#[derive(Debug, PartialEq)]
pub(super) enum Target {
    /// Bytes embedded in the URI.
    Bytes(Vec<u8>),
    /// Path relative to the model's folder.
    File(String),
}

/// Parses a URI (RFC 3986, RFC 2397), or returns an error message.
pub(super) fn follow(uri: &str) -> Result<Target, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, text)) = data.split_once(";base64,") else {
            return Err("it holds data that is not base64".into());
        };
        return BASE64.decode(text).map(Target::Bytes).map_err(|e| format!("its base64 data is damaged: {e}"));
    }
    if uri.contains("://") {
        let short: String = uri.chars().take(60).collect();
        return Err(format!("it refers to `{short}`; only files can be read"));
    }
    Ok(Target::File(decoded(uri)))
}

/// Decodes percent encoding (`%20` → space); invalid codes are left unchanged.
fn decoded(text: &str) -> String {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        let code = after.get(..2).filter(|_| *first == b'%').and_then(|hex| std::str::from_utf8(hex).ok());
        if let Some(byte) = code.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            bytes.push(byte);
            rest = &after[2..];
        } else {
            bytes.push(*first);
            rest = after;
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_lead_to_files_or_bytes() {
        assert_eq!(follow("a%20leaf%C3%A9.png"), Ok(Target::File("a leafé.png".into())));
        assert_eq!(follow("100%.png"), Ok(Target::File("100%.png".into())));
        assert_eq!(follow("data:application/octet-stream;base64,AAEC"), Ok(Target::Bytes(vec![0, 1, 2])));
        assert_eq!(follow("data:;base64,AAE"), Ok(Target::Bytes(vec![0, 1])));
        for bad in ["https://a.b/c.png", "data:text/plain,abc", "data:;base64,!!"] {
            assert!(follow(bad).is_err(), "{bad}");
        }
    }
}
