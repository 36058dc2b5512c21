//! Point sets in the unit cube: random, stratified and quasi-random.
//!
//! The mean of an integrand over the points of a set estimates its integral. For independent points the error falls as
//! `N^(-1/2)`; points that are spread more evenly do better, the more so the smoother the integrand:
//!
//! | set | error, smooth | error, across an edge in 2-D | source |
//! | --- | --- | --- | --- |
//! | [`PointSet::Random`] | `N^(-1/2)` | `N^(-1/2)` | |
//! | [`PointSet::Stratified`] | `N^(-1/2-1/d)` | `N^(-3/4)` | Mitchell, "Consequences of stratified sampling in graphics" (1996) |
//! | [`PointSet::Halton`], [`PointSet::Hammersley`] | `N^(-1) log^d N` | about `N^(-3/4)` | Halton (1960), Hammersley (1960) |
//! | [`PointSet::OwenSobol`] | `N^(-3/2)` | about `N^(-3/4)` | Sobol' (1967), Owen (1997) |
//! | [`PointSet::Lattice`] | `N^(-1)`, periodic `N^(-2)` | about `N^(-3/4)` | Korobov (1959), Cools, Kuo and Nuyens (2006) |
//! | [`PointSet::BlueNoise`] | `N^(-1/2)` to `N^(-1)` | about `N^(-3/4)` | Ulichney (1993) |
//!
//! 256 points of each, and the errors on a smooth integrand and across an edge (`manylight estimate` makes them anew):
//!
//! <div>
#![doc = include_str!("../../../../docs/monte-carlo/points.svg")]
//! </div>
//!
//! <div>
#![doc = include_str!("../../../../docs/monte-carlo/smooth-2d-points-evaluations.svg")]
//! </div>
//!
//! <div>
#![doc = include_str!("../../../../docs/monte-carlo/edge-2d-points-evaluations.svg")]
//! </div>
//!
//! ```
//! use sampling::points::PointSet;
//! let mean = |set: PointSet| {
//!     let points = set.points(1024, 2, Some(1)).expect("exists in two dimensions");
//!     points.iter().map(|x| x[0] * x[1]).sum::<f64>() / points.len() as f64
//! };
//! assert!((mean(PointSet::Random) - 0.25).abs() < 0.03);
//! assert!((mean(PointSet::OwenSobol) - 0.25).abs() < 0.000_3);
//! ```

pub(crate) mod blue_noise;
mod radical_inverse;

pub use radical_inverse::{PRIMES, folded_radical_inverse, radical_inverse, scrambled_radical_inverse};

use crate::random::{Random, Stream, unit_f64};
use crate::sobol::{DIMENSIONS, owen_scramble, sobol};

/// Generating vector of the lattice sequence: R. Cools, F. Y. Kuo and D. Nuyens, "Constructing embedded lattice rules for
/// multivariate integration", SIAM J. Sci. Comput. 28 (2006); base 2, up to 2^20 points, order-2 weights.
const LATTICE: [u32; 10] = [
    1, 182_667, 469_891, 498_753, 110_745, 446_247, 250_185, 118_627, 245_333, 283_199,
];

/// Names of the streams of random numbers, so that no two uses share one.
mod purpose {
    pub(super) const POINTS: u32 = 0;
    pub(super) const SHIFT: u32 = 1;
    pub(super) const SCRAMBLE: u32 = 2;
}

/// A way to place points in the unit cube.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PointSet {
    /// Independent points.
    Random,
    /// One random point in each cell of a grid of equal cells (jittered sampling).
    Stratified,
    /// Radical inverses in the prime bases: J. H. Halton, "On the efficiency of certain quasi-random sequences" (1960).
    Halton,
    /// The same, digits scrambled: [`scrambled_radical_inverse`].
    ScrambledHalton,
    /// `i / n`, then radical inverses: J. M. Hammersley, "Monte Carlo methods for solving multivariable problems" (1960).
    Hammersley,
    /// The same with [`folded_radical_inverse`]s (Hammersley-Zaremba).
    FoldedHammersley,
    /// The Sobol' sequence, see [`crate::sobol`].
    Sobol,
    /// The same under Owen's nested uniform scramble.
    OwenSobol,
    /// A rank-1 lattice whose points come in an order that makes every power of two of them a lattice.
    Lattice,
    /// Multiples of powers of the generalised golden ratio: M. Roberts, "The unreasonable effectiveness of quasirandom
    /// sequences" (2018).
    R2,
    /// Void and cluster, on a torus of 64 x 64 cells: 2-D, at most 4,096 points, each at random in its cell.
    BlueNoise,
}

