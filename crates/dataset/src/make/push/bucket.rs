//! Upload to a bucket of S3, or of a store with the same protocol (MinIO, Ceph, Cloudflare R2, Google Cloud Storage).
//!
//! The program `curl` transfers the files: it signs requests (AWS Signature Version 4) and knows proxies and
//! certificates of the machine, for which a client in Rust would add about fifty crates. Each request is signed with the
//! SHA-256 of the file, so a store refuses contents that changed on the way. Keys and addresses reach `curl` through its
//! standard input, not through its arguments, which other users of a machine can read.
//!
//! Source: Amazon S3 API Reference, "PutObject" and "Authenticating Requests"; `curl --help aws-sigv4`.

use super::credentials::Credentials;
use super::process::{self, Ended, Limits};
use crate::read::checksum::Checksum;
use furrow_base::input::below;
use furrow_base::{Error, Result};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

/// A bucket, and the prefix of the names in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bucket {
    name: String,
    /// Names of folders, without slashes at the ends; empty for none.
    prefix: String,
}

/// Largest file of one request, bytes. Source: Amazon S3 User Guide, "Uploading objects".
const MOST_BYTES: u64 = 5 << 30;
/// Oldest version of `curl` that signs the hash of the contents, tested.
const OLDEST_CURL: (u32, u32) = (7, 88);
/// Number of files that one process uploads. A pack with its formats has thousands.
const AT_ONCE: usize = 64;
/// Longest time without a byte, seconds, after which an upload fails.
const STALLED_S: u32 = 300;
/// Begin of curl's line with the HTTP status and the name of a file.
const STATUS: &str = "furrow: ";
/// Longest answer of a store in an error, characters.
const SHOWN: usize = 300;

/// Returns the address of a bucket without its scheme, or `None` for any other text.
pub(super) fn address(text: &str) -> Option<&str> {
    text.strip_prefix("s3://")
}

/// Returns an environment variable that is set and not empty.
fn variable(name: &str) -> Option<String> {
    std::env::var(name).ok().filter(|value| !value.is_empty())
}

