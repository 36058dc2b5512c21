//! Many lights: one coordinate chooses.

use super::reflection::Reflection;
use super::shape::Shape;
use super::single::Sight;
use crate::discrete::{Discrete, TOTAL};
use crate::integrands::{Integrand, Product, Technique};
use crate::random::Stream;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;

/// Number of lights.
const LIGHTS: usize = 32;

/// Lights beyond this x are behind a wall.
const WALL_X: f64 = 1.0;

/// Half the side of the cell for which the fixed subdivision knows the lights, around the receiver.
const CELL_HALF: f64 = 1.0;

/// Probability that all lights share, whatever the strategy thinks of them: what is missed must stay possible.
const FLOOR: f64 = 0.02;

/// Samples of each light from which the dynamic strategy has learned.
const LESSONS: u32 = 64;

/// Panels of the quadrature of one light.
const PANELS: u32 = 16;

/// The light of 32 lights of very different sizes and powers, of which a wall hides some. The first coordinate chooses the light, the
/// others the point on it; each strategy of choice is one more density:
///
/// - `equal`: `1 / n`;
/// - `power`: in proportion to the emitted power;
/// - `subdivision`: in proportion to the light that arrives, unshadowed, at the corners of the cell of a fixed subdivision of space which the receiver
///   lies in (P. Shirley, C. Wang and K. Zimmerman, "Monte Carlo techniques for direct lighting calculations", 1996);
/// - `dynamic`: in proportion to the root of the second moment of what earlier samples found, visibility included (I. Wald, C. Benthin and P. Slusallek,
///   "Interactive global illumination in complex and highly occluded environments", 2003).
///
/// All draw the point by solid angle.
pub struct ManyLights {
    lights: Arc<[Lamp]>,
    integral: f64,
    techniques: Vec<Box<dyn Technique>>,
}

/// A light, and whether the receiver sees it.
#[derive(Clone, Copy)]
struct Lamp {
    sight: Sight,
    center: DVec3,
    visible: bool,
}

impl Lamp {
    /// A light somewhere in the hall; `None` for one that is seen from the edge.
    fn random(stream: &mut Stream) -> Option<Self> {
        let mut signed = || 2.0 * stream.number() - 1.0;
        let center = DVec3::new(4.0 * signed(), 4.0 * signed(), 1.8 + signed());
        let normal = (center.normalize() + 0.6 * DVec3::new(signed(), signed(), signed())).normalize();
        let size = [0.1 + 0.3 * signed().abs(), 0.1 + 0.3 * signed().abs()];
        Some(Self {
            sight: Sight {
                shape: Shape::rectangle(center, normal, size)?,
                reflection: Reflection::glossy(),
                radiance: (2.0 * signed()).exp(),
            },
            center,
            visible: center.x < WALL_X,
        })
    }

    fn value(&self, x: [f64; 2]) -> f64 {
        if self.visible { self.sight.value(x) } else { 0.0 }
    }

    fn power(&self) -> f64 {
        // To both sides.
        2.0 * PI * self.sight.shape.area() * self.sight.radiance
    }

    /// Light that could arrive anywhere in the cell: the mean over its corners of power over squared distance.
    fn in_cell(&self) -> f64 {
        let corners = (0..8).map(|k| {
            let side = |bit: i32| if k >> bit & 1 == 1 { CELL_HALF } else { -CELL_HALF };
            DVec3::new(side(0), side(1), side(2))
        });
        corners
            .map(|corner| self.power() / self.center.distance_squared(corner).max(0.1))
            .sum::<f64>()
            / 8.0
    }

    /// Root mean square of samples of the light.
    fn learned(&self, stream: &mut Stream) -> f64 {
        let mut square = |_| {
            let x = self.sight.shape.sample_solid_angle([stream.number(), stream.number()]);
            let pdf = self.sight.solid_angle_pdf(x);
            if pdf > 0.0 { (self.value(x) / pdf).powi(2) } else { 0.0 }
        };
        ((0..LESSONS).map(&mut square).sum::<f64>() / f64::from(LESSONS)).sqrt()
    }
}

/// Chooses a light, then a direction towards it.
struct Choice {
    name: &'static str,
    lights: Arc<[Lamp]>,
    probabilities: Discrete,
}

impl Choice {
    fn new(name: &'static str, lights: &Arc<[Lamp]>, weights: &[f64]) -> Self {
        Self {
            name,
            lights: Arc::clone(lights),
            probabilities: Discrete::new(weights, FLOOR).expect("there are lights"),
        }
    }
}

impl Technique for Choice {
    fn name(&self) -> &str {
        self.name
    }

    fn sample(&self, u: &[f64], x: &mut [f64]) -> bool {
        let light = self.probabilities.sample((u[0] * TOTAL as f64) as u32).index as usize;
        // The middle of the light's share of the first coordinate: nothing depends on where in it.
        x[0] = (light as f64 + 0.5) / self.lights.len() as f64;
        x[1..].copy_from_slice(&self.lights[light].sight.shape.sample_solid_angle([u[1], u[2]]));
        true
    }

    fn pdf(&self, x: &[f64]) -> f64 {
        let light = index(x[0], self.lights.len());
        let pmf = self.probabilities.mass(light as u32) as f64 / TOTAL as f64;
        pmf * self.lights.len() as f64 * self.lights[light].sight.solid_angle_pdf([x[1], x[2]])
    }
}

/// The light that the first coordinate stands for.
fn index(x: f64, count: usize) -> usize {
    ((x * count as f64) as usize).min(count - 1)
}

impl ManyLights {
    /// The hall; always the same.
    pub fn new() -> Self {
        let mut stream = Stream::new(32, 0);
        let mut lights = Vec::with_capacity(LIGHTS);
        while lights.len() < LIGHTS {
            lights.extend(Lamp::random(&mut stream));
        }
        let lights: Arc<[Lamp]> = lights.into();
        let weights = |weight: &mut dyn FnMut(&Lamp) -> f64| lights.iter().map(weight).collect::<Vec<_>>();
        let choice = |name, weights: &[f64]| Box::new(Choice::new(name, &lights, weights)) as Box<dyn Technique>;
        let techniques = vec![
            Box::new(Product::uniform(3)) as Box<dyn Technique>,
            choice("equal", &weights(&mut |_| 1.0)),
            choice("power", &weights(&mut Lamp::power)),
            choice("subdivision", &weights(&mut Lamp::in_cell)),
            choice("dynamic", &weights(&mut |lamp| lamp.learned(&mut stream))),
        ];
        let seen = lights.iter().filter(|lamp| lamp.visible);
        Self {
            integral: seen.map(|lamp| lamp.sight.integral(PANELS, |_| 1.0)).sum(),
            techniques,
            lights,
        }
    }
}

impl Default for ManyLights {
    fn default() -> Self {
        Self::new()
    }
}

impl Integrand for ManyLights {
    fn name(&self) -> &str {
        "many-lights"
    }

    fn description(&self) -> &str {
        "32 square lights, some behind a wall; the first coordinate chooses"
    }

    fn dimensions(&self) -> usize {
        3
    }

    fn value(&self, x: &[f64]) -> f64 {
        let count = self.lights.len();
        count as f64 * self.lights[index(x[0], count)].value([x[1], x[2]])
    }

    fn integral(&self) -> f64 {
        self.integral
    }

    fn techniques(&self) -> &[Box<dyn Technique>] {
        &self.techniques
    }
}
