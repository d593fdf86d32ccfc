//! The loop that renders and executes the commands of pages.
//!
//! While the camera moves, the loop renders a smaller picture of a few samples, at a size that
//! allows about 25 pictures a second (`preview`). After the camera has rested for a moment, the
//! loop renders the full picture (`still`). Rendering is divided into slices of time, and pages are
//! updated between two slices. The picture is bit-identical to a picture without slices. A change
//! of the camera or of a parameter keeps the scene and its acceleration structure. A changed file,
//! material or light loads the scene again, and keeps the acceleration structure if the meshes are
//! equal. A second render with other settings may alternate with the picture (`rival`).

mod commands;
mod denoising;
mod groups;
mod messages;
mod picking;
mod preview;
mod rival;
mod saving;
mod thumbnails;

use super::hub::{Hub, Mail, PageId, SaveFormat};
use super::loading::LoadingMessages;
use super::protocol::PageCamera;
use super::watch::{FileStamps, Watch};
use super::{FileLight, Host, Options, SceneChanges, SceneRequest, parameters};
use crate::camera::CameraDescription;
use crate::film::{Aov, Film, RgbImage};
use crate::io::{ExrFormat, LoadObserver};
use crate::render::{Observer, Outcome};
use crate::scene_file::{SceneFile, SceneOptions};
use crate::session::{Error, RenderState, Renderer, Session, Settings};
use denoising::PageDenoiser;
use rival::{Rival, RivalRender};
use serde_json::json;
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant, SystemTime};

/// Time without camera motion before the whole picture is rendered.
const REST: Duration = Duration::from_millis(150);
/// Length of the first slice of a picture, and maximum length of a slice.
const FIRST_SLICE: Duration = Duration::from_millis(80);
const LONGEST_SLICE: Duration = Duration::from_millis(320);
/// Maximum time to wait for mail if there is nothing to render.
const IDLE: Duration = Duration::from_millis(100);
/// Time between two checks for the denoised picture.
const REFRESH: Duration = Duration::from_millis(15);
/// Minimum time between two messages about the state of the render.
const STATUS: Duration = Duration::from_millis(250);
/// Minimum time between two measurements of noise and exposure, which read all pixels.
const MEASURING: Duration = Duration::from_secs(1);
/// Time without open pages after which the program ends, if the option `exit_when_closed` is set.
/// The time is above 0 because a browser that reloads a page closes the page and opens it again.
const RELOADING: Duration = Duration::from_secs(3);
/// Duration of a slice for a small picture.
const MOMENT: Duration = Duration::from_millis(250);

/// Next step after a picture.
enum NextStep {
    /// A picture with another camera or other settings is rendered.
    Picture,
    /// More samples of the same picture are taken.
    More(Box<RenderState>),
    /// The scene is loaded from its files. If the files are invalid, the render continues with the
    /// old scene.
    Scene(Option<Box<RenderState>>),
    /// Thumbnails of views are rendered, and then more samples of the same picture.
    Views(Box<RenderState>),
    End,
}

/// Change that mail requires. The variants are in ascending order of their extent.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Change {
    Nothing,
    /// Other settings. The samples that were taken may still be valid.
    Settings,
    Picture,
    Scene,
}

/// Request of a page that needs the picture.
enum PageRequest {
    Inspect(PageId, [u32; 2], u32),
    Pick(PageId, [u32; 2]),
    Brightest(PageId, [u32; 2]),
    Views(PageId),
    Save(SaveFormat, Sender<Result<Vec<u8>, String>>),
}

