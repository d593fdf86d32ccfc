//! Shapes that show the front of an object. The back-rest of a seat is at its back. Feet stick out
//! to the front of the ankles, and so do the paws and hooves of animals on four legs. The head of
//! such an animal is high at its front, or overhangs its front legs. The front of a fish or a bird
//! is blunt, and its back is a tail. The front of a vehicle is lower than its back, and the gun of
//! a tank points to the front (`barrel`). Cupboards, sofas and football goals are open at the front
//! (`open_side`).
//!
//! Limits were set on some 700 public files. Their seats and people were identified by name and by
//! eye. Both are rare among other files: about one in a hundred has the shape of a seat or of feet.
//! Limits of overhangs, blunt ends and open sides were set on 155 other files, and tested on 128.

use super::barrel::barrel_sticks_out;
use super::open_side::{DepthMap, open_side};
use super::side_points::{SIDES, SidePoint, axis_of, likeness, placed, range};
use super::surfaces::Point;
use crate::math::{Bounds3, Horizon, Vec3};
use std::ops::RangeInclusive;

/// Minimum ratio of a seat's height to its larger width.
const HIGH: f32 = 0.25;
/// Heights above which there is only the back-rest, as fractions of the object's height.
const RESTS: [f32; 4] = [0.6, 0.7, 0.8, 0.9];
/// Minimum number of points of a back-rest, and of other parts that are compared.
const MIN_POINTS: usize = 40;
/// Maximum positions of the back end and of the front end of a back-rest, from −1/2 at the back of
/// the object to 1/2 at its front.
const REST: (f32, f32) = (-0.2, -0.1);
/// Minimum width of a back-rest, as a fraction of the object's width.
const REST_WIDTH: f32 = 0.45;
/// Range of heights of the surface to sit on, as fractions of the object's height.
const SEAT: RangeInclusive<f32> = 0.2..=0.5;
/// Thickness of the band in which the surface to sit on is searched, as a fraction of the object's
/// height.
const SEAT_BAND: f32 = 0.15;
/// Minimum fraction of the outline that a seat covers.
const SEAT_AREA: f32 = 0.35;
/// Number of grid cells along a side of the outline, to measure the covered fraction.
const CELLS: f32 = 16.0;
/// Maximum fraction of the points that lie above the middle of the seat.
const CLUTTER: f32 = 0.06;

/// Range of heights of feet, as fractions of the person's height.
const FEET: RangeInclusive<f32> = 0.0..=0.04;
/// Range of heights of ankles, as fractions of the person's height.
const ANKLES: RangeInclusive<f32> = 0.07..=0.14;
/// Minimum ratio of a person's height to the length from front to back.
const UPRIGHT: f32 = 1.25;
/// Distance between the ankles, as a fraction of the person's width.
const APART: RangeInclusive<f32> = 0.03..=0.7;
/// Minimum fraction of the ankle points in each leg.
const LEG: f32 = 0.25;
/// Length of a foot, as a fraction of the person's height.
const FOOT: RangeInclusive<f32> = 0.05..=0.35;
/// Length by which the toes stick out farther than the heel, as a fraction of the person's height.
const TOES: RangeInclusive<f32> = 0.03..=0.25;
/// Minimum length by which the toes stick out in front of the ankle, as a fraction of the person's
/// height: the backs of machines that overhang their feet in front do not.
const BEYOND_ANKLES: f32 = 0.015;

/// Minimum and maximum of height divided by length, for an animal on four legs.
const ON_LEGS: RangeInclusive<f32> = 0.4..=1.6;
/// Minimum ratio of length to width of an animal on four legs.
const LONG_BODY: f32 = 1.5;
/// Height above which there are only head and neck, as a fraction of the animal's height.
const HEAD: f32 = 0.65;
/// Minimum fraction of the points of head and neck that lie in front of the animal's middle.
const IN_FRONT: f32 = 0.9;
/// Width of the head, as a fraction of the animal's width: fins are narrower. Antlers are wider
/// than the body. They are thin, so that few points show the width of the whole.
const HEAD_WIDTH: RangeInclusive<f32> = 0.2..=2.0;
/// Minimum length of the head, as a fraction of the animal's length: head boards of beds are thin.
const HEAD_LENGTH: f32 = 0.12;
/// Maximum height of feet, as a fraction of the animal's height.
const HOOVES: f32 = 0.08;
/// Minimum distance between front and hind feet, as a fraction of the animal's length.
const STRIDE: f32 = 0.35;
/// Half the length of the part in the middle that is free of legs, as a fraction of the animal's
/// length.
const BELLY: f32 = 0.1;
/// Maximum fraction of the feet's points that lie in the part free of legs.
const UNDER_BELLY: f32 = 0.08;