impl Bucket {
    /// Parses `BUCKET/PREFIX`.
    pub(super) fn parse(address: &str) -> Result<Self> {
        let (name, prefix) = address.split_once('/').unwrap_or((address, ""));
        let refuse = |what: &str| {
            Err(Error::misuse(format!("--push s3://{address}: {what}"))
                .help("write s3://BUCKET or s3://BUCKET/FOLDER/FOLDER"))
        };
        let is_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '.' | '-');
        if !(3..=63).contains(&name.len())
            || !name.chars().all(is_name)
            || !name.starts_with(|c| is_name(c) && c != '.')
        {
            return refuse("a bucket has 3 to 63 lower-case letters, digits, dots and hyphens");
        }
        let prefix = prefix.trim_matches('/');
        if !prefix.is_empty() && prefix.split('/').any(|folder| matches!(folder, "" | "." | "..")) {
            return refuse("a folder of the prefix is empty, `.` or `..`");
        }
        if prefix.contains(char::is_control) || prefix.contains(['?', '#']) {
            return refuse("the prefix contains a control character, `?` or `#`");
        }
        Ok(Self { name: name.to_owned(), prefix: prefix.to_owned() })
    }

    /// Fails if there are no access keys, or no `curl` that can sign requests.
    pub(super) fn check_machine() -> Result<()> {
        Credentials::find(&variable)?;
        Place::of("bucket", &variable)?;
        let needs = format!("install curl {}.{} or newer, or give --push a command", OLDEST_CURL.0, OLDEST_CURL.1);
        let Ok(printed) = Command::new("curl").arg("--version").output() else {
            return Err(Error::misuse("--push to s3 needs the program curl").help(needs));
        };
        let printed = String::from_utf8_lossy(&printed.stdout).into_owned();
        let version = printed.split_whitespace().nth(1).unwrap_or_default().to_owned();
        let mut numbers = version.split('.').map(|part| part.parse::<u32>().unwrap_or_default());
        if (numbers.next().unwrap_or_default(), numbers.next().unwrap_or_default()) < OLDEST_CURL {
            return Err(Error::misuse(format!("curl {version} cannot sign uploads to s3")).help(needs));
        }
        Ok(())
    }

    /// Uploads files of a folder once. Returns a description of the failure if one fails.
    pub(super) fn send(&self, folder: &Path, files: &[String], limits: &Limits<'_>) -> Result<Option<String>> {
        for files in files.chunks(AT_ONCE) {
            limits.stop.check()?;
            if let Some(failure) = self.send_some(folder, files, limits)? {
                return Ok(Some(failure));
            }
        }
        Ok(None)
    }

    /// Uploads a few files in one process.
    fn send_some(&self, folder: &Path, files: &[String], limits: &Limits<'_>) -> Result<Option<String>> {
        let place = Place::of(&self.name, &variable)?;
        let credentials = Credentials::find(&variable)?;
        let orders = files.iter().map(|file| {
            let path = below(folder, file)?;
            let sum = Checksum::of_file(&path).map_err(Error::io(&path))?;
            if sum.bytes > MOST_BYTES {
                let what = "a file of more than 5 GiB cannot be pushed to s3 in one request";
                return Err(Error::failed(what).help("plan the dataset with a smaller --pack").in_file(&path));
            }
            let path = path.to_str().ok_or_else(|| {
                Error::misuse("--push cannot pass a folder whose name is not UTF-8")
                    .in_file(&path)
                    .help("give --out another name")
            })?;
            Ok(self.order(&place, &credentials, file, path, &sum.sha256))
        });
        let orders = orders.collect::<Result<Vec<String>>>()?.join("next\n");
        let mut curl = Command::new("curl");
        // `--disable`, which must come first: no ~/.curlrc changes what is sent.
        curl.args(["--disable", "--silent", "--show-error", "--fail-early", "--config", "-"]);
        let ended = process::run(&mut curl, orders.as_bytes(), limits)?;
        // curl takes a redirect for success.
        let is_stored = ended.output.lines().filter(|line| line.starts_with("furrow: 2")).count() == files.len();
        Ok((ended.failure.is_some() || !is_stored).then(|| self.describe(&ended)))
    }

    /// Returns the part of curl's configuration that uploads one file.
    fn order(&self, place: &Place, credentials: &Credentials, file: &str, path: &str, sha256: &str) -> String {
        let Credentials { id, secret, token } = credentials;
        let mut order = String::new();
        let mut say = |option: &str, value: &str| {
            let _ = writeln!(order, "{option} = {}", quoted(value));
        };
        say("url", &format!("{}/{}", place.address, encoded(&self.key(file))));
        say("upload-file", path);
        say("aws-sigv4", &format!("aws:amz:{}:s3", place.region));
        say("user", &format!("{id}:{secret}"));
        say("header", &format!("x-amz-content-sha256: {sha256}"));
        if let Some(token) = token {
            say("header", &format!("x-amz-security-token: {token}"));
        }
        say("connect-timeout", "60");
        say("speed-limit", "1");
        say("speed-time", &STALLED_S.to_string());
        say("proto", "=http,https");
        say("write-out", &format!("\n{STATUS}%{{http_code}} {}\n", self.key(file).replace('%', "%%")));
        order + "fail-with-body\ngloboff\n"
    }

    /// Returns the name of a file in the bucket.
    fn key(&self, file: &str) -> String {
        if self.prefix.is_empty() { file.to_owned() } else { format!("{}/{file}", self.prefix) }
    }

    /// Describes a failure with what the store answered, or else with curl's message.
    fn describe(&self, Ended { failure, timed_out, output }: &Ended) -> String {
        let statuses = output.lines().filter_map(|line| line.strip_prefix(STATUS)?.split_once(' '));
        let failed = statuses.rev().find(|(status, _)| !status.starts_with('2'));
        let place = failed.map_or_else(|| self.to_string(), |(_, key)| format!("s3://{}/{key}", self.name));
        let how = failure.as_deref().unwrap_or("was not stored");
        if *timed_out {
            return format!("the upload to {place} {how}");
        }
        let message = output.lines().rev().find_map(|line| line.strip_prefix("curl: "));
        let words = match (element(output, "Code"), element(output, "Message"), failed) {
            (Some(code), Some(message), _) => format!("{code}: {message}"),
            (Some(code), None, _) => code.to_owned(),
            (.., Some((status, _))) if message.is_none() => format!("the store answered with status {status}"),
            _ => message.unwrap_or(how).to_owned(),
        };
        // The answer of a store is not to be trusted with a terminal.
        let plain: String = words.chars().map(|c| if c.is_control() { ' ' } else { c }).take(SHOWN).collect();
        format!("{place}: {plain}")
    }
}

impl std::fmt::Display for Bucket {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "s3://{}{}{}", self.name, if self.prefix.is_empty() { "" } else { "/" }, self.prefix)
    }
}

/// Where a bucket is reached.
#[derive(Debug, PartialEq, Eq)]
struct Place {
    region: String,
    /// URL of the bucket, without a slash at its end.
    address: String,
}

impl Place {
    /// Returns the place of a bucket by the variables that Amazon's programs know: `AWS_REGION`, `AWS_DEFAULT_REGION`,
    /// `AWS_ENDPOINT_URL_S3`, `AWS_ENDPOINT_URL`. Without a region, it is us-east-1.
    fn of(bucket: &str, variable: &dyn Fn(&str) -> Option<String>) -> Result<Self> {
        let first = |names: [&str; 2]| names.into_iter().find_map(variable);
        let region = first(["AWS_REGION", "AWS_DEFAULT_REGION"]).unwrap_or_else(|| "us-east-1".into());
        let endpoint = first(["AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL"]);
        if let Some(endpoint) = &endpoint
            && !["http://", "https://"].iter().any(|scheme| endpoint.starts_with(scheme))
        {
            return Err(Error::misuse(format!("the endpoint `{endpoint}` is no address of http or https"))
                .help("export AWS_ENDPOINT_URL=https://HOST, or leave it out for Amazon's own"));
        }
        let address = match endpoint {
            Some(endpoint) => format!("{}/{bucket}", endpoint.trim_end_matches('/')),
            // A certificate for *.s3.… does not cover names with dots.
            None if bucket.contains('.') => format!("https://s3.{region}.amazonaws.com/{bucket}"),
            None => format!("https://{bucket}.s3.{region}.amazonaws.com"),
        };
        Ok(Self { region, address })
    }
}

