use super::{Accel, Answer, BackendInfo, Query, QueryKind};
use crate::geometry::Hit;
use crate::math::Ray;
use std::sync::{Mutex, PoisonError};

/// A backend that notes what it is asked and what it answers.
#[derive(Debug)]
pub struct Recorder<'a, A> {
    accel: &'a A,
    notes: Mutex<Vec<(Query, Answer)>>,
}

impl<'a, A: Accel> Recorder<'a, A> {
    /// Lets `accel` answer.
    pub fn new(accel: &'a A) -> Self {
        Self {
            accel,
            notes: Mutex::default(),
        }
    }

    /// All since the last time, in the order of asking where one thread asked.
    pub fn take(&self) -> Vec<(Query, Answer)> {
        std::mem::take(&mut *self.notes.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn ask(&self, ray: &Ray, kind: QueryKind) -> Answer {
        let query = Query { ray: *ray, kind };
        let answer = query.ask(self.accel);
        let mut notes = self.notes.lock().unwrap_or_else(PoisonError::into_inner);
        notes.push((query, answer));
        answer
    }
}

impl<A: Accel> Accel for Recorder<'_, A> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.ask(ray, QueryKind::Closest).hit()
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.ask(ray, QueryKind::Occlusion).is_hit()
    }

    fn info(&self) -> BackendInfo {
        self.accel.info()
    }

    fn bytes(&self) -> u64 {
        self.accel.bytes()
    }
}
