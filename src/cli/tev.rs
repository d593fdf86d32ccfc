//! Live preview in tev (<https://github.com/Tom94/tev>) or another viewer with its TCP protocol:
//! `--tev`.
//!
//! A separate thread sends the pictures. The time from one picture to the next is fifty times the
//! time that was needed to send the last picture, and at least a second. During the render only `R
//! G B` are sent, because developing fourteen channels takes several times as long. The last
//! picture has the default channels of image files. A picture is sent in bands of rows, which
//! limits memory and keeps the packet length within 32 bits.
//!
//! If a viewer reads nothing for 3 s, or takes 10 s for a picture, the connection is closed, as if
//! the user had closed the viewer. Only the last picture makes the program wait.

use super::args::RenderArgs;
use super::progress::interrupted_for;
use crate::film::{Channel, Film, Image};
use crate::io::FileError;
use std::io;
use std::net::{Shutdown, TcpStream, ToSocketAddrs};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

/// Maximum time for a viewer to accept a connection, or to read again after it has stopped reading.
const PATIENCE: Duration = Duration::from_secs(3);

/// Maximum time for a viewer to read one picture.
const LONGEST: Duration = Duration::from_secs(10);

/// Maximum time for a viewer to read a band of the last picture. The program waits for this
/// picture. After an interrupt, it is the maximum time for the whole picture.
const PATIENCE_AT_END: Duration = Duration::from_secs(1);

/// Time between two checks for interrupts.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Minimum time between two pictures.
const SHORTEST_INTERVAL: Duration = Duration::from_secs(1);

/// Time between two pictures, divided by the time to send the last picture. The preview therefore
/// takes less than 2 % of a render.
const INTERVAL_FACTOR: u32 = 50;

/// Maximum number of floats in a packet, unless one row has more. The packet length must fit 32
/// bits. tev allocates 1 MiB for a packet, and this number stays within it.
const PACKET: usize = 1 << 17;

/// The viewer of a render, if any. A separate thread sends the pictures, so that a slow viewer does
/// not delay the render. A picture that is due while the previous one is being sent is skipped.
pub(super) struct Preview {
    viewer: Option<SenderThread>,
    /// Time between two pictures; `None` without a viewer.
    pub interval: Option<Duration>,
}

/// Handle of the thread that sends pictures.
struct SenderThread {
    /// Address as the user wrote it.
    address: String,
    /// Connection of the thread. The thread ends if this connection is closed.
    connection: TcpStream,
    work: Sender<ViewerMessage>,
    /// Result of each work item.
    results: Receiver<io::Result<()>>,
    /// Number of bands sent so far.
    bands: Arc<AtomicU64>,
    /// Start of the current work item.
    since: Option<Instant>,
}

/// Work item of the thread.
enum ViewerMessage {
    /// A black image with this width and height.
    Open([u32; 2]),
    Picture(Image),
}

struct Viewer {
    client: TevClient,
    /// Name of the image. Viewers identify images by name.
    name: String,
    bands: Arc<AtomicU64>,
}

impl Preview {
    /// Connects to the viewer of the arguments, if they name one.
    ///
    /// # Errors
    ///
    /// No viewer responds at the address.
    pub fn new(args: &RenderArgs) -> Result<Self, FileError> {
        let connect = |address: &String| SenderThread::connect(address, &args.scene);
        let viewer = args.tev.as_ref().map(connect).transpose()?;
        Ok(Self {
            interval: viewer.as_ref().map(|_| SHORTEST_INTERVAL),
            viewer,
        })
    }

    /// Opens a black image of the film's full size, with the default channels of image files. If
    /// the connection is lost, this function and the following functions return an error once.
    /// Afterwards there is no viewer.
    pub fn open(&mut self, film: &Film) -> Option<FileError> {
        self.send(|| ViewerMessage::Open(film.resolution().to_array()))
    }