/// Returns a value in quotes for curl's configuration.
fn quoted(value: &str) -> String {
    let mut out = String::from("\"");
    for c in value.chars() {
        match c {
            '\\' | '"' => out.extend(['\\', c]),
            '\n' => out += "\\n",
            '\t' => out += "\\t",
            '\r' => out += "\\r",
            _ => out.push(c),
        }
    }
    out + "\""
}

/// Encodes a name for a URL, except slashes, as the signature requires: all bytes but unreserved characters (RFC 3986).
fn encoded(key: &str) -> String {
    key.bytes().fold(String::new(), |mut out, byte| {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => out.push(char::from(byte)),
            _ => {
                let _ = write!(out, "%{byte:02X}");
            }
        }
        out
    })
}

/// Returns the text of an element of a store's answer.
fn element<'a>(answer: &'a str, name: &str) -> Option<&'a str> {
    let (_, after) = answer.split_once(&format!("<{name}>"))?;
    after.split_once(&format!("</{name}>")).map(|(text, _)| text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_parsed_and_mistakes_named() {
        for (text, name, prefix) in [("ab-c", "ab-c", ""), ("a.b/c/d e/", "a.b", "c/d e"), ("abc//x", "abc", "x")] {
            assert_eq!(Bucket::parse(text).unwrap(), Bucket { name: name.into(), prefix: prefix.into() });
        }
        assert_eq!(Bucket::parse("abc/x/y/").unwrap().to_string(), "s3://abc/x/y");
        for text in ["", "ab", "Abc", "a_b_c", ".abc", "abc/../x", "abc/x//y", "abc/x\ny", "abc/x?y"] {
            assert!(Bucket::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn buckets_are_reached_by_region_or_endpoint() {
        let place = |bucket: &str, variables: &[(&str, &str)]| {
            Place::of(bucket, &|name| variables.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).into()))
                .unwrap()
        };
        let of = |region: &str, address: &str| Place { region: region.into(), address: address.into() };
        assert_eq!(place("abc", &[]), of("us-east-1", "https://abc.s3.us-east-1.amazonaws.com"));
        let region = [("AWS_DEFAULT_REGION", "eu-west-1")];
        assert_eq!(place("a.b", &region), of("eu-west-1", "https://s3.eu-west-1.amazonaws.com/a.b"));
        let endpoint = [("AWS_ENDPOINT_URL", "http://localhost:9000/"), ("AWS_REGION", "x")];
        assert_eq!(place("abc", &endpoint), of("x", "http://localhost:9000/abc"));
    }

    /// Expected: nothing in a name ends the quotes or the line of the configuration, or is read as another part of a URL.
    #[test]
    fn names_cannot_change_the_configuration() {
        assert_eq!(quoted("a\"b\\c\nurl = x"), "\"a\\\"b\\\\c\\nurl = x\"");
        assert_eq!(encoded("a b/ü+%?#[1]"), "a%20b/%C3%BC%2B%25%3F%23%5B1%5D");
        let bucket = Bucket { name: "abc".into(), prefix: String::new() };
        let place = Place { region: "r".into(), address: "http://h/abc".into() };
        let credentials = Credentials { id: "i".into(), secret: "s".into(), token: Some("t".into()) };
        let order = bucket.order(&place, &credentials, "x\ny%", "/d/x\ny%", "00");
        assert_eq!(order.lines().count(), 13, "{order}");
    }

    #[test]
    fn failures_say_what_the_store_answered() {
        let bucket = Bucket { name: "abc".into(), prefix: "p".into() };
        let failed = |output: &str, failure: Option<&str>, timed_out| {
            bucket.describe(&Ended { failure: failure.map(str::to_owned), timed_out, output: output.into() })
        };
        let answer =
            "<Error><Code>NoSuch</Code><Message>no\u{1b}[31mne</Message></Error>\nfurrow: 404 p/x.png\ncurl: (22) 404";
        assert_eq!(failed(answer, Some("ended with 22"), false), "s3://abc/p/x.png: NoSuch: no [31mne");
        let lost = "curl: (6) Could not resolve host: h\n\nfurrow: 000 p/a\n";
        assert_eq!(failed(lost, Some("ended with 6"), false), "s3://abc/p/a: (6) Could not resolve host: h");
        assert_eq!(
            failed("furrow: 200 p/a\n\nfurrow: 301 p/b\n", None, false),
            "s3://abc/p/b: the store answered with status 301"
        );
        assert_eq!(failed("", Some("ended with 2"), false), "s3://abc/p: ended with 2");
        assert_eq!(failed("", Some("took longer than 1 s"), true), "the upload to s3://abc/p took longer than 1 s");
    }
}
