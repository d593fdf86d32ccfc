//! Shared state of the render and the threads of the pages: commands for the render, messages and
//! pictures for the pages.

use super::frame::Frame;
use super::protocol::Command;
use crate::color::Tone;
use crate::io::half_picture::PICTURE;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Maximum number of waiting commands. Further commands are dropped.
const MAX_MAIL: usize = 4096;
/// Maximum number of messages waiting for a page. The oldest are dropped.
const MAX_OUTBOX: usize = 256;

/// Number of the connection of a page.
pub(super) type PageId = u64;

/// Request to the render.
pub(super) enum Mail {
    /// Command of a page.
    Command(PageId, Command),
    /// Request for the picture as a file, and the sender for its reply.
    Save(SaveFormat, Sender<Result<Vec<u8>, String>>),
}

/// File format for a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SaveFormat {
    /// All channels, as in `render -o FILE.exr`.
    Exr,
    /// PNG file with the given tone, or else with the tone of the settings.
    Png(Option<Tone>),
    /// A small picture of a scene texture, for display.
    Texture(u32),
}

/// Messages and pictures that wait for a page.
#[derive(Default)]
pub(super) struct Outbox {
    pub messages: VecDeque<Arc<str>>,
    /// Channels that the page shows, each with its newest unsent picture.
    channels: Vec<(String, Option<Frame>)>,
}

/// State that the render and the threads of the pages share.
pub(super) struct Hub {
    mail: Mutex<VecDeque<Mail>>,
    bell: Condvar,
    /// True if mail waits. The second field is true if waiting mail makes the current work useless.
    has_mail: AtomicBool,
    is_urgent: AtomicBool,
    pages: Mutex<BTreeMap<PageId, Outbox>>,
    next_page: AtomicU64,
    next_frame: AtomicU64,
    /// First messages for a new page, by kind.
    greetings: Mutex<BTreeMap<&'static str, Arc<str>>>,
    /// First picture for a new page.
    picture: Mutex<Option<Frame>>,
    is_over: AtomicBool,
}

/// Ends the threads of all pages on drop.
pub(super) struct PageThreadsGuard<'a>(&'a Hub);

impl Drop for PageThreadsGuard<'_> {
    fn drop(&mut self) {
        self.0.is_over.store(true, Ordering::SeqCst);
    }
}

/// Locks `mutex`, even after a panic in another thread. The value is then still consistent, because
/// each change of the value is a single step.
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

    /// A guard that ends all threads on drop.
    pub fn ending(&self) -> PageThreadsGuard<'_> {
        PageThreadsGuard(self)
    }

    /// Returns true if the threads of pages must end.
    pub fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }

    /// Sends `mail` to the render.
    pub fn send(&self, mail: Mail) {
        // Camera motion and changed settings make the current samples useless. Other mail can wait
        // for the end of a tile.
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

    /// Returns true if mail waits.
    pub fn has_mail(&self) -> bool {
        self.has_mail.load(Ordering::Relaxed)
    }

    /// Returns true if waiting mail makes the current work useless.
    pub fn is_urgent(&self) -> bool {
        self.is_urgent.load(Ordering::Relaxed)
    }

    /// Takes all mail. If there is none, waits up to `patience` for it.
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

    /// Adds a page. It receives the first messages and the first picture.
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

    /// Removes a closed page.
    pub fn leave(&self, id: PageId) {
        lock(&self.pages).remove(&id);
        // Wake the render, which may have to end with its last page.
        self.bell.notify_all();
    }

    /// Number of open pages, and number of all pages since the start.
    pub fn pages(&self) -> (usize, u64) {
        (lock(&self.pages).len(), self.next_page.load(Ordering::SeqCst) - 1)
    }

    /// Sends `text` to all pages, or to a single page.
    pub fn send_text(&self, page: Option<PageId>, text: &str) {
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

    /// Removes the message of this kind from the greetings of new pages.
    pub fn remove_greeting(&self, kind: &'static str) {
        lock(&self.greetings).remove(kind);
    }

    /// Sends `text` to all pages, and stores it as the first message `kind` for new pages. New
    /// pages receive their first messages in the order of kinds.
    pub fn greet(&self, kind: &'static str, text: &str) {
        lock(&self.greetings).insert(kind, text.into());
        self.send_text(None, text);
    }

    /// Sets the channels that the page shows.
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

    /// Returns a new number for a picture.
    pub fn next_frame(&self) -> u64 {
        self.next_frame.fetch_add(1, Ordering::SeqCst)
    }

    /// Sets the first picture of new pages.
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

    /// Takes the waiting messages for `page`. Takes the waiting pictures too, unless the page
    /// `is_behind`: too many bytes of pictures are still on their way to the page.
    pub fn outgoing(&self, page: PageId, is_behind: bool) -> (VecDeque<Arc<str>>, Vec<Frame>) {
        let mut pages = lock(&self.pages);
        let Some(outbox) = pages.get_mut(&page) else {
            return (VecDeque::new(), Vec::new());
        };
        let frames = if is_behind {
            Vec::new()
        } else {
            outbox
                .channels
                .iter_mut()
                .filter_map(|(_, frame)| frame.take())
                .collect()
        };
        (std::mem::take(&mut outbox.messages), frames)
    }
}
