//! Learned cuts: the sampler that knows which lights matter where.
//!
//! World-space cells, hashed, each with a cut of the light tree of its own, whose entries carry the learned ratio of what they
//! contribute, visibility included, to what they are estimated to send. A light is drawn in two steps: an entry by the weights of all
//! entries at the point, then, where the entry is a cluster, a light of it by the tree's descent at the point itself. A fixed share of the
//! random numbers goes to the global importance table, which holds the guaranteed minimum of every light and every light that ever mattered
//! anywhere in the image. Where shadows are finer than a cell, cubes within it count the visible share of each entry.
//!
//! The same evaluation adds up what the whole cut is expected to bring, in colour: a control variate, so that a draw only has to find out
//! by how much the light it finds differs from what was expected of it (Szecsi, Sbert and Szirmay-Kalos 2004, Combined correlated and importance sampling in
//! direct light source computation and environment mapping; Vevoda et al. 2018). Entries that are expected to be visible for certain are then drawn less.
//!
//! Related: Pantaleoni 2019 (Importance sampling of many lights with reinforcement lightcuts learning), Wang et al. 2021 (Learning to cluster for rendering with many
//! lights), Vevoda et al. 2018 (Bayesian online regression for adaptive direct illumination sampling). Differs: what is learned are ratios of second moments to an
//! estimate that is evaluated for the whole cut at every point (with vector instructions: about the time of a shadow ray), the
//! probability is an exact sum of integer masses, and random numbers keep their strata because entries stand in tree order.

mod branch;
mod cell;
mod cells;
mod cube;
mod cut;
mod directions;
mod emitter;
mod entry;
mod grid;
mod packed;
mod palette;
mod row;
mod subcell;
mod subcells;
mod weights;

use crate::schedule::Schedule;
use crate::state::Saved;
use crate::tree::{Descent, PER_U32, Receiver, Tree, UNIT, position, probability};
use crate::{
    CellRecord, Choice, LightRecord, LightSampler, Observation, Pace, Packed, SamplerStats, Settings, ShadingPoint,
    TableSampler, Thinning, TreeVisibleSampler, records, state,
};
use cell::{Lights, Nearby};
use cells::Cells;
use glam::Vec3;
use palette::Palette;
use sampling::HemisphereGuide;
use scene::Scene;
use std::time::Instant;
use weights::{Part, Wanted};

/// Share of the samples that goes to the global table. Higher values find lights sooner that a cell has overlooked; lower values waste less.
const TABLE_SHARE: f64 = 0.01;

/// Entries of a cell are drawn with 52 bits, which `f64` holds exactly; what is below goes to the lights within an entry.
const CELL_SHIFT: u32 = 11;

/// So few lights are known after the first frames: then epochs grow by [`FEW_LIGHTS_GROWTH`], else by [`EPOCH_GROWTH`].
/// Higher values keep the strata of random numbers in more scenes; lower values learn more.
const FEW_LIGHTS: usize = 64;
/// By how much epochs grow where lights are few, see [`Schedule::new`]: so much that nobody waits for the end of the next one.
const FEW_LIGHTS_GROWTH: u32 = 1 << 20;
/// The same where they are many.
const EPOCH_GROWTH: u32 = 2;

/// Lights that are drawn from one evaluation of a cell.
const EACH: usize = 8;

/// Learned cuts.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub struct AdaptiveSampler {
    /// The light tree with visibility learned over the whole image: the prior of every cell.
    prior: TreeVisibleSampler,
    table: TableSampler,
    cells: Cells,
    /// For the control variate; `None` without.
    palette: Option<Palette>,
    /// The table's part of 32-bit random numbers.
    table_mass: u32,
    /// Which frames are learned from.
    schedule: Schedule,
    /// Frames done.
    frames: u64,
    settings: Settings,
    build_s: f64,
    learn_s: f64,
}

