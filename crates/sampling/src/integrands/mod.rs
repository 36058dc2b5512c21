//! Integrands over the unit cube whose integrals are known: what estimators are compared on.
//!
//! An integrand may bring [`Technique`]s, that is densities to draw from, and a [`Control`], a similar function whose integral is
//! known. Whatever is to be integrated (a shadow boundary, a lamp seen from a point, a choice among lamps) is written as a function on
//! the unit cube, its natural measures becoming Jacobians: so every estimator can be applied to every integrand.

mod analytic;
pub mod direct_light;
mod marginal;

pub use analytic::analytic;
pub use marginal::{Marginal, Product};

/// All of them: the [`analytic()`] ones, then those of [`direct_light`].
pub fn all() -> Vec<Box<dyn Integrand>> {
    let mut all = analytic();
    all.extend(direct_light::single());
    all.push(Box::new(direct_light::ManyLights::new()));
    all
}

/// A function on the unit cube, and what is known about it.
pub trait Integrand: Send + Sync {
    /// The name on the command line.
    fn name(&self) -> &str;

    /// What it is, in a few words.
    fn description(&self) -> &str;

    /// Dimensions of the cube, at least 1.
    fn dimensions(&self) -> usize;

    /// The value at `x` in the cube; never negative.
    fn value(&self, x: &[f64]) -> f64;

    /// The integral over the cube.
    fn integral(&self) -> f64;

    /// A bound that no value exceeds, if one is known.
    fn maximum(&self) -> Option<f64> {
        None
    }

    /// Densities to draw points from; the first one is uniform.
    fn techniques(&self) -> &[Box<dyn Technique>];

    /// A similar function whose integral is known.
    fn control(&self) -> Option<&Control> {
        None
    }
}

/// A density over the cube that can be drawn from.
pub trait Technique: Send + Sync {
    /// Its name in tables.
    fn name(&self) -> &str;

    /// Turns a point `u`, uniform in the cube, into a draw `x`. Returns whether there is one: a technique may miss, as a direction
    /// misses a lamp, which counts as a draw where the integrand is 0.
    fn sample(&self, u: &[f64], x: &mut [f64]) -> bool;

    /// The density of the draws at `x`.
    fn pdf(&self, x: &[f64]) -> f64;

    /// Whether no draw misses, so that the density integrates to 1.
    fn always_hits(&self) -> bool {
        true
    }
}

/// A function on the unit cube.
pub type Function = Box<dyn Fn(&[f64]) -> f64 + Send + Sync>;

/// A function like the integrand whose integral over the cube is known.
pub struct Control {
    /// The function.
    pub value: Function,
    /// Its integral.
    pub integral: f64,
}
