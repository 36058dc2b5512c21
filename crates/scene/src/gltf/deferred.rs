//! Meshes of large files, left there until a ray comes near them.

use super::geometry::{self, Budget, MAX_COORDINATE};
use super::json::{Accessor, Checked, ComponentType, Mode, Primitive, Semantic, Type};
use super::materials::Needs;
use super::source::Source;
use crate::stored::Outline;
use crate::{Memory, Mesh, Report, SceneError, StoredMesh};
use glam::Vec3;
use serde_json::Value;
use std::sync::Arc;

/// Meshes of fewer triangles are read with the others. Higher values keep more in memory; lower values make more trees and more reads.
const LEAST_TRIANGLES: usize = 1_000;

/// Share of the largest coordinate by which a claimed box is widened: exporters round what they write in decimals.
const MARGIN: f32 = 1e-5;

/// The mesh `index` to be read later, if it can be: triangles that do not emit, whose number and box the file tells. What it
/// holds counts against `budget` now. `None` means that it is to be read like any other, errors included.
pub(super) fn mesh(
    source: &Arc<Source>,
    index: usize,
    needs: &Arc<[Needs]>,
    emits: impl Fn(usize) -> bool,
    budget: &mut Budget,
    memory: &Arc<Memory>,
) -> Result<Option<StoredMesh>, SceneError> {
    let json = &source.json.meshes[index];
    let outlines = json.primitives.iter().map(|primitive| {
        let material = primitive.material.map_or(needs.len() - 1, |material| material.value());
        (!emits(material)).then(|| outline(source, primitive)).flatten()
    });
    let Some(outlines) = outlines.collect::<Option<Vec<Outline>>>() else {
        return Ok(None);
    };
    let triangles: usize = outlines.iter().map(|outline| outline.triangles).sum();
    if triangles < LEAST_TRIANGLES {
        return Ok(None);
    }
    let place = format!("mesh {index} '{}'", geometry::mesh_name(index, json));
    budget.take(source, &place, 3 * triangles as u64)?;
    let all = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let [low, high] = outlines.iter().fold(all, |[low, high], outline| {
        [low.min(outline.bounds[0]), high.max(outline.bounds[1])]
    });
    let margin = Vec3::splat(MARGIN * low.abs().max(high.abs()).max_element());
    let outline = Outline {
        triangles,
        bounds: [low - margin, high + margin],
        smooth: outlines.iter().any(|outline| outline.smooth),
    };
    let (source, needs) = (source.clone(), needs.clone());
    Ok(Some(StoredMesh::deferred(outline, memory.clone(), move || {
        read(&source, index, &needs, &place, &outline)
    })))
}

/// What the file tells of a primitive, if that is enough.
fn outline(source: &Source, primitive: &Primitive) -> Option<Outline> {
    let accessors = &source.json.accessors;
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic));
    let indices: &Accessor = accessors.get(primitive.indices?.value())?;
    let positions: &Accessor = accessors.get(attribute(Semantic::Positions)?.value())?;
    let corners = usize::try_from(indices.count.0).ok()?;
    let floats = matches!(positions.component_type, Checked::Valid(kind) if kind.0 == ComponentType::F32);
    let plain = primitive.mode == Checked::Valid(Mode::Triangles)
        && positions.type_ == Checked::Valid(Type::Vec3)
        && floats
        && positions.sparse.is_none();
    (plain && corners > 0 && corners.is_multiple_of(3)).then_some(())?;
    let bounds = [corner(positions.min.as_ref()?)?, corner(positions.max.as_ref()?)?];
    bounds[0].cmple(bounds[1]).all().then(|| Outline {
        triangles: corners / 3,
        bounds,
        smooth: attribute(Semantic::Normals).is_some(),
    })
}

/// Three numbers in range.
fn corner(value: &Value) -> Option<Vec3> {
    let numbers: Option<Vec<f32>> = value.as_array()?.iter().map(|n| Some(n.as_f64()? as f32)).collect();
    let corner = Vec3::from_array(numbers?.try_into().ok()?);
    (corner.abs().max_element() <= MAX_COORDINATE && corner.is_finite()).then_some(corner)
}

/// Reads it, and checks that it is what the scene was built for.
fn read(source: &Source, index: usize, needs: &[Needs], place: &str, outline: &Outline) -> Result<Mesh, SceneError> {
    source.check_unchanged()?;
    let mut budget = Budget::new(source.bytes);
    let mut mesh = geometry::read_mesh(source, index, needs, &mut budget, &mut Report::default())?;
    let [low, high] = outline.bounds;
    let inside = |p: &Vec3| low.cmple(*p).all() && p.cmple(high).all();
    if let Some(outside) = mesh.positions.iter().find(|p| !inside(p)) {
        return Err(source.invalid(
            place,
            format!("has a vertex at {outside}, outside of the box that its POSITION accessor claims (min, max)"),
            "correct min and max, or export the file again",
        ));
    }
    if mesh.len() != outline.triangles {
        let problem = format!("has {} triangles instead of {}", mesh.len(), outline.triangles);
        return Err(source.invalid(place, problem, "the file is damaged: export it again"));
    }
    crate::validate::repair_mesh(&mut mesh, &mut Report::default());
    Ok(mesh)
}
