//! `render --tev`: a stand-in for the viewer receives the packets, and assembles the image.
//!
//! Protocol according to tev's README and `IpcPacket`. A packet is [length in bytes, including the
//! length field: u32][kind: u8][payload], little-endian. Strings end with a zero.

use crate::support::program::{CHANNELS, code, folder, run, words};
use crate::support::read_channel;
use std::collections::BTreeMap;
use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Output;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

const CREATE_IMAGE: u8 = 4;
const UPDATE_IMAGE_V3: u8 = 6;

/// Renders the Cornell box in `folder`.
fn render(folder: &Path, address: &str, args: &str) -> Output {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml");
    let args = [
        &["render", scene.to_str().unwrap()],
        &*args.split_whitespace().collect::<Vec<_>>(),
        &["--tev", address],
    ];
    run(folder, &args.concat())
}

/// Starts a stand-in for the viewer that handles its first client with `serve`. Returns the address
/// and the thread.
fn viewer<T: Send + 'static>(serve: impl FnOnce(TcpStream) -> T + Send + 'static) -> (String, thread::JoinHandle<T>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    (address, thread::spawn(move || serve(listener.accept().unwrap().0)))
}

/// Rest of a packet, from which fields are read.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn bytes(&mut self, count: usize) -> &'a [u8] {
        let (taken, rest) = self.0.split_at(count);
        self.0 = rest;
        taken
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes(4).try_into().unwrap())
    }

    fn index(&mut self) -> usize {
        i64::from_le_bytes(self.bytes(8).try_into().unwrap())
            .try_into()
            .unwrap()
    }

    fn string(&mut self) -> String {
        let length = self.0.iter().position(|&b| b == 0).unwrap();
        let text = String::from_utf8(self.bytes(length).to_vec()).unwrap();
        assert_eq!(self.bytes(1), [0]);
        text
    }

    fn strings(&mut self, count: usize) -> Vec<String> {
        (0..count).map(|_| self.string()).collect()
    }
}

/// Image as received by a viewer.
struct ViewerImage {
    name: String,
    size: [usize; 2],
    /// Values as bits, and the number of times that each was set.
    channels: BTreeMap<String, Vec<(u32, u32)>>,
}

impl ViewerImage {
    fn create(mut packet: Fields) -> Self {
        assert_eq!(packet.bytes(2), [CREATE_IMAGE, 1]);
        let name = packet.string();
        let size = [packet.u32() as usize, packet.u32() as usize];
        let count = packet.u32() as usize;
        let names = packet.strings(count);
        assert!(packet.0.is_empty());
        Self {
            name,
            size,
            channels: names
                .into_iter()
                .map(|n| (n, vec![(0, 0); size[0] * size[1]]))
                .collect(),
        }
    }

    fn update(&mut self, mut packet: Fields) {
        assert_eq!(packet.bytes(2), [UPDATE_IMAGE_V3, 0]);
        assert_eq!(packet.string(), self.name);
        let count = packet.u32() as usize;
        let names = packet.strings(count);
        let [x, y, width, height] = [(); 4].map(|()| packet.u32() as usize);
        assert!(x + width <= self.size[0] && y + height <= self.size[1]);
        let offsets: Vec<usize> = (0..count).map(|_| packet.index()).collect();
        let strides: Vec<usize> = (0..count).map(|_| packet.index()).collect();
        let data: Vec<u32> = packet
            .0
            .chunks(4)
            .map(|b| u32::from_le_bytes(b.try_into().unwrap()))
            .collect();
        for ((name, offset), stride) in names.iter().zip(offsets).zip(strides) {
            let channel = self.channels.get_mut(name).unwrap();
            for i in 0..width * height {
                let at = &mut channel[(y + i / width) * self.size[0] + x + i % width];
                *at = (data[offset + i * stride], at.1 + 1);
            }
        }
    }
}

/// Receives packets until the client disconnects. Returns the image, and the lengths of all
/// packets.
fn watch(mut client: TcpStream) -> (ViewerImage, Vec<usize>) {
    let mut bytes = Vec::new();
    client.read_to_end(&mut bytes).unwrap();
    let mut stream = Fields(&bytes);
    let mut next = || {
        let length = (!stream.0.is_empty()).then(|| stream.u32() as usize)?;
        Some(Fields(stream.bytes(length - 4)))
    };
    let mut shown = ViewerImage::create(next().unwrap());
    let mut lengths = Vec::new();
    while let Some(packet) = next() {
        lengths.push(packet.0.len() + 4);
        shown.update(packet);
    }
    (shown, lengths)
}

