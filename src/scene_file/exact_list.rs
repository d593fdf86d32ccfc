//! Lists of a fixed number of values. serde's arrays ignore additional values. Here, additional
//! values are an error.

use serde::de::{Deserializer, Error, IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::marker::PhantomData;

/// A list of exactly `N` values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub(super) struct ExactList<L>(pub L);

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for ExactList<[T; N]> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct List<T, const N: usize>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>, const N: usize> Visitor<'de> for List<T, N> {
            type Value = ExactList<[T; N]>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "an array of length {N}")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
                let mut values = Vec::with_capacity(N);
                while values.len() < N {
                    match list.next_element()? {
                        Some(value) => values.push(value),
                        None => break,
                    }
                }
                let mut length = values.len();
                while list.next_element::<IgnoredAny>()?.is_some() {
                    length += 1;
                }
                let values = values.try_into().ok().filter(|_| length == N);
                values
                    .map(ExactList)
                    .ok_or_else(|| A::Error::invalid_length(length, &self))
            }
        }
        deserializer.deserialize_seq(List(PhantomData))
    }
}
