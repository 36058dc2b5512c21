//! One light.

use super::quadrature::integrate;
use super::reflection::Reflection;
use super::shape::Shape;
use crate::integrands::{Control, Integrand, Product, Technique};
use glam::DVec3;

/// Panels of the quadrature in each coordinate. Doubling them changes no integral here by more than 1e-9 of it.
const PANELS: u32 = 16;

/// A light seen from the receiver.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    pub(super) shape: Shape,
    pub(super) reflection: Reflection,
    /// Emitted radiance.
    pub(super) radiance: f64,
}

impl Sight {
    /// The unshadowed integrand at a point of the unit square.
    pub(super) fn value(&self, x: [f64; 2]) -> f64 {
        let place = self.shape.place(x);
        self.radiance * self.reflection.value(place.wi) * place.solid_angle_per_square
    }

    /// Density on the square of drawing uniformly by solid angle.
    pub(super) fn solid_angle_pdf(&self, x: [f64; 2]) -> f64 {
        self.shape.place(x).solid_angle_per_square / self.shape.solid_angle()
    }

    /// The integral of the value over the part of the square where the first coordinate is below `limit` of the second.
    pub(super) fn integral(&self, panels: u32, limit: impl Fn(f64) -> f64) -> f64 {
        match self.shape {
            Shape::Rectangle { .. } => integrate(0.0, 1.0, panels, |t| {
                integrate(0.0, limit(t), panels, |s| self.value([s, t]))
            }),
            // Over the cone, since half of the square faces away; all around it, since spheres have no limits here.
            Shape::Sphere { center, radius } => {
                let along = |u, turn| self.reflection.value(Shape::cone_direction(center, radius, [u, turn]));
                let mean = integrate(0.0, 1.0, panels, |turn| integrate(0.0, 1.0, panels, |u| along(u, turn)));
                self.radiance * self.shape.solid_angle() * mean
            }
        }
    }
}

/// Uniform over the directions in which the light is seen.
struct BySolidAngle(Sight);

impl Technique for BySolidAngle {
    fn name(&self) -> &str {
        "solid-angle"
    }

    fn sample(&self, u: &[f64], x: &mut [f64]) -> bool {
        x.copy_from_slice(&self.0.shape.sample_solid_angle([u[0], u[1]]));
        true
    }

    fn pdf(&self, x: &[f64]) -> f64 {
        self.0.solid_angle_pdf([x[0], x[1]])
    }
}

/// In proportion to the reflection.
struct ByDirection(Sight);

impl Technique for ByDirection {
    fn name(&self) -> &str {
        "direction"
    }

    fn sample(&self, u: &[f64], x: &mut [f64]) -> bool {
        let wi = self.0.reflection.sample([u[0], u[1]]);
        self.0.shape.hit(wi).is_some_and(|hit| {
            x.copy_from_slice(&hit);
            true
        })
    }

    fn pdf(&self, x: &[f64]) -> f64 {
        let place = self.0.shape.place([x[0], x[1]]);
        self.0.reflection.pdf(place.wi) * place.solid_angle_per_square
    }

    fn always_hits(&self) -> bool {
        false
    }
}

/// The light that one area light sends to the viewer by way of the receiver.
pub struct OneLight {
    name: &'static str,
    description: &'static str,
    sight: Sight,
    /// Where a shadow begins, if there is one.
    shadow: Option<f64>,
    integral: f64,
    techniques: Vec<Box<dyn Technique>>,
    control: Option<Control>,
}

impl OneLight {
    fn new(
        name: &'static str,
        description: &'static str,
        shape: Shape,
        reflection: Reflection,
        shadow: Option<f64>,
    ) -> Self {
        let sight = Sight {
            shape,
            reflection,
            radiance: 1.0,
        };
        let unshadowed = sight.integral(PANELS, |_| 1.0);
        let control = Control {
            value: Box::new(move |x| sight.value([x[0], x[1]])),
            integral: unshadowed,
        };
        Self {
            name,
            description,
            sight,
            shadow,
            integral: shadow.map_or(unshadowed, |from| sight.integral(PANELS, |t| shadow_limit(from, t))),
            techniques: vec![
                Box::new(Product::uniform(2)),
                Box::new(BySolidAngle(sight)),
                Box::new(ByDirection(sight)),
            ],
            // Without a shadow it would be the integrand itself.
            control: shadow.map(|_| control),
        }
    }
}

/// How far along the first edge of the light one sees at `t` of the second: a straight edge of an occluder, seen from a point, is one on
/// the light too.
fn shadow_limit(from: f64, t: f64) -> f64 {
    from - 0.5 * t
}

impl Integrand for OneLight {
    fn name(&self) -> &str {
        self.name
    }

    fn description(&self) -> &str {
        self.description
    }

    fn dimensions(&self) -> usize {
        2
    }

    fn value(&self, x: &[f64]) -> f64 {
        match self.shadow {
            Some(from) if x[0] >= shadow_limit(from, x[1]) => 0.0,
            _ => self.sight.value([x[0], x[1]]),
        }
    }

    fn integral(&self) -> f64 {
        self.integral
    }

