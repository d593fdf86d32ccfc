//! `embrasure view`: a render that a browser shows and steers.
//!
//! [`serve`] renders on the thread that calls it, by the sessions that `render` uses, so the picture of N samples has the bits of `render --spp N`. `engine` is that
//! loop; `hub` is what it shares with the pages. `server` accepts connections and answers requests (`http`); each page has a thread with its WebSocket (`socket`),
//! whose words `protocol` defines. `frame` has a picture's pixels (`io::half_picture`), packed for slow links (`io::packed`), `parameters` lists what can be set, `scene_file` writes cameras and other
//! changes into a scene file, `scene_keys` has the keys that can be changed, `watch` notices files that change, and `page` has the files of the page itself. The page is served before the scene is loaded,
//! and `loading` tells it how far that is.
//!
//! The render is for its user alone: the server listens on the loopback address unless told otherwise, a link has 128 random bits, and the name by which a browser
//! asks (`Host`) and the page that asks (`Origin`) are checked, so that a page elsewhere cannot ask by a name of its own. Sizes, rates and numbers of connections are
//! limited. Files other than the page's are not served, but for the picture.

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

use crate::description::{LightSection, SceneFile, SceneOptions};
use crate::film::RgbImage;
use crate::io::{ExrFormat, LoadObserver};
use crate::session::{Error, Renderer, Session, Settings};
use engine::Engine;
use hub::Hub;
use loading::Loading;
use serde::Serialize;
use serde_json::{Value, json};
use server::Server;
use std::net::IpAddr;
use std::ops::Range;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, SystemTime};

/// How the pages are served.
pub(crate) struct Options {
    /// Address to listen on.
    pub listen: IpAddr,
    /// Port; 0 for a free one.
    pub port: u16,
    /// Whether to end when the last page is closed.
    pub exit_when_closed: bool,
    /// What is rendered, and what beside it: each `KEY=VALUE` or an integrator, joined by `+`.
    pub compare: Option<[String; 2]>,
    /// The picture against which errors count.
    pub reference: Option<RgbImage>,
    /// A time before the scene's files were read.
    pub started: SystemTime,
}

/// A part of the scene that is saved in its file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SavedPart {
    /// Place and lens of the camera.
    Camera,
    /// Changes of materials and lights.
    Changes,
}

/// A patch of the material `name`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct MaterialEdit {
    pub name: String,
    pub key: String,
    /// TOML, or a plain string.
    pub value: String,
}

/// A key of the `[[light]]` with this index in the scene file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LightEdit {
    pub index: usize,
    pub key: String,
    /// TOML.
    pub value: String,
}

impl LightEdit {
    /// `KEY=VALUE` of the scene file (`--set`).
    pub fn flag(&self) -> String {
        let Self { index, key, value } = self;
        format!("light.{index}.{key}={value}")
    }
}

/// Changes of a scene that pages have asked for.
#[derive(Clone, Debug, Default)]
pub(crate) struct SceneChanges {
    pub materials: Vec<MaterialEdit>,
    pub lights: Vec<LightEdit>,
    /// Light groups, as `KEY=VALUE` of the scene file (`--set`).
    pub groups: Vec<String>,
}

/// A light of the scene file that flags have not replaced.
#[derive(Clone, Debug)]
pub(crate) struct FileLight {
    /// Index among all `[[light]]` of the file.
    pub index: usize,
    pub section: LightSection,
}

/// A scene as a command line means it.
pub(crate) struct SceneRequest {
    /// The scene file with the changes of flags.
    pub file: SceneFile,
    /// Lights of the scene file, without those that flags replace.
    pub lights: Vec<FileLight>,
    /// Path of the scene, as it was typed.
    pub path: PathBuf,
    /// What is to be rendered.
    pub settings: Settings,
    /// What the scene file and flags say of parameters.
    pub options: SceneOptions,
    /// How EXR files are written.
    pub exr: ExrFormat,
}

/// What the command line knows, and the viewer asks it for.
pub(crate) trait Host: Sync {
    /// Loads the scene of `request`, and tells `observer` and the user how far that is.
    ///
    /// # Errors
    ///
    /// Those of [`Session::load`].
    fn load(&self, request: &SceneRequest, observer: &dyn LoadObserver) -> Result<Session, Error>;

    /// Reads the scene file with the flags, and `changes` after those of the flags.
    ///
    /// # Errors
    ///
    /// What is wrong with the file, in words.
    fn read(&self, changes: &SceneChanges) -> Result<SceneRequest, String>;

    /// Checks the contents `text` of the scene file, which have another `part` than those `before`: `render` must read
    /// them. If it needs the flags of the viewer to read those before, it may need them for `text` too.
    ///
    /// # Errors
    ///
    /// What is wrong with `text`.
    fn check(&self, text: &str, before: &str, part: SavedPart) -> Result<(), String>;

    /// The numbers of a sample of a pixel, as `render --pixel X,Y --sample K --json` prints them.
    ///
    /// # Errors
    ///
    /// A pixel outside of the image.
    fn inspect(&self, renderer: &Renderer, pixel: [u32; 2], sample: u32) -> Result<Value, String>;

    /// Red, green and blue of each of the `samples` of a pixel, fewer where `time` does not suffice.
    ///
    /// # Errors
    ///
    /// A pixel outside of the image.
    fn samples_of(
        &self,
        renderer: &Renderer,
        pixel: [u32; 2],
        samples: Range<u32>,
        time: Duration,
    ) -> Result<Vec<[f32; 3]>, String>;

    /// Whether the user wants to end.
    fn is_interrupted(&self) -> bool;

    /// Says that the page is served at `link`.
    fn ready(&self, link: &str);
}

/// Serves the render that `request` asks for, until the user ends it. The threads of server and pages have ended, and all sockets are closed, when it
/// returns. Returns true if a denoiser still works on a thread of its own.
///
/// # Errors
///
/// An address that cannot be listened on, a scene that cannot be loaded, and what ends the render.
pub(crate) fn serve(options: Options, host: &dyn Host, request: SceneRequest) -> Result<bool, Error> {
    let server = Server::bind(&options)?;
    let hub = Hub::new();
    thread::scope(|scope| {
        let run = || server.run(scope, &hub);
        let named = thread::Builder::new().name("server".into()).spawn_scoped(scope, run);
        named.map_err(|error| Error::Failed(format!("cannot start a thread: {error}")))?;
        // Threads end even where the render panics.
        let _ending = hub.ending();
        host.ready(&server.link());
        let told = |error: Error| {
            let text = json!({ "type": "error", "text": error.to_string() });
            hub.greet("3 end", &text.to_string());
            error
        };
        let loading = Loading::new(&hub);
        let session = host.load(&request, &loading).map_err(told)?;
        drop(loading);
        let engine = Engine::new(&hub, host, request, &session, options)?;
        engine.run(session)
    })
}
