//! Check that a request comes from a page of this server.
//!
//! A page of another site can send requests to the loopback address, and with DNS rebinding under a host name of its own. A request
//! is answered only if
//!
//! * its path begins with the token, 128 random bits of the operating system that only the printed address contains;
//! * its `Host` is the address of the server, which it is not after DNS rebinding;
//! * its `Origin` and `Sec-Fetch-Site`, if the browser sends them, are those of our own page;
//! * a `POST` contains JSON, which a form of another site cannot send.

use anyhow::Context;
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use linkwright::model_file::visible;
use std::fmt::Write;
use std::net::SocketAddr;
use std::sync::Mutex;

/// The headers of every answer: nothing is loaded from elsewhere, framed, stored, or told to other sites.
const HEADERS: [(&str, &str); 7] = [
    (
        "content-security-policy",
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'; require-trusted-types-for 'script'",
    ),
    ("x-content-type-options", "nosniff"),
    ("x-frame-options", "DENY"),
    ("referrer-policy", "no-referrer"),
    ("cache-control", "no-store"),
    ("cross-origin-opener-policy", "same-origin"),
    ("cross-origin-resource-policy", "same-origin"),
];

/// The secret of a server, and the address at which it answers.
pub struct AccessControl {
    token: String,
    /// A code that is exchanged for the token once. The command line of the browser, which other users can read, contains only this.
    launch: Mutex<Option<String>>,
    host: String,
}

impl AccessControl {
    /// A guard with a new token for a server at this address.
    pub fn new(address: SocketAddr) -> anyhow::Result<Self> {
        Ok(Self { token: random()?, launch: Mutex::new(Some(random()?)), host: address.to_string() })
    }

    /// The address of the page.
    pub fn address(&self) -> String {
        format!("http://{}/{}/", self.host, self.token)
    }

    /// An address that leads to the page once.
    pub fn launch_address(&self) -> String {
        let launch = self.launch.lock().unwrap_or_else(|e| e.into_inner());
        format!("http://{}/{}", self.host, launch.as_deref().unwrap_or_default())
    }

    /// The path of a request after the token, or the status with which the request is refused.
    pub fn admit<'p>(&self, method: &Method, path: &'p str, headers: &HeaderMap) -> Result<&'p str, StatusCode> {
        let text = |name: header::HeaderName| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
        let mut hosts = headers.get_all(header::HOST).iter();
        if hosts.next().map(HeaderValue::as_bytes) != Some(self.host.as_bytes()) || hosts.next().is_some() {
            return Err(StatusCode::MISDIRECTED_REQUEST);
        }
        let rest = path.strip_prefix('/').ok_or(StatusCode::BAD_REQUEST)?;
        let (token, rest) = rest.split_once('/').ok_or(StatusCode::FORBIDDEN)?;
        let own = format!("http://{}", self.host);
        let from_elsewhere = text(header::ORIGIN).is_some_and(|origin| origin != own)
            || headers.get("sec-fetch-site").is_some_and(|site| site != "same-origin" && site != "none");
        if !is_equal(token, &self.token) || from_elsewhere {
            return Err(StatusCode::FORBIDDEN);
        }
        let is_json = text(header::CONTENT_TYPE).is_some_and(|kind| kind == "application/json");
        match *method {
            Method::GET => Ok(rest),
            Method::POST if is_json => Ok(rest),
            Method::POST => Err(StatusCode::UNSUPPORTED_MEDIA_TYPE),
            _ => Err(StatusCode::METHOD_NOT_ALLOWED),
        }
    }

    /// The address of the page, if the path is the launch code, which then is used up.
    pub fn exchange(&self, path: &str, headers: &HeaderMap) -> Option<String> {
        let is_own = headers.get(header::HOST).map(HeaderValue::as_bytes) == Some(self.host.as_bytes());
        let mut launch = self.launch.lock().unwrap_or_else(|e| e.into_inner());
        let code = launch.as_ref().filter(|code| is_own && is_equal(path.trim_start_matches('/'), code));
        code.is_some().then(|| {
            *launch = None;
            self.address()
        })
    }
}