/// The render, and the state that pages have requested.
pub(super) struct Engine<'a> {
    hub: &'a Hub,
    host: &'a dyn Host,
    exits_when_closed: bool,
    /// Time at which the last page was closed; `None` if a page is open or none was ever open.
    closed_since: Option<Instant>,
    file: SceneFile,
    lights: Vec<FileLight>,
    path: PathBuf,
    /// Contents of the scene file when it was last loaded or saved.
    text: String,
    exr: ExrFormat,
    options: SceneOptions,
    /// Settings of the displayed picture.
    settings: Settings,
    camera: CameraDescription,
    /// The camera of the scene file, or the guessed camera.
    home: CameraDescription,
    /// State of the last successful render.
    restore_point: Option<RestorePoint>,
    /// Parameters set by pages, which override the scene file.
    changes: BTreeMap<String, Option<String>>,
    /// Changes of materials and lights.
    edits: SceneChanges,
    /// Channels requested by the user.
    requested_aovs: Vec<Aov>,
    /// True if light groups are rendered as separate channels. The second field is true if ids are
    /// rendered.
    shows_groups: bool,
    shows_ids: bool,
    /// True if the scene file has its own light groups.
    has_own_groups: bool,
    /// Names of materials that emit.
    emitting: Vec<String>,
    /// Settings of the second render for a comparison. The second field is the render with its
    /// scene.
    compare: Option<String>,
    rival: Option<Rival>,
    reference: Option<RgbImage>,
    watch: Watch,
    /// Start of the first reading of the files, or an earlier time. Files that changed later are
    /// loaded again.
    started: SystemTime,
    is_paused: bool,
    /// Number of camera moves by pages.
    moves: u64,
    /// Time of the last camera move; `None` if the camera rests.
    moved: Option<Instant>,
    jobs: Vec<PageRequest>,
    /// Views that have no thumbnail yet.
    views: VecDeque<thumbnails::ThumbnailView>,
    /// True if thumbnails of views have interrupted the picture, which then continues with its
    /// samples.
    has_paused_for_views: bool,
    denoising: PageDenoiser,
    /// Change required by mail that was read, but not applied yet.
    pending: Change,
    /// Mail that is not read yet: a save that waits for the scene, and all later mail.
    held: VecDeque<Mail>,
    /// Number of times that the scene was loaded for the current save.
    loads_of_save: u32,
    /// Measured number of samples per second, over all pixels.
    rate: f64,
    /// True if a page has selected another channel since the last picture.
    has_new_channel: bool,
    shown: SentData,
}

/// State of a successful render, to return to after a failure.
struct RestorePoint {
    options: SceneOptions,
    settings: Settings,
    camera: CameraDescription,
    changes: BTreeMap<String, Option<String>>,
    edits: SceneChanges,
    shows_groups: bool,
    shows_ids: bool,
    compare: Option<String>,
}

/// Data that pages have received.
struct SentData {
    /// Time of the last status message; `None` if a message is due at once.
    status: Option<Instant>,
    /// Number of samples and time of the last measurement of noise and exposure.
    measured: Option<(u64, Instant)>,
    noise: Option<f64>,
    exposure: Option<f32>,
    /// Time of the last message with errors against the reference. The second field is true if the
    /// message included the last samples.
    errors: Instant,
    has_sent_last: bool,
}

/// Observer that checks the mail while samples are taken.
struct Watcher<'a> {
    hub: &'a Hub,
    end: Instant,
    samples: AtomicU64,
    host: &'a dyn Host,
    /// True if mail may end the slice. A preview must take one sample per pixel first, even if the
    /// camera moves fast.
    is_open: AtomicBool,
}

impl Observer for Watcher<'_> {
    fn progress(&self, samples: u64) {
        self.samples.fetch_add(samples, Ordering::Relaxed);
    }

    fn passed(&self, _: &Film) {
        self.is_open.store(true, Ordering::Relaxed);
    }

    fn should_stop(&self) -> bool {
        (self.is_open.load(Ordering::Relaxed) && self.hub.is_urgent()) || self.host.is_interrupted()
    }

    fn should_pause(&self) -> bool {
        let now = Instant::now();
        if self.is_open.load(Ordering::Relaxed) {
            now >= self.end || self.hub.has_mail()
        } else {
            now >= self.end + LONGEST_SLICE
        }
    }
}

