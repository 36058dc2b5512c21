//! A surface that light samples are weighed at.

use super::Tree;
use super::layer::Seen;
use super::reservoir::{LightSample, Reservoir};
use crate::direct::{Connection, Vertex};
use crate::path::{FrameView, TileLog};
use glam::{Vec2, Vec3};
use light_cache::LightSampler;
use sampling::unit_f32;
use scene::{Ray, Surface, luminance};

/// Surfaces whose normals have less than this cosine share nothing: 25 degrees (Bitterli et al. 2020). Higher values share less,
/// lower values share what is of less use.
const LEAST_COSINE: f32 = 0.906;
/// Surfaces whose distances from the eye differ by more than this share of one share nothing (likewise).
const MOST_DEPTH_DIFFERENCE: f32 = 0.1;

/// The surface that a pixel sees, or has seen in the frame before.
pub(super) struct Site<'f> {
    pub(super) view: &'f FrameView<'f, Tree>,
    pub(super) surface: Surface,
    wo_ws: Vec3,
    /// From the eye that sees it, metres.
    distance: f32,
}

impl<'f> Site<'f> {
    /// What was seen from `eye_ws`.
    #[inline]
    pub(super) fn new(view: &'f FrameView<'f, Tree>, eye_ws: Vec3, seen: &Seen) -> Self {
        let ray = Ray {
            origin_ws: eye_ws,
            direction_ws: -seen.wo_ws,
            t_max: f32::INFINITY,
        };
        Self {
            view,
            surface: view.scene.surface(&ray, &seen.hit),
            wo_ws: seen.wo_ws,
            distance: seen.hit.t,
        }
    }

    /// The first vertex of a path.
    #[inline]
    pub(super) fn vertex(&self) -> Vertex<'_> {
        Vertex::of_path(self.view, &self.surface, self.wo_ws, Vec3::ONE, 0).0
    }

    /// Whether this surface, `distance` away from the eye that sees `other`, is enough like it to be worth sharing. Asks for nothing
    /// that depends on which lights were drawn, or the mean would not be right.
    #[inline]
    pub(super) fn is_like(&self, distance: f32, other: &Self) -> bool {
        let cosine = self.surface.bsdf.normal_ws.dot(other.surface.bsdf.normal_ws);
        cosine >= LEAST_COSINE && (distance - other.distance).abs() <= MOST_DEPTH_DIFFERENCE * distance
    }

    /// [`Site::is_like`] for surfaces that the same eye sees.
    #[inline]
    pub(super) fn is_beside(&self, other: &Self) -> bool {
        self.is_like(self.distance, other)
    }

    /// Joins the surface with a sample whose light the tree draws here with probability `pmf`; `None` if no light can arrive.
    #[inline]
    pub(super) fn connect(&self, vertex: &Vertex<'_>, sample: LightSample, pmf: f32) -> Option<Connection> {
        let on_light = Vec2::from(sample.point.map(unit_f32));
        let tried = pmf * vertex.candidates as f32;
        Connection::new(self.view.scene, vertex, sample.light, tried, on_light)
    }

    /// What a sample brings to the surface if it is visible, of which the target is the luminance.
    #[inline]
    pub(super) fn unshadowed(&self, vertex: &Vertex<'_>, sample: LightSample) -> Option<(Connection, Vec3)> {
        // The probability counts in weights only.
        let pmf = if vertex.shared.is_some() {
            let tree = &self.view.direct.0;
            tree.pmf(&tree.local(self.view.scene, &vertex.point), sample.light)
        } else {
            1.0
        };
        let connection = self.connect(vertex, sample, pmf)?;
        let radiance = connection.contribution(1.0);
        Some((connection, radiance))
    }

    /// What the sample of another surface brings to this one.
    #[inline]
    pub(super) fn look(&self, sample: LightSample, log: &mut TileLog<'_>) -> Vec3 {
        let vertex = self.vertex();
        match self.unshadowed(&vertex, sample) {
            Some((connection, radiance)) if connection.is_visible(self.view.scene, &vertex, log, &mut ()) => radiance,
            _ => Vec3::ZERO,
        }
    }

    /// What the sample of this surface's own reservoir brings, of which it is known that it is visible.
    #[inline]
    pub(super) fn recall(&self, reservoir: &Reservoir) -> Vec3 {
        if reservoir.weight == 0.0 {
            return Vec3::ZERO;
        }
        let found = self.unshadowed(&self.vertex(), reservoir.sample);
        found.map_or(Vec3::ZERO, |(_, radiance)| radiance)
    }
}

/// The target of a sample that brings `radiance`.
#[inline]
pub(super) fn target(radiance: Vec3) -> f32 {
    luminance(radiance)
}
