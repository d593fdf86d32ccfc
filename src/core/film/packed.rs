//! Packed integers: the sums of all pixels of a tile, without the bytes that no pixel needs.
//!
//! A sum has a wide range, of which the pixels of a tile use a small part. For example, radiance
//! around 1 has no bits above 2⁸, and a sum of few floats has none below 2⁻⁴⁰. A column has one
//! integer for each pixel. The bits below the lowest set bit of the column, and all bits above its
//! highest bit but one sign bit, are left out, and the rest is rounded up to whole bytes. Nothing
//! else is compressed, because the other bits are random. Packing is exact. It takes about as much
//! time as adding the sums of a task to the pixels.
//!
//! Columns are packed in groups. A group has a table of its columns: for each, the number of low
//! bits that are left out, and the number of bytes per integer. The integers of each column follow,
//! the lowest byte first.

use std::borrow::Borrow;
use std::marker::PhantomData;

/// Bytes after the last column. They let [`Group::get`] read whole machine words.
const SLACK: usize = 16;

/// A signed integer of 64 or 128 bits.
pub(super) trait Integer: Copy {
    const ZERO: Self;
    /// Size in bytes.
    const SIZE: usize;

    /// Bits of `self` that differ from the sign bit.
    fn magnitude(self) -> Self;

    fn or(self, other: Self) -> Self;

    /// Number of low bits that are 0 in all integers of a column, and number of bytes for the other
    /// bits. `high` has all bits of their magnitudes, and `low` all bits of the integers.
    fn column(high: Self, low: Self) -> Column;

    /// Writes all bytes of `self`, without its lowest `shift` bits, to the start of `bytes`.
    fn write(self, shift: u32, bytes: &mut [u8]);

    /// Integer whose lowest `shift` bits are 0, and whose next `width` bytes are at the start of
    /// `bytes`. `width` must not be 0.
    fn read(bytes: &[u8], width: usize, shift: u32) -> Self;
}

/// First `N` bytes of `bytes`; zeros if there are fewer.
fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
    bytes.first_chunk().copied().unwrap_or([0; N])
}

macro_rules! integer {
    ($integer:ty) => {
        impl Integer for $integer {
            const ZERO: Self = 0;
            const SIZE: usize = size_of::<Self>();

            #[inline(always)]
            fn magnitude(self) -> Self {
                self ^ (self >> (Self::BITS - 1))
            }

            #[inline(always)]
            fn or(self, other: Self) -> Self {
                self | other
            }

            fn column(high: Self, low: Self) -> Column {
                if low == 0 {
                    return Column::default();
                }
                let shift = low.trailing_zeros();
                let used = Self::BITS - high.leading_zeros() + 1 - shift;
                Column {
                    shift,
                    width: used.div_ceil(8) as usize,
                    start: 0,
                }
            }

            #[inline(always)]
            fn write(self, shift: u32, bytes: &mut [u8]) {
                if let Some(bytes) = bytes.first_chunk_mut() {
                    *bytes = (self >> shift).to_le_bytes();
                }
            }

            #[inline(always)]
            fn read(bytes: &[u8], width: usize, shift: u32) -> Self {
                // Shift the sign bit to the top, and back again.
                if width <= 8 {
                    let unused = 64 - 8 * width as u32;
                    return Self::from((i64::from_le_bytes(first(bytes)) << unused) >> unused) << shift;
                }
                let unused = Self::BITS.saturating_sub(8 * width as u32);
                (Self::from_le_bytes(first(bytes)) << unused) >> unused << shift
            }
        }
    };
}

integer!(i64);
integer!(i128);

/// A quantity that is stored as an integer.
pub(super) trait Stored: Copy {
    type Integer: Integer;

    fn to_integer(self) -> Self::Integer;

    fn of_integer(integer: Self::Integer) -> Self;
}

impl Stored for u32 {
    type Integer = i64;

    fn to_integer(self) -> i64 {
        i64::from(self)
    }

    fn of_integer(integer: i64) -> Self {
        integer as Self
    }
}

impl Stored for f64 {
    type Integer = i64;

    fn to_integer(self) -> i64 {
        self.to_bits() as i64
    }

    fn of_integer(integer: i64) -> Self {
        Self::from_bits(integer as u64)
    }
}

/// Part of the bits of a column that is stored.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Column {
    /// Number of low bits that are 0 in all integers.
    shift: u32,
    /// Number of bytes of an integer.
    width: usize,
    /// Position of the first integer, from the start of the group.
    start: usize,
}

