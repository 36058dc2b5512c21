//! Choosing lights, and learning which of them matter.
//!
//! Every sampler answers two questions alike: which light for this point ([`LightSampler::sample`]), and how probable
//! was that light ([`LightSampler::pmf`]). They agree to the bit, because both read the same integer masses or walk the
//! same tree. Every light that can contribute has a probability above zero. Learning happens between frames only
//! ([`LightSampler::end_frame`]), from the logs of the frame that has ended: a frame never depends on itself, so each is unbiased.
//!
//! Absent from this crate: GPU handles, windows, files, ray tracing. Deterministic for a seed at any thread count:
//! logs are merged in the order of the image's tiles.

mod adaptive;
mod belief;
mod brightness;
mod dispatch;
mod octree;
mod packed;
mod power;
mod records;
mod schedule;
pub mod settings;
mod state;
mod table;
#[cfg(test)]
mod testing;
mod tree;
mod tree_visible;
mod uniform;

use glam::Vec3;
use sampling::HemisphereGuide;
use scene::Scene;
use std::fmt::Debug;

pub use adaptive::AdaptiveSampler;
pub use dispatch::{Visitor, build};
pub use octree::OctreeSampler;
pub use packed::{Packed, Scheme};
pub use power::PowerSampler;
pub use records::Recording;
pub use schedule::Thinning;
pub use settings::{SamplerKind, Settings};
pub use table::TableSampler;
pub use tree::TreeSampler;
pub use tree_visible::TreeVisibleSampler;
pub use uniform::UniformSampler;

/// What a sampler may know about the point that wants light.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub struct ShadingPoint {
    /// World position.
    pub position_ws: Vec3,
    /// Unit shading normal on the viewer's side: lights below it contribute nothing.
    pub normal_ws: Vec3,
    /// First hit of the eye path, or a later one (separate tables).
    pub primary: bool,
}

/// A drawn light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Index into [`Scene::lights`].
    pub light: u32,
    /// The probability with which it was drawn, exactly as [`LightSampler::pmf`] reports it. Above 0.
    pub pmf: f32,
    /// Irradiance per channel to add to what the light brings, once per draw: a control variate. Its mean over all draws at a point is
    /// zero. Zero too where a sampler has none.
    pub control: Vec3,
}

impl Choice {
    /// Without a control variate.
    pub fn new(light: u32, pmf: f32) -> Self {
        Self {
            light,
            pmf,
            control: Vec3::ZERO,
        }
    }
}

/// What an eye-path vertex found out about a light.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub struct Observation {
    /// Where.
    pub point: ShadingPoint,
    /// Which light.
    pub light: u32,
    /// Luminance of the contribution to the pixel that the light would make if nothing stood in the way, the light
    /// being chosen for certain: path throughput x BSDF x cosine x radiance / pdf of the point on the light. Finite,
    /// at least 0.
    pub unshadowed: f32,
    /// Luminance of the irradiance alone that goes with `unshadowed`: cosine x radiance / pdf of the point on the light,
    /// the surface's colour and the path's weight left out. Finite, at least 0.
    pub irradiance: f32,
    /// The probability with which the light was chosen.
    pub pmf: f32,
    /// Whether the shadow ray arrived.
    pub visible: bool,
    /// How many such observations it stands for: 1, or more if others like it were left out.
    pub weight: u32,
    /// What the path found that went on from there; `None` if it did not.
    pub bounce: Option<Bounce>,
}

/// What a path found in the direction in which it left a vertex.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub struct Bounce {
    /// The part of the hemisphere ([`sampling::guide::part_of`]), less than [`sampling::guide::PARTS`].
    pub part: u16,
    /// Luminance of the radiance that arrived from there, as the path estimated it (its throughput after the bounce divided out). Finite, at least 0.
    pub radiance: f32,
}