impl PointSet {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Random,
        Self::Stratified,
        Self::Halton,
        Self::ScrambledHalton,
        Self::Hammersley,
        Self::FoldedHammersley,
        Self::Sobol,
        Self::OwenSobol,
        Self::Lattice,
        Self::R2,
        Self::BlueNoise,
    ];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Stratified => "stratified",
            Self::Halton => "halton",
            Self::ScrambledHalton => "halton-scrambled",
            Self::Hammersley => "hammersley",
            Self::FoldedHammersley => "hammersley-zaremba",
            Self::Sobol => "sobol",
            Self::OwenSobol => "sobol-owen",
            Self::Lattice => "lattice",
            Self::R2 => "r2",
            Self::BlueNoise => "blue-noise",
        }
    }

    /// The numbers of dimensions for which there are points.
    pub fn dimensions(self) -> std::ops::RangeInclusive<usize> {
        match self {
            Self::Random | Self::Stratified | Self::R2 => 1..=64,
            Self::Halton | Self::ScrambledHalton => 1..=PRIMES.len(),
            Self::Hammersley | Self::FoldedHammersley => 1..=PRIMES.len() + 1,
            Self::Sobol | Self::OwenSobol => 1..=DIMENSIONS as usize,
            Self::Lattice => 1..=LATTICE.len(),
            Self::BlueNoise => 2..=2,
        }
    }

    /// Most points that there are.
    pub const fn max_points(self) -> usize {
        match self {
            Self::BlueNoise => blue_noise::MAX_POINTS,
            Self::Lattice => 1 << 20,
            _ => u32::MAX as usize,
        }
    }

    /// `n` points in `[0, 1)^dimensions`; of [`PointSet::Stratified`] as many as the largest grid of at most `n` cells has.
    ///
    /// With a seed each point by itself is uniform, so that means over the set are unbiased: scrambled sets are scrambled anew, those
    /// without a randomness of their own are shifted on the torus (R. Cranley and T. N. L. Patterson, "Randomization of number
    /// theoretic methods for multiple integration", 1976). Without one the points are those of the literature.
    /// `None` outside of [`PointSet::dimensions`] and [`PointSet::max_points`].
    pub fn points(self, n: usize, dimensions: usize, seed: Option<u64>) -> Option<Points> {
        if !self.dimensions().contains(&dimensions) || n > self.max_points() {
            return None;
        }
        let by_formula = |random: &Random| {
            let mut coordinates = Vec::with_capacity(n * dimensions);
            for index in 0..n as u32 {
                coordinates.extend((0..dimensions).map(|d| self.coordinate(index, n, d, random)));
            }
            coordinates
        };
        let own = Random::new(seed.unwrap_or(0), purpose::SCRAMBLE, 0);
        let mut coordinates = match self {
            Self::Random => random(n, dimensions, seed.unwrap_or(0)),
            Self::Stratified => stratified(n, dimensions, seed.unwrap_or(0)),
            Self::BlueNoise => blue_noise::points(n, &own),
            Self::R2 => r2(n, dimensions),
            _ => by_formula(&own),
        };
        if let Some(seed) = seed
            && !self.is_random()
        {
            shift(&mut coordinates, dimensions, seed);
        }
        Some(Points {
            dimensions,
            coordinates,
        })
    }

    /// Coordinate `dimension` of point `index` of `n`, of the sets that have a formula for it.
    fn coordinate(self, index: u32, n: usize, dimension: usize, random: &Random) -> f64 {
        // Random numbers, not a plain hash of the dimension: the leading bits of a scramble depend on few bits of its seed.
        let scramble = || random.u32(dimension as u32);
        let hammersley = |inverse: fn(u32, u32) -> f64| match dimension {
            0 => f64::from(index) / n as f64,
            _ => inverse(PRIMES[dimension - 1], index),
        };
        match self {
            Self::Random | Self::Stratified | Self::BlueNoise | Self::R2 => {
                unreachable!("these are made as a whole")
            }
            Self::Halton => radical_inverse(PRIMES[dimension], index),
            Self::ScrambledHalton => scrambled_radical_inverse(PRIMES[dimension], index, scramble()),
            Self::Hammersley => hammersley(radical_inverse),
            Self::FoldedHammersley => hammersley(folded_radical_inverse),
            Self::Sobol => f64::from(sobol(index, dimension as u32)) / 4_294_967_296.0,
            Self::OwenSobol => unit_f64(owen_scramble(sobol(index, dimension as u32), scramble())),
            Self::Lattice => (radical_inverse(2, index) * f64::from(LATTICE[dimension])).fract(),
        }
    }

    /// Whether the set has a randomness of its own: without a seed it is that of seed 0.
    pub const fn is_random(self) -> bool {
        matches!(
            self,
            Self::Random | Self::Stratified | Self::ScrambledHalton | Self::OwenSobol | Self::BlueNoise
        )
    }
}