    /// Shows the current picture, unless the viewer is busy. Only the picture's channels are sent,
    /// because the other channels would take most of the time.
    pub fn update(&mut self, film: &Film) -> Option<FileError> {
        self.send(|| ViewerMessage::Picture(film.develop_picture()))
    }

    /// Shows the final `image`, limited to the default channels of image files. Waits until all
    /// bands are sent, or until the time limit.
    pub fn finish(&mut self, image: &Image) -> Option<FileError> {
        let viewer = self.viewer.as_mut()?;
        let start = Instant::now();
        let shown = viewer.wait(start).and_then(|()| {
            viewer.give(ViewerMessage::Picture(image.clone()));
            viewer.wait(start)
        });
        shown.err().map(|error| self.lose(&error))
    }

    /// Sends `work` to the thread, unless it is busy.
    fn send(&mut self, work: impl FnOnce() -> ViewerMessage) -> Option<FileError> {
        let viewer = self.viewer.as_mut()?;
        match viewer.poll() {
            Ok(None) => None,
            Ok(Some(last)) => {
                self.interval = Some(SHORTEST_INTERVAL.max(last * INTERVAL_FACTOR));
                viewer.give(work());
                None
            }
            Err(error) => Some(self.lose(&error)),
        }
    }

    fn lose(&mut self, error: &io::Error) -> FileError {
        let viewer = self.viewer.take();
        self.interval = None;
        let address = viewer.map_or(String::new(), |viewer| {
            // Close the connection, which ends the thread.
            let _ = viewer.connection.shutdown(Shutdown::Both);
            viewer.address
        });
        lost(&address, error)
    }
}

impl SenderThread {
    /// Connects to `address`, a host and a port. The image name has `scene` and the process id, so
    /// that the viewer keeps images of other runs.
    fn connect(address: &str, scene: &Path) -> Result<Self, FileError> {
        let connected = address.to_socket_addrs().and_then(|sockets| {
            // A name such as localhost may have several addresses.
            let mut tried = Err(io::Error::other("the host has no address"));
            for socket in sockets {
                tried = TcpStream::connect_timeout(&socket, PATIENCE);
                if tried.is_ok() {
                    break;
                }
            }
            let stream = tried?;
            stream.set_write_timeout(Some(PATIENCE))?;
            Ok((stream.try_clone()?, stream))
        });
        let (connection, stream) = connected.map_err(|error| {
            FileError::system(Path::new(address), "cannot connect to a viewer", &error)
                .help("start tev first; by default it listens at 127.0.0.1:14158")
        })?;
        let scene = scene.file_name().unwrap_or_default().to_string_lossy();
        let bands = Arc::new(AtomicU64::new(0));
        let mut viewer = Viewer {
            client: TevClient::wrap(stream),
            name: format!("{scene} (process {})", std::process::id()),
            bands: Arc::clone(&bands),
        };
        let (work, works) = channel();
        let (outcomes, results) = channel();
        let send = move || {
            for work in works {
                let sent = match work {
                    ViewerMessage::Open(size) => viewer.open(size),
                    ViewerMessage::Picture(image) => viewer.send(&image),
                };
                let is_lost = sent.is_err();
                if outcomes.send(sent).is_err() || is_lost {
                    break;
                }
            }
        };
        let thread = thread::Builder::new().name("tev".into()).spawn(send);
        thread
            .map_err(|error| FileError::system(Path::new(address), "cannot start a thread for the viewer", &error))?;
        Ok(Self {
            address: address.into(),
            connection,
            work,
            results,
            bands,
            since: None,
        })
    }

    /// Sends work to the idle thread.
    fn give(&mut self, work: ViewerMessage) {
        // If the thread has ended, the next check reports it.
        let _ = self.work.send(work);
        self.since = Some(Instant::now());
    }

    /// Duration of the last work item; `None` if the thread is still busy.
    fn poll(&mut self) -> io::Result<Option<Duration>> {
        self.poll_for(Duration::ZERO)
    }