/// Counters and shares a sampler can tell about itself, for `--stats` and `info`.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct SamplerStats {
    /// Bytes held, learned tables included.
    pub bytes: usize,
    /// Cells in use; 0 for samplers without cells.
    pub cells: usize,
    /// Smallest probability that any light has at any point where it can contribute; 0 if no such guarantee is given.
    pub min_probability: f64,
    /// Seconds of building before the first frame.
    pub build_s: f64,
    /// Seconds spent in [`LightSampler::end_frame`] so far.
    pub learn_s: f64,
    /// What the sampler left out because it was not needed ("one light: no table").
    pub skipped: Vec<String>,
    /// Set if an opt-in setting makes the result biased; says which.
    pub biased: Option<String>,
}

/// What has been learned about one light: a row of `dump`.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct LightRecord {
    /// Largest contribution (visible, luminance) of the light at any pixel, as now remembered.
    pub max_contribution: f64,
    /// Mean over all observations of the visible contribution / pmf: the light's share of the image's mean luminance.
    pub mean_contribution: f64,
    /// Visible share of its unshadowed contribution; `NaN` if never observed (written as empty).
    pub visible_fraction: f64,
    /// Times it was drawn.
    pub samples: u64,
    /// Probability with which it is drawn now, averaged over the points where lights were drawn in the last frame (position-independent
    /// samplers: everywhere). Sums to 1 over all lights.
    pub probability: f64,
    /// The least probability it is guaranteed at any point where it can contribute.
    pub min_probability: f64,
}

/// One entry of what a cell has learned: a light, or a cluster of lights that are drawn together. A row of
/// `dump --cells`; field names are column names.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct CellRecord {
    /// Number of the cell.
    pub cell: u64,
    /// Centre of the cell, world space.
    pub x_m: f32,
    /// See `x_m`.
    pub y_m: f32,
    /// See `x_m`.
    pub z_m: f32,
    /// Edge of the cell.
    pub size_m: f32,
    /// Where the normals in the cell point: "+x", "-x", "+y", "-y", "+z" or "-z".
    pub normal: &'static str,
    /// First hits of eye paths, or later ones.
    pub primary: bool,
    /// The light, or the cluster's first one.
    pub light: u32,
    /// Lights in the cluster; 1 for a light of its own.
    pub lights: u32,
    /// With which the entry is drawn in the cell, what is shared by all lights included as far as the cell knows it.
    pub probability: f64,
    /// Visible share of the contributions observed in the cell; `None` if never observed.
    pub visible_fraction: Option<f64>,
    /// Observations the entry rests on.
    pub samples: u64,
    /// Frames since the cell was made.
    pub age: u64,
}

/// Where a sampler is in the course of its learning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Weight of the coming frame in the image, above 0: later frames, which know more, are less noisy. By a schedule that is fixed
    /// beforehand, so that it cannot bias.
    pub frame_weight: f32,
    /// How often it has learned, that is, changed what it draws because of what was drawn. Random numbers that come after a
    /// lesson must be independent of those before it.
    pub lessons: u32,
}

impl Pace {
    /// Of a sampler that does not learn.
    pub const STEADY: Self = Self {
        frame_weight: 1.0,
        lessons: 0,
    };
}

/// Chooses lights.
///
/// The associated type [`LightSampler::Local`] holds what is worked out once per shading point and used by every
/// draw and query there.
pub trait LightSampler: Debug + Send + Sync {
    /// Per-point state.
    type Local<'a>
    where
        Self: 'a;

    /// Whether the sampler wants observations at all; if not, the integrator collects none.
    const LEARNS: bool;

    /// Tells where the eye is, before the first frame and when it has moved: samplers that keep cells make them finer
    /// near it.
    fn set_eye(&mut self, _eye_ws: Vec3) {}

    /// Tells that the scene has changed since the last frame: its lights are the same in number and order, but some may
    /// shine otherwise, and surfaces may have come, gone or moved.
    fn scene_changed(&mut self, _scene: &Scene) {}

