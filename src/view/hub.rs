//! What the render and the threads of the pages share: commands on their way to the render, messages and pictures on their way to the pages.

use super::frame::Frame;
use super::protocol::Command;
use crate::color::Tone;
use crate::io::half_picture::PICTURE;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Commands that may wait for the render; further ones are dropped.
const MAX_MAIL: usize = 4096;
/// Messages that may wait for a page; the oldest are dropped.
const MAX_OUTBOX: usize = 256;

/// Number of a page's connection.
pub(super) type PageId = u64;

/// What the render is asked for.
pub(super) enum Mail {
    /// By a page.
    Command(PageId, Command),
    /// The picture as a file, which is sent back.
    Save(SaveFormat, Sender<Result<Vec<u8>, String>>),
}

/// A picture that is asked for as a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SaveFormat {
    /// All channels, as `render -o FILE.exr` writes them.
    Exr,
    /// For display.
    Png(Option<Tone>),
    /// A texture of the scene, small, for display.
    Texture(u32),
}

/// What waits for a page.
#[derive(Default)]
pub(super) struct Outbox {
    pub messages: VecDeque<Arc<str>>,
    /// Channels that the page shows, each with its newest picture if that was not sent.
    channels: Vec<(String, Option<Frame>)>,
}

/// The shared state.
pub(super) struct Hub {
    mail: Mutex<VecDeque<Mail>>,
    bell: Condvar,
    /// Whether mail waits, and whether some of it makes the work at hand useless.
    has_mail: AtomicBool,
    is_urgent: AtomicBool,
    pages: Mutex<BTreeMap<PageId, Outbox>>,
    next_page: AtomicU64,
    next_frame: AtomicU64,
    /// The first message for a page, by its kind.
    greetings: Mutex<BTreeMap<&'static str, Arc<str>>>,
    /// The first picture for a page.
    picture: Mutex<Option<Frame>>,
    is_over: AtomicBool,
}

/// Ends the threads of all pages when it is dropped.
pub(super) struct Ending<'a>(&'a Hub);

impl Drop for Ending<'_> {
    fn drop(&mut self) {
        self.0.is_over.store(true, Ordering::SeqCst);
    }
}

