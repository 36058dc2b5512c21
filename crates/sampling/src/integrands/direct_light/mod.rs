//! Direct light at a point: the integral that a renderer evaluates for every pixel.
//!
//! A receiver at the origin with normal `+z` reflects the light of an area light towards a viewer. Written over the light's area `A`,
//!
//! `L = integral over A of L_e f_r cos(theta) cos(theta') V / d^2 dA`,
//!
//! it becomes an integral over the unit square by a map of the square to the light. The three classical techniques are densities on
//! that square:
//!
//! - **by area**: uniform on the light (and on the square). Poor where `cos(theta') / d^2` varies over the light: near or large lights, and
//!   spheres, half of which face away.
//! - **by solid angle**: uniform over the directions in which the light is seen, which cancels `cos(theta') / d^2`. For a light smaller than a fifth of
//!   its distance that factor hardly varies, and area does as well: the five-times rule of lighting engineers.
//! - **by direction**: in proportion to the reflection, `f_r cos(theta)`. Good for large lights and glossy surfaces; misses small lights.
//!
//! No light wins everywhere by one of them, which is what multiple importance sampling is for. With several lights a further coordinate
//! chooses the light: [`ManyLights`]. Errors with a large light nearby, then with many lights, technique by technique:
//!
//! <div>
#![doc = include_str!("../../../../../docs/monte-carlo/planar-near-large-combined-evaluations.svg")]
//! </div>
//!
//! <div>
#![doc = include_str!("../../../../../docs/monte-carlo/many-lights-technique-evaluations.svg")]
//! </div>

mod many;
mod quadrature;
mod reflection;
mod shape;
mod single;

pub use many::ManyLights;
pub use single::{OneLight, single};
