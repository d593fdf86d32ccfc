//! Renders. The thread of a render owns the session, the renderer and the state. It sends films on
//! request.

use crate::errors;
use crate::film::{Developed, Film, Source};
use crate::job::{Status, guarded, wait};
use crate::scene::Description;
use embrasure::cli::Request;
use embrasure::session::Unfinished;
use embrasure::{Error, Observer, Outcome, RenderState, Renderer, Session};
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// Reply of the render thread: the next film, or `None` after the last film.
type Answer = Result<Option<Developed>, Error>;

/// A render in progress. When it is dropped, its thread ends.
#[pyclass(frozen, module = "embrasure._native")]
pub struct Render {
    status: Arc<Status>,
    /// Sender of requests to the render thread. When it is dropped, the thread ends.
    asks: Mutex<Sender<()>>,
    answers: Mutex<Receiver<Answer>>,
    /// Locked while a Python thread waits for a reply.
    turn: Mutex<()>,
}

#[pymethods]
impl Render {
    /// A render of `scene` with `flags`. If `pause` is given, films are made at the ends of passes,
    /// with at least `pause` seconds between two films. Else only one film is made, at the end.
    #[new]
    #[pyo3(signature = (scene, flags, pause=None))]
    fn new(py: Python, scene: &Description, flags: Vec<String>, pause: Option<f64>) -> PyResult<Self> {
        let request = Request::new(&scene.0, &flags).map_err(|error| errors::of_session(py, error))?;
        let pause = pause.map(|seconds| Duration::try_from_secs_f64(seconds).unwrap_or_default());
        let status = Arc::<Status>::default();
        let (asks, asked) = channel();
        let (answers, answered) = channel();
        let work = Work {
            request,
            pause,
            status: status.clone(),
            asked,
            answers,
        };
        let name = thread::Builder::new().name("embrasure".into());
        let spawned = name.spawn(move || work.run());
        spawned.map_err(|error| errors::Error::new_err(format!("cannot start a thread: {error}")))?;
        Ok(Self {
            status,
            asks: Mutex::new(asks),
            answers: Mutex::new(answered),
            turn: Mutex::default(),
        })
    }

    /// Returns the next film; `None` after the last film. `progress` is called with the number of
    /// samples taken and the number of samples to take, over all pixels.
    #[pyo3(signature = (progress=None))]
    fn next(&self, py: Python, progress: Option<Py<PyAny>>) -> PyResult<Option<Film>> {
        let Ok(_turn) = self.turn.try_lock() else {
            return Err(errors::Error::new_err(
                "another thread waits for the next film of this render",
            ));
        };
        if self.asks.lock().is_ok_and(|asks| asks.send(()).is_err()) {
            return Ok(None);
        }
        let answer = wait(py, &self.answers, &self.status, progress.as_ref())?;
        let film = answer.map_err(|error| errors::of_session(py, error))?;
        Ok(film.map(Film::new))
    }
}

impl Drop for Render {
    fn drop(&mut self) {
        self.status.stop.store(true, Ordering::Relaxed);
    }
}

/// Data of a render thread.
struct Work {
    request: Request,
    pause: Option<Duration>,
    status: Arc<Status>,
    asked: Receiver<()>,
    answers: Sender<Answer>,
}

impl Work {
    /// Replies to requests until the sender of the requests is dropped.
    fn run(self) {
        if self.asked.recv().is_err() {
            return;
        }
        // Drop the session before the last reply. If the process forks later, no thread of the
        // session can then hold a lock of Embree
        let last = guarded(|| self.render());
        let _ = self.answers.send(last);
        // Reply to later requests without a film
        while self.asked.recv().is_ok() {
            let _ = self.answers.send(Ok(None));
        }
    }

    /// Renders, and sends a film for each request. The last film is not sent, but returned. Returns
    /// `None` if the render was stopped, or if no film was requested.
    fn render(&self) -> Answer {
        let Request {
            scene,
            settings,
            time_limit,
            ..
        } = &self.request;
        let session = Session::load(scene, settings.clone(), &())?;
        if self.status.is_stopped() {
            return Ok(None);
        }
        let renderer = session.renderer()?;
        let mut state = renderer.start();
        let samples = settings.crop().area() * settings.samples().len() as u64;
        self.status.total.store(samples, Ordering::Relaxed);
        let limit = time_limit.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        let end = limit.and_then(|limit| Instant::now().checked_add(limit));
        loop {
            let watcher = Watcher {
                status: &self.status,
                end,
                pause: self.pause.and_then(|pause| Instant::now().checked_add(pause)),
                is_due: AtomicBool::new(false),
            };
            let outcome = renderer.render(&mut state, &watcher);
            let is_over = outcome == Outcome::Complete || watcher.is_late();
            if self.status.is_stopped() {
                return Ok(None);
            }
            let film = self.film(&renderer, &mut state, (outcome, is_over))?;
            if is_over {
                return Ok(Some(film));
            }
            let sent = self.answers.send(Ok(Some(film)));
            if sent.is_err() || self.asked.recv().is_err() {
                return Ok(None);
            }
        }
    }

    /// Makes the current film. The film is denoised if a denoiser was requested and the render has
    /// ended (`is_over`).
    fn film(
        &self,
        renderer: &Renderer,
        state: &mut RenderState,
        (outcome, is_over): (Outcome, bool),
    ) -> Result<Developed, Error> {
        let settings = renderer.session().settings();
        if state.is_empty() {
            let words = "time_limit was reached before the first sample was complete";
            return Err(Error::Failed(format!(
                "{words}\n  help: allow more time, or render fewer pixels"
            )));
        }
        let mut metadata = renderer.metadata(state, outcome == Outcome::Complete);
        let mut image = renderer.develop(state);
        if is_over {
            let done = renderer.denoise_unless(image, &mut metadata, &|| self.status.is_stopped());
            image = done.map_err(|unfinished| match unfinished {
                Unfinished::Failed(error) => error.into(),
                _ => Error::Failed("denoising was interrupted".into()),
            })?;
        }
        metadata.note_exposure(settings.tone, &image);
        let warnings = [&self.request.warnings, renderer.session().warnings()].concat();
        Ok(Developed {
            image,
            tone: settings.tone,
            exr: self.request.exr.clone(),
            seconds: state.seconds,
            warnings: warnings.into_iter().map(|warning| warning.text).collect(),
            source: Source::Rendered(Box::new(metadata)),
            // Keep the sums of a part, so that they can be saved
            sums: settings.is_part().then(|| state.clone()),
        })
    }
}

/// Observer of a render. It counts samples, stops the render at its time limit or on request, and
/// pauses the render at the ends of passes.
struct Watcher<'a> {
    status: &'a Status,
    end: Option<Instant>,
    pause: Option<Instant>,
    is_due: AtomicBool,
}

impl Watcher<'_> {
    /// Returns true if the time limit has passed.
    fn is_late(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }
}

impl Observer for Watcher<'_> {
    fn progress(&self, samples: u64) {
        self.status.done.fetch_add(samples, Ordering::Relaxed);
    }

    fn expect(&self, samples: u64, _: f64) {
        let total = self.status.done.load(Ordering::Relaxed) + samples;
        self.status.total.store(total, Ordering::Relaxed);
    }

    fn passed(&self, _: &embrasure::film::Film) {
        if self.pause.is_some_and(|pause| Instant::now() >= pause) {
            self.is_due.store(true, Ordering::Relaxed);
        }
    }

    fn should_stop(&self) -> bool {
        self.status.is_stopped() || self.is_late()
    }

    fn should_pause(&self) -> bool {
        self.is_due.load(Ordering::Relaxed)
    }
}
