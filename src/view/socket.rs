//! WebSocket of a page. It passes commands of the page to the render, and messages and pictures of
//! the render to the page.
//!
//! A page reports each picture that it has shown, and the number of bytes in transit is limited. So
//! a slow link shows fewer pictures, but no old pictures. The speed of the link is measured from
//! the transit time, and pictures are packed for slow links. The rate of commands is limited: a
//! page that sends more must wait, and a page that sends many invalid messages is closed.

use super::frame::Encoding;
use super::hub::{Hub, Mail, PageId};
use super::protocol::Command;
use crate::io::half_picture::PICTURE;
use std::io::ErrorKind;
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

/// Time between two checks for something to send.
const POLL_INTERVAL: Duration = Duration::from_millis(5);
/// Maximum size of a command in bytes.
const MAX_COMMAND: usize = 64 << 10;
/// Maximum number of picture bytes in transit. At this number no further picture is sent. It is the
/// size of a full picture, or of two pictures of a moving camera.
const MAX_ON_WAY: usize = 192 << 10;
/// Maximum transit time in seconds of pictures on a slow link.
const MAX_DELAY: f64 = 0.08;
/// Speed in bytes per second below which pictures are packed: 50 Mbit/s.
const SLOW: f64 = 6.25e6;
/// Minimum size in bytes of a message to measure the speed of the link. The time of smaller
/// messages is mostly latency.
const MIN_MEASURED: usize = 24 << 10;
/// Time after which a picture no longer counts as in transit, even if the page has not reported it.
const SHOWING: Duration = Duration::from_secs(30);
/// Maximum number of commands per second. The second constant is the maximum number at once.
const RATE: f64 = 400.0;
const BURST: f64 = 800.0;
/// Maximum number of consecutive invalid messages before the page is closed.
const MAX_NONSENSE: u32 = 200;

/// Serves a page until it is closed or the hub ends.
pub(super) fn serve(stream: TcpStream, hub: &Hub) {
    if stream.set_read_timeout(Some(POLL_INTERVAL)).is_err() {
        return;
    }
    let config = WebSocketConfig::default()
        .read_buffer_size(16 << 10)
        .max_message_size(Some(MAX_COMMAND))
        .max_frame_size(Some(MAX_COMMAND));
    let id = hub.join();
    // Send a complete picture to the new page.
    let (name, second) = (PICTURE.to_string(), None);
    hub.send(Mail::Command(id, Command::Channel { name, second }));
    hub.send_text(Some(id), &serde_json::json!({ "type": "page", "page": id }).to_string());
    let mut page = Page {
        socket: WebSocket::from_raw_socket(stream, Role::Server, Some(config)),
        hub,
        id,
        sent: Vec::new(),
        speed: None,
        allowance: BURST,
        since: Instant::now(),
        nonsense: 0,
    };
    page.run();
    hub.leave(id);
}

/// Connection of a page.
struct Page<'a> {
    socket: WebSocket<TcpStream>,
    hub: &'a Hub,
    id: PageId,
    /// Pictures in transit: number, bytes, and time of sending.
    sent: Vec<(u64, usize, Instant)>,
    /// Speed of the link in bytes per second, if known.
    speed: Option<f64>,
    /// Number of commands that the page may send at once now. The second field is the time of the
    /// last update.
    allowance: f64,
    since: Instant,
    /// Number of consecutive invalid messages.
    nonsense: u32,
}

impl Page<'_> {
    fn run(&mut self) {
        while self.send().is_ok() && self.receive().is_ok() {
            if self.hub.is_over() {
                // The last messages may contain the reason for the end.
                let _ = self.send();
                self.close(CloseCode::Away, "the render has ended");
                return;
            }
        }
    }

    /// Sends waiting messages and pictures.
    fn send(&mut self) -> Result<(), Error> {
        self.sent.retain(|(.., at)| at.elapsed() < SHOWING);
        let on_way = self.sent.iter().map(|(_, bytes, _)| bytes).sum::<usize>();
        let most = self
            .speed
            .map_or(MAX_ON_WAY, |speed| MAX_ON_WAY.min((speed * MAX_DELAY) as usize));
        let (messages, frames) = self.hub.outgoing(self.id, on_way > 0 && on_way >= most);
        for message in messages {
            self.socket.send(Message::text(&*message))?;
        }
        for frame in frames {
            let coding = match self.speed {
                Some(speed) if speed >= SLOW => Encoding::Plain,
                _ => Encoding::Packed,
            };
            let bytes = frame.message(coding);
            self.sent.push((frame.id, bytes.len(), Instant::now()));
            self.socket.send(Message::Binary(bytes))?;
        }
        Ok(())
    }

    /// Handles the report that the page has shown the picture `id` and took `milliseconds` for it.
    fn shown(&mut self, id: u64, milliseconds: f64) {
        if let Some(at) = self.sent.iter().position(|(sent, ..)| *sent == id) {
            let (_, bytes, start) = self.sent[at];
            let seconds = start.elapsed().as_secs_f64() - (milliseconds * 1e-3).clamp(0.0, 60.0);
            if bytes >= MIN_MEASURED {
                let speed = bytes as f64 / seconds.max(1e-3);
                self.speed = Some(self.speed.map_or(speed, |known| 0.7 * known + 0.3 * speed));
            }
        }
        // Messages keep their order, so all older pictures were shown too.
        self.sent.retain(|(sent, ..)| *sent > id);
    }

    /// Receives a message, if any.
    fn receive(&mut self) -> Result<(), Error> {
        let message = match self.socket.read() {
            Ok(message) => message,
            Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                return Ok(());
            }
            Err(error) => return Err(error),
        };
        self.wait_for_allowance();
        let read = match &message {
            Message::Text(text) => Command::read(text.as_str()),
            Message::Binary(_) => Err("binary messages are not supported".into()),
            // The WebSocket library answers other messages.
            _ => return Ok(()),
        };
        match read {
            Ok(Command::Shown { frame, ms }) => self.shown(frame, ms),
            Ok(Command::Channel { name, second }) => {
                let names = [name.clone()].into_iter().chain(second.clone());
                self.hub.set_channels(self.id, names);
                self.hub.send(Mail::Command(self.id, Command::Channel { name, second }));
            }
            Ok(command) => self.hub.send(Mail::Command(self.id, command)),
            Err(words) => {
                self.nonsense += 1;
                if self.nonsense > MAX_NONSENSE {
                    self.close(CloseCode::Policy, "too many invalid messages");
                    return Err(Error::ConnectionClosed);
                }
                let text = serde_json::json!({ "type": "error", "text": words }).to_string();
                self.hub.send_text(Some(self.id), &text);
                return Ok(());
            }
        }
        self.nonsense = 0;
        Ok(())
    }

    /// Delays a page that sends too many commands.
    fn wait_for_allowance(&mut self) {
        self.allowance = (self.allowance + RATE * self.since.elapsed().as_secs_f64()).min(BURST) - 1.0;
        self.since = Instant::now();
        if self.allowance < 0.0 {
            thread::sleep(Duration::from_secs_f64(-self.allowance / RATE));
        }
    }

    fn close(&mut self, code: CloseCode, words: &'static str) {
        let frame = CloseFrame {
            code,
            reason: words.into(),
        };
        let _ = self.socket.close(Some(frame));
        let _ = self.socket.flush();
    }
}
