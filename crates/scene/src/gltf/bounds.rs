//! The bounding box of what is placed.

use crate::SceneParts;
use glam::Vec3;

/// An axis-aligned box, world space; empty while `min > max`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) min: Vec3,
    pub(super) max: Vec3,
}

impl Bounds {
    pub(super) const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// Of all instances: boxes of the moved boxes of their meshes.
    pub(super) fn of(parts: &SceneParts) -> Self {
        let meshes: Vec<Self> = (parts.meshes.iter())
            .map(|mesh| {
                let [min, max] = mesh.bounds();
                Self { min, max }
            })
            .collect();
        parts.instances.iter().fold(Self::EMPTY, |all, instance| {
            let local = meshes[instance.mesh as usize];
            if local.is_empty() {
                return all;
            }
            (0..8).fold(all, |all, corner| {
                let pick = |bit: usize| if corner >> bit & 1 == 0 { local.min } else { local.max };
                let corner = Vec3::new(pick(0).x, pick(1).y, pick(2).z);
                all.with(instance.world_from_local.transform_point3(corner))
            })
        })
    }

    /// Enlarged to hold `p`.
    pub(super) fn with(self, p: Vec3) -> Self {
        Self {
            min: self.min.min(p),
            max: self.max.max(p),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Centre; the origin if empty.
    pub(super) fn center(&self) -> Vec3 {
        if self.is_empty() {
            Vec3::ZERO
        } else {
            0.5 * (self.min + self.max)
        }
    }

    /// Radius of the sphere around the box; 0 if empty.
    pub(super) fn radius(&self) -> f32 {
        if self.is_empty() {
            0.0
        } else {
            0.5 * self.min.distance(self.max)
        }
    }
}