/// At the end, the viewer's image is bit-identical to the file, for the pixels of the crop. The
/// viewer displayed the image before the end.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn the_viewer_has_the_picture() {
    let folder = folder(&[]);
    let (address, shown) = viewer(watch);
    let args = "--size 400x260 --crop 7,5,390,250 --spp 65536 --time-limit 2.5s -o a.exr";
    let out = render(folder.path(), &address, args);
    assert_eq!(code(&out), 0, "{}", words(&out));
    assert!(!words(&out).contains("warning"), "{}", words(&out));
    let (shown, lengths) = shown.join().unwrap();
    assert!(shown.name.contains("cornell-box.toml"), "{}", shown.name);
    assert_eq!(shown.size, [400, 260]);
    assert!(lengths.iter().all(|&length| length <= 1 << 20), "{lengths:?}");
    let names: Vec<&str> = shown.channels.keys().map(String::as_str).collect();
    let mut expected = CHANNELS;
    expected.sort_unstable();
    assert_eq!(names, expected);

    let times = shown.channels["R"][5 * 400 + 7].1;
    assert!(times >= 2, "{times}");
    for (name, channel) in &shown.channels {
        let file = read_channel(&folder.path().join("a.exr"), name);
        let mut file = file.iter().map(|v| v.to_bits());
        let times = if ["R", "G", "B"].contains(&name.as_str()) {
            times
        } else {
            1
        };
        for (y, row) in channel.chunks(400).enumerate() {
            for (x, &(bits, set)) in row.iter().enumerate() {
                if (7..390).contains(&x) && (5..250).contains(&y) {
                    assert_eq!((bits, set), (file.next().unwrap(), times), "{name} at {x},{y}");
                } else {
                    assert_eq!(set, 0, "{name} at {x},{y}");
                }
            }
        }
        assert_eq!(file.next(), None);
    }
    let middle = shown.channels["R"][130 * 400 + 200].0;
    assert!(f32::from_bits(middle) > 0.0, "{middle}");
}

/// A viewer that closes during a transfer causes one warning, and the render continues.
#[test]
fn lost_viewer_is_reported_once() {
    let folder = folder(&[]);
    let (address, served) = viewer(|mut client| client.read_exact(&mut [0; 1000]).unwrap());
    let args = "--size 400x260 --spp 65536 --time-limit 2.3s -o a.exr --stats s.json";
    let out = render(folder.path(), &address, args);
    served.join().unwrap();
    let said = words(&out);
    assert_eq!(code(&out), 0, "{said}");
    assert_eq!(said.matches("warning").count(), 1, "{said}");
    assert!(said.contains(&format!("warning: {address}: lost the viewer")), "{said}");
    let stats = std::fs::read_to_string(folder.path().join("s.json")).unwrap();
    assert!(stats.contains("\"stop\": \"time-limit\""), "{stats}");
    assert!(
        read_channel(&folder.path().join("a.exr"), "samples")
            .iter()
            .any(|&n| n >= 1.0)
    );
}

#[test]
fn missing_viewer_is_an_error_before_rendering() {
    let folder = folder(&[]);
    let address = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .to_string();
    // A complete render of this size would take hours.
    let out = render(folder.path(), &address, "--spp 65536 --size 4096x4096 -o a.exr");
    let said = words(&out);
    assert_eq!(code(&out), 1, "{said}");
    assert!(said.contains(&address) && said.contains("help: start tev"), "{said}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);

    for wrong in ["localhost", ":14158", "localhost:tev", "localhost:0", "localhost:65536"] {
        let out = render(folder.path(), wrong, "-o a.exr");
        assert_eq!(code(&out), 2, "{wrong}: {}", words(&out));
        assert!(
            words(&out).contains("a host and a port are expected"),
            "{}",
            words(&out)
        );
    }
}

/// A viewer that never reads is dropped once the system buffers are full.
#[test]
fn viewer_that_never_reads_does_not_block() {
    let folder = folder(&[]);
    let (over, wait) = mpsc::channel::<()>();
    let (address, served) = viewer(move |client| {
        let _ = wait.recv();
        drop(client);
    });
    // 27 MB of channels: more than systems buffer for a connection
    let out = render(folder.path(), &address, "--size 800x600 --spp 1 -o a.png");
    drop(over);
    served.join().unwrap();
    let said = words(&out);
    assert_eq!(code(&out), 0, "{said}");
    // On a slow machine, the viewer may be dropped earlier, because it has read nothing for too
    // long.
    assert_eq!(said.matches("lost the viewer: it ").count(), 1, "{said}");
    assert!(folder.path().join("a.png").exists());
}

/// A viewer reads at most 64 bytes at a time, with pauses, so it never finishes. It delays neither
/// the render nor the end of the program.
#[test]
fn viewer_that_reads_slowly_does_not_block() {
    let folder = folder(&[]);
    let (address, _) = viewer(|mut client| {
        while client.read(&mut [0; 64]).is_ok_and(|read| read > 0) {
            thread::sleep(Duration::from_millis(50));
        }
    });
    let began = Instant::now();
    let args = "--size 800x600 --spp 65536 --time-limit 2s -o a.png";
    let out = render(folder.path(), &address, args);
    let (said, took) = (words(&out), began.elapsed());
    assert_eq!(code(&out), 0, "{said}");
    assert_eq!(said.matches("lost the viewer").count(), 1, "{said}");
    assert!(took < Duration::from_secs(20), "{took:?}");
    assert!(folder.path().join("a.png").exists());
}
