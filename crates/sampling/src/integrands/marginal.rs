//! Densities over the cube with independent coordinates.

use super::Technique;
use std::f64::consts::PI;

/// The density of one coordinate over `[0, 1)`, drawn from by inversion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Marginal {
    /// 1.
    Uniform,
    /// `(1 + x) / 1.5`.
    Linear,
    /// `6 x (1 - x)`.
    Parabola,
    /// `1 / (1 + ((x - center) / width)^2)`, normalised.
    Lorentz {
        /// Where the density is largest.
        center: f64,
        /// Half the width at half the height.
        width: f64,
    },
}

impl Marginal {
    /// The value below which a share `u` of the density lies.
    pub fn sample(self, u: f64) -> f64 {
        match self {
            Self::Uniform => u,
            Self::Linear => (1.0 + 3.0 * u).sqrt() - 1.0,
            // The root of 3 x^2 - 2 x^3 = u in the unit interval.
            Self::Parabola => 0.5 - ((1.0 - 2.0 * u).asin() / 3.0).sin(),
            Self::Lorentz { center, width } => {
                let [low, high] = Self::angles(center, width);
                (center + width * (low + u * (high - low)).tan()).clamp(0.0, 1.0)
            }
        }
    }

    /// The density at `x`.
    pub fn pdf(self, x: f64) -> f64 {
        match self {
            Self::Uniform => 1.0,
            Self::Linear => (1.0 + x) / 1.5,
            Self::Parabola => 6.0 * x * (1.0 - x),
            Self::Lorentz { center, width } => {
                let [low, high] = Self::angles(center, width);
                lorentz(x, center, width) * PI / (high - low)
            }
        }
    }

    fn angles(center: f64, width: f64) -> [f64; 2] {
        [0.0, 1.0].map(|end| ((end - center) / width).atan())
    }
}

/// The density of Lorentz (Cauchy) over the whole line.
pub(super) fn lorentz(x: f64, center: f64, width: f64) -> f64 {
    width / (PI * ((x - center).powi(2) + width * width))
}

/// Independent coordinates, as many as there are marginals.
#[derive(Clone, Debug)]
pub struct Product {
    name: &'static str,
    marginals: Vec<Marginal>,
}

impl Product {
    /// The product of `marginals`.
    pub fn new(name: &'static str, marginals: Vec<Marginal>) -> Self {
        Self { name, marginals }
    }

    /// The uniform density in `dimensions` dimensions.
    pub fn uniform(dimensions: usize) -> Self {
        Self::new("uniform", vec![Marginal::Uniform; dimensions])
    }
}

impl Technique for Product {
    fn name(&self) -> &str {
        self.name
    }

    fn sample(&self, u: &[f64], x: &mut [f64]) -> bool {
        for ((x, u), marginal) in x.iter_mut().zip(u).zip(&self.marginals) {
            *x = marginal.sample(*u);
        }
        true
    }

    fn pdf(&self, x: &[f64]) -> f64 {
        self.marginals
            .iter()
            .zip(x)
            .map(|(marginal, x)| marginal.pdf(*x))
            .product()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn densities_are_the_slopes_of_what_is_drawn() {
        let lorentz = Marginal::Lorentz {
            center: 0.3,
            width: 0.02,
        };
        for marginal in [Marginal::Uniform, Marginal::Linear, Marginal::Parabola, lorentz] {
            assert!(marginal.sample(0.0).abs() < 1e-7 && (marginal.sample(1.0) - 1.0).abs() < 1e-7);
            for i in 1..50 {
                let u = f64::from(i) / 50.0;
                let slope = (marginal.sample(u + 1e-6) - marginal.sample(u - 1e-6)) / 2e-6;
                assert!(
                    (slope * marginal.pdf(marginal.sample(u)) - 1.0).abs() < 1e-5,
                    "{marginal:?} at {u}"
                );
            }
        }
    }
}
