//! The server: accepts connections, checks the origin of requests, and answers with the page, its
//! WebSocket, or the picture as a file.

use super::http::{Refusal, Request, answer, is_known_host, is_own_origin, read_request};
use super::hub::{Hub, Mail, SaveFormat};
use super::{Options, page, socket};
use crate::color::{Curve, Exposure, Tone};
use crate::session::Error;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, ErrorKind, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::{self, Scope};
use std::time::{Duration, Instant};
use tungstenite::handshake::derive_accept_key;

/// Maximum number of connections that have shown the token. Further connections are refused.
const MAX_KNOWN: usize = 32;
/// Maximum number of connections without the token. If there are more, the oldest is closed. A page
/// sends its request at once, but other users of this machine may open connections and send
/// nothing.
const MAX_STRANGERS: usize = 32;
/// Time between two checks for a connection.
const POLL_INTERVAL: Duration = Duration::from_millis(15);
/// Maximum time to inform pages of the end.
const FAREWELL: Duration = Duration::from_millis(200);
/// Maximum time for a page to read a message.
const WRITE_PATIENCE: Duration = Duration::from_secs(20);

/// A listening server.
pub(super) struct Server {
    listener: TcpListener,
    address: SocketAddr,
    /// Random digits in the link, so that other users of this machine cannot guess it.
    token: String,
    /// Open connections.
    open: Mutex<Connections>,
}

/// Open connections by their numbers, which increase with time.
#[derive(Default)]
struct Connections {
    /// Connections that have not shown the token.
    strangers: BTreeMap<u64, TcpStream>,
    /// Connections that have shown the token.
    known: BTreeMap<u64, TcpStream>,
}

impl Connections {
    /// Adds a connection without the token. If there are too many, closes the oldest.
    fn add(&mut self, id: u64, stream: TcpStream) {
        self.strangers.insert(id, stream);
        while self.strangers.len() > MAX_STRANGERS {
            if let Some((_, oldest)) = self.strangers.pop_first() {
                let _ = oldest.shutdown(Shutdown::Both);
            }
        }
    }

    /// Moves a connection to `known` after it has shown the token. Returns false if `known` is
    /// full.
    fn admit(&mut self, id: u64) -> bool {
        if self.known.len() >= MAX_KNOWN {
            return false;
        }
        // If the connection was closed meanwhile, reads and writes of its thread fail, and the
        // thread ends.
        self.known.extend(self.strangers.remove_entry(&id));
        true
    }

    /// Removes a closed connection.
    fn remove(&mut self, id: u64) {
        self.strangers.remove(&id);
        self.known.remove(&id);
    }

    fn is_empty(&self) -> bool {
        self.strangers.is_empty() && self.known.is_empty()
    }

    /// Closes all connections, with and without the token.
    fn close(&self) {
        for stream in self.strangers.values().chain(self.known.values()) {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }
}

impl Server {
    /// Listens on the address and port of `options`.
    ///
    /// # Errors
    ///
    /// An unavailable address or port.
    pub fn bind(options: &Options) -> Result<Self, Error> {
        let wanted = SocketAddr::new(options.listen, options.port);
        let failed = |error: io::Error| {
            let help = match error.kind() {
                ErrorKind::AddrInUse => "use another --port, or none for a free one",
                ErrorKind::AddrNotAvailable => "--listen takes an address of this machine",
                _ => "use another --port or --listen",
            };
            Error::Failed(format!("cannot listen on {wanted}: {error}\n  help: {help}"))
        };
        let listener = TcpListener::bind(wanted).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let mut random = [0; 16];
        getrandom::fill(&mut random)
            .map_err(|error| Error::Failed(format!("the system gives no random numbers: {error}")))?;
        let mut token = String::new();
        for byte in random {
            // Writing to a string cannot fail.
            let _ = write!(token, "{byte:02x}");
        }
        Ok(Self {
            listener,
            address,
            token,
            open: Mutex::default(),
        })
    }