/// Minimum fraction of the points that lie in front of the fore feet of an animal, and minimum
/// ratio to the fraction of the points that lie behind its hind feet: a head is heavier than a
/// tail. The trunk of an elephant hangs in front of its feet too.
const OVERHANG: f32 = 0.1;
const HEAVIER: f32 = 2.5;
/// Distance between the feet and an overhang, as a fraction of the animal's length.
const OFF_FEET: f32 = 0.02;

/// Minimum difference between the mean depths of a body that is seen from its tail and from its
/// head: the head is blunt, and the tail is thin.
const BLUNT: f32 = 0.12;
/// Minimum similarity of the left and right halves of a body with a blunt end, and minimum
/// difference to the similarity of the front and back halves. Those of beds are more similar.
const BLUNT_SIDES: f32 = 0.7;
const BLUNT_ENDS: f32 = 0.3;
/// Minimum and maximum of height divided by length, for such a body.
const BLUNT_HEIGHT: RangeInclusive<f32> = 0.2..=1.2;
/// Maximum length on which such a body stands, as a fraction of its length: furniture and vehicles
/// stand on more.
const BLUNT_STRIDE: f32 = 0.7;

/// Minimum length by which wheels are longer at the height of ankles than at the ground, on each
/// side, as a fraction of the object's height.
const ROUND_WHEEL: f32 = 0.02;
/// Ends of a vehicle are farther than `END` from its middle, and its bonnet or boot is between
/// `BONNET` and `END`, as fractions of its length.
const END: f32 = 0.38;
const BONNET: f32 = 0.25;
/// Minimum height by which the front end and the bonnet of a vehicle are lower than its back end
/// and its boot, as fractions of its height.
const LOWER: [f32; 2] = [0.05, 0.1];
/// Height above which points belong to the roof of a vehicle, as a fraction of its height.
const ROOF: f32 = 0.8;
/// Minimum distance of the middle of the roof behind the vehicle's middle, as a fraction of its
/// length.
const ROOF_BEHIND: f32 = 0.03;
/// Fraction of an end's points that are above its height.
const TOP: f32 = 0.05;

/// Minimum ratio of length to width of an animal whose paws or hooves show its front.
const LONG_ON_PAWS: f32 = 1.2;

/// Minimum similarity of the left and right halves.
const ALIKE: f32 = 0.8;
/// Minimum difference between the similarity of the left and right halves and the similarity of the
/// front and back halves.
const LESS_ALIKE: f32 = 0.12;
/// Minimum and maximum of length divided by width, for vehicles and animals.
const LENGTH: RangeInclusive<f32> = 1.6..=4.0;
/// Minimum and maximum of height divided by width, for vehicles and animals.
const VEHICLE: RangeInclusive<f32> = 0.45..=1.6;
/// Maximum of height divided by length, for vehicles and animals.
const LOW: f32 = 0.8;