impl Column {
    /// Integer of the pixel `i` in a group with the bytes `bytes`.
    #[inline(always)]
    fn get<I: Integer>(self, bytes: &[u8], i: usize) -> I {
        if self.width == 0 {
            return I::ZERO;
        }
        I::read(
            bytes.get(self.start + i * self.width..).unwrap_or(&[]),
            self.width,
            self.shift,
        )
    }
}

/// Packs groups of columns, one after the other.
#[derive(Debug)]
pub(super) struct Packer {
    bytes: Vec<u8>,
}

impl Packer {
    /// Packer for a tile of `pixels` pixels with `expected` bytes per pixel.
    pub fn new(pixels: usize, expected: usize) -> Self {
        Self {
            bytes: Vec::with_capacity(pixels * expected + SLACK),
        }
    }

    /// Packs a group of `N` columns. `rows` has the values of all columns for each pixel.
    pub fn group<T: Stored, const N: usize, R: Borrow<[T; N]>>(
        &mut self,
        rows: impl ExactSizeIterator<Item = R> + Clone,
    ) {
        let mut columns = [Column::default(); N];
        for (c, column) in columns.iter_mut().enumerate() {
            let (mut high, mut low) = (T::Integer::ZERO, T::Integer::ZERO);
            for row in rows.clone() {
                let integer = row.borrow()[c].to_integer();
                high = high.or(integer.magnitude());
                low = low.or(integer);
            }
            *column = T::Integer::column(high, low);
            self.bytes.extend([column.shift as u8, column.width as u8]);
        }
        for (c, Column { shift, width, .. }) in columns.into_iter().enumerate().filter(|(_, column)| column.width > 0) {
            let start = self.bytes.len();
            let end = start + rows.len() * width;
            self.bytes.resize(end + SLACK, 0);
            // Each integer is written with bytes that the next one overwrites.
            let mut bytes = &mut self.bytes[start..];
            for row in rows.clone() {
                row.borrow()[c].to_integer().write(shift, bytes);
                bytes = bytes.get_mut(width..).unwrap_or_default();
            }
            self.bytes.truncate(end);
        }
    }

    /// Appends a number, outside of the groups.
    pub fn number(&mut self, number: u32) {
        self.bytes.extend(number.to_le_bytes());
    }

    /// The packed groups.
    pub fn finish(mut self) -> Packed {
        self.bytes.extend([0; SLACK]);
        Packed(self.bytes.into_boxed_slice())
    }
}

/// Packed groups of columns.
#[derive(Clone, Debug, Default)]
pub(super) struct Packed(Box<[u8]>);

impl Packed {
    /// All bytes of the groups.
    pub fn bytes(&self) -> &[u8] {
        &self.0[..self.0.len().saturating_sub(SLACK)]
    }

    /// Groups with these [`Packed::bytes`].
    pub fn of_bytes(bytes: &[u8]) -> Self {
        Self([bytes, &[0; SLACK]].concat().into_boxed_slice())
    }

    /// Reader of the groups of a tile of `pixels` pixels.
    pub fn unpack(&self, pixels: usize) -> Unpacker<'_> {
        Unpacker { rest: &self.0, pixels }
    }
}

/// Reads packed groups, in the order in which they were packed.
#[derive(Debug)]
pub(super) struct Unpacker<'a> {
    rest: &'a [u8],
    pixels: usize,
}

impl<'a> Unpacker<'a> {
    /// Next group, of `N` columns. `None` if the bytes are not such a group, or end too early.
    pub fn group<T: Stored, const N: usize>(&mut self) -> Option<Group<'a, T, N>> {
        let mut columns = [Column::default(); N];
        let mut start = 2 * N;
        for (column, entry) in columns.iter_mut().zip(self.rest.get(..start)?.chunks_exact(2)) {
            let (shift, width) = (u32::from(entry[0]), usize::from(entry[1]));
            if shift >= 8 * T::Integer::SIZE as u32 || width > T::Integer::SIZE {
                return None;
            }
            *column = Column { shift, width, start };
            start += width * self.pixels;
        }
        let bytes = self.rest;
        self.rest = bytes.get(start..)?;
        (self.rest.len() >= SLACK).then_some(Group {
            bytes,
            columns,
            stored: PhantomData,
        })
    }

    /// Next number outside of the groups. `None` if the bytes end before.
    pub fn number(&mut self) -> Option<u32> {
        let (number, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(u32::from_le_bytes(*number))
    }

    /// Returns true if all groups were read.
    pub fn is_done(&self) -> bool {
        self.rest.len() <= SLACK
    }
}

/// A packed group of `N` columns.
#[derive(Debug)]
pub(super) struct Group<'a, T, const N: usize> {
    bytes: &'a [u8],
    columns: [Column; N],
    stored: PhantomData<T>,
}

