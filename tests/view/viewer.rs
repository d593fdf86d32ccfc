//! A running viewer, and a page without a browser.

use super::coding;
use crate::support::program::{PROGRAM, signal};
use crate::support::read_rgb;
use half::f16;
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// Timeout of any step. It is long, because test machines are busy.
pub const PATIENCE: Duration = Duration::from_secs(120);

/// A viewer that runs until the value is dropped.
pub struct Viewer {
    pub child: Child,
    /// Address and port.
    pub address: String,
    pub token: String,
    _out: BufReader<ChildStdout>,
}

impl Viewer {
    pub fn start(folder: &Path, args: &[&str]) -> Self {
        let mut child = Command::new(PROGRAM)
            .current_dir(folder)
            .args(["view", "--no-open", "-q"])
            .args(args)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut link = String::new();
        out.read_line(&mut link).unwrap();
        let rest = link.trim().strip_prefix("http://").unwrap_or_else(|| panic!("{link}"));
        let (address, token) = rest.split_once('/').unwrap();
        Self {
            child,
            address: address.into(),
            token: token.trim_end_matches('/').into(),
            _out: out,
        }
    }

    pub fn link(&self) -> String {
        format!("http://{}/{}/", self.address, self.token)
    }

    /// Sends a raw request. Returns the status and the body of the answer.
    pub fn request(&self, text: &str) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        // A server may refuse before it has read the whole request.
        let _ = stream.write_all(text.as_bytes());
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let head = answer
            .windows(4)
            .position(|end| end == b"\r\n\r\n")
            .unwrap_or(answer.len());
        let status = String::from_utf8_lossy(&answer[..head])
            .split(' ')
            .nth(1)
            .unwrap_or("0")
            .parse()
            .unwrap();
        (status, answer[(head + 4).min(answer.len())..].to_vec())
    }

    pub fn get(&self, path: &str) -> (u16, Vec<u8>) {
        let Self { address, token, .. } = self;
        self.request(&format!("GET /{token}/{path} HTTP/1.1\r\nHost: {address}\r\n\r\n"))
    }

    pub fn page(&self) -> Page {
        Page::open(self).unwrap()
    }

    /// Interrupts the viewer. Returns the exit code, and the time from the interrupt to the end.
    pub fn interrupt(mut self) -> (Option<i32>, Duration) {
        let start = Instant::now();
        signal(&self.child, "INT");
        let code = self.child.wait().unwrap().code();
        (code, start.elapsed())
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A page that is simulated without a browser.
pub struct Page {
    pub socket: WebSocket<TcpStream>,
}

/// An image that the server sent to a page.
pub struct Frame {
    pub header: Value,
    /// Samples as 16-bit floats.
    pub pixels: Vec<u8>,
    /// Length of the message in bytes.
    pub bytes: usize,
}

impl Page {
    pub fn open(viewer: &Viewer) -> Result<Self, String> {
        Self::open_at(viewer, &viewer.address)
    }

    /// Opens a page at another address of the server.
    pub fn open_at(viewer: &Viewer, at: &str) -> Result<Self, String> {
        let stream = TcpStream::connect(at).map_err(|e| e.to_string())?;
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let address = format!("ws://{at}/{}/socket", viewer.token);
        let mut request = address.into_client_request().map_err(|e| e.to_string())?;
        let origin = format!("http://{at}");
        request.headers_mut().insert("Origin", origin.parse().unwrap());
        let (socket, _) = tungstenite::client(request, stream).map_err(|e| e.to_string())?;
        Ok(Self { socket })
    }

    pub fn send(&mut self, text: &str) {
        self.socket.send(Message::text(text)).unwrap();
    }

    pub fn next(&mut self) -> Message {
        self.socket.read().unwrap()
    }

    /// Next message of this type.
    pub fn message(&mut self, kind: &str) -> Value {
        self.message_where(kind, |_| true)
    }

    /// Next message of this type for which `is_it` returns true.
    pub fn message_where(&mut self, kind: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            assert!(start.elapsed() < PATIENCE, "no {kind}");
            match self.next() {
                Message::Text(text) => {
                    let value: Value = serde_json::from_str(&text).unwrap();
                    assert!(
                        kind == "error" || value["type"] != "error",
                        "while waiting for {kind}: {value}"
                    );
                    if value["type"] == kind && is_it(&value) {
                        return value;
                    }
                }
                Message::Binary(bytes) => self.shown(&Frame::of(&bytes)),
                _ => {}
            }
        }
    }

    /// Next image for which `is_it` returns true.
    pub fn frame_where(&mut self, is_it: impl Fn(&Value) -> bool) -> Frame {
        let start = Instant::now();
        loop {
            assert!(start.elapsed() < PATIENCE, "no picture");
            if let Message::Binary(bytes) = self.next() {
                let frame = Frame::of(&bytes);
                self.shown(&frame);
                if is_it(&frame.header) {
                    return frame;
                }
            }
        }
    }

    pub fn shown(&mut self, frame: &Frame) {
        self.send(&format!(r#"{{"do":"shown","frame":{}}}"#, frame.header["frame"]));
    }

    /// Waits until all samples are rendered.
    pub fn wait_for_all(&mut self) -> Value {
        self.message_where("status", |status| status["phase"] == "complete")
    }

    /// Sets the camera, and waits until it is confirmed.
    pub fn look(&mut self, camera: &Value) {
        let mut command = camera.clone();
        command["do"] = "camera".into();
        self.send(&command.to_string());
        self.message_where("camera", |said| said["camera"] == *camera);
    }
}

impl Frame {
    pub fn of(bytes: &[u8]) -> Self {
        let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        let header = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
        Self {
            pixels: coding::pixels(&header, &bytes[4 + length..]),
            header,
            bytes: bytes.len(),
        }
    }

    pub fn halves(&self) -> impl Iterator<Item = f16> {
        self.pixels.chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]]))
    }
}

/// Red, green and blue of each pixel of an EXR file, as sent to pages.
pub fn halves_of(path: &Path) -> Vec<f16> {
    let [r, g, b] = read_rgb(path);
    let pixels = r.iter().zip(&g).zip(&b);
    pixels.flat_map(|((r, g), b)| [*r, *g, *b].map(f16::from_f32)).collect()
}

/// A copy of the Cornell box that tests may change.
pub fn cornell_box() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for name in ["cornell-box.toml", "cornell-box.obj", "cornell-box.mtl"] {
        fs::copy(scenes.join(name), folder.path().join(name)).unwrap();
    }
    folder
}

/// The Cornell box with a point light in its scene file, so the page has controls for it.
pub fn two_lamps() -> TempDir {
    let folder = cornell_box();
    let path = folder.path().join("cornell-box.toml");
    let light = "\n[[light]]\ntype = \"point\"\nposition = [278, 400, 150]\nintensity = [20000, 20000, 40000]\n";
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text + light).unwrap();
    folder
}
