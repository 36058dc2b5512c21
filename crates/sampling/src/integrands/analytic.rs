//! Integrands that are formulas.

use super::marginal::lorentz;
use super::{Control, Integrand, Marginal, Product, Technique};
use std::f64::consts::{E, FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4, PI};

/// Where the spikes are, away from any fraction that a point set prefers.
const SPIKE_AT: f64 = 0.371_6;

/// Half the width of the spikes at half their height.
const SPIKE_WIDTH: f64 = 0.01;

/// Dimensions of the products.
const MANY: usize = 6;

/// A formula on the unit cube.
struct Analytic {
    name: &'static str,
    description: &'static str,
    dimensions: usize,
    value: fn(&[f64]) -> f64,
    integral: f64,
    maximum: f64,
    techniques: Vec<Box<dyn Technique>>,
    control: Option<Control>,
}

impl Analytic {
    /// With the uniform technique only.
    fn new(name: &'static str, dimensions: usize, value: fn(&[f64]) -> f64, integral: f64, maximum: f64) -> Self {
        Self {
            name,
            description: "",
            dimensions,
            value,
            integral,
            maximum,
            techniques: vec![Box::new(Product::uniform(dimensions))],
            control: None,
        }
    }

    fn described(self, description: &'static str) -> Self {
        Self { description, ..self }
    }

    fn drawn_from(mut self, name: &'static str, marginals: Vec<Marginal>) -> Self {
        self.techniques.push(Box::new(Product::new(name, marginals)));
        self
    }

    fn controlled_by(self, value: fn(&[f64]) -> f64, integral: f64) -> Self {
        Self {
            control: Some(Control {
                value: Box::new(value),
                integral,
            }),
            ..self
        }
    }
}

impl Integrand for Analytic {
    fn name(&self) -> &str {
        self.name
    }

    fn description(&self) -> &str {
        self.description
    }

    fn dimensions(&self) -> usize {
        self.dimensions
    }

    fn value(&self, x: &[f64]) -> f64 {
        (self.value)(x)
    }

    fn integral(&self) -> f64 {
        self.integral
    }

    fn maximum(&self) -> Option<f64> {
        Some(self.maximum)
    }

    fn techniques(&self) -> &[Box<dyn Technique>] {
        &self.techniques
    }

    fn control(&self) -> Option<&Control> {
        self.control.as_ref()
    }
}