impl<'a> Engine<'a> {
    /// An engine for `session`, the session of `request`.
    ///
    /// # Errors
    ///
    /// Invalid settings to compare.
    pub fn new(
        hub: &'a Hub,
        host: &'a dyn Host,
        request: SceneRequest,
        session: &Session,
        view: Options,
    ) -> Result<Self, Error> {
        let (settings, camera) = (session.settings().clone(), *session.camera_description());
        let mut engine = Self {
            hub,
            host,
            exits_when_closed: view.exit_when_closed,
            closed_since: None,
            restore_point: None,
            requested_aovs: settings.aovs.clone(),
            text: request.file.text().into(),
            file: request.file,
            lights: request.lights,
            path: request.path,
            exr: request.exr,
            options: request.options,
            settings,
            camera,
            home: camera,
            changes: BTreeMap::new(),
            edits: SceneChanges::default(),
            shows_groups: false,
            shows_ids: false,
            has_own_groups: false,
            emitting: groups::emitting(session.scene()),
            compare: None,
            rival: None,
            reference: view.reference,
            watch: Watch::new(),
            started: view.started,
            is_paused: false,
            moves: 0,
            moved: None,
            jobs: Vec::new(),
            views: VecDeque::new(),
            has_paused_for_views: false,
            denoising: PageDenoiser::new(),
            pending: Change::Nothing,
            held: VecDeque::new(),
            loads_of_save: 0,
            rate: 0.0,
            has_new_channel: false,
            shown: SentData {
                status: None,
                measured: None,
                noise: None,
                exposure: None,
                errors: Instant::now(),
                has_sent_last: false,
            },
        };
        engine.has_own_groups = engine.file.has_light_groups();
        if let Some([first, second]) = view.compare {
            engine.compare(&first, &second).map_err(Error::Failed)?;
        }
        Ok(engine)
    }

    /// Renders until the user ends the program. Returns true if a denoiser still runs in a separate
    /// thread.
    ///
    /// # Errors
    ///
    /// Errors of the first acceleration structure. Later errors are sent to the pages.
    pub fn run(mut self, mut session: Session) -> Result<bool, Error> {
        let loading = LoadingMessages::new(self.hub);
        loading.begin("building the acceleration structure", 1);
        session.keep_accel()?;
        drop(loading);
        // Begin with the small picture of a moving camera.
        self.moved = Some(Instant::now());
        self.watch
            .finish(&FileStamps::first(self.started), self.files(&session));
        self.greet(&session);
        let mut state = None;
        loop {
            // Check for the end also if nothing can be rendered
            if self.is_over() {
                return Ok(self.denoising.is_busy());
            }
            let next = if self.pending == Change::Scene {
                self.pending = Change::Nothing;
                Ok(NextStep::Scene(state.take().map(Box::new)))
            } else if self.moved.is_some() {
                self.preview(&mut session)
            } else {
                self.still(&mut session, state.take())
            };
            match next {
                Ok(NextStep::End) => return Ok(self.denoising.is_busy()),
                Ok(NextStep::Picture) => {}
                Ok(NextStep::More(old)) => state = Some(*old),
                Ok(NextStep::Views(old)) => {
                    state = Some(*old);
                    self.has_paused_for_views = true;
                    if let Err(error) = self.picture_views(&mut session) {
                        self.views.clear();
                        self.send_error(None, &error.to_string());
                    }
                }
                Ok(NextStep::Scene(old)) => {
                    if let Err(words) = self.load(&mut session) {
                        self.retreat(&words);
                        state = old.map(|old| *old);
                    }
                }
                Err(error) => self.retreat(&error.to_string()),
            }
        }
    }

    /// Sends the error `words` to the pages, and restores the last successful render.
    fn retreat(&mut self, words: &str) {
        self.send_error(None, words);
        self.refuse_saves(words);
        // Without a successful render, drop all changes of the pages.
        self.edits = SceneChanges::default();
        if let Some(restore_point) = &self.restore_point {
            (self.options, self.settings, self.camera) = (
                restore_point.options,
                restore_point.settings.clone(),
                restore_point.camera,
            );
            (self.changes, self.edits) = (restore_point.changes.clone(), restore_point.edits.clone());
            (self.shows_groups, self.shows_ids) = (restore_point.shows_groups, restore_point.shows_ids);
            self.compare = restore_point.compare.clone();
        }
        self.moved = None;
        self.send_state();
        // Wait a moment: the last good state may fail, too, for example if other programs use the
        // memory.
        self.pending = self.read_mail(REST);
    }