    /// Link to the page.
    pub fn link(&self) -> String {
        let mut address = self.address;
        // A browser cannot connect to an unspecified address, so use the loopback address.
        match address.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => address.set_ip(Ipv4Addr::LOCALHOST.into()),
            IpAddr::V6(ip) if ip.is_unspecified() => address.set_ip(Ipv6Addr::LOCALHOST.into()),
            _ => {}
        }
        format!("http://{address}/{}/", self.token)
    }

    /// Locks and returns the open connections.
    fn open(&self) -> MutexGuard<'_, Connections> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Serves until the hub ends. Each connection has a thread of `scope`.
    pub fn run<'s>(&'s self, scope: &'s Scope<'s, '_>, hub: &'s Hub) {
        self.accept(scope, hub);
        let start = Instant::now();
        while !self.open().is_empty() && start.elapsed() < FAREWELL {
            thread::sleep(POLL_INTERVAL);
        }
        // Close the connections, because their threads may still wait for a page.
        self.open().close();
    }

    /// Accepts connections until the hub ends.
    fn accept<'s>(&'s self, scope: &'s Scope<'s, '_>, hub: &'s Hub) {
        for id in 0.. {
            let Some(stream) = self.next_connection(hub) else {
                return;
            };
            let ready = stream
                .set_nonblocking(false)
                .and_then(|()| stream.set_write_timeout(Some(WRITE_PATIENCE)))
                .and_then(|()| stream.set_nodelay(true));
            let Ok(copy) = ready.and_then(|()| stream.try_clone()) else {
                continue;
            };
            self.open().add(id, copy);
            let serve = move || {
                self.serve(id, stream, hub);
                self.open().remove(id);
            };
            let thread = thread::Builder::new().name("page".into());
            if thread.spawn_scoped(scope, serve).is_err() {
                self.open().remove(id);
            }
        }
    }

    /// The next connection; `None` after the hub has ended.
    fn next_connection(&self, hub: &Hub) -> Option<TcpStream> {
        while !hub.is_over() {
            match self.listener.accept() {
                Ok((stream, _)) => return Some(stream),
                Err(_) => thread::sleep(POLL_INTERVAL),
            }
        }
        None
    }

    /// Serves the connection with the number `id`.
    fn serve(&self, id: u64, mut stream: TcpStream, hub: &Hub) {
        let request = match read_request(&mut stream) {
            Ok(request) => request,
            Err(refusal) => {
                let _ = refuse(&mut stream, &refusal);
                return;
            }
        };
        match self.route(&request).and_then(|route| self.admitted(id, route)) {
            Err(refusal) => drop(refuse(&mut stream, &refusal)),
            Ok(Route::File(kind, text)) => {
                drop(answer(&mut stream, (200, "OK"), kind, "", text.as_bytes()));
            }
            Ok(Route::Home) => {
                let place = format!("Location: /{}/\r\n", self.token);
                drop(answer(
                    &mut stream,
                    (308, "Permanent Redirect"),
                    "text/plain",
                    &place,
                    b"",
                ));
            }
            Ok(Route::Picture(format)) => drop(send_picture(&mut stream, hub, format)),
            Ok(Route::Socket(key)) => {
                let head = format!(
                    "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {}\r\n\r\n",
                    derive_accept_key(key.as_bytes())
                );
                if stream.write_all(head.as_bytes()).is_ok() {
                    socket::serve(stream, hub);
                }
            }
        }
    }

    /// The `route` of a request with the token, or a refusal if there are too many connections.
    fn admitted(&self, id: u64, route: Route) -> Result<Route, Refusal> {
        if self.open().admit(id) {
            Ok(route)
        } else {
            Err((503, "Service Unavailable", "too many connections; close a page".into()))
        }
    }

    /// Route of a request.
    fn route(&self, request: &Request) -> Result<Route, Refusal> {
        let forbidden = |words: &str| Err((403, "Forbidden", words.to_string()));
        if !is_known_host(&request.host, self.address.ip()) {
            return forbidden("This server answers only to localhost and to IP addresses.");
        }
        if !is_own_origin(request.origin.as_deref(), &request.host) {
            return forbidden("Requests from pages of other servers are refused.");
        }
        let (path, query) = request.target.split_once('?').unwrap_or((&request.target, ""));
        let mut parts = path.splitn(3, '/').skip(1);
        if !is_same(parts.next().unwrap_or_default(), &self.token) {
            return forbidden("This link is not valid: open the link that the render has printed.");
        }
        let Some(name) = parts.next() else {
            return Ok(Route::Home);
        };
        match (name, &request.socket_key) {
            ("socket", Some(key)) => Ok(Route::Socket(key.clone())),
            ("picture.exr", None) => Ok(Route::Picture(SaveFormat::Exr)),
            ("picture.png", None) => Ok(Route::Picture(SaveFormat::Png(tone_of(query)))),
            ("texture.png", None) => match query.strip_prefix("id=").map(str::parse) {
                Some(Ok(id)) => Ok(Route::Picture(SaveFormat::Texture(id))),
                _ => Err((404, "Not Found", "Textures have a number: texture.png?id=0.".into())),
            },
            (name, None) => match page::file(name) {
                Some((kind, text)) => Ok(Route::File(kind, text)),
                None => Err((404, "Not Found", "There is no such page.".into())),
            },
            _ => Err((404, "Not Found", "There is no such socket.".into())),
        }
    }
}

