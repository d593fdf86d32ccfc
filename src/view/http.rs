//! HTTP requests and responses, limited to the needs of the page: only `GET`, without bodies, with
//! one request per connection. httparse reads the head.

use std::io::{self, Read, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, TcpStream};
use std::time::{Duration, Instant};

/// Maximum size in bytes of the head of a request.
const MAX_HEAD: usize = 16 << 10;
/// Maximum number of lines in the head of a request.
const MAX_HEADERS: usize = 64;
/// Maximum time for a head to arrive.
const PATIENCE: Duration = Duration::from_secs(5);

/// The head of a request.
#[derive(Debug, Default)]
pub(super) struct Request {
    /// Path and query of the requested URL.
    pub target: String,
    pub host: String,
    /// Origin of the requesting page, set by browsers.
    pub origin: Option<String>,
    /// Key of a WebSocket request.
    pub socket_key: Option<String>,
}

/// Refusal of a request: status code, status name, and text for users.
pub(super) type Refusal = (u16, &'static str, String);

/// Reads the head of a request.
///
/// # Errors
///
/// A refusal of an invalid or slow request.
pub(super) fn read_request(stream: &mut TcpStream) -> Result<Request, Refusal> {
    let refused = |words: String| (400, "Bad Request", words);
    let failed = |error: io::Error| refused(format!("cannot read the request: {error}"));
    stream.set_read_timeout(Some(PATIENCE)).map_err(failed)?;
    let start = Instant::now();
    let mut head = Vec::new();
    let mut buffer = [0; 2048];
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        if head.len() > MAX_HEAD || start.elapsed() > PATIENCE {
            return Err((431, "Request Header Fields Too Large", "the request is too long".into()));
        }
        match stream.read(&mut buffer).map_err(failed)? {
            0 => return Err(refused("the request ends early".into())),
            n => head.extend_from_slice(&buffer[..n]),
        }
    }
    parse(&head)
}

/// Parses the bytes of a head.
fn parse(head: &[u8]) -> Result<Request, Refusal> {
    let refused = |words: String| (400, "Bad Request", words);
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    parsed
        .parse(head)
        .map_err(|error| refused(format!("not a request: {error}")))?;
    if parsed.method != Some("GET") {
        return Err((405, "Method Not Allowed", "use GET".into()));
    }
    let mut request = Request {
        target: parsed.path.unwrap_or_default().into(),
        ..Request::default()
    };
    let (mut is_upgrade, mut version, mut key, mut hosts) = (false, None, None, 0);
    for header in parsed.headers.iter() {
        let Ok(value) = std::str::from_utf8(header.value) else {
            continue;
        };
        let value = value.trim();
        match header.name.to_ascii_lowercase().as_str() {
            "host" => {
                request.host = value.to_ascii_lowercase();
                hosts += 1;
            }
            "origin" => request.origin = Some(value.to_ascii_lowercase()),
            "upgrade" => is_upgrade |= value.eq_ignore_ascii_case("websocket"),
            "sec-websocket-version" => version = Some(value),
            "sec-websocket-key" => key = Some(value),
            _ => {}
        }
    }
    if hosts != 1 {
        return Err(refused("a request names one Host".into()));
    }
    if is_upgrade {
        request.socket_key = match (version, key) {
            (Some("13"), Some(key)) => Some(key.into()),
            _ => {
                return Err((
                    426,
                    "Upgrade Required",
                    "only version 13 of WebSocket is supported".into(),
                ));
            }
        };
    }
    Ok(request)
}

/// Name in a `Host` header, without the port.
fn name_of_host(host: &str) -> &str {
    match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.split(':').next().unwrap_or_default(),
    }
}

