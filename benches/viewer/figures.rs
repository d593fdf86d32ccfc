//! Measures latencies, pictures and bytes per second, and memory after many restarts, for
//! docs/benchmarks.md.

use super::link::{SLOW, slow_link};
use super::viewer::{Frame, PATIENCE, Page, Viewer};
use std::fs;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};
use tungstenite::Message;

/// Number of measured changes.
const CHANGES: usize = 20;
/// Duration of an orbit of the camera.
const ORBIT: Duration = Duration::from_secs(5);
/// Time between two moves of an orbit.
const MOVE: Duration = Duration::from_millis(33);

/// Resident memory of a process in MB.
fn memory(process: u32) -> f64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    line.trim().split(' ').next().unwrap().parse::<f64>().unwrap() / 1024.0
}

/// Processor time of a process in seconds: first of the render threads, then of all other threads.
/// The others are the threads of the pages and the server, and the main loop, which shows pictures.
fn processor_time(process: u32) -> [f64; 2] {
    /// Ticks per second in Linux.
    const TICKS: f64 = 100.0;
    let mut times = [0.0; 2];
    for task in fs::read_dir(format!("/proc/{process}/task")).unwrap().flatten() {
        let (Ok(stat), Ok(name)) = (
            fs::read_to_string(task.path().join("stat")),
            fs::read_to_string(task.path().join("comm")),
        ) else {
            continue;
        };
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
        let ticks: f64 = fields[11..13].iter().map(|t| t.parse::<f64>().unwrap()).sum();
        // Threads of the pool have the name of the program. The first thread also has this name,
        // but only waits for the pool.
        let is_first = task.file_name().to_string_lossy() == process.to_string();
        let renders = !is_first && !["page", "server"].contains(&name.trim());
        times[usize::from(!renders)] += ticks / TICKS;
    }
    times
}

fn median(mut times: Vec<Duration>) -> f64 {
    times.sort();
    times[times.len() / 2].as_secs_f64() * 1e3
}

/// Sends the camera `home`, moved by `step` steps.
fn send_move(page: &mut Page, home: &serde_json::Value, step: usize) {
    let mut camera = home.clone();
    let x = home["position"][0].as_f64().unwrap() + 0.01 * (1 + step % 7) as f64;
    camera["position"][0] = x.into();
    camera["do"] = "camera".into();
    page.send(&camera.to_string());
}

/// Prints the table for cornell-box.toml and for the scenes `more`.
pub fn print(more: &[String]) {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml");
    let scenes = [own.display().to_string()].into_iter().chain(more.iter().cloned());
    println!(
        "| scene | link | first pixels, ms | a sample of each pixel, ms | pictures/s | kB a picture | MB/s | the lossless picture: kB, ms | others, % | MB before, after |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for scene in scenes {
        let name = Path::new(&scene).file_stem().unwrap().to_string_lossy().into_owned();
        for (link, rate) in [("localhost", f64::INFINITY), ("10 Mbit/s", SLOW)] {
            figures_of(&scene, &name, link, rate);
        }
    }
}

/// Prints the row of a scene for a link of `rate` bytes per second.
fn figures_of(scene: &str, name: &str, link: &str, rate: f64) {
    let folder = tempfile::tempdir().unwrap();
    let viewer = Viewer::start(folder.path(), &[scene, "--size", "512x512", "--spp", "100000"]);
    let mut page = match rate.is_finite() {
        true => Page::open_at(&viewer, &slow_link(&viewer, rate)).unwrap(),
        false => viewer.page(),
    };
    let home = page.message("state")["camera"].clone();
    page.frame_where(|header| header["samples"].as_f64() >= Some(4.0));

    let (mut first, mut full) = (Vec::new(), Vec::new());
    for change in 1..=CHANGES {
        let start = Instant::now();
        send_move(&mut page, &home, change);
        page.frame_where(|header| header["moves"] == change);
        first.push(start.elapsed());
        page.frame_where(|h| h["moves"] == change && h["width"] == 512 && h["samples"].as_f64() >= Some(1.0));
        full.push(start.elapsed());
    }

    // Orbit the camera: send moves while pictures arrive.
    let [rendering, others] = processor_time(viewer.child.id());
    let (start, mut moves, mut pictures, mut bytes) = (Instant::now(), 0, 0, 0);
    page.socket
        .get_ref()
        .set_read_timeout(Some(Duration::from_millis(2)))
        .unwrap();
    while start.elapsed() < ORBIT {
        if start.elapsed() >= MOVE * moves {
            moves += 1;
            send_move(&mut page, &home, moves as usize);
        }
        if let Ok(Message::Binary(message)) = page.socket.read() {
            pictures += 1;
            bytes += message.len();
            page.shown(&Frame::of(&message));
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    let orbiting = share(&viewer, [rendering, others]);
    page.socket.get_ref().set_read_timeout(Some(PATIENCE)).unwrap();
    page.frame_where(|header| header["preview"] == false);

    // Keep the camera at rest: the render continues, and pages receive its progress.
    let before = processor_time(viewer.child.id());
    let start = Instant::now();
    while start.elapsed() < ORBIT {
        page.frame_where(|_| true);
    }
    let resting = share(&viewer, before);
    // Pause the render: the paused picture is lossless.
    let start = Instant::now();
    page.send(r#"{"do":"pause"}"#);
    let whole = page.frame_where(|header| header["final"] == true);
    let (whole, late) = (whole.bytes as f64 / 1e3, start.elapsed().as_secs_f64() * 1e3);
    page.send(r#"{"do":"resume"}"#);

    let before = memory(viewer.child.id());
    for restart in 0..1000 {
        page.send(r#"{"do":"restart"}"#);
        if restart % 20 == 0 {
            page.frame_where(|_| true);
        }
        thread::sleep(Duration::from_millis(5));
    }
    page.frame_where(|header| header["samples"].as_f64() >= Some(1.0));
    let after = memory(viewer.child.id());
    println!(
        "| {name} | {link} | {:.0} | {:.0} | {:.1} | {:.0} | {:.2} | {whole:.0}, {late:.0} | {orbiting:.1}, {resting:.1} | {before:.0}, {after:.0} |",
        median(first),
        median(full),
        f64::from(pictures) / seconds,
        bytes as f64 / 1e3 / f64::from(pictures.max(1)),
        bytes as f64 / 1e6 / seconds,
    );
}

/// Percentage of the processor time since `before` that was not spent on rendering.
fn share(viewer: &Viewer, before: [f64; 2]) -> f64 {
    let now = processor_time(viewer.child.id());
    let [rendering, others] = [0, 1].map(|i| now[i] - before[i]);
    100.0 * others / (rendering + others).max(1e-9)
}