/// Response to a request.
enum Route {
    File(&'static str, &'static str),
    Home,
    Picture(SaveFormat),
    Socket(String),
}

/// Compares `given` with the token. All bytes are compared, so that the time does not depend on the
/// first difference.
fn is_same(given: &str, token: &str) -> bool {
    let differs = given.bytes().zip(token.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
    given.len() == token.len() && differs == 0
}

/// Parses `exposure=STOPS&tone=NAME` of a query; `None` if either is missing.
fn tone_of(query: &str) -> Option<Tone> {
    let value = |key: &str| {
        let mut pairs = query.split('&').filter_map(|pair| pair.split_once('='));
        pairs.find(|(name, _)| *name == key).map(|(_, value)| value)
    };
    let stops = value("exposure")?
        .parse::<f32>()
        .ok()
        .filter(|stops| stops.is_finite())?;
    let name = value("tone")?;
    let (_, curve) = Curve::NAMES.iter().find(|(known, _)| *known == name)?;
    Some(Tone {
        exposure: Exposure::Stops(stops),
        curve: *curve,
    })
}

fn refuse(stream: &mut TcpStream, (status, name, words): &Refusal) -> io::Result<()> {
    let text = format!("{words}\n");
    answer(
        stream,
        (*status, name),
        "text/plain; charset=utf-8",
        "",
        text.as_bytes(),
    )
}

/// Requests a file of the picture from the render, and sends it.
fn send_picture(stream: &mut TcpStream, hub: &Hub, format: SaveFormat) -> io::Result<()> {
    let (kind, name) = match format {
        SaveFormat::Exr => ("image/x-exr", "picture.exr"),
        SaveFormat::Png(_) => ("image/png", "picture.png"),
        SaveFormat::Texture(_) => ("image/png", "texture.png"),
    };
    let (reply, answered) = channel();
    hub.send(Mail::Save(format, reply));
    let made = loop {
        match answered.recv_timeout(POLL_INTERVAL) {
            Ok(made) => break made,
            Err(RecvTimeoutError::Timeout) if !hub.is_over() => {}
            Err(_) => break Err("the render has ended".into()),
        }
    };
    match made {
        Ok(bytes) => {
            let place = format!("Content-Disposition: attachment; filename=\"{name}\"\r\n");
            answer(stream, (200, "OK"), kind, &place, &bytes)
        }
        Err(words) => refuse(stream, &(409, "Conflict", words)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_the_same_or_not() {
        assert!(is_same("ab", "ab"));
        assert!(!is_same("ab", "abc") && !is_same("abc", "ab") && !is_same("", "ab") && !is_same("aB", "ab"));
    }

    #[test]
    fn tones_of_queries() {
        let tone = tone_of("exposure=-1.5&tone=agx").unwrap();
        assert_eq!((tone.exposure, tone.curve), (Exposure::Stops(-1.5), Curve::Agx));
        for query in ["", "exposure=1", "exposure=nan&tone=agx", "exposure=1&tone=x"] {
            assert!(tone_of(query).is_none(), "{query}");
        }
    }
}