/// The sampler as seen from one shading point.
#[derive(Debug)]
pub struct Local<'a> {
    receiver: Receiver,
    source: Source<'a>,
    table: <TableSampler as LightSampler>::Local<'a>,
    salt: u32,
}

/// What draws the lights that the table does not draw.
#[derive(Debug)]
enum Source<'a> {
    /// What has been learned around the point.
    Cell(Nearby<'a>),
    /// Nothing has been learned there yet: the tree as it is.
    Tree(Descent<'a>),
    /// No light can contribute.
    Nothing,
}

/// The part of a random number's range that stands for the probability `mass` x 2^-32.
fn width(mass: u64) -> u64 {
    mass * PER_U32
}

impl AdaptiveSampler {
    #[inline]
    fn tree(&self) -> &Tree {
        self.prior.tree()
    }

    /// Learned cuts over the lights of `scene`, which start as the light tree.
    pub fn new(scene: &Scene, settings: &Settings) -> Self {
        let start = Instant::now();
        let lights = &scene.lights[..];
        let floor = f64::from(settings.min_probability_mass);
        let share = TABLE_SHARE.max(floor).min(0.9);
        // The table holds the guaranteed mass of all: within its share of the samples it must be that much larger.
        let within_table = Settings {
            min_probability_mass: (floor / share) as f32,
            ..settings.clone()
        };
        let prior = TreeVisibleSampler::prior(lights, settings);
        Self {
            palette: settings.control_variate.then(|| Palette::new(prior.tree(), lights)),
            prior,
            table: TableSampler::net(lights, scene.radius, &within_table),
            cells: Cells::new(scene.center_ws, scene.radius, Tree::unit(lights)),
            table_mass: (share * 4_294_967_296.0) as u32,
            schedule: Schedule::new(if lights.len() <= FEW_LIGHTS {
                FEW_LIGHTS_GROWTH
            } else {
                EPOCH_GROWTH
            }),
            frames: 0,
            settings: settings.clone(),
            build_s: start.elapsed().as_secs_f64(),
            learn_s: 0.0,
        }
    }
}

impl Saved for AdaptiveSampler {
    fn is_sound_like(&self, fresh: &Self) -> bool {
        let lights = Lights {
            tree: self.tree(),
            palette: self.palette.as_ref(),
        };
        self.prior.is_sound_like(&fresh.prior)
            && self.table.is_sound_like(&fresh.table)
            && self.palette == fresh.palette
            && self.table_mass == fresh.table_mass
            && self.settings == fresh.settings
            && self.schedule.is_sound_like(&fresh.schedule, self.tree().len())
            && self.cells.is_sound_like(&fresh.cells, lights, self.frames)
    }
}

impl LightSampler for AdaptiveSampler {
    type Local<'a> = Local<'a>;
    const LEARNS: bool = true;

    fn pace(&self) -> Pace {
        self.schedule.pace()
    }

    fn is_controlled(&self) -> bool {
        self.palette.is_some()
    }

    /// What was learned may be wrong anywhere, and is learned again in a few frames.
    fn scene_changed(&mut self, scene: &Scene) {
        *self = Self::new(scene, &self.settings);
    }

    fn set_eye(&mut self, eye_ws: Vec3) {
        self.cells.set_eye(eye_ws);
        self.schedule.restart();
    }

    #[inline]
    fn local(&self, scene: &Scene, point: &ShadingPoint) -> Local<'_> {
        let source = match self.cells.at(point) {
            Some(nearby) => Source::Cell(nearby),
            None => {
                let descent = Descent::new(self.tree(), point.into());
                if descent.alive() {
                    Source::Tree(descent)
                } else {
                    Source::Nothing
                }
            }
        };
        Local {
            receiver: point.into(),
            source,
            table: self.table.local(scene, point),
            salt: point.salt(),
        }
    }

    #[inline]
    fn sample(&self, local: &Local<'_>, u: u32) -> Option<Choice> {
        let x = position(u, local.salt);
        let table_width = self.table_width();
        match &local.source {
            Source::Nothing => None,
            _ if x < table_width => self.sample_table(local, x),
            Source::Tree(descent) => {
                let (place, own) = descent.draw(x - table_width, UNIT - table_width);
                Some(self.choice(local, place, own))
            }
            Source::Cell(cell) => {
                let part = cell.draw(
                    &local.receiver,
                    (x - table_width) >> CELL_SHIFT,
                    (UNIT - table_width) >> CELL_SHIFT,
                )?;
                Some(self.within(local, &part, x - table_width))
            }
        }
    }

    fn sample_each(&self, local: &Local<'_>, us: &[u32], choices: &mut [Option<Choice>]) {
        let Source::Cell(cell) = &local.source else {
            let each = choices.iter_mut().zip(us);
            return each.for_each(|(choice, &u)| *choice = self.sample(local, u));
        };
        let table_width = self.table_width();
        for (us, choices) in us.chunks(EACH).zip(choices.chunks_mut(EACH)) {
            let mut wanted = [Wanted::At(0); EACH];
            let mut parts = [None; EACH];
            for (wanted, &u) in wanted.iter_mut().zip(us) {
                *wanted = Wanted::At(position(u, local.salt).saturating_sub(table_width) >> CELL_SHIFT);
            }
            cell.draw_each(
                &local.receiver,
                &wanted[..us.len()],
                (UNIT - table_width) >> CELL_SHIFT,
                &mut parts[..us.len()],
            );
            for ((choice, &u), part) in choices.iter_mut().zip(us).zip(&parts) {
                let x = position(u, local.salt);
                *choice = if x < table_width {
                    self.sample_table(local, x)
                } else {
                    part.map(|part| self.within(local, &part, x - table_width))
                };
            }
        }
    }

    #[inline]
    fn pmf(&self, local: &Local<'_>, light: u32) -> f32 {
        self.chosen(local, light).map_or(0.0, |choice| choice.pmf)
    }

    fn guides(&self) -> bool {
        self.settings.guided_bounces
    }

    #[inline]
    fn guide<'a>(&'a self, local: &Local<'a>) -> Option<&'a HemisphereGuide> {
        match &local.source {
            Source::Cell(cell) => cell.guide(),
            Source::Tree(_) | Source::Nothing => None,
        }
    }

    fn end_frame(&mut self, _scene: &Scene, logs: &[Vec<Observation>]) {
        let start = Instant::now();
        self.frames += 1;
        if let Some(logs) = self.schedule.end_frame(logs) {
            self.learn(&logs);
            self.learn_s += start.elapsed().as_secs_f64();
        }
    }

    fn thinning(&self) -> Option<Thinning> {
        Some(self.schedule.thinning())
    }

    fn end_thinned_frame(&mut self, _scene: &Scene, kept: Vec<Vec<Observation>>) {
        let start = Instant::now();
        self.frames += 1;
        if let Some(logs) = self.schedule.end_thinned_frame(kept) {
            self.learn(&logs);
            self.learn_s += start.elapsed().as_secs_f64();
        }
    }

    fn save(&self) -> Option<Vec<u8>> {
        state::save(self)
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        state::restore(self, state)
    }

    fn stats(&self) -> SamplerStats {
        let table = self.table.stats();
        SamplerStats {
            bytes: self.tree().bytes()
                + table.bytes
                + self.cells.bytes()
                + self.schedule.bytes()
                + self.palette.as_ref().map_or(0, Palette::bytes),
            cells: self.cells.len(),
            min_probability: table.min_probability * f64::from(self.table_mass) / 4_294_967_296.0,
            build_s: self.build_s,
            learn_s: self.learn_s,
            skipped: Vec::new(),
            biased: table.biased,
        }
    }

    fn records(&self, scene: &Scene) -> Vec<LightRecord> {
        records::of_sampler(self, scene, &[])
    }

    fn pack(&self) -> Option<Packed> {
        self.packed()
    }

    fn cells(&self, _scene: &Scene) -> Vec<CellRecord> {
        self.cells.records(self.tree(), self.frames)
    }

    fn cell_at(&self, point: &ShadingPoint) -> Option<u64> {
        self.cells.number_at(point)
    }
}