/// Returns true if `host` is a valid name of a server that listens on `listens`: an address or
/// localhost. Other names are refused. The owner of a name could let the name point to this machine
/// (DNS rebinding). A page of that name would then have the same origin as this server. Ports are
/// not checked, because an ssh tunnel has another port.
pub(super) fn is_known_host(host: &str, listens: IpAddr) -> bool {
    let name = name_of_host(host);
    let is_loopback = |ip: IpAddr| ip == Ipv4Addr::LOCALHOST || ip == Ipv6Addr::LOCALHOST;
    match name.parse::<IpAddr>() {
        Ok(ip) => is_loopback(ip) || !is_loopback(listens),
        Err(_) => name == "localhost",
    }
}

/// Returns true if the requesting page belongs to this server, or if no page is named. Browsers
/// name the page in all WebSocket requests.
pub(super) fn is_own_origin(origin: Option<&str>, host: &str) -> bool {
    origin.is_none_or(|origin| origin.strip_prefix("http://") == Some(host))
}

/// Writes a response and ends the connection. The headers allow pages to load only files of this
/// server. The headers also suppress the referrer, because the address of the page has the token.
///
/// # Errors
///
/// Errors of the connection.
pub(super) fn answer(
    stream: &mut TcpStream,
    (status, name): (u16, &str),
    kind: &str,
    more: &str,
    body: &[u8],
) -> io::Result<()> {
    let head = format!(
        "HTTP/1.1 {status} {name}\r\n\
         Content-Type: {kind}\r\n\
         Content-Length: {}\r\n\
         Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\n\
         Cross-Origin-Opener-Policy: same-origin\r\n\
         X-Content-Type-Options: nosniff\r\n\
         Referrer-Policy: no-referrer\r\n\
         Cache-Control: no-store\r\n\
         {more}Connection: close\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)?;
    stream.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn target(head: &str) -> Result<String, u16> {
        parse(head.as_bytes()).map(|r| r.target).map_err(|(status, ..)| status)
    }

    #[test]
    fn requests_are_read() {
        assert_eq!(
            target("GET /a/?b HTTP/1.1\r\nHost: localhost:1\r\n\r\n"),
            Ok("/a/?b".into())
        );
        assert_eq!(target("POST / HTTP/1.1\r\nHost: x\r\n\r\n"), Err(405));
        assert_eq!(target("GET / HTTP/1.1\r\n\r\n"), Err(400));
        assert_eq!(target("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n"), Err(400));
        assert_eq!(target("nonsense\r\n\r\n"), Err(400));
        let old = "GET / HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 8\r\n\r\n";
        assert_eq!(target(old), Err(426));
        let many = format!("GET / HTTP/1.1\r\nHost: x\r\n{}\r\n", "A: b\r\n".repeat(100));
        assert_eq!(target(&many), Err(400));
    }

    /// A page with another host name cannot reach the server, even if the name has the server's
    /// address.
    #[test]
    fn hosts_are_addresses_or_localhost() {
        let loopback = IpAddr::V4(Ipv4Addr::LOCALHOST);
        for host in ["localhost", "localhost:8080", "127.0.0.1:1", "[::1]:5"] {
            assert!(is_known_host(host, loopback), "{host}");
        }
        for host in [
            "",
            "evil.example",
            "localhost.evil.example",
            "127.0.0.1.evil.example:80",
            "10.0.0.1",
            "[::2]:5",
        ] {
            assert!(!is_known_host(host, loopback), "{host}");
        }
        let all = IpAddr::V4(Ipv4Addr::UNSPECIFIED);
        assert!(is_known_host("10.0.0.1:80", all));
        assert!(!is_known_host("evil.example", all));
    }

    #[test]
    fn origins_are_the_host() {
        assert!(is_own_origin(Some("http://localhost:5"), "localhost:5"));
        assert!(is_own_origin(None, "localhost:5"));
        for origin in [
            "http://localhost:6",
            "https://localhost:5",
            "null",
            "http://evil.example",
            "",
        ] {
            assert!(!is_own_origin(Some(origin), "localhost:5"), "{origin}");
        }
    }
}