    /// Files whose changes cause the scene to be loaded again.
    fn files(&self, session: &Session) -> Vec<PathBuf> {
        let mut files = session.files().to_vec();
        files.push(self.path.clone());
        files.sort();
        files.dedup();
        files
    }

    /// Loads the scene from its files. The old scene is kept if that fails.
    fn load(&mut self, session: &mut Session) -> Result<(), String> {
        let loading = LoadingMessages::new(self.hub);
        loading.begin("reading the scene", 1);
        let reading = self.watch.begin();
        let mut request = self.host.read(&self.edits)?;
        // Parameters of pages override the file.
        for (key, value) in &self.changes {
            parameters::set((&mut request.options, &mut request.settings), key, value.as_deref())?;
        }
        self.requested_aovs.clone_from(&request.settings.aovs);
        self.set_aovs(&mut request.settings);
        let mut new = Session::load(&request.file, request.settings, &loading).map_err(|error| error.to_string())?;
        let is_same_shape = new.keep_accel_of(session).map_err(|error| error.to_string())?;
        // A camera moved by the user is kept. Otherwise the camera of the file is used.
        let found = *new.camera_description();
        let has_moved = PageCamera::of(&self.camera) != PageCamera::of(&self.home);
        *session = new;
        self.hub.greet_with(None);
        // The second render still has the old scene, so end it.
        self.rival = None;
        self.emitting = groups::emitting(session.scene());
        self.note_groups(&request.file);
        // The viewer's own groups do not belong to the file, so remove them from its lights.
        if !self.edits.groups.is_empty() {
            request.lights.iter_mut().for_each(|light| light.section.group = None);
        }
        self.text = request.file.text().into();
        (self.file, self.lights, self.options) = (request.file, request.lights, request.options);
        self.settings = session.settings().clone();
        self.home = found;
        if !has_moved {
            self.camera = found;
        }
        self.watch.finish(&reading, self.files(session));
        self.greet(session);
        self.send(&json!({ "type": "note", "text": "The scene was reloaded.", "kept_structure": is_same_shape }));
        Ok(())
    }

    /// Renders the picture, or continues `old`, together with the second render (rival) if there is
    /// one.
    fn still(&mut self, session: &mut Session, old: Option<RenderState>) -> Result<NextStep, Error> {
        if !session.serves(&self.settings) {
            return Ok(NextStep::Scene(old.map(Box::new)));
        }
        session.change(self.settings.clone(), self.camera, old.is_some())?;
        let rival = self.next_rival(session)?;
        let next = self.still_beside(session, old, rival.as_ref());
        self.rival = rival;
        next
    }

