//! Every knob of light choice, once.

use serde::{Deserialize, Serialize};

/// The ways to choose a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SamplerKind {
    /// Every light alike.
    Uniform,
    /// In proportion to emitted power.
    Power,
    /// Fixed subdivision of space, contribution estimated per cell.
    Octree,
    /// Light tree with bounding cones (Conty Estevez and Kulla 2018), visibility unknown.
    Tree,
    /// The same tree, leaf flux times learned visibility.
    TreeVisible,
    /// The global running-maximum importance table (Wald et al. 2003).
    Table,
    /// Learned cuts: cells that know which lights matter where.
    Adaptive,
}

impl SamplerKind {
    /// All of them, in the order in which tables list them.
    pub const ALL: [Self; 7] = [
        Self::Uniform,
        Self::Power,
        Self::Octree,
        Self::Tree,
        Self::TreeVisible,
        Self::Table,
        Self::Adaptive,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Power => "power",
            Self::Octree => "octree",
            Self::Tree => "tree",
            Self::TreeVisible => "tree-visible",
            Self::Table => "table",
            Self::Adaptive => "adaptive",
        }
    }
}

/// Knobs of light choice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Total probability mass shared equally by all lights whatever was learned, in \[0, 1\]. Higher values find
    /// overlooked lights sooner and bound the noise they make; lower values waste fewer samples. 0.005.
    pub min_probability_mass: f32,
    /// Factor by which the table's running maximum shrinks with every lesson (after each of the first frames, then after
    /// 8, 16, 32, ... frames), in (0, 1\]. Higher values remember longer; lower values follow changes sooner. 0.9.
    pub table_decay: f32,
    /// Biased, off at 0: lights whose table entry is below this share of the mean are ignored. Higher values drop more.
    pub ignore_below: f32,
    /// `adaptive`: what each light is expected to bring to a point is added up, and draws only find out by how much it is off (a control
    /// variate; pixels may come out below zero). On: less noise; off: less work at every point.
    pub control_variate: bool,
    /// `adaptive`: paths leave a surface more often to where earlier ones found light. On: less noise in light that arrives by way of other
    /// surfaces; off: no memory for directions.
    #[serde(default = "on")]
    pub guided_bounces: bool,
    /// `octree`: halvings of the scene's bounding cube per axis, 0..=7. Higher values fit lights to smaller places; lower
    /// values fill fewer cells. 5.
    pub octree_depth: u32,
    /// `octree`: lights with a probability of their own in each cell. Higher values leave less to the rest that is
    /// drawn by power; lower values fill cells faster. 64.
    pub octree_bright: u32,
    /// To measure what leaving it out saves: whether the sampler is made, asked and taught where there is one light only. Off.
    #[serde(default)]
    pub choose_among_one: bool,
}

fn on() -> bool {
    true
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            min_probability_mass: 0.005,
            table_decay: 0.9,
            ignore_below: 0.0,
            control_variate: true,
            guided_bounces: on(),
            octree_depth: 5,
            octree_bright: 64,
            choose_among_one: false,
        }
    }
}
