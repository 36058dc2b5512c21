//! One cube of a cell: what was seen of each entry of the cell's cut in it.

use super::cube::Cube;
use super::row::{LANES, Lanes};
use super::weights::Factors;
use crate::Observation;
use crate::state::is_amount;

/// How many observations the share around a cube is worth in it.
const PRIOR_COUNT: f32 = 4.0;
/// Part of the prior that does not fade, as in the whole cell: what was not visible so far may still be, to few points.
const LASTING_PRIOR: f32 = 0.03;
/// Factors are made anew when the cube has seen this many times more than when they were last made.
const REBUILD_GROWTH: f32 = 1.15;
/// No cube yet.
pub(super) const NONE: u16 = u16::MAX;

/// What was seen of one entry.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Count {
    /// Times drawn.
    pub(super) drawn: f32,
    /// Times drawn and visible.
    pub(super) visible: f32,
}

impl Count {
    /// What one observation says.
    pub(super) fn of(observation: &Observation) -> Self {
        let drawn = observation.weight as f32;
        let visible = if observation.visible { drawn } else { 0.0 };
        Self { drawn, visible }
    }

    /// Visible share, given what is expected.
    fn share(self, expected: f32) -> f32 {
        let n = self.drawn + PRIOR_COUNT;
        // The prior counts less the longer nothing is seen, as in `Entry::ratio`.
        let fade = PRIOR_COUNT / n + LASTING_PRIOR;
        (self.visible + PRIOR_COUNT * fade.min(1.0) * expected) / n
    }
}

/// One cube.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct SubCell {
    /// Number of the one around it in the layer before.
    pub(super) around: u16,
    /// One of the smallest cubes in it.
    pub(super) place: Cube,
    /// Of every entry of the cell's cut.
    pub(super) counts: Vec<Count>,
    /// [`Factors::drawn`]; empty before anything is known.
    pub(super) drawn: Vec<Lanes>,
    /// [`Factors::expected`]: visible share here over that in the whole cell.
    pub(super) expected: Vec<Lanes>,
    seen: f32,
    built_at: f32,
}

impl SubCell {
    /// Nothing seen of so many `entries`.
    pub(super) fn new(around: u16, place: Cube, entries: usize) -> Self {
        Self {
            around,
            place,
            counts: vec![Count::default(); entries],
            drawn: Vec::new(),
            expected: Vec::new(),
            seen: 0.0,
            built_at: 0.0,
        }
    }

    /// How many observations it has seen.
    pub(super) fn seen(&self) -> f32 {
        self.seen
    }

    /// Whether so much was seen that the factors are to be made anew.
    pub(super) fn is_due(&self) -> bool {
        self.seen >= REBUILD_GROWTH * self.built_at
    }

    /// Takes note of draws of an entry.
    pub(super) fn observe(&mut self, entry: usize, draws: Count) {
        let count = &mut self.counts[entry];
        count.drawn += draws.drawn;
        count.visible += draws.visible;
        self.seen += draws.drawn;
    }

    /// Makes the factors. `counts`: what was seen of each entry, here and beside; `whole`: what the whole cell has seen of it; `around`: how
    /// much more or less the cube around this one expects of each, empty for 1; `certainty`: see `CERTAINTY` of the cubes of a cell, 0 without a control variate.
    pub(super) fn build(&mut self, counts: &[Count], whole: &[Count], around: &[Lanes], certainty: f32) {
        self.built_at = self.seen;
        let rows = whole.len().div_ceil(LANES);
        for factors in [&mut self.drawn, &mut self.expected] {
            factors.clear();
            factors.resize(rows, [1.0; LANES]);
        }
        for (entry, (own, whole)) in counts.iter().zip(whole).enumerate() {
            // As if it had been visible once in half as many draws more: never 0.
            let share = (whole.visible + 0.5) / (whole.drawn + 1.0);
            let (row, lane) = (entry % rows, entry / rows);
            let around = around.get(row).map_or(1.0, |row| row[lane]);
            let own = own.share(share * around);
            self.expected[row][lane] = own / share;
            self.drawn[row][lane] = (own / share * (1.0 - certainty * own.min(1.0))).sqrt();
        }
    }

    #[inline]
    pub(super) fn factors(&self) -> Factors<'_> {
        Factors {
            drawn: &self.drawn,
            expected: &self.expected,
        }
    }

    /// Whether it can be one of a cut into so many `entries`, with so many cubes in the layer `before`; `None`: there is no such layer.
    pub(super) fn is_sound(&self, entries: usize, before: Option<usize>) -> bool {
        let rows = entries.div_ceil(LANES);
        let factors = [&self.drawn, &self.expected];
        before.map_or(self.around == NONE, |before| usize::from(self.around) < before)
            && self.place.is_sound()
            && self.counts.len() == entries
            && self
                .counts
                .iter()
                .all(|count| is_amount(count.drawn) && is_amount(count.visible))
            && (factors.iter().all(|lanes| lanes.is_empty()) || factors.iter().all(|lanes| lanes.len() == rows))
            && factors
                .iter()
                .all(|lanes| lanes.as_flattened().iter().copied().all(is_amount))
            && is_amount(self.seen)
            && is_amount(self.built_at)
    }

    pub(super) fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.counts.capacity() * size_of::<Count>()
            + (self.drawn.capacity() + self.expected.capacity()) * size_of::<Lanes>()
    }
}
