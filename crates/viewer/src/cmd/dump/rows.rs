//! A row per light.

use super::write::{Columns, Row};
use anyhow::Result;
use light_cache::LightRecord;
use scene::{LightKind, Scene};
use serde::Serialize;
use std::io::Write;

/// One light. Field names are column names, in this order.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct LightRow {
    /// Index of the light.
    pub(super) light: u64,
    /// Name that a person recognises.
    pub(super) name: String,
    /// Triangle, point, spot or directional.
    pub(super) kind: LightKind,
    /// Centre; empty for directional lights, which have no place.
    pub(super) x_m: Option<f32>,
    /// See `x_m`.
    pub(super) y_m: Option<f32>,
    /// See `x_m`.
    pub(super) z_m: Option<f32>,
    /// Area, 0 for point lights.
    pub(super) area_m2: f32,
    /// Emitted power.
    pub(super) power_w: f32,
    /// See [`LightRecord`], also for the following ones.
    pub(super) max_contribution: f64,
    /// Share of the image's mean luminance.
    pub(super) mean_contribution: f64,
    /// Empty if never observed.
    pub(super) visible_fraction: Option<f64>,
    /// Times drawn.
    pub(super) samples: u64,
    /// Probability now.
    pub(super) probability: f64,
    /// Probability guaranteed.
    pub(super) min_probability: f64,
    /// Name of the node in the file.
    pub(super) node: String,
    /// Name of the mesh or punctual light.
    pub(super) mesh: String,
    /// Name of the material.
    pub(super) material: String,
    /// Triangle within its primitive.
    pub(super) triangle: u64,
}

impl Row for LightRow {
    const HEADER: &'static [&'static str] = &[
        "light",
        "name",
        "kind",
        "x_m",
        "y_m",
        "z_m",
        "area_m2",
        "power_w",
        "max_contribution",
        "mean_contribution",
        "visible_fraction",
        "samples",
        "probability",
        "min_probability",
        "node",
        "mesh",
        "material",
        "triangle",
    ];

    const SCHEMA: &'static str = "message lights {
        required int64 light;
        required binary name (UTF8);
        required binary kind (UTF8);
        optional float x_m;
        optional float y_m;
        optional float z_m;
        required float area_m2;
        required float power_w;
        required double max_contribution;
        required double mean_contribution;
        optional double visible_fraction;
        required int64 samples;
        required double probability;
        required double min_probability;
        required binary node (UTF8);
        required binary mesh (UTF8);
        required binary material (UTF8);
        required int64 triangle;
    }";

    fn columns<W: Write + Send>(columns: &mut Columns<'_, '_, W, Self>) -> Result<()> {
        columns.integers(|row| row.light)?;
        columns.texts(|row| &row.name)?;
        columns.texts(|row| kind_name(row.kind))?;
        columns.floats(|row| row.x_m, false)?;
        columns.floats(|row| row.y_m, false)?;
        columns.floats(|row| row.z_m, false)?;
        columns.floats(|row| Some(row.area_m2), true)?;
        columns.floats(|row| Some(row.power_w), true)?;
        columns.doubles(|row| Some(row.max_contribution), true)?;
        columns.doubles(|row| Some(row.mean_contribution), true)?;
        columns.doubles(|row| row.visible_fraction, false)?;
        columns.integers(|row| row.samples)?;
        columns.doubles(|row| Some(row.probability), true)?;
        columns.doubles(|row| Some(row.min_probability), true)?;
        columns.texts(|row| &row.node)?;
        columns.texts(|row| &row.mesh)?;
        columns.texts(|row| &row.material)?;
        columns.integers(|row| row.triangle)
    }
}

/// Joins the lights with what is known about them: all in their order, or the `top` most probable ones.
pub(super) fn collect(scene: &Scene, records: &[LightRecord], top: Option<usize>) -> Vec<LightRow> {
    let mut order: Vec<usize> = (0..scene.lights.len().min(records.len())).collect();
    if let Some(top) = top {
        order.sort_by(|&a, &b| records[b].probability.total_cmp(&records[a].probability));
        order.truncate(top);
    }
    order
        .into_iter()
        .map(|index| row(scene, index, &records[index]))
        .collect()
}

fn row(scene: &Scene, index: usize, record: &LightRecord) -> LightRow {
    let light = &scene.lights[index];
    let source = scene.light_source(index as u32);
    let place = (light.kind != LightKind::Directional).then(|| scene.parts.in_file(light.center_ws()).as_vec3());
    let named = [&source.node, &source.mesh, &source.material]
        .into_iter()
        .find(|name| !name.is_empty());
    LightRow {
        light: index as u64,
        name: named.cloned().unwrap_or_else(|| format!("light {index}")),
        kind: light.kind,
        x_m: place.map(|p| p.x),
        y_m: place.map(|p| p.y),
        z_m: place.map(|p| p.z),
        area_m2: light.area,
        power_w: light.power,
        max_contribution: record.max_contribution,
        mean_contribution: record.mean_contribution,
        visible_fraction: record.visible_fraction.is_finite().then_some(record.visible_fraction),
        samples: record.samples,
        probability: record.probability,
        min_probability: record.min_probability,
        node: source.node,
        mesh: source.mesh,
        material: source.material,
        triangle: source.triangle.into(),
    }
}

/// The name of a kind, as serde writes it.
fn kind_name(kind: LightKind) -> &'static str {
    match kind {
        LightKind::Triangle => "triangle",
        LightKind::Point => "point",
        LightKind::Spot => "spot",
        LightKind::Directional => "directional",
    }
}