/// Azimuth of the front according to shapes, in degrees; `None` if no shape shows it.
pub(super) fn facing(points: &[Point], bounds: Bounds3, horizon: &Horizon) -> Option<f32> {
    let size = bounds.max - bounds.min;
    if size.y <= 0.0 || !size.is_finite() {
        return None;
    }
    let seat = || {
        let areas = SIDES.map(|azimuth| seat_area(&placed(points, bounds, horizon, azimuth), size));
        let best = (0..SIDES.len()).max_by(|&a, &b| areas[a].total_cmp(&areas[b]))?;
        (areas[best] >= SEAT_AREA).then_some(SIDES[best])
    };
    let has_toes = |azimuth: &f32| toes_stick_out(&placed(points, bounds, horizon, *azimuth), size.y);
    let has_head = |azimuth: &f32| head_is_high(&placed(points, bounds, horizon, *azimuth), size.y);
    let has_paws = |azimuth: &f32| paws_stick_out(&placed(points, bounds, horizon, *azimuth), size.y);
    // Test heads and paws first: a head above a back resembles a back-rest above a seat.
    let head = SIDES.into_iter().find(has_head);
    let overhangs = |azimuth: &f32| head_overhangs(&placed(points, bounds, horizon, *azimuth), size.y);
    let is_blunt = |azimuth: &f32| is_blunt_end(points, bounds, horizon, *azimuth);
    let animal = head
        .or_else(|| SIDES.into_iter().find(has_paws))
        .or_else(|| SIDES.into_iter().find(overhangs))
        .or_else(|| SIDES.into_iter().find(is_blunt));
    let car = || {
        let is_car = |azimuth: &f32| bonnet_is_low(&placed(points, bounds, horizon, *azimuth), size.y);
        let is_long = is_long_body(points, bounds, horizon);
        SIDES.into_iter().find(|azimuth| is_long && is_car(azimuth))
    };
    let has_barrel = |azimuth: &f32| barrel_sticks_out(&placed(points, bounds, horizon, *azimuth));
    let tank = SIDES.into_iter().find(has_barrel);
    let shown = tank.or(animal).or_else(car).or_else(seat);
    shown
        .or_else(|| SIDES.into_iter().find(has_toes))
        .or_else(|| open_side(points, bounds, horizon))
}

/// Returns true if the object is an animal on four legs with its head at the front. `points` are in
/// coordinates of the side that is taken as the front.
fn head_is_high(points: &[SidePoint], height: f32) -> bool {
    let of = |from: f32, to: f32| points.iter().filter(move |p| p.height >= from && p.height <= to);
    let (Some((back, front)), Some((left, right))) = (
        range(points.iter().map(|p| p.front), MIN_POINTS),
        range(points.iter().map(|p| p.right), MIN_POINTS),
    ) else {
        return false;
    };
    let (length, width) = (front - back, right - left);
    if length < LONG_BODY * width || !ON_LEGS.contains(&(height / length)) {
        return false;
    }
    let middle = 0.5 * (back + front);
    let (Some((nape, nose)), Some((head_left, head_right))) = (
        range(of(HEAD, 1.0).map(|p| p.front), MIN_POINTS),
        range(of(HEAD, 1.0).map(|p| p.right), MIN_POINTS),
    ) else {
        return false;
    };
    if nose - nape < HEAD_LENGTH * length {
        return false;
    }
    let head = of(HEAD, 1.0).count() as f32;
    let before = of(HEAD, 1.0).filter(|p| p.front > middle).count() as f32;
    if before < IN_FRONT * head || !HEAD_WIDTH.contains(&((head_right - head_left) / width)) {
        return false;
    }
    let Some((hind, fore)) = range(of(0.0, HOOVES).map(|p| p.front), MIN_POINTS / 4) else {
        return false;
    };
    let feet = of(0.0, HOOVES).count() as f32;
    let between = of(0.0, HOOVES)
        .filter(|p| (p.front - 0.5 * (hind + fore)).abs() < BELLY * length)
        .count() as f32;
    fore - hind >= STRIDE * length && between <= UNDER_BELLY * feet
}

