//! Recording of the queries of a backend. Rays of a packet are recorded consecutively. `--pixel`
//! prints the recorded queries, and `embrasure bench` traces them again.

use super::{Accel, Answer, BackendInfo, Query};
use crate::geometry::Hit;
use crate::math::Ray;
use std::sync::{Mutex, PoisonError};

/// A backend that records its queries and answers. Rays of a packet are recorded consecutively.
#[derive(Debug)]
pub struct Recorder<'a, A> {
    accel: &'a A,
    notes: Mutex<Vec<(Query, Answer)>>,
}

impl<'a, A: Accel> Recorder<'a, A> {
    /// A recorder that forwards queries to `accel`.
    pub fn new(accel: &'a A) -> Self {
        Self {
            accel,
            notes: Mutex::default(),
        }
    }

    /// Returns all recorded queries with their answers, and clears the record. With one thread, the
    /// record has the order of the queries. Rays of a packet are consecutive.
    pub fn take(&self) -> Vec<(Query, Answer)> {
        std::mem::take(&mut *self.notes.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn note(&self, notes: impl Iterator<Item = (Query, Answer)>) {
        self.notes.lock().unwrap_or_else(PoisonError::into_inner).extend(notes);
    }
}

impl<A: Accel> Accel for Recorder<'_, A> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let hit = self.accel.intersect(ray);
        self.note(std::iter::once((Query::closest(ray), Answer::Closest(hit))));
        hit
    }

    fn intersect_coherent(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.accel.intersect_coherent(rays, hits);
        let answers = hits.iter().copied().map(Answer::Closest);
        self.note(rays.iter().map(Query::closest).zip(answers));
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let occluded = self.accel.occluded(ray);
        self.note(std::iter::once((Query::occlusion(ray), Answer::Occlusion(occluded))));
        occluded
    }

    fn occluded_coherent(&self, rays: &[Ray], occluded: &mut [bool]) {
        self.accel.occluded_coherent(rays, occluded);
        let answers = occluded.iter().copied().map(Answer::Occlusion);
        self.note(rays.iter().map(Query::occlusion).zip(answers));
    }

    fn info(&self) -> BackendInfo {
        self.accel.info()
    }

    fn bytes(&self) -> u64 {
        self.accel.bytes()
    }
}
