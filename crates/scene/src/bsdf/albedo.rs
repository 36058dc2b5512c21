//! The share of light that the specular lobe sends back, tabulated: what is left for the lobe below.

use glam::{Vec2, Vec3};
use sampling::ggx;
use std::sync::LazyLock;

/// Rows over sqrt(alpha) from that of [`super::MIN_ALPHA`] to 1.
const ROWS: usize = 16;

/// Columns over the square root of the cosine in \[0, 1\]: most happens near grazing.
const COLUMNS: usize = 32;

/// Square root of [`super::MIN_ALPHA`].
pub(super) const LEAST: f32 = 0.031_622_78;

static TABLE: LazyLock<Table> = LazyLock::new(Table::new);

/// Directional albedo of GGX under Schlick's Fresnel, which is linear: `f0 * x + f90 * y`.
struct Table {
    albedo: [[Vec2; COLUMNS]; ROWS],
    /// Cosine-weighted means over the hemisphere.
    mean: [Vec2; ROWS],
}

/// The specular albedo of one material, ready for any cosine.
#[derive(Clone, Copy)]
pub(super) struct SpecularAlbedo {
    reflectance: Vec2,
    row: usize,
    /// Between that row and the next.
    fraction: f32,
    table: &'static Table,
}

impl SpecularAlbedo {
    #[inline]
    pub(super) fn new(f0: f32, f90: f32, alpha: f32) -> Self {
        let place = (alpha.sqrt() - LEAST).max(0.0) * ((ROWS - 1) as f32 / (1.0 - LEAST));
        let row = (place as usize).min(ROWS - 2);
        Self {
            reflectance: Vec2::new(f0, f90),
            row,
            fraction: place - row as f32,
            table: &TABLE,
        }
    }

    /// Share of the light from a direction with this cosine that is reflected anywhere.
    #[inline]
    pub(super) fn at(&self, cosine: f32) -> f32 {
        let (column, fraction) = place(cosine);
        let along = |row: &[Vec2; COLUMNS]| row[column].lerp(row[column + 1], fraction);
        let rows = &self.table.albedo;
        let albedo = along(&rows[self.row]).lerp(along(&rows[self.row + 1]), self.fraction);
        albedo.dot(self.reflectance)
    }

    /// Its cosine-weighted mean over the hemisphere.
    #[inline]
    pub(super) fn mean(&self) -> f32 {
        let means = &self.table.mean;
        means[self.row]
            .lerp(means[self.row + 1], self.fraction)
            .dot(self.reflectance)
    }
}

/// Column of a cosine, and how far towards the next.
#[inline]
fn place(cosine: f32) -> (usize, f32) {
    let place = cosine.sqrt() * (COLUMNS - 1) as f32;
    let column = (place as usize).min(COLUMNS - 2);
    (column, place - column as f32)
}

/// The table as words: albedos by row and column, then the means by row, two numbers each.
pub(crate) fn words() -> impl Iterator<Item = u32> {
    let entries = TABLE.albedo.iter().flatten().chain(&TABLE.mean);
    entries.flat_map(|entry| entry.to_array().map(f32::to_bits))
}

impl Table {
    fn new() -> Self {
        let mut table = Self {
            albedo: [[Vec2::ZERO; COLUMNS]; ROWS],
            mean: [Vec2::ZERO; ROWS],
        };
        const MEAN_STEPS: usize = 1024;
        let step = 1.0 / (COLUMNS - 1) as f32;
        for (row, (albedo, mean)) in table.albedo.iter_mut().zip(&mut table.mean).enumerate() {
            let alpha = (LEAST + (1.0 - LEAST) * row as f32 / (ROWS - 1) as f32).powi(2);
            for (column, entry) in albedo.iter_mut().enumerate() {
                // Not the horizon itself, where nothing is visible.
                *entry = integrate((column as f32 * step).max(0.1 * step).powi(2), alpha);
            }
            // Midpoints of the cosine's square, whose uniform steps are cosine-weighted.
            for i in 0..MEAN_STEPS {
                let (column, fraction) = place(((i as f32 + 0.5) / MEAN_STEPS as f32).sqrt());
                *mean += albedo[column].lerp(albedo[column + 1], fraction) / MEAN_STEPS as f32;
            }
        }
        table
    }
}

/// The two parts of the albedo by the midpoint rule over the visible normals.
fn integrate(cosine: f32, alpha: f32) -> Vec2 {
    const SIDE: u32 = 24;
    let wo = Vec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let mut sum = Vec2::ZERO;
    for i in 0..SIDE * SIDE {
        let u = (Vec2::new((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32;
        let half = ggx::sample_vndf(wo, alpha, u);
        let cos_oh = wo.dot(half);
        let cos_i = 2.0 * cos_oh * half.z - wo.z;
        if cos_i > 0.0 {
            let grazing = (1.0 - cos_oh).max(0.0).powi(5);
            sum += Vec2::new(1.0 - grazing, grazing) * (ggx::g2(wo.z, cos_i, alpha) / ggx::g1(wo.z, alpha));
        }
    }
    sum / (SIDE * SIDE) as f32
}