/// The value within; a thread that has panicked leaves it whole, because each change is a single step.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Hub {
    pub fn new() -> Self {
        Self {
            mail: Mutex::default(),
            bell: Condvar::new(),
            has_mail: AtomicBool::new(false),
            is_urgent: AtomicBool::new(false),
            pages: Mutex::default(),
            next_page: AtomicU64::new(1),
            next_frame: AtomicU64::new(1),
            greetings: Mutex::default(),
            picture: Mutex::default(),
            is_over: AtomicBool::new(false),
        }
    }

    /// What ends all threads when it goes.
    pub fn ending(&self) -> Ending<'_> {
        Ending(self)
    }

    /// Whether the threads of pages are to end.
    pub fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }

    /// Gives `mail` to the render.
    pub fn send(&self, mail: Mail) {
        // A moving camera and other settings make the samples at hand useless; all else can wait for the end of a tile.
        let is_urgent = matches!(
            mail,
            Mail::Command(
                _,
                Command::Camera(_)
                    | Command::Set { .. }
                    | Command::Restart {}
                    | Command::Material { .. }
                    | Command::Light { .. }
                    | Command::Compare { .. }
            )
        );
        let mut waiting = lock(&self.mail);
        if waiting.len() < MAX_MAIL {
            waiting.push_back(mail);
        }
        self.has_mail.store(true, Ordering::SeqCst);
        if is_urgent {
            self.is_urgent.store(true, Ordering::SeqCst);
        }
        drop(waiting);
        self.bell.notify_all();
    }

    /// Whether mail waits.
    pub fn has_mail(&self) -> bool {
        self.has_mail.load(Ordering::Relaxed)
    }

    /// Whether mail waits that makes the work at hand useless.
    pub fn is_urgent(&self) -> bool {
        self.is_urgent.load(Ordering::Relaxed)
    }

    /// All mail; it waits for some for so long at most.
    pub fn take_mail(&self, patience: Duration) -> Vec<Mail> {
        let mut waiting = lock(&self.mail);
        if waiting.is_empty() && !patience.is_zero() {
            waiting = match self.bell.wait_timeout(waiting, patience) {
                Ok((waiting, _)) => waiting,
                Err(poisoned) => poisoned.into_inner().0,
            };
        }
        self.has_mail.store(false, Ordering::SeqCst);
        self.is_urgent.store(false, Ordering::SeqCst);
        waiting.drain(..).collect()
    }

    /// A new page, which is told the greetings and shown the picture.
    pub fn join(&self) -> PageId {
        let id = self.next_page.fetch_add(1, Ordering::SeqCst);
        let greetings = lock(&self.greetings);
        let outbox = Outbox {
            messages: greetings.values().cloned().collect(),
            channels: vec![(PICTURE.into(), lock(&self.picture).clone())],
        };
        lock(&self.pages).insert(id, outbox);
        id
    }

    /// The page is closed.
    pub fn leave(&self, id: PageId) {
        lock(&self.pages).remove(&id);
        // The render may be to end with its last page.
        self.bell.notify_all();
    }

    /// Number of pages, and how many there were in all.
    pub fn pages(&self) -> (usize, u64) {
        (lock(&self.pages).len(), self.next_page.load(Ordering::SeqCst) - 1)
    }

    /// Sends `text` to all pages, or to one.
    pub fn tell(&self, page: Option<PageId>, text: &str) {
        let text: Arc<str> = text.into();
        for (id, outbox) in lock(&self.pages).iter_mut() {
            if page.is_none_or(|page| page == *id) {
                outbox.messages.push_back(Arc::clone(&text));
                if outbox.messages.len() > MAX_OUTBOX {
                    outbox.messages.pop_front();
                }
            }
        }
    }

    /// New pages are no longer told the message of this kind.
    pub fn forget(&self, kind: &'static str) {
        lock(&self.greetings).remove(kind);
    }

    /// Sends `text` to all pages, and to each new one in its place among other kinds.
    pub fn greet(&self, kind: &'static str, text: &str) {
        lock(&self.greetings).insert(kind, text.into());
        self.tell(None, text);
    }

    /// The page shows other channels from now on.
    pub fn set_channels(&self, page: PageId, names: impl IntoIterator<Item = String>) {
        if let Some(outbox) = lock(&self.pages).get_mut(&page) {
            outbox.channels = names.into_iter().map(|name| (name, None)).collect();
        }
    }

    /// Channels that pages show.
    pub fn channels(&self) -> BTreeSet<String> {
        let pages = lock(&self.pages);
        let channels = pages.values().flat_map(|outbox| &outbox.channels);
        channels.map(|(name, _)| name.clone()).collect()
    }

    /// Number of the next picture.
    pub fn next_frame(&self) -> u64 {
        self.next_frame.fetch_add(1, Ordering::SeqCst)
    }

    /// New pages are shown `frame` first.
    pub fn greet_with(&self, frame: Option<&Frame>) {
        *lock(&self.picture) = frame.cloned();
    }

    /// Shows `frame` on all pages that show `channel`.
    pub fn show(&self, channel: &str, frame: &Frame) {
        let mut pages = lock(&self.pages);
        let channels = pages.values_mut().flat_map(|outbox| &mut outbox.channels);
        for (_, waiting) in channels.filter(|(name, _)| name == channel) {
            *waiting = Some(frame.clone());
        }
    }

    /// What waits for `page`: messages, and pictures unless the page is behind (`is_behind`).
    pub fn outgoing(&self, page: PageId, is_behind: bool) -> (VecDeque<Arc<str>>, Vec<Frame>) {
        let mut pages = lock(&self.pages);
        let Some(outbox) = pages.get_mut(&page) else {
            return (VecDeque::new(), Vec::new());
        };
        let frames = match is_behind {
            true => Vec::new(),
            false => outbox
                .channels
                .iter_mut()
                .filter_map(|(_, frame)| frame.take())
                .collect(),
        };
        (std::mem::take(&mut outbox.messages), frames)
    }
}