    fn techniques(&self) -> &[Box<dyn Technique>] {
        &self.techniques
    }

    fn control(&self) -> Option<&Control> {
        self.control.as_ref()
    }
}

/// The cases: light planar or spherical; its size below a fifth of its distance (far) or above (near), and each of the two once with a small light and
/// once with a large one; and a shadow boundary across a light.
pub fn single() -> Vec<Box<dyn Integrand>> {
    let toward = DVec3::new(0.5, 0.0, 0.75_f64.sqrt());
    let planar = |size: f64| {
        Shape::rectangle(toward, DVec3::new(0.0, 0.0, -1.0), [size, size]).expect("it is not seen from the edge")
    };
    let spherical = |size: f64| Shape::Sphere {
        center: toward,
        radius: 0.5 * size,
    };
    let glossy = Reflection::glossy();
    let case = |name, description, shape, shadow| {
        Box::new(OneLight::new(name, description, shape, glossy, shadow)) as Box<dyn Integrand>
    };
    vec![
        case(
            "planar-far-small",
            "a square light, 1/20 of its distance wide",
            planar(0.05),
            None,
        ),
        case(
            "planar-far-large",
            "a square light, just below 1/5 of its distance wide",
            planar(0.19),
            None,
        ),
        case(
            "planar-near-small",
            "a square light, half its distance wide",
            planar(0.5),
            None,
        ),
        case(
            "planar-near-large",
            "a square light, four times its distance wide",
            planar(4.0),
            None,
        ),
        case(
            "sphere-far-small",
            "a spherical light, 1/20 of its distance wide",
            spherical(0.05),
            None,
        ),
        case(
            "sphere-far-large",
            "a spherical light, just below 1/5 of its distance wide",
            spherical(0.19),
            None,
        ),
        case(
            "sphere-near-small",
            "a spherical light, half its distance wide",
            spherical(0.5),
            None,
        ),
        case(
            "sphere-near-large",
            "a spherical light that nearly touches",
            spherical(1.6),
            None,
        ),
        case(
            "planar-shadow",
            "a square light as wide as distant, cut by a shadow boundary",
            planar(1.0),
            Some(0.8),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const LAMBERT: Reflection = Reflection {
        diffuse: 0.5,
        glossy: 0.0,
        exponent: 1.0,
        mirror: DVec3::Z,
    };

    /// J. H. Lambert (1760): the irradiance of a polygon of radiance 1 is half the sum of the angles of its edges times the cosines of
    /// the planes that they span with the receiver.
    #[test]
    fn rectangles_agree_with_lambert() {
        for size in [0.05, 0.5, 1.2] {
            let shape = Shape::rectangle(
                DVec3::new(0.5, 0.2, 1.0),
                DVec3::new(0.6, 0.0, -0.8),
                [size, 0.7 * size],
            )
            .unwrap();
            let Shape::Rectangle {
                corner, edges: [a, b], ..
            } = shape
            else {
                unreachable!("it was made as one")
            };
            let corners = [corner, corner + a, corner + a + b, corner + b];
            let term = |i: usize| {
                let (p, q) = (corners[i].normalize(), corners[(i + 1) % 4].normalize());
                p.angle_between(q) * p.cross(q).normalize().z
            };
            let irradiance = 0.5 * (0..4).map(term).sum::<f64>().abs();
            let sight = Sight {
                shape,
                reflection: LAMBERT,
                radiance: 1.0,
            };
            let expected = 0.5 / PI * irradiance;
            assert!(
                (sight.integral(PANELS, |_| 1.0) / expected - 1.0).abs() < 1e-9,
                "{size}"
            );
        }
    }

    /// A sphere wholly above the horizon: irradiance `pi (r/d)^2 cos(theta)`.
    #[test]
    fn spheres_agree_with_their_closed_form() {
        for radius in [0.025, 0.25, 0.8] {
            let center = DVec3::new(0.5, 0.0, 0.75_f64.sqrt());
            let sight = Sight {
                shape: Shape::Sphere { center, radius },
                reflection: LAMBERT,
                radiance: 2.0,
            };
            let expected = 2.0 * 0.5 * radius * radius * center.z;
            assert!(
                (sight.integral(PANELS, |_| 1.0) / expected - 1.0).abs() < 1e-9,
                "{radius}"
            );
        }
    }

    #[test]
    fn finer_quadrature_changes_nothing() {
        for shape in [
            Shape::rectangle(DVec3::new(0.5, 0.0, 0.8), DVec3::new(0.0, 0.0, -1.0), [4.0, 4.0]).unwrap(),
            Shape::Sphere {
                center: DVec3::new(0.5, 0.0, 0.87),
                radius: 0.8,
            },
        ] {
            let sight = Sight {
                shape,
                reflection: Reflection::glossy(),
                radiance: 1.0,
            };
            let [coarse, fine] = [PANELS, 2 * PANELS].map(|panels| sight.integral(panels, |t| 0.8 - 0.5 * t));
            assert!((coarse / fine - 1.0).abs() < 1e-9, "{coarse} {fine}");
        }
    }
}