/// The integrands that are formulas: smooth ones, edges, spikes, and products in many dimensions.
pub fn analytic() -> Vec<Box<dyn Integrand>> {
    let spike = |x: f64| lorentz(x, SPIKE_AT, SPIKE_WIDTH);
    let spike_integral = (((1.0 - SPIKE_AT) / SPIKE_WIDTH).atan() + (SPIKE_AT / SPIKE_WIDTH).atan()) / PI;
    // A density that knows the place of the spike, and takes it for three times as wide.
    let near_spike = Marginal::Lorentz {
        center: SPIKE_AT,
        width: 3.0 * SPIKE_WIDTH,
    };
    let half_sine = |x: &[f64]| x.iter().map(|x| FRAC_PI_2 * (PI * x).sin()).product();
    let list = [
        Analytic::new("smooth-1d", 1, |x| x[0].exp(), E - 1.0, E)
            .described("e^x")
            .drawn_from("linear", vec![Marginal::Linear])
            .controlled_by(|x| 1.0 + x[0], 1.5),
        Analytic::new(
            "step-1d",
            1,
            |x| f64::from(u8::from(x[0] < FRAC_1_SQRT_2)),
            FRAC_1_SQRT_2,
            1.0,
        )
        .described("1 up to x = 0.707, then 0"),
        Analytic::new(
            "spike-1d",
            1,
            |x| lorentz(x[0], SPIKE_AT, SPIKE_WIDTH),
            spike_integral,
            spike(SPIKE_AT),
        )
        .described("a Lorentz curve of half-width 0.01")
        .drawn_from("lorentz", vec![near_spike]),
        Analytic::new("smooth-2d", 2, |x| (x[0] + x[1]).exp(), (E - 1.0).powi(2), E * E)
            .described("e^(x+y)")
            .drawn_from("linear", vec![Marginal::Linear; 2])
            .controlled_by(|x| (1.0 + x[0]) * (1.0 + x[1]), 2.25),
        Analytic::new("edge-2d", 2, lit, 0.825, 2.0)
            .described("a slanted shadow boundary across 1 + x")
            .drawn_from("linear", vec![Marginal::Linear, Marginal::Uniform])
            .controlled_by(|x| 1.0 + x[0], 1.5),
        Analytic::new(
            "disc-2d",
            2,
            |x| f64::from(u8::from(x[0].hypot(x[1]) < 1.0)),
            FRAC_PI_4,
            1.0,
        )
        .described("1 in a quarter of a disc"),
        Analytic::new("spike-2d", 2, spike_2d, spike_integral.powi(2), spike(SPIKE_AT).powi(2))
            .described("a product of two spikes")
            .drawn_from("lorentz", vec![near_spike; 2]),
        Analytic::new("product-6d", MANY, half_sine, 1.0, FRAC_PI_2.powi(MANY as i32))
            .described("a product of six half sine waves")
            .drawn_from("parabolas", vec![Marginal::Parabola; MANY])
            .controlled_by(|x| x.iter().map(|x| 6.0 * x * (1.0 - x)).product(), 1.0),
        Analytic::new(
            "corner-6d",
            MANY,
            corner,
            corner_integral(),
            (0.6_f64 + 0.7 + 4.0).exp(),
        )
        .described("e^(sum of six x) where x < 0.6 and y < 0.7, 0 elsewhere: Genz's discontinuous family")
        .drawn_from("linear", vec![Marginal::Linear; MANY]),
    ];
    list.into_iter()
        .map(|integrand| Box::new(integrand) as Box<dyn Integrand>)
        .collect()
}

fn lit(x: &[f64]) -> f64 {
    if x[1] < 0.3 + 0.45 * x[0] { 1.0 + x[0] } else { 0.0 }
}

fn spike_2d(x: &[f64]) -> f64 {
    x.iter().map(|&x| lorentz(x, SPIKE_AT, SPIKE_WIDTH)).product()
}

fn corner(x: &[f64]) -> f64 {
    if x[0] < 0.6 && x[1] < 0.7 {
        x.iter().sum::<f64>().exp()
    } else {
        0.0
    }
}

fn corner_integral() -> f64 {
    0.6_f64.exp_m1() * 0.7_f64.exp_m1() * 1_f64.exp_m1().powi(MANY as i32 - 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::PointSet;

    /// Against a mean over many well-spread points; no value exceeds the bound.
    #[test]
    fn integrals_and_bounds_hold() {
        for integrand in analytic() {
            let points = PointSet::OwenSobol
                .points(1 << 16, integrand.dimensions(), Some(1))
                .unwrap();
            let values: Vec<f64> = points.iter().map(|x| integrand.value(x)).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            // A point set finds the tip of a spike by chance only.
            let tolerance = if integrand.name().starts_with("spike") {
                1e-2
            } else {
                2e-3
            } * integrand.integral();
            assert!(
                (mean - integrand.integral()).abs() < tolerance,
                "{}: {mean}",
                integrand.name()
            );
            let bound = integrand.maximum().unwrap();
            assert!(
                values.iter().all(|&v| (0.0..=bound).contains(&v)),
                "{}",
                integrand.name()
            );
            if let Some(control) = integrand.control() {
                let mean = points.iter().map(|x| (control.value)(x)).sum::<f64>() / points.len() as f64;
                assert!((mean / control.integral - 1.0).abs() < 2e-3, "{}", integrand.name());
            }
        }
    }
}