impl AdaptiveSampler {
    /// Learns from the observations of an epoch.
    fn learn(&mut self, logs: &[Vec<Observation>]) {
        let frame = self.frames;
        // First: what new cells believe of visibility is what the whole image has taught so far.
        self.prior.learn(logs);
        let (table, prior, cells) = (&mut self.table, &self.prior, &mut self.cells);
        let lights = Lights {
            tree: prior.tree(),
            palette: self.palette.as_ref(),
        };
        rayon::join(|| table.learn(logs), || cells.learn(lights, frame, logs));
    }

    /// What the table has of the range of random numbers.
    #[inline]
    fn table_width(&self) -> u64 {
        width(self.table_mass.into())
    }

    /// The light at position `x` of that.
    fn sample_table(&self, local: &Local<'_>, x: u64) -> Option<Choice> {
        let stretched = (u128::from(x) << 32) / u128::from(self.table_width());
        let light = self.table.sample(&local.table, stretched as u32)?.light;
        self.chosen(local, light).filter(|choice| choice.pmf > 0.0)
    }

    /// `light`, as if it had been drawn; `None` where nothing can arrive: nothing is drawn there, not by the table either.
    #[inline]
    fn chosen(&self, local: &Local<'_>, light: u32) -> Option<Choice> {
        let place = self.tree().rank[light as usize];
        let rest = UNIT - self.table_width();
        match &local.source {
            Source::Nothing => None,
            Source::Tree(descent) => Some(self.choice(local, place, descent.width_of(place, rest))),
            Source::Cell(cell) => {
                let part = cell.part_of(&local.receiver, place, rest >> CELL_SHIFT)?;
                let own = part.width << CELL_SHIFT;
                let own = match part.branch.light() {
                    Some(_) => own,
                    None => self.inside(local).width_in(part.branch.node(), place, own),
                };
                Some(self.controlled(local, &part, place, own))
            }
        }
    }