/// Points of a set, in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    dimensions: usize,
    coordinates: Vec<f64>,
}

impl Points {
    /// Points with these coordinates, those of a point one after the other; `None` if they do not divide evenly.
    pub fn new(dimensions: usize, coordinates: Vec<f64>) -> Option<Self> {
        (dimensions > 0 && coordinates.len().is_multiple_of(dimensions)).then_some(Self {
            dimensions,
            coordinates,
        })
    }

    /// The points.
    pub fn iter(&self) -> std::slice::ChunksExact<'_, f64> {
        self.coordinates.chunks_exact(self.dimensions)
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.coordinates.len() / self.dimensions
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.coordinates.is_empty()
    }

    /// Coordinates of a point.
    pub fn dimensions(&self) -> usize {
        self.dimensions
    }
}

fn random(n: usize, dimensions: usize, seed: u64) -> Vec<f64> {
    let mut stream = Stream::new(seed, purpose::POINTS);
    (0..n * dimensions).map(|_| stream.number()).collect()
}

fn stratified(n: usize, dimensions: usize, seed: u64) -> Vec<f64> {
    let mut stream = Stream::new(seed, purpose::POINTS);
    let side = grid_side(n, dimensions);
    let mut coordinates = Vec::new();
    for cell in 0..side.pow(dimensions as u32) {
        let mut rest = cell;
        for _ in 0..dimensions {
            coordinates.push(((rest % side) as f64 + stream.number()) / side as f64);
            rest /= side;
        }
    }
    coordinates
}

/// The largest `m` with `m^dimensions <= n`.
pub(crate) fn grid_side(n: usize, dimensions: usize) -> usize {
    let fits = |m: usize| m.checked_pow(dimensions as u32).is_some_and(|cells| cells <= n);
    let near = (n as f64).powf(1.0 / dimensions as f64).round() as usize;
    (near.saturating_sub(1)..=near + 1)
        .rev()
        .find(|&m| fits(m))
        .unwrap_or(0)
}

/// Moves all points by the same random vector, around the torus.
fn shift(coordinates: &mut [f64], dimensions: usize, seed: u64) {
    let mut stream = Stream::new(seed, purpose::SHIFT);
    let by: Vec<f64> = (0..dimensions).map(|_| stream.number()).collect();
    for point in coordinates.chunks_exact_mut(dimensions) {
        for (x, by) in point.iter_mut().zip(&by) {
            *x = (*x + by).fract();
        }
    }
}

/// `1/2 + i` times the vector of the first powers of the reciprocal golden ratio of so many dimensions.
fn r2(n: usize, dimensions: usize) -> Vec<f64> {
    let step = generalised_golden_ratio(dimensions).recip();
    let steps: Vec<f64> = (1..=dimensions as i32).map(|power| step.powi(power)).collect();
    let mut coordinates = Vec::with_capacity(n * dimensions);
    for index in 0..n {
        coordinates.extend(steps.iter().map(|step| (0.5 + index as f64 * step).fract()));
    }
    coordinates
}

/// The positive root of `x^(d+1) = x + 1`: the golden ratio for `d` = 1.
fn generalised_golden_ratio(dimensions: usize) -> f64 {
    // A contraction: 40 rounds are exact to the last digit in any dimension.
    (0..40).fold(2.0, |x: f64, _| (1.0 + x).powf(1.0 / (dimensions as f64 + 1.0)))
}

#[cfg(test)]
mod tests;