/// Adds the headers of all answers.
pub fn protect(headers: &mut HeaderMap) {
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
}

/// 128 random bits in hexadecimal.
fn random() -> anyhow::Result<String> {
    let mut bytes = [0u8; 16];
    getrandom::fill(&mut bytes).context("the operating system has no random numbers for the token")?;
    let mut text = String::new();
    bytes.iter().try_for_each(|byte| write!(text, "{byte:02x}"))?;
    Ok(text)
}

/// Compares in a time that does not depend on where the texts differ.
fn is_equal(given: &str, secret: &str) -> bool {
    let differences = given.bytes().zip(secret.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b));
    given.len() == secret.len() && differences == 0
}

/// A message for an answer: control characters are visible.
pub fn message(error: &anyhow::Error) -> String {
    visible(&format!("{error:#}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(all: &[(&'static str, &str)]) -> HeaderMap {
        all.iter().map(|(name, value)| (name.parse().unwrap(), HeaderValue::from_str(value).unwrap())).collect()
    }

    #[test]
    fn only_requests_of_the_own_page_are_admitted() {
        let guard = AccessControl::new("127.0.0.1:4000".parse().unwrap()).unwrap();
        let path = format!("/{}/model", guard.token);
        let own = [("host", "127.0.0.1:4000"), ("content-type", "application/json")];
        let admit = |method: Method, path: &str, more: &[(&'static str, &str)]| {
            guard.admit(&method, path, &headers(&[&own[..], more].concat())).map(str::to_owned)
        };
        assert_eq!(admit(Method::GET, &path, &[]), Ok("model".to_owned()));
        assert_eq!(admit(Method::POST, &path, &[("origin", "http://127.0.0.1:4000")]), Ok("model".to_owned()));
        let foreign: [(&'static str, &str); 4] = [
            ("origin", "http://evil.example"),
            ("origin", "null"),
            ("sec-fetch-site", "cross-site"),
            ("sec-fetch-site", "same-site"),
        ];
        for header in foreign {
            assert_eq!(admit(Method::GET, &path, &[header]), Err(StatusCode::FORBIDDEN), "{header:?}");
        }
        for wrong in ["/", "/model", "//model", &format!("/{}/model", "0".repeat(32)), &path[..path.len() - 8]] {
            assert!(admit(Method::GET, wrong, &[]).is_err(), "{wrong}");
        }
        let refused = |all: &[(&'static str, &str)]| guard.admit(&Method::POST, &path, &headers(all)).unwrap_err();
        assert_eq!(refused(&[("host", "evil.example:4000"), own[1]]), StatusCode::MISDIRECTED_REQUEST);
        assert_eq!(refused(&[own[1]]), StatusCode::MISDIRECTED_REQUEST);
        assert_eq!(refused(&[own[0], ("content-type", "text/plain")]), StatusCode::UNSUPPORTED_MEDIA_TYPE);
        assert_eq!(admit(Method::DELETE, &path, &[]), Err(StatusCode::METHOD_NOT_ALLOWED));
    }

    #[test]
    fn the_launch_code_leads_to_the_page_once() {
        let guard = AccessControl::new("127.0.0.1:4000".parse().unwrap()).unwrap();
        let (own, code) = (headers(&[("host", "127.0.0.1:4000")]), guard.launch_address());
        let code = code.strip_prefix("http://127.0.0.1:4000").unwrap();
        assert_eq!(guard.exchange("/", &own), None);
        assert_eq!(guard.exchange(code, &headers(&[("host", "evil.example")])), None);
        assert_eq!(guard.exchange(code, &own), Some(guard.address()));
        assert_eq!(guard.exchange(code, &own), None);
        assert_eq!(guard.exchange("/", &own), None);
    }
}
