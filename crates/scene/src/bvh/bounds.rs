//! Axis-aligned boxes.

use crate::StoredMesh;
use glam::{Affine3A, Vec3};

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Smallest corner.
    pub(super) min: Vec3,
    /// Largest corner.
    pub(super) max: Vec3,
}

impl Bounds {
    /// Contains nothing.
    pub(super) const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// The box around three points.
    pub(super) fn of_triangle([a, b, c]: [Vec3; 3]) -> Self {
        Self {
            min: a.min(b).min(c),
            max: a.max(b).max(c),
        }
    }

    /// [`StoredMesh::bounds`].
    pub(super) fn of_mesh(mesh: &StoredMesh) -> Self {
        let [min, max] = mesh.bounds();
        Self { min, max }
    }

    /// Whether nothing is inside.
    pub(super) fn is_empty(&self) -> bool {
        self.min.x > self.max.x
    }

    /// The box around both.
    pub(super) fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// The box around the image of this box, with a margin for the rounding of the transform.
    pub(super) fn transformed(self, transform: &Affine3A) -> Self {
        let mut result = Self::EMPTY;
        for corner in 0..8 {
            let pick = |axis: usize| {
                if corner >> axis & 1 == 0 {
                    self.min[axis]
                } else {
                    self.max[axis]
                }
            };
            let p = transform.transform_point3(Vec3::new(pick(0), pick(1), pick(2)));
            result = result.union(Self { min: p, max: p });
        }
        let margin = Vec3::splat(result.min.abs().max(result.max.abs()).max_element() * 4e-6);
        Self {
            min: result.min - margin,
            max: result.max + margin,
        }
    }
}
