//! `embrasure view`: a render shown and controlled in a browser.
//!
//! [`serve`] renders on the calling thread with the sessions of `render`, so a picture of N samples
//! is bit-identical to `render --spp N`. `engine` is the render loop. `hub` is the state that the
//! loop shares with the threads of the pages. `server` accepts connections and answers requests
//! (`http`). Each page has a thread with its WebSocket (`socket`); `protocol` defines the messages.
//! `frame` has a picture's pixels (`io::half_picture`), packed for slow links (`io::packed`).
//! `parameters` lists the render parameters that a page can set, and `scene_keys` the keys of
//! materials and lights that a page can set. `scene_file` writes cameras and other changes into a
//! scene file, and `watch` detects changed files. `page` has the files of the page. The page is
//! served before the scene is loaded, and `loading` reports the progress.
//!
//! Only the user can control the render. By default the server listens on the loopback address, and
//! the link has 128 random bits. The server checks the requested name (`Host`) and the requesting
//! page (`Origin`). A page of another site therefore cannot send requests, even if the domain of
//! the site resolves to this machine. Sizes, rates and numbers of connections are limited. Only
//! files of the page and the picture are served.

mod engine;
mod frame;
mod http;
mod hub;
mod loading;
mod page;
mod parameters;
mod protocol;
mod scene_file;
mod scene_keys;
mod server;
mod socket;
mod watch;

use crate::film::RgbImage;
use crate::io::{ExrFormat, LoadObserver};
use crate::scene_file::{LightSection, SceneFile, SceneOptions};
use crate::session::{Error, Renderer, Session, Settings};
use engine::Engine;
use hub::Hub;
use loading::LoadingMessages;
use serde::Serialize;
use serde_json::{Value, json};
use server::Server;
use std::net::IpAddr;
use std::ops::Range;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, SystemTime};

/// Options of the server.
pub(crate) struct Options {
    /// Address to listen on.
    pub listen: IpAddr,
    /// Port; 0 for any free port.
    pub port: u16,
    /// True if the program must end when the last page is closed.
    pub exit_when_closed: bool,
    /// Settings of the picture, and settings of the second render. Each text has parts joined by
    /// `+`, and a part is `KEY=VALUE` or an integrator.
    pub compare: Option<[String; 2]>,
    /// Reference picture, against which errors are computed.
    pub reference: Option<RgbImage>,
    /// Time before the first reading of the files. Files that change later are loaded again.
    pub started: SystemTime,
}

/// Part of the scene to save in its file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SavedPart {
    /// Position and lens of the camera.
    Camera,
    /// Changes of materials and lights.
    Changes,
}

/// A patch of the material `name`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct MaterialEdit {
    pub name: String,
    pub key: String,
    /// New value of the key, as TOML or a plain string.
    pub value: String,
}

/// A changed key of the `[[light]]` with index `index` in the scene file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LightEdit {
    pub index: usize,
    pub key: String,
    /// New value of the key, as TOML.
    pub value: String,
}

impl LightEdit {
    /// Text `KEY=VALUE` for the scene file (`--set`).
    pub fn flag(&self) -> String {
        let Self { index, key, value } = self;
        format!("light.{index}.{key}={value}")
    }
}

/// Changes of a scene requested by pages.
#[derive(Clone, Debug, Default)]
pub(crate) struct SceneChanges {
    pub materials: Vec<MaterialEdit>,
    pub lights: Vec<LightEdit>,
    /// Light groups as `KEY=VALUE` of the scene file (`--set`).
    pub groups: Vec<String>,
}

/// A light of the scene file that no flag has replaced.
#[derive(Clone, Debug)]
pub(crate) struct FileLight {
    /// Index among all `[[light]]` of the file.
    pub index: usize,
    pub section: LightSection,
}

/// A scene with the flags of the command line applied.
pub(crate) struct SceneRequest {
    /// The scene file with the changes of flags.
    pub file: SceneFile,
    /// Lights of the scene file, except lights that flags replace.
    pub lights: Vec<FileLight>,
    /// Path of the scene as the user typed it.
    pub path: PathBuf,
    /// Settings of the render.
    pub settings: Settings,
    /// Parameters set by the scene file and flags.
    pub options: SceneOptions,
    /// Format of EXR files.
    pub exr: ExrFormat,
}

/// Functions that the command line provides for the viewer.
pub(crate) trait Host: Sync {
    /// Loads the scene of `request`, and reports the progress to `observer` and to the user.
    ///
    /// # Errors
    ///
    /// Errors of [`Session::load`].
    fn load(&self, request: &SceneRequest, observer: &dyn LoadObserver) -> Result<Session, Error>;

    /// Reads the scene file, and applies first the flags and then `changes`.
    ///
    /// # Errors
    ///
    /// Text of the error in the file.
    fn read(&self, changes: &SceneChanges) -> Result<SceneRequest, String>;

    /// Checks that `render` can read `text`, the new contents of the scene file. Only `part`
    /// differs from the contents `before`. If `before` can be read only with the flags of the
    /// viewer, `text` may need these flags too.
    ///
    /// # Errors
    ///
    /// Text of the error in `text`.
    fn check(&self, text: &str, before: &str, part: SavedPart) -> Result<(), String>;

    /// Paths of a sample of a pixel, as in `render --pixel X,Y --sample K --json`.
    ///
    /// # Errors
    ///
    /// A pixel outside the image.
    fn inspect(&self, renderer: &Renderer, pixel: [u32; 2], sample: u32) -> Result<Value, String>;

    /// Light (red, green, blue) of each of the `samples` of a pixel. Returns fewer samples if they
    /// take longer than `time`.
    ///
    /// # Errors
    ///
    /// A pixel outside the image.
    fn samples_of(
        &self,
        renderer: &Renderer,
        pixel: [u32; 2],
        samples: Range<u32>,
        time: Duration,
    ) -> Result<Vec<[f32; 3]>, String>;

    /// Returns true if the user has requested the program to end.
    fn is_interrupted(&self) -> bool;

    /// Reports that the page is served at `link`.
    fn ready(&self, link: &str);
}

/// Serves the render of `request` until the user ends the program. On return, the threads of the
/// server and of the pages have ended, and all sockets are closed. Returns true if a denoiser still
/// runs in a separate thread.
///
/// # Errors
///
/// An invalid address to listen on, errors of loading the scene, and errors that end the render.
pub(crate) fn serve(options: Options, host: &dyn Host, request: SceneRequest) -> Result<bool, Error> {
    let server = Server::bind(&options)?;
    let hub = Hub::new();
    thread::scope(|scope| {
        let run = || server.run(scope, &hub);
        let named = thread::Builder::new().name("server".into()).spawn_scoped(scope, run);
        named.map_err(|error| Error::Failed(format!("cannot start a thread: {error}")))?;
        // On drop, this guard ends the threads, even if the render panics.
        let _ending = hub.ending();
        host.ready(&server.link());
        let announce = |error: Error| {
            let text = json!({ "type": "error", "text": error.to_string() });
            hub.greet("3 end", &text.to_string());
            error
        };
        let loading = LoadingMessages::new(&hub);
        let session = host.load(&request, &loading).map_err(announce)?;
        drop(loading);
        let engine = Engine::new(&hub, host, request, &session, options)?;
        engine.run(session)
    })
}