    /// Prepares for `point`.
    fn local(&self, scene: &Scene, point: &ShadingPoint) -> Self::Local<'_>;

    /// Draws a light with the random number `u` (all 32 bits count; stratified `u` give stratified lights). `None`: no
    /// light can contribute at this point.
    fn sample(&self, local: &Self::Local<'_>, u: u32) -> Option<Choice>;

    /// Draws a light with each number, as [`LightSampler::sample`] does: samplers that work much out at a point do it once.
    fn sample_each(&self, local: &Self::Local<'_>, us: &[u32], choices: &mut [Option<Choice>]) {
        for (choice, &u) in choices.iter_mut().zip(us) {
            *choice = self.sample(local, u);
        }
    }

    /// The probability with which [`LightSampler::sample`] draws `light` here; 0 if never.
    fn pmf(&self, local: &Self::Local<'_>, light: u32) -> f32;

    /// Adds the probability of every light here to `sum`, which has one entry per light.
    fn add_pmfs(&self, local: &Self::Local<'_>, sum: &mut [f64]) {
        for (light, sum) in (0..).zip(sum) {
            *sum += f64::from(self.pmf(local, light));
        }
    }

    /// Whether it wants to know what paths find that go on from where they asked for light ([`Observation::bounce`]).
    fn guides(&self) -> bool {
        false
    }

    /// How the diffuse lobe is drawn by a path that goes on from here; `None` if nothing is known.
    fn guide<'a>(&'a self, _local: &Self::Local<'a>) -> Option<&'a HemisphereGuide> {
        None
    }

    /// Where it is in the course of its learning.
    fn pace(&self) -> Pace {
        Pace::STEADY
    }

    /// Whether its choices may come with a control variate.
    fn is_controlled(&self) -> bool {
        false
    }

    /// Learns from a frame, or keeps it for later. `logs`: one per tile, in tile order. Called after every frame, also with empty logs.
    fn end_frame(&mut self, scene: &Scene, logs: &[Vec<Observation>]);

    /// How another back end may thin the observations of the coming frame, for [`LightSampler::end_thinned_frame`]; `None` if all are wanted.
    fn thinning(&self) -> Option<Thinning> {
        None
    }

    /// [`LightSampler::end_frame`] after observations were thinned as [`LightSampler::thinning`] said. `kept`: what is left of the frames since
    /// it was last told of any, by frame and tile; it must be told of all by the last frame that is learned from together.
    fn end_thinned_frame(&mut self, scene: &Scene, kept: Vec<Vec<Observation>>) {
        self.end_frame(scene, &kept);
    }

    /// All that it has learned, so that [`LightSampler::restore`] makes a sampler of the same scene and settings go on to the bit as this one
    /// would. `None` if it cannot be told; nothing for samplers that do not learn.
    fn save(&self) -> Option<Vec<u8>> {
        (!Self::LEARNS).then(Vec::new)
    }

    /// Takes over what [`LightSampler::save`] has told. Returns whether it could be read; if not, nothing has changed. Of damaged bytes only
    /// those are taken that could have been learned: with them it draws other lights, as exactly as ever.
    fn restore(&mut self, state: &[u8]) -> bool {
        !Self::LEARNS && state.is_empty()
    }

    /// What it can tell about itself.
    fn stats(&self) -> SamplerStats;

    /// What it knows about each light, in the order of [`Scene::lights`].
    fn records(&self, scene: &Scene) -> Vec<LightRecord>;

    /// It as words, with which another back end draws the same lights; `None` if none can.
    fn pack(&self) -> Option<Packed> {
        None
    }

    /// What it has learned in each cell; none for samplers without cells.
    fn cells(&self, _scene: &Scene) -> Vec<CellRecord> {
        Vec::new()
    }

    /// The number of the cell that serves a point, as in [`CellRecord::cell`]; `None` where none does.
    fn cell_at(&self, _point: &ShadingPoint) -> Option<u64> {
        None
    }
}
