//! A slow connection to the server, like an ssh tunnel.

use super::viewer::Viewer;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

/// Rate in bytes per second: 10 Mbit/s.
pub const SLOW: f64 = 1.25e6;

/// Address of a proxy to the server of `viewer`, which forwards answers at `rate` bytes per second.
/// The proxy runs until the test program ends.
pub fn slow_link(viewer: &Viewer, rate: f64) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let server = viewer.address.clone();
    thread::spawn(move || {
        for page in listener.incoming().flatten() {
            let Ok(server) = TcpStream::connect(&server) else {
                return;
            };
            let _ = page.set_nodelay(true).and_then(|()| server.set_nodelay(true));
            let (from, to) = (page.try_clone().unwrap(), server.try_clone().unwrap());
            thread::spawn(move || forward(from, to, f64::INFINITY));
            thread::spawn(move || forward(server, page, rate));
        }
    });
    address
}

/// Forwards bytes with `rate` bytes per second.
fn forward(mut from: TcpStream, mut to: TcpStream, rate: f64) {
    let mut buffer = [0; 4096];
    let (mut start, mut passed) = (Instant::now(), 0.0);
    while let Ok(n @ 1..) = from.read(&mut buffer) {
        let late = passed / rate - start.elapsed().as_secs_f64();
        if late > 0.0 {
            thread::sleep(Duration::from_secs_f64(late));
        } else {
            // A pause does not allow a higher rate later.
            (start, passed) = (Instant::now(), 0.0);
        }
        passed += n as f64;
        if to.write_all(&buffer[..n]).is_err() {
            break;
        }
    }
    let _ = to.shutdown(Shutdown::Both);
}