    /// Waits at most `patience` for the end of the last work item. Returns the duration of this
    /// item; `None` if the thread is still busy.
    fn poll_for(&mut self, patience: Duration) -> io::Result<Option<Duration>> {
        let Some(since) = self.since else {
            return Ok(Some(Duration::ZERO));
        };
        match self.results.recv_timeout(patience) {
            Ok(result) => {
                self.since = None;
                result.map(|()| Some(since.elapsed()))
            }
            Err(RecvTimeoutError::Disconnected) => Err(io::ErrorKind::BrokenPipe.into()),
            Err(RecvTimeoutError::Timeout) if since.elapsed() > LONGEST => Err(slow(LONGEST)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
        }
    }

    /// Waits until the thread is idle. Returns an error if the thread sends no band for
    /// [`PATIENCE_AT_END`], if this time has passed since an interrupt, or if [`LONGEST`] has
    /// passed since `start`.
    fn wait(&mut self, start: Instant) -> io::Result<()> {
        let (mut bands, mut moved) = (self.bands.load(Ordering::Relaxed), Instant::now());
        let is_interrupted = interrupted_for(PATIENCE_AT_END);
        while self.poll_for(POLL_INTERVAL)?.is_none() {
            let sent = self.bands.load(Ordering::Relaxed);
            if sent != bands {
                (bands, moved) = (sent, Instant::now());
            }
            if moved.elapsed() > PATIENCE_AT_END || is_interrupted() {
                return Err(slow(PATIENCE_AT_END));
            }
            if start.elapsed() > LONGEST {
                return Err(slow(LONGEST));
            }
        }
        Ok(())
    }
}

/// Error of a viewer that takes longer than `patience`.
fn slow(patience: Duration) -> io::Error {
    let seconds = patience.as_secs();
    io::Error::other(format!(
        "it reads too slowly: it has not taken the picture within {seconds} s"
    ))
}

/// Error that the viewer at `address` is lost.
fn lost(address: &str, error: &io::Error) -> FileError {
    let message = match error.kind() {
        // Systems report a time-out with different kinds.
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => {
            format!("lost the viewer: it has read nothing for {} s", PATIENCE.as_secs())
        }
        _ => format!("lost the viewer: {error}"),
    };
    FileError::new(Path::new(address), message)
}

impl Viewer {
    fn open(&mut self, [width, height]: [u32; 2]) -> io::Result<()> {
        let channels: Vec<&str> = Image::channel_names().collect();
        self.client.send(PacketCreateImage {
            image_name: &self.name,
            grab_focus: true,
            width,
            height,
            channel_names: &channels,
        })
    }

    /// Sends the channels of `image` that `open` has created, in bands of rows.
    fn send(&mut self, image: &Image) -> io::Result<()> {
        let channels: Vec<&Channel> = Image::channel_names().filter_map(|name| image.channel(name)).collect();
        let names: Vec<&str> = channels.iter().map(|c| c.name.as_ref()).collect();
        let size = image.crop.size();
        let width = size.x as usize;
        let rows = (PACKET / (width * names.len()).max(1)).max(1);
        for (top, height) in (0..size.y)
            .step_by(rows)
            .map(|top| (top, (size.y - top).min(rows as u32)))
        {
            // Channels are stored one after the other
            let pixels = width * height as usize;
            let first = width * top as usize;
            let band = channels.iter().flat_map(|c| &c.values[first..first + pixels]);
            let offsets: Vec<u64> = (0..names.len()).map(|c| (c * pixels) as u64).collect();
            self.client.send(PacketUpdateImage {
                image_name: &self.name,
                grab_focus: false,
                channel_names: &names,
                channel_offsets: &offsets,
                channel_strides: &vec![1; names.len()],
                x: image.crop.min.x,
                y: image.crop.min.y + top,
                width: size.x,
                height,
                data: &band.copied().collect::<Vec<f32>>(),
            })?;
            self.bands.fetch_add(1, Ordering::Relaxed);
        }
        Ok(())
    }
}