impl<T: Stored, const N: usize> Group<'_, T, N> {
    /// Values of all columns for the pixel `i`.
    pub fn get(&self, i: usize) -> [T; N] {
        self.columns.map(|column| T::of_integer(column.get(self.bytes, i)))
    }

    /// Writes the values of all columns to `rows`, which has one row for each pixel. Columns of
    /// zeros are left out.
    pub fn unpack<'r>(&self, rows: impl Iterator<Item = &'r mut [T; N]>)
    where
        T: 'r,
    {
        let mut rows: Vec<_> = rows.collect();
        for (c, column) in self.columns.iter().enumerate().filter(|(_, column)| column.width > 0) {
            for (i, row) in rows.iter_mut().enumerate() {
                row[c] = T::of_integer(column.get(self.bytes, i));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Fixed;
    use super::super::fixed::Narrow;
    use super::*;
    use crate::math::hash::mix;

    fn packed<T: Stored, const N: usize>(rows: &[[T; N]]) -> Packed {
        let mut packer = Packer::new(rows.len(), 0);
        packer.group(rows.iter().copied());
        packer.finish()
    }

    /// Columns of all widths and shifts, of both signs, are unpacked to the bit. So are the largest
    /// and the smallest integers.
    #[test]
    fn every_width_is_exact() {
        for pixels in [1, 7, 256] {
            for bits in 0..128 {
                for shift in [0, 1, 13, 64, 120] {
                    let row = |i: u64| {
                        let random = |c| (u128::from(mix(3 * i + c)) << 64 | u128::from(mix(i ^ c << 32))) as i128;
                        let wide = [0, 1].map(|c| random(c) >> (127 - bits) << shift.min(127 - bits));
                        [wide[0], if i == 0 { wide[1] } else { 0 }, -1, i128::MAX, i128::MIN]
                    };
                    let rows: Vec<_> = (0..pixels).map(row).collect();
                    let wide: Vec<_> = rows.iter().map(|row| row.map(Fixed::of_integer)).collect();
                    let narrow = rows.iter().map(|row| row.map(|v| Narrow::of_integer((v >> 64) as i64)));
                    let narrow: Vec<_> = narrow.collect();
                    let mut packer = Packer::new(wide.len(), 3);
                    packer.group(wide.iter().copied());
                    packer.group(narrow.iter().copied());
                    let packed = Packed::of_bytes(packer.finish().bytes());
                    let mut unpacker = packed.unpack(wide.len());
                    let group = unpacker.group::<Fixed, 5>().unwrap();
                    let narrow_group = unpacker.group::<Narrow, 5>().unwrap();
                    assert!(unpacker.is_done());
                    for i in 0..wide.len() {
                        assert_eq!((group.get(i), narrow_group.get(i)), (wide[i], narrow[i]));
                    }
                }
            }
        }
    }

    #[test]
    fn unused_bits_take_no_bytes() {
        let bytes = |values: &[f64]| {
            let rows: Vec<[Fixed; 1]> = values.iter().map(|&v| [Fixed::new(v)]).collect();
            packed(&rows).bytes().len() - 2
        };
        assert_eq!(bytes(&[0.0; 256]), 0);
        // One byte has the numbers from −128 to 127, in any unit.
        assert_eq!(bytes(&[0.0, 127.0, -128.0]), 3);
        assert_eq!(bytes(&[0.0, 127.0 / 1024.0, -0.125]), 3);
        assert_eq!(bytes(&[0.0, 128.0, 1.0]), 6);
        // A float of 24 bits takes 4 bytes, because its sign is a bit, too.
        assert_eq!(bytes(&[f64::from(0.1f32)]), 4);
        assert_eq!(bytes(&[1e30, -1e30, 2f64.powi(-64)]), 48);
        assert_eq!(packed(&[[0.0, f64::NAN]]).bytes().len(), 4 + 2);
    }

    /// Bytes that are no group are found, and never read beyond their end.
    #[test]
    fn wrong_bytes_are_not_a_group() {
        let rows = [[Fixed::new(0.3), Fixed::new(-7e5)]; 20];
        let packed = packed(&rows);
        let read = |bytes: &[u8], pixels| Packed::of_bytes(bytes).unpack(pixels).group::<Fixed, 2>().is_some();
        assert!(read(packed.bytes(), 20) && !read(packed.bytes(), 21));
        assert!(!read(&packed.bytes()[..packed.bytes().len() - 1], 20) && !read(&[], 20));
        for (i, value) in [(0, 128), (1, 17), (3, 255)] {
            let mut bytes = packed.bytes().to_vec();
            bytes[i] = value;
            assert!(!read(&bytes, 20));
        }
        assert!(Packed::default().unpack(20).group::<Fixed, 2>().is_none());
    }
}
