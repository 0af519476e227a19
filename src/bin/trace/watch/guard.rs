//! Access control. The page's address contains a random token, which other users of the machine cannot guess. `Host`
//! and `Origin` must be those of the page, so that other pages in the user's browser cannot send requests in its place
//! (DNS rebinding, cross-site requests).

use furrow_base::{Error, Result};
use std::fmt::Write;
use std::io::Read;
use std::net::{IpAddr, Ipv6Addr};

/// Number of random bytes of a token.
const BYTES: usize = 16;

/// Credentials required from a request.
pub(super) struct Guard {
    token: String,
    host: IpAddr,
}

impl Guard {
    /// Creates a guard with a new token for a page at this address.
    pub(super) fn new(host: IpAddr) -> Result<Self> {
        let mut bytes = [0_u8; BYTES];
        std::fs::File::open("/dev/urandom")
            .and_then(|mut file| file.read_exact(&mut bytes))
            .map_err(|e| Error::failed(format!("cannot read random numbers from the system: {e}")))?;
        let token = bytes.iter().fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        });
        Ok(Self { token, host })
    }

    /// Returns the token.
    pub(super) fn token(&self) -> &str {
        &self.token
    }

    /// Returns the part of a request's path after the token; `None` if the token is wrong.
    pub(super) fn within<'p>(&self, path: &'p str) -> Option<&'p str> {
        let (token, rest) = path.strip_prefix('/')?.split_once('/')?;
        // Compare all bytes, so that the time does not reveal the position of the first difference.
        let differs = token.bytes().zip(self.token.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b));
        (token.len() == self.token.len() && differs == 0).then_some(rest)
    }

    /// Returns `true` if a request with this `Host` and optional `Origin` comes from the page.
    pub(super) fn admits(&self, host: Option<&str>, origin: Option<&str>) -> bool {
        let Some(host) = host else { return false };
        // Any port is allowed: `ssh -L` may forward from another one.
        let own = match name(host) {
            None => false,
            Some("localhost") => true,
            Some(name) => name.parse::<IpAddr>().is_ok_and(|ip| {
                // A server that listens on all addresses accepts any IP address, but no host name, which could be
                // anybody's.
                ip.is_loopback() || ip == self.host || self.host.is_unspecified()
            }),
        };
        own && origin.is_none_or(|origin| origin.strip_prefix("http://") == Some(host))
    }
}

/// Returns a `Host` header without port and without the brackets of an IPv6 address; `None` if anything else follows.
fn name(host: &str) -> Option<&str> {
    let (name, rest) = match host.strip_prefix('[') {
        Some(rest) => rest.split_once(']').filter(|(name, _)| name.parse::<Ipv6Addr>().is_ok())?,
        None => host.split_at(host.find(':').unwrap_or(host.len())),
    };
    let port = |rest: &str| rest.strip_prefix(':').is_some_and(|port| port.bytes().all(|b| b.is_ascii_digit()));
    (rest.is_empty() || port(rest)).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(host: &str) -> Guard {
        Guard { token: "a1b2".into(), host: host.parse().unwrap() }
    }

    #[test]
    fn only_the_token_opens_a_path() {
        let guard = guard("127.0.0.1");
        assert_eq!(guard.within("/a1b2/"), Some(""));
        assert_eq!(guard.within("/a1b2/events"), Some("events"));
        for path in ["", "/", "/a1b2", "/a1b3/", "/a1b/", "/a1b2c/", "a1b2/", "//a1b2/", "/A1B2/"] {
            assert_eq!(guard.within(path), None, "{path}");
        }
    }

    #[test]
    fn foreign_hosts_and_origins_are_refused() {
        let local = guard("127.0.0.1");
        assert!(local.admits(Some("127.0.0.1:8000"), None));
        assert!(local.admits(Some("localhost:9"), Some("http://localhost:9")));
        assert!(local.admits(Some("[::1]:8000"), None));
        assert!(!local.admits(None, None));
        assert!(!local.admits(Some("evil.example:8000"), None));
        assert!(!local.admits(Some("192.168.1.5:8000"), None));
        for host in ["[::1].evil", "[::1].evil:80", "[::1]evil", "[127.0.0.1]", "[::1", "[]", "::1"] {
            assert!(!local.admits(Some(host), None), "{host}");
        }
        for host in ["localhost.evil", "localhost:9.evil", "localhost:9:9", "127.0.0.1:.evil", "127.0.0.1.evil", ""] {
            assert!(!local.admits(Some(host), None), "{host}");
        }
        for origin in ["http://evil.example", "null", "http://127.0.0.1:9", "https://127.0.0.1:8000"] {
            assert!(!local.admits(Some("127.0.0.1:8000"), Some(origin)), "{origin}");
        }
        assert!(guard("192.168.1.5").admits(Some("192.168.1.5:8000"), None));
        assert!(guard("0.0.0.0").admits(Some("192.168.1.5:8000"), None));
        assert!(!guard("0.0.0.0").admits(Some("evil.example"), None));
    }
}