/// Returns true if the object is an animal on four legs with its head in front of its fore feet.
/// `points` are in coordinates of the side that is taken as the front.
fn head_overhangs(points: &[SidePoint], height: f32) -> bool {
    let low = || points.iter().filter(|p| p.height <= HOOVES);
    let (Some((back, front)), Some((left, right)), Some((hind, fore))) = (
        range(points.iter().map(|p| p.front), MIN_POINTS),
        range(points.iter().map(|p| p.right), MIN_POINTS),
        range(low().map(|p| p.front), MIN_POINTS / 4),
    ) else {
        return false;
    };
    let length = front - back;
    let is_long = length >= LONG_BODY * (right - left) && ON_LEGS.contains(&(height / length));
    let middle = 0.5 * (hind + fore);
    let between = low().filter(|p| (p.front - middle).abs() < BELLY * length).count() as f32;
    let has_legs = fore - hind >= STRIDE * length && between <= UNDER_BELLY * low().count() as f32;
    if !is_long || !has_legs || has_wheels(points, height, length) {
        return false;
    }
    let off = OFF_FEET * length;
    let share =
        |is_in: &dyn Fn(f32) -> bool| points.iter().filter(|p| is_in(p.front)).count() as f32 / points.len() as f32;
    let (head, tail) = (share(&|x| x > fore + off), share(&|x| x < hind - off));
    head >= OVERHANG && head >= HEAVIER * tail
}

/// Returns true if the side at `azimuth` is the blunt end of a body with a tail, such as a fish or
/// a bird.
fn is_blunt_end(points: &[Point], bounds: Bounds3, horizon: &Horizon, azimuth: f32) -> bool {
    let [front, behind] = [azimuth, azimuth + 180.0].map(|azimuth| placed(points, bounds, horizon, azimuth));
    let (Some((back, nose)), Some((left, right)), Some((hind, fore))) = (
        range(front.iter().map(|p| p.front), MIN_POINTS),
        range(front.iter().map(|p| p.right), MIN_POINTS),
        range(front.iter().filter(|p| p.height <= HOOVES).map(|p| p.front), 1),
    ) else {
        return false;
    };
    let length = nose - back;
    let is_shaped = length >= LONG_BODY * (right - left)
        && BLUNT_HEIGHT.contains(&((bounds.max.y - bounds.min.y) / length))
        && fore - hind <= BLUNT_STRIDE * length;
    if !is_shaped {
        return false;
    }
    let [sides, ends] = [azimuth + 90.0, azimuth].map(|azimuth| likeness(points, bounds, horizon, axis_of(azimuth)));
    if sides < BLUNT_SIDES || ends > sides - BLUNT_ENDS {
        return false;
    }
    // A tail is a small part of the surface, so no points are left out.
    let [front, behind] = [front, behind].map(|points| DepthMap::new(&points, 0.0));
    front
        .zip(behind)
        .is_some_and(|(front, behind)| behind.mean - front.mean >= BLUNT)
}

/// Area to sit on in front of a back-rest, as a fraction of the outline; 0 if there is no
/// back-rest. `points` are in coordinates of one side.
fn seat_area(points: &[SidePoint], size: Vec3) -> f32 {
    let extent = |of: fn(&SidePoint) -> f32| {
        let values = || points.iter().map(of);
        values().fold(f32::NEG_INFINITY, f32::max) - values().fold(f32::INFINITY, f32::min)
    };
    let (width, depth) = (extent(|p| p.right), extent(|p| p.front));
    if size.y < HIGH * width.max(depth) || width.min(depth) <= 0.0 {
        return 0.0;
    }
    let areas = RESTS.map(|above| {
        let rest = || points.iter().filter(|p| p.height > above);
        let ends = (
            range(rest().map(|p| p.front / depth), MIN_POINTS),
            range(rest().map(|p| p.right / width), MIN_POINTS),
        );
        let (Some((back, front)), Some((left, right))) = ends else {
            return 0.0;
        };
        if back > REST.0 || front > REST.1 || right - left < REST_WIDTH {
            return 0.0;
        }
        let before = || points.iter().filter(|p| p.front / depth > front + 0.03);
        // Find the height with most of the level points.
        let step = SEAT_BAND / 3.0;
        let low = SEAT.start() - step..=SEAT.end().min(above - SEAT_BAND);
        let count = |from: f32| {
            let band = from..=from + SEAT_BAND;
            before().filter(|p| p.is_level && band.contains(&p.height)).count()
        };
        let bands = (0..).map(|i| SEAT.start() + i as f32 * step);
        let best = bands
            .take_while(|from| low.contains(from))
            .max_by_key(|&from| count(from));
        let Some(from) = best.filter(|&from| count(from) >= MIN_POINTS) else {
            return 0.0;
        };
        let clutter = before().filter(|p| p.height > from + 1.2 * SEAT_BAND && p.right.abs() < 0.35 * width);
        if clutter.count() as f32 > CLUTTER * points.len() as f32 {
            return 0.0;
        }
        let band = from..=from + SEAT_BAND;
        let cell = |p: &SidePoint| {
            let of = |x: f32| ((x + 0.5) * CELLS).clamp(0.0, CELLS - 1.0) as u32;
            of(p.right / width) * CELLS as u32 + of(p.front / depth)
        };
        let mut cells: Vec<u32> = before()
            .filter(|p| p.is_level && band.contains(&p.height))
            .map(cell)
            .collect();
        cells.sort_unstable();
        cells.dedup();
        cells.len() as f32 / (CELLS * CELLS)
    });
    areas.into_iter().fold(0.0, f32::max)
}

