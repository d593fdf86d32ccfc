//! Live preview in tev (<https://github.com/Tom94/tev>) or another viewer that speaks its TCP protocol: what `--tev` asks for.

use super::args::RenderArgs;
use crate::film::{Channel, Film, Image};
use crate::io::FileError;
use std::io;
use std::net::{TcpStream, ToSocketAddrs};
use std::path::Path;
use std::time::{Duration, Instant};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

/// How long a viewer may take to answer, and to read on where it has stopped.
const PATIENCE: Duration = Duration::from_secs(3);

/// How long sending one picture may take, for which the render waits.
const LONGEST: Duration = Duration::from_secs(10);

/// Between one picture and the next, at least.
const SHORTEST_INTERVAL: Duration = Duration::from_secs(1);

/// The interval is also so many times what the last picture took: less than 2 % of a render go into its preview.
const INTERVAL_FACTOR: u32 = 50;

/// Floats in a packet, where that is a row or more. A packet's length must fit 32 bits; tev sets 1 MiB aside for one, which this keeps within.
const PACKET: usize = 1 << 17;

/// Who looks on while a render goes on, if anybody does.
pub(super) struct Preview {
    viewer: Option<Viewer>,
    /// Time to leave until the next picture; `None` where nobody looks on.
    pub interval: Option<Duration>,
}

struct Viewer {
    /// As the user named it.
    address: String,
    client: TevClient,
    /// Of the image: viewers know images by name.
    name: String,
}

impl Preview {
    /// Connects to the viewer that the arguments name, if they do.
    ///
    /// # Errors
    ///
    /// Nobody answers there.
    pub fn new(args: &RenderArgs) -> Result<Self, FileError> {
        let connect = |address: &String| Viewer::connect(address, &args.scene);
        let viewer = args.tev.as_ref().map(connect).transpose()?;
        Ok(Self {
            interval: viewer.as_ref().map(|_| SHORTEST_INTERVAL),
            viewer,
        })
    }

    /// Opens a black image of the film's full size, with the channels that all files have. Here and below, a viewer that cannot be reached any more
    /// is what comes back, once; after that nobody looks on.
    pub fn open(&mut self, film: &Film) -> Option<FileError> {
        self.tell(|viewer| viewer.open(film))
    }

    /// Shows the picture so far. The other channels are left out: they would take most of the time.
    pub fn update(&mut self, film: &Film) -> Option<FileError> {
        self.tell(|viewer| viewer.send(&film.develop_picture()))
    }

    /// Shows `image`, that of the file, as far as it has channels that all files have.
    pub fn finish(&mut self, image: &Image) -> Option<FileError> {
        self.tell(|viewer| viewer.send(image))
    }

    fn tell(&mut self, what: impl FnOnce(&mut Viewer) -> io::Result<()>) -> Option<FileError> {
        let viewer = self.viewer.as_mut()?;
        let start = Instant::now();
        let told = what(viewer);
        self.interval = Some(SHORTEST_INTERVAL.max(start.elapsed() * INTERVAL_FACTOR));
        let lost = viewer.lost(&told.err()?);
        *self = Self {
            viewer: None,
            interval: None,
        };
        Some(lost)
    }
}

impl Viewer {
    /// At `address`, a host and a port; the image is named after `scene` and this process, so that the viewer keeps those of other runs.
    fn connect(address: &str, scene: &Path) -> Result<Self, FileError> {
        let connected = address.to_socket_addrs().and_then(|sockets| {
            // A name such as localhost may stand for several addresses.
            let mut tried = Err(io::Error::other("the host has no address"));
            for socket in sockets {
                tried = TcpStream::connect_timeout(&socket, PATIENCE);
                if tried.is_ok() {
                    break;
                }
            }
            let stream = tried?;
            stream.set_write_timeout(Some(PATIENCE))?;
            Ok(stream)
        });
        let stream = connected.map_err(|error| {
            FileError::system(Path::new(address), "cannot connect to a viewer", &error)
                .help("start tev there first; it listens at 127.0.0.1:14158 where its own --host says nothing else")
        })?;
        let scene = scene.file_name().unwrap_or_default().to_string_lossy();
        Ok(Self {
            address: address.into(),
            client: TevClient::wrap(stream),
            name: format!("{scene} (process {})", std::process::id()),
        })
    }

    fn open(&mut self, film: &Film) -> io::Result<()> {
        let channels: Vec<&str> = Image::channel_names().collect();
        self.client.send(PacketCreateImage {
            image_name: &self.name,
            grab_focus: true,
            width: film.resolution().x,
            height: film.resolution().y,
            channel_names: &channels,
        })
    }

    /// Sends those channels of `image` that were opened, in bands of rows.
    fn send(&mut self, image: &Image) -> io::Result<()> {
        let start = Instant::now();
        let channels: Vec<&Channel> = Image::channel_names().filter_map(|name| image.channel(name)).collect();
        let names: Vec<&str> = channels.iter().map(|c| c.name.as_ref()).collect();
        let size = image.crop.size();
        let width = size.x as usize;
        let rows = (PACKET / (width * names.len()).max(1)).max(1);
        for (top, height) in (0..size.y)
            .step_by(rows)
            .map(|top| (top, (size.y - top).min(rows as u32)))
        {
            // Channel after channel
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
            if start.elapsed() > LONGEST {
                let slow = format!("a picture takes longer than {} s", LONGEST.as_secs());
                return Err(io::Error::other(slow));
            }
        }
        Ok(())
    }

    fn lost(&self, error: &io::Error) -> FileError {
        let message = match error.kind() {
            // What systems call a time-out differs.
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => {
                format!("lost the viewer: it has read nothing for {} s", PATIENCE.as_secs())
            }
            _ => format!("lost the viewer: {error}"),
        };
        FileError::new(Path::new(&self.address), message)
    }
}
