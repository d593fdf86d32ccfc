use super::*;
use crate::math::hash::mix;

/// Uniform random numbers from a counter.
struct Numbers(u64);

impl Numbers {
    fn uniform(&mut self) -> f64 {
        self.0 += 1;
        (mix(mix(self.0)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A normally distributed number (Box and Muller 1958).
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

const WINDOW: Rect = Rect {
    min: UVec2::new(10, 7),
    max: UVec2::new(106, 87),
};

type Picture = (RgbImage, Noise);

/// Picture whose pixels are means of `n` samples, with the variances of these means. `sample` draws
/// a sample of a pixel.
fn picture(n: u32, mut sample: impl FnMut(UVec2) -> [f64; 3]) -> Picture {
    let (mut pixels, mut variance) = (Vec::new(), Vec::new());
    for at in WINDOW.pixels() {
        let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
        for _ in 0..n {
            let value = sample(at);
            for c in 0..3 {
                sum[c] += value[c];
                squares[c] += value[c] * value[c];
            }
        }
        let n = n as f64;
        pixels.push(sum.map(|s| (s / n) as f32));
        variance.push([0, 1, 2].map(|c| ((squares[c] - sum[c] * sum[c] / n).max(0.0) / (n * (n - 1.0))) as f32));
    }
    let size = WINDOW.size();
    let image = RgbImage {
        width: size.x as usize,
        height: size.y as usize,
        pixels,
    };
    let samples = vec![n as f32; variance.len()];
    (
        image,
        Noise {
            variance,
            samples,
            common: CommonErrors::None,
        },
    )
}

/// Test picture that gets brighter to the right. Each sample has noise with a standard deviation of
/// 30 %, equal in all channels.
fn grainy(numbers: &mut Numbers, n: u32) -> Picture {
    picture(n, |at| {
        let x = 1.0 + 0.3 * numbers.normal();
        [0.2, 0.5, 0.1].map(|v| v * (1.0 + at.x as f64 / 50.0) * x)
    })
}

/// Test picture with rare bright samples: one of 50 samples adds 50 times the mean of the added
/// light.
fn spotted(numbers: &mut Numbers, n: u32) -> Picture {
    picture(n, |_| {
        let light = if numbers.uniform() < 0.02 { 50.0 } else { 0.0 };
        [0.1 + 0.9 * light; 3]
    })
}

fn judge((a, b): (&Picture, &Picture), level: f64) -> Significance {
    Significance::new(WINDOW, (&a.0, &a.1), (&b.0, &b.1), level).unwrap()
}

fn alarms(pairs: u32, level: f64, mut pair: impl FnMut() -> (Picture, Picture)) -> u32 {
    let mut alarm = || {
        let (a, b) = pair();
        u32::from(judge((&a, &b), level).differs())
    };
    (0..pairs).map(|_| alarm()).sum()
}

#[test]
fn tails_of_the_tables() {
    for (p, expected) in [
        (normal_tails(-1.959_964), 0.05),
        (normal_tails(6.109_41), 1e-9),
        (student_tails(12.706_2, 1.0), 0.05),
        (student_tails(-2.228_14, 10.0), 0.05),
        (student_tails(4.586_9, 10.0), 1e-3),
        (of_family(0.01, 100), 0.633_968),
        (of_family(1e-12, 1000), 1e-9),
    ] {
        assert!((p / expected - 1.0).abs() < 1e-4, "{p}, expected {expected}");
    }
    assert_eq!((student_tails(f64::INFINITY, 3.0), student_tails(0.0, 3.0)), (0.0, 1.0));
}

/// At a level of 0.2, 12 false alarms in 60 are expected; more than 25 have a probability of 1e-4.
/// Skewed noise and different numbers of samples must not increase the number of alarms.
#[test]
fn rate_of_false_alarms_is_the_level() {
    let mut numbers = Numbers(1);
    let grainy_alarms = alarms(60, 0.2, || (grainy(&mut numbers, 8), grainy(&mut numbers, 8)));
    let uneven = alarms(60, 0.2, || (grainy(&mut numbers, 24), grainy(&mut numbers, 4)));
    let spots = alarms(60, 0.2, || (spotted(&mut numbers, 16), spotted(&mut numbers, 16)));
    let uneven_spots = alarms(20, 0.2, || (spotted(&mut numbers, 128), spotted(&mut numbers, 16)));
    println!("false alarms: {grainy_alarms}, {uneven}, {spots} of 60, {uneven_spots} of 20");
    // The scale of the whole picture has a quarter of the level.
    assert!((1..=25).contains(&grainy_alarms), "{grainy_alarms}");
    assert!(
        uneven <= 25 && spots <= 25 && uneven_spots <= 12,
        "{uneven}, {spots}, {uneven_spots}"
    );
}

/// Sixteen pixels of a tile have the same error. The errors of tile means are then four times as
/// large as the variances of pixels suggest.
#[test]
fn common_errors_of_a_tile_cause_no_false_alarms() {
    let mut numbers = Numbers(2);
    let mut shared = || {
        let errors: Vec<f64> = (0..16 * 49).map(|_| numbers.normal()).collect();
        let mut picture = picture(2, |_| [1.0; 3]);
        for (i, at) in WINDOW.pixels().enumerate() {
            let tile = at / TILE_SIZE;
            let group = (tile.y * 7 + tile.x) * 16 + (at.x * 5 + at.y) % 16;
            picture.0.pixels[i] = [1.0 + 0.1 * errors[group as usize] as f32; 3];
        }
        picture.1.variance.fill([0.01; 3]);
        picture.1.samples.fill(1e6);
        picture.1.common = CommonErrors::Tile;
        picture
    };
    let pairs: Vec<(Picture, Picture)> = (0..40).map(|_| (shared(), shared())).collect();
    let mut next = pairs.iter().cloned();
    assert!(alarms(40, 0.05, || next.next().unwrap()) <= 9);
    // If the pictures do not tell that pixels have common errors, the test reports a difference for
    // all pairs.
    let mut next = pairs.into_iter().map(|(mut a, mut b)| {
        (a.1.common, b.1.common) = (CommonErrors::None, CommonErrors::None);
        (a, b)
    });
    assert_eq!(alarms(40, 0.05, || next.next().unwrap()), 40);
}

/// Errors are correlated within disks of 33 pixels across, or over the whole picture. The variances
/// include these errors in the first three cases, and do not include them in the others. Tests that
/// assume independent tiles report false differences. The other tests report no difference between
/// equal pictures, but detect that a whole picture is brighter.
#[test]
fn common_errors_of_tiles_cause_no_false_alarms() {
    let mut numbers = Numbers(5);
    let mut blotched = || {
        let disks: Vec<(f64, f64, f64)> = (0..60)
            .map(|_| {
                (
                    116.0 * numbers.uniform(),
                    94.0 * numbers.uniform(),
                    0.03 * numbers.normal(),
                )
            })
            .collect();
        let all = 0.01 * numbers.normal();
        let mut picture = picture(4, |_| [1.0 + 0.02 * numbers.normal(); 3]);
        for (at, pixel) in WINDOW.pixels().zip(&mut picture.0.pixels) {
            let is_near = |(x, y, _): &&(f64, f64, f64)| (x - at.x as f64).hypot(y - at.y as f64) < 16.5;
            let error: f64 = disks.iter().filter(is_near).map(|disk| disk.2).sum();
            *pixel = pixel.map(|v| v * (1.0 + all + error) as f32);
        }
        picture
    };
    let pairs: Vec<(Picture, Picture)> = (0..30).map(|_| (blotched(), blotched())).collect();
    let with = |common, variance: f32, brightness: f32| {
        let mut next = pairs.iter().cloned().map(|(mut a, mut b)| {
            for picture in [&mut a, &mut b] {
                picture.1.common = common;
                picture.1.variance.iter_mut().for_each(|v| *v = v.map(|v| v + variance));
            }
            b.0.pixels.iter_mut().for_each(|p| *p = p.map(|v| v * brightness));
            (a, b)
        });
        alarms(30, 0.05, || next.next().unwrap())
    };
    // Nine disks overlap each pixel.
    let known = 9.0 * 0.03 * 0.03 + 0.01 * 0.01;
    let found = [
        with(CommonErrors::None, known, 1.0),
        with(CommonErrors::Sample, known, 1.0),
        with(CommonErrors::Sample, known, 1.5),
        with(CommonErrors::Tile, 0.0, 1.0),
        with(CommonErrors::Picture, 0.0, 1.0),
        with(CommonErrors::Picture, 0.0, 1.5),
    ];
    println!("differences found: {found:?} of 30");
    assert!(found[0] >= 20 && found[3] >= 20, "{found:?}");
    // At this level, 1.5 false alarms in 30 are expected; more than 5 have a probability of 0.3 %.
    assert!(found[1] <= 5 && found[4] <= 5, "{found:?}");
    assert!(found[2] >= 28 && found[5] >= 28, "{found:?}");
    let (mut a, b) = pairs[0].clone();
    a.1.common = CommonErrors::Picture;
    let scales: Vec<Scale> = judge((&a, &b), 0.01).extremes.iter().map(|e| e.scale).collect();
    assert_eq!(scales, [Scale::Whole]);
}

#[test]
fn change_is_found_in_its_window() {
    let mut numbers = Numbers(3);
    let (a, b) = (grainy(&mut numbers, 16), grainy(&mut numbers, 16));
    assert!(!judge((&a, &b), 0.01).differs());
    let changed = |f: &dyn Fn(UVec2, [f32; 3]) -> [f32; 3]| {
        let mut image = b.clone();
        let pixels = WINDOW.pixels().zip(&mut image.0.pixels);
        pixels.for_each(|(at, pixel)| *pixel = f(at, *pixel));
        judge((&a, &image), 0.01)
    };
    // Change the whole picture by 1 %, with an error of 7.5 % in each pixel
    let test = changed(&|_, p| p.map(|v| 1.01 * v));
    let worst = test.worst().unwrap();
    assert!(test.differs() && worst.scale == Scale::Whole, "{test:?}");
    assert!(
        (worst.difference - 0.01).abs() < 0.004 && worst.window == WINDOW,
        "{worst:?}"
    );

    // Change the green of one pixel
    let place = UVec2::new(77, 33);
    let test = changed(&|at, [r, g, b]| [r, if at == place { 3.0 * g } else { g }, b]);
    let worst = test.worst().unwrap();
    assert!(
        test.differs() && (worst.scale, worst.channel) == (Scale::Pixel, 1),
        "{test:?}"
    );
    assert_eq!(worst.window.min, place);
    assert!(worst.score > 9.0 && worst.p < 0.0025, "{worst:?}");

    // Change a tile by 5 %, and its neighbour by −5 %
    let test = changed(&|at, p| match (at / TILE_SIZE).to_array() {
        [3, 2] => p.map(|v| 1.05 * v),
        [4, 2] => p.map(|v| 0.95 * v),
        _ => p,
    });
    let worst = test.worst().unwrap();
    assert!(test.differs() && worst.scale == Scale::Tile, "{test:?}");
    assert!(
        worst.window.min.y == 32 && [48, 64].contains(&worst.window.min.x),
        "{worst:?}"
    );
}

#[test]
fn unknown_variance_gives_no_result() {
    let mut numbers = Numbers(4);
    let (a, mut b) = (grainy(&mut numbers, 4), grainy(&mut numbers, 4));
    b.0.pixels.iter_mut().for_each(|p| *p = [7.0; 3]);
    b.1.variance.fill([f32::INFINITY; 3]);
    assert_eq!(Significance::new(WINDOW, (&a.0, &a.1), (&b.0, &b.1), 0.01), None);
    b.1.variance.truncate(5);
    assert_eq!(Significance::new(WINDOW, (&a.0, &a.1), (&b.0, &b.1), 0.01), None);
    // Without noise, a difference of the size of a rounding error is not significant, and every
    // larger difference is.
    let same = (
        a.0.clone(),
        Noise {
            variance: vec![[0.0; 3]; a.0.pixels.len()],
            ..a.1.clone()
        },
    );
    let mut rounded = same.clone();
    rounded
        .0
        .pixels
        .iter_mut()
        .for_each(|p| *p = p.map(|v| v * (1.0 + f32::EPSILON)));
    assert!(!judge((&same, &rounded), 0.01).differs());
    rounded.0.pixels[100][2] *= 1.001;
    assert!(judge((&same, &rounded), 0.01).differs());
}