    /// The light at `place` in tree order, of which `own` is the width that the cell or the tree gives it.
    #[inline]
    fn choice(&self, local: &Local<'_>, place: u32, own: u64) -> Choice {
        let light = self.tree().light_at(place);
        let of_table = self.table.pmf(&local.table, light) * (self.table_mass as f32 / 4_294_967_296.0);
        Choice::new(light, probability(own) + of_table)
    }

    /// The same with the control variate, given the light's entry: what all lights are expected to bring, minus what this one is, over
    /// its probability. Of what an entry is expected to bring, a light in it has the share with which it is drawn there, so that the mean
    /// over all draws is zero.
    #[inline]
    fn controlled(&self, local: &Local<'_>, part: &Part, place: u32, own: u64) -> Choice {
        let choice = self.choice(local, place, own);
        let share = probability(own) / (probability(UNIT - self.table_width()) * choice.pmf);
        Choice {
            control: self.cells.unit() * (part.expected.total - part.expected.own * share),
            ..choice
        }
    }

    /// The light at position `x` (within what the table leaves), given the entry there.
    #[inline]
    fn within(&self, local: &Local<'_>, part: &Part, x: u64) -> Choice {
        let (start, own) = (part.start << CELL_SHIFT, part.width << CELL_SHIFT);
        let (place, own) = match part.branch.light() {
            Some(place) => (place, own),
            None => self.inside(local).draw_in(part.branch.node(), x - start, own),
        };
        self.controlled(local, part, place, own)
    }

    /// For the inside of a cluster.
    #[inline]
    fn inside(&self, local: &Local<'_>) -> Descent<'_> {
        Descent::inside(self.tree(), local.receiver)
    }
}

#[cfg(test)]
mod tests;