    fn still_beside(
        &mut self,
        session: &Session,
        old: Option<RenderState>,
        rival: Option<&Rival>,
    ) -> Result<NextStep, Error> {
        let renderer = session.renderer()?;
        let mut rival_render = rival.map(RivalRender::new).transpose()?;
        let mut state = old.unwrap_or_else(|| renderer.start());
        self.restore_point = Some(RestorePoint {
            options: self.options,
            settings: self.settings.clone(),
            camera: self.camera,
            changes: self.changes.clone(),
            edits: self.edits.clone(),
            shows_groups: self.shows_groups,
            shows_ids: self.shows_ids,
            compare: self.compare.clone(),
        });
        if !std::mem::take(&mut self.has_paused_for_views) {
            self.denoising.next_picture();
        }
        let mut slice = FIRST_SLICE;
        let mut is_complete = false;
        (self.shown.measured, self.shown.noise, self.shown.has_sent_last) = (None, None, false);
        self.send_state();
        loop {
            let rival_works = rival_render
                .as_ref()
                .is_some_and(|rival_render| !rival_render.is_complete);
            let is_awaited = self.denoising.is_awaited();
            let works = !self.is_paused && !is_awaited && (!is_complete || rival_works);
            if let Some(rival_render) = rival_render
                .as_mut()
                .filter(|rival_render| works && rival_render.is_next(&state, is_complete))
            {
                self.take_turn(rival_render, slice);
            } else if works {
                let before = state.film.samples();
                is_complete = self.take_samples(&renderer, &mut state, slice, true) == Outcome::Complete;
                slice = LONGEST_SLICE.min(slice.mul_f64(1.5));
                if state.film.samples() > before || is_complete {
                    self.show(&renderer, &state, is_complete);
                }
            }
            self.denoise(&renderer, &state, is_complete || self.is_paused);
            let is_over = is_complete
                && rival_render
                    .as_ref()
                    .is_none_or(|rival_render| rival_render.is_complete);
            self.send_errors(&state, rival_render.as_ref(), is_over);
            let has_jobs = !self.jobs.is_empty();
            self.do_jobs(&renderer, &state);
            self.send_status(&renderer, &state, is_over, has_jobs);
            if self.is_over() {
                return Ok(NextStep::End);
            }
            let patience = match (works && !is_over, is_awaited) {
                (true, _) => Duration::ZERO,
                (false, true) => REFRESH,
                (false, false) => IDLE,
            };
            match self.read_mail(patience) {
                Change::Scene => return Ok(NextStep::Scene(Some(Box::new(state)))),
                Change::Picture => return Ok(NextStep::Picture),
                Change::Settings if rival_render.is_some() => return Ok(NextStep::Picture),
                Change::Settings => return Ok(self.after_settings(session, state)),
                Change::Nothing => {}
            }
            if !self.views.is_empty() && !state.is_empty() {
                return Ok(NextStep::Views(Box::new(state)));
            }
            if std::mem::take(&mut self.has_new_channel) && !state.is_empty() {
                self.show(&renderer, &state, true);
                if let Some(rival_render) = &rival_render {
                    self.show_rival(rival_render, true);
                }
            }
            if self.watch.has_changed() {
                return Ok(NextStep::Scene(Some(Box::new(state))));
            }
        }
    }

    /// Next step after a change of settings: more samples if the samples of `state`, taken by
    /// `session`, are still valid, else a new picture.
    fn after_settings(&self, session: &Session, state: RenderState) -> NextStep {
        let (had, wanted) = (session.settings(), &self.settings);
        let taken = state.film.tiles().iter().map(|tile| tile.next_sample()).max();
        let same = had.describe() == wanted.describe()
            && had.resolution == wanted.resolution
            && had.seed == wanted.seed
            && taken.unwrap_or(0) <= wanted.samples().end;
        if same {
            NextStep::More(Box::new(state))
        } else {
            NextStep::Picture
        }
    }

    /// Adds samples for the time `time`, and measures the sample rate. Mail may end the slice early
    /// if `is_open` is true, or after one pass is complete.
    fn take_samples(&mut self, renderer: &Renderer, state: &mut RenderState, time: Duration, is_open: bool) -> Outcome {
        let start = Instant::now();
        let watcher = Watcher {
            hub: self.hub,
            end: start + time,
            samples: AtomicU64::new(0),
            host: self.host,
            is_open: AtomicBool::new(is_open),
        };
        let outcome = renderer.render(state, &watcher);
        let (samples, seconds) = (watcher.samples.into_inner() as f64, start.elapsed().as_secs_f64());
        if samples > 0.0 && seconds > 1e-3 {
            let rate = samples / seconds;
            self.rate = if self.rate > 0.0 {
                0.7 * self.rate + 0.3 * rate
            } else {
                rate
            };
        }
        outcome
    }

    /// Returns true if the user has ended the program. Also returns true if no page was open for
    /// [`RELOADING`] and the program ends with its last page.
    fn is_over(&mut self) -> bool {
        let (open, ever) = self.hub.pages();
        self.closed_since = if open == 0 && ever > 0 {
            self.closed_since.or_else(|| Some(Instant::now()))
        } else {
            None
        };
        let is_closed = self.closed_since.is_some_and(|since| since.elapsed() >= RELOADING);
        self.host.is_interrupted() || (self.exits_when_closed && is_closed)
    }
}

/// Mean number of samples per pixel.
fn samples_of(state: &RenderState) -> f64 {
    state.film.samples() as f64 / state.film.crop().area() as f64
}