/// Returns true if the object stands on two feet whose toes point to the front. `points` are in
/// coordinates of the side that is taken as the front.
fn toes_stick_out(points: &[SidePoint], height: f32) -> bool {
    let of_band = |band: RangeInclusive<f32>| points.iter().filter(move |p| band.contains(&p.height));
    let mut legs: Vec<f32> = of_band(ANKLES).map(|p| p.right).collect();
    legs.sort_unstable_by(f32::total_cmp);
    let (Some(depth), Some(width)) = (
        range(points.iter().map(|p| p.front), MIN_POINTS),
        range(points.iter().map(|p| p.right), MIN_POINTS),
    ) else {
        return false;
    };
    let gaps = legs.windows(2).enumerate();
    let widest = gaps.max_by(|(_, a), (_, b)| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
    let Some((at, &[left, right])) = widest.map(|(at, gap)| (at, <&[f32; 2]>::try_from(gap).unwrap_or(&[0.0; 2])))
    else {
        return false;
    };
    let share = (at + 1) as f32 / legs.len() as f32;
    let apart = (right - left) / (width.1 - width.0).max(f32::MIN_POSITIVE);
    let stands = height >= UPRIGHT * (depth.1 - depth.0) && (LEG..=1.0 - LEG).contains(&share);
    if !stands || !APART.contains(&apart) {
        return false;
    }
    let middle = 0.5 * (left + right);
    [true, false].into_iter().all(|is_left| {
        let leg = |band: RangeInclusive<f32>| {
            let points = of_band(band).filter(|p| (p.right < middle) == is_left);
            range(points.map(|p| p.front), MIN_POINTS / 4)
        };
        let (Some(foot), Some(ankle)) = (leg(FEET), leg(ANKLES)) else {
            return false;
        };
        let beyond = (foot.1 - ankle.1) / height;
        let toes = beyond - (ankle.0 - foot.0) / height;
        beyond >= BEYOND_ANKLES && FOOT.contains(&((foot.1 - foot.0) / height)) && TOES.contains(&toes)
    })
}

/// Returns true if the object stands on four legs whose paws or hooves all point to the front.
/// `points` are in coordinates of the side that is taken as the front.
fn paws_stick_out(points: &[SidePoint], height: f32) -> bool {
    let (Some((back, front)), Some((left, right))) = (
        range(points.iter().map(|p| p.front), MIN_POINTS),
        range(points.iter().map(|p| p.right), MIN_POINTS),
    ) else {
        return false;
    };
    if front - back < LONG_ON_PAWS * (right - left) {
        return false;
    }
    let toes_of = |[foot, ankle]: [(f32, f32); 2]| ((foot.1 - ankle.1) - (ankle.0 - foot.0)) / height;
    let legs = four_legs(points, STRIDE * (front - back));
    legs.is_some_and(|legs| legs.into_iter().all(|leg| TOES.contains(&toes_of(leg))))
}

/// Ranges from back to front of the foot and of the ankle of each of four legs; `None` if the
/// object does not stand on four legs whose feet are at least `stride` apart. `points` are in
/// coordinates of one side.
fn four_legs(points: &[SidePoint], stride: f32) -> Option<[[(f32, f32); 2]; 4]> {
    let low = || points.iter().filter(|p| p.height <= *ANKLES.end());
    let (hind, fore) = range(low().map(|p| p.front), MIN_POINTS)?;
    let (left, right) = range(low().map(|p| p.right), MIN_POINTS)?;
    if fore - hind < stride {
        return None;
    }
    let (middle, between) = (0.5 * (hind + fore), 0.5 * (left + right));
    let part = |is_fore: bool, is_right: bool, band: RangeInclusive<f32>| {
        let is_of_leg = |p: &&SidePoint| (p.front > middle) == is_fore && (p.right > between) == is_right;
        let points = points.iter().filter(|p| band.contains(&p.height)).filter(is_of_leg);
        range(points.map(|p| p.front), MIN_POINTS / 4)
    };
    let leg = |is_fore, is_right| Some([part(is_fore, is_right, FEET)?, part(is_fore, is_right, ANKLES)?]);
    Some([
        leg(true, true)?,
        leg(true, false)?,
        leg(false, true)?,
        leg(false, false)?,
    ])
}

/// Returns true if an object of the length `length` stands on four wheels, or on a body with four
/// short feet: at the height of ankles they are longer than at the ground.
fn has_wheels(points: &[SidePoint], height: f32, length: f32) -> bool {
    let widens = |[foot, above]: [(f32, f32); 2]| {
        above.1 - foot.1 >= ROUND_WHEEL * height && foot.0 - above.0 >= ROUND_WHEEL * height
    };
    four_legs(points, STRIDE * length).is_some_and(|wheels| wheels.into_iter().all(widens))
}

/// Returns true if a long object has four wheels, or a body on four short feet, and its front end
/// is lower than its back end: cars have a low bonnet, trucks a high body, and beds a high head
/// board. `points` are in coordinates of the side that is taken as the front.
fn bonnet_is_low(points: &[SidePoint], height: f32) -> bool {
    let (Some((back, front)), Some((left, right))) = (
        range(points.iter().map(|p| p.front), MIN_POINTS),
        range(points.iter().map(|p| p.right), MIN_POINTS),
    ) else {
        return false;
    };
    let length = front - back;
    if length <= right - left || !has_wheels(points, height, length) {
        return false;
    }
    let place = |p: &SidePoint| (p.front - 0.5 * (back + front)) / length;
    let top = |is_in: &dyn Fn(f32) -> bool| {
        let mut heights: Vec<f32> = points.iter().filter(|p| is_in(place(p))).map(|p| p.height).collect();
        heights.sort_unstable_by(|a, b| b.total_cmp(a));
        let tail = (TOP * heights.len() as f32) as usize;
        heights.get(tail).copied().filter(|_| heights.len() >= MIN_POINTS)
    };
    let (Some(bonnet), Some(boot), Some(nose), Some(tail)) = (
        top(&|x| (BONNET..END).contains(&x)),
        top(&|x| (BONNET..END).contains(&-x)),
        top(&|x| x >= END),
        top(&|x| -x >= END),
    ) else {
        return false;
    };
    let roof: Vec<f32> = points.iter().filter(|p| p.height > ROOF).map(place).collect();
    let of_roof = roof.iter().sum::<f32>() / (roof.len() as f32).max(1.0);
    tail - nose >= LOWER[0] && boot - bonnet >= LOWER[1] && of_roof <= -ROOF_BEHIND
}

/// Returns true if an object is built like vehicles and animals: longer than wide, with sides that
/// are mirror images, and ends that are not.
pub(super) fn is_long_body(points: &[Point], bounds: Bounds3, horizon: &Horizon) -> bool {
    let size = bounds.max - bounds.min;
    let (along, across) = if size.x > size.z { (0, 2) } else { (2, 0) };
    let (length, width) = (size[along], size[across]);
    let is_shaped = width > 0.0
        && LENGTH.contains(&(length / width))
        && VEHICLE.contains(&(size.y / width))
        && size.y <= LOW * length;
    if !is_shaped || points.is_empty() {
        return false;
    }
    let [sides, ends] = [across, along].map(|axis| likeness(points, bounds, horizon, axis));
    sides >= ALIKE && ends <= sides - LESS_ALIKE
}
