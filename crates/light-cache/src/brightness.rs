//! How bright the image is around a point, coarsely: the measure of what a light contributes there.
//!
//! Errors are seen, and reported, relative to the brightness of the pixel; so a light matters by its share of the light
//! at a point, not by its contribution alone (the weight 1 / F^2 in the second moment that is to be minimised).

use crate::state::is_amount;
use crate::{Observation, ShadingPoint};
use sampling::hash::hash3;

/// Cells of the table; points that share one by accident blur each other's brightness, no more.
const CELLS: usize = 1 << 14;
/// Cells along the radius of the scene.
const CELLS_PER_RADIUS: f32 = 24.0;
/// Pseudo-samples of the mean of the whole image.
const PRIOR_SAMPLES: f32 = 4.0;
/// Share of the mean that is added everywhere: no place is so dark that errors there matter beyond all others.
const LEAST: f32 = 0.1;
/// Estimates above this many times the mean count as that many.
const SPIKE: f32 = 100.0;

/// Mean contribution of light by place.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Brightness {
    cells: Vec<(f32, f32)>,
    cells_per_metre: f32,
    sum: f64,
    count: f64,
}

impl Brightness {
    /// Nothing is known yet; `radius` of the scene sets the size of the cells.
    pub(crate) fn new(radius: f32) -> Self {
        Self {
            cells: vec![(0.0, 0.0); CELLS],
            cells_per_metre: CELLS_PER_RADIUS / radius.max(f32::MIN_POSITIVE),
            sum: 0.0,
            count: 0.0,
        }
    }

    fn cell(&self, point: &ShadingPoint) -> u16 {
        let at = (point.position_ws * self.cells_per_metre).floor().as_ivec3();
        let facing = point.normal_ws.abs().max_position() as u32;
        let side = facing * 2 + u32::from(point.normal_ws[facing as usize] > 0.0);
        hash3(at.x as u32, at.y as u32, (at.z as u32).wrapping_mul(8) + side) as u16 % CELLS as u16
    }

    /// Takes note of an estimate; returns the cell that the point is in, for [`Brightness::of_cell`].
    pub(crate) fn observe(&mut self, observation: &Observation) -> u16 {
        let mean = self.mean();
        let estimate = if observation.visible {
            observation.unshadowed / observation.pmf.max(f32::MIN_POSITIVE)
        } else {
            0.0
        };
        let estimate = if mean > 0.0 {
            estimate.min(SPIKE * mean)
        } else {
            estimate
        };
        let cell = self.cell(&observation.point);
        let (sum, count) = &mut self.cells[usize::from(cell)];
        let times = observation.weight as f32;
        *sum += times * estimate;
        *count += times;
        self.sum += f64::from(times * estimate);
        self.count += f64::from(times);
        cell
    }

    fn mean(&self) -> f32 {
        (self.sum / self.count.max(1.0)) as f32
    }

    /// Brightness of a cell, above 0 as soon as any light has been seen.
    pub(crate) fn of_cell(&self, cell: u16) -> f32 {
        let mean = self.mean();
        let (sum, count) = self.cells[usize::from(cell)];
        (sum + PRIOR_SAMPLES * mean) / (count + PRIOR_SAMPLES) + LEAST * mean
    }

    /// Whether it can be what another of the same scene has become.
    pub(crate) fn is_sound_like(&self, other: &Self) -> bool {
        self.cells.len() == other.cells.len()
            && self.cells_per_metre == other.cells_per_metre
            && self
                .cells
                .iter()
                .all(|&(sum, count)| is_amount(sum) && is_amount(count))
            && is_amount(self.sum)
            && is_amount(self.count)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.cells[..])
    }
}
