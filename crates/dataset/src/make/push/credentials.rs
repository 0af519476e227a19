//! Access keys of S3, found as Amazon's own programs do: environment variables, then a profile of
//! `~/.aws/credentials`. Source: AWS SDKs and Tools Reference Guide, "Credentials" and "Environment variables".

use furrow_base::input::read_text;
use furrow_base::{Error, Result};
use std::path::PathBuf;

/// Longest file of credentials, bytes.
const MOST_BYTES: u64 = 1 << 20;
/// Help where there are no keys.
const HELP: &str = "export AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or write a profile to ~/.aws/credentials; for other logins, \
                    `aws configure export-credentials --format env` prints them";

/// An access key.
#[derive(PartialEq, Eq)]
pub(super) struct Credentials {
    pub(super) id: String,
    pub(super) secret: String,
    /// Token of a temporary key.
    pub(super) token: Option<String>,
}

// Without the secret, so that no message can contain it.
impl std::fmt::Debug for Credentials {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Credentials({})", self.id)
    }
}

impl Credentials {
    /// Finds the keys; `variable` returns environment variables. Fails if there are none.
    pub(super) fn find(variable: &dyn Fn(&str) -> Option<String>) -> Result<Self> {
        let found = match (variable("AWS_ACCESS_KEY_ID"), variable("AWS_SECRET_ACCESS_KEY")) {
            (Some(id), Some(secret)) => Self { id, secret, token: variable("AWS_SESSION_TOKEN") },
            _ => Self::of_profile(variable)?,
        };
        let is_plain =
            |text: &String| !text.is_empty() && !text.contains(|c: char| c.is_control() || c.is_whitespace());
        if [Some(&found.id), Some(&found.secret), found.token.as_ref()].into_iter().flatten().all(is_plain) {
            return Ok(found);
        }
        Err(Error::misuse("the access key of S3 is empty or contains spaces").help(HELP))
    }

    fn of_profile(variable: &dyn Fn(&str) -> Option<String>) -> Result<Self> {
        let home = || variable("HOME").map(|home| PathBuf::from(home).join(".aws/credentials"));
        let path = variable("AWS_SHARED_CREDENTIALS_FILE").map(PathBuf::from).or_else(home);
        let Some(path) = path.filter(|path| path.is_file()) else {
            return Err(Error::misuse("there are no access keys for S3").help(HELP));
        };
        let name = variable("AWS_PROFILE").unwrap_or_else(|| "default".into());
        let text = read_text(&path, MOST_BYTES)?;
        let value = |key: &str| value(&text, &name, key);
        match (value("aws_access_key_id"), value("aws_secret_access_key")) {
            (Some(id), Some(secret)) => Ok(Self { id, secret, token: value("aws_session_token") }),
            _ => Err(Error::misuse(format!("the profile `{name}` has no access key")).help(HELP).in_file(&path)),
        }
    }
}

/// Returns a value of a section of an INI file; `None` if it is missing or empty. Capitals in names of values do not matter.
fn value(text: &str, section: &str, key: &str) -> Option<String> {
    let mut is_inside = false;
    for line in text.lines().map(str::trim).filter(|line| !line.starts_with(['#', ';'])) {
        if let Some((name, _)) = line.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
            is_inside = name.trim() == section;
        } else if is_inside
            && let Some((name, value)) = line.split_once('=')
            && name.trim().eq_ignore_ascii_case(key)
        {
            // As Amazon's programs: a comment begins with a space. Keys contain none.
            let value =
                [" #", "\t#", " ;", "\t;"].iter().fold(value, |value, mark| value.split(mark).next().unwrap_or(value));
            return Some(value.trim().to_owned()).filter(|value| !value.is_empty());
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(variables: &[(&str, &str)]) -> Result<Credentials> {
        Credentials::find(&|name| variables.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned()))
    }

    /// Expected: variables come first, then the named profile; secrets are in no message.
    #[test]
    fn keys_come_from_variables_or_a_profile() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("credentials");
        let text = "# keys\n[default] # mine\naws_access_key_id = A\naws_secret_access_key=b=/+\naws_session_token =\n\n[ robot ]\n\
                    AWS_ACCESS_KEY_ID=R ; old\n\
                    aws_secret_access_key = s\naws_session_token = t\n[half]\naws_access_key_id=H\n";
        std::fs::write(&file, text).unwrap();
        let file = ("AWS_SHARED_CREDENTIALS_FILE", file.to_str().unwrap());
        let own = [("AWS_ACCESS_KEY_ID", "E"), ("AWS_SECRET_ACCESS_KEY", "secret"), file];
        let key = |id: &str, secret: &str, token: Option<&str>| Credentials {
            id: id.into(),
            secret: secret.into(),
            token: token.map(str::to_owned),
        };
        assert_eq!(find(&own).unwrap(), key("E", "secret", None));
        assert_eq!(find(&[file]).unwrap(), key("A", "b=/+", None));
        assert_eq!(find(&[file, ("AWS_PROFILE", "robot")]).unwrap(), key("R", "s", Some("t")));
        assert!(!format!("{:?}", find(&own)).contains("secret"));
        for (variables, what) in [
            (&[][..], "there are no access keys"),
            (&[file, ("AWS_PROFILE", "half")], "`half` has no access key"),
            (&[file, ("AWS_PROFILE", "none")], "`none` has no access key"),
            (&[("AWS_ACCESS_KEY_ID", "a b"), ("AWS_SECRET_ACCESS_KEY", "s")], "contains spaces"),
            (&[("AWS_ACCESS_KEY_ID", "a"), ("AWS_SECRET_ACCESS_KEY", "")], "empty"),
        ] {
            let error = find(variables).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
    }
}
