//! The node hierarchy, walked without recursion into placements in world space.

use super::accessor::Accessor;
use super::json::{Instancing, Node, Type, UnitQuaternion};
use super::source::Source;
use crate::{Report, SceneError};
use glam::{DAffine3, DMat4, DQuat, DVec3};

/// Deepest hierarchy that is read.
const MAX_DEPTH: u32 = 10_000;

/// A node of the scene, in world space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    /// Index of the node.
    pub(super) node: usize,
    /// Local to world.
    pub(super) world: DAffine3,
}

/// All nodes that the file's scene shows, parents before children, with their transforms.
///
/// # Errors
/// [`SceneError::Invalid`] for a cycle, a node with two parents, an index out of range, a transform that is not finite.
pub(super) fn walk(source: &Source, report: &mut Report) -> Result<Vec<Placed>, SceneError> {
    let nodes = &source.json.nodes;
    let mut parents = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        for child in children(node) {
            let place = label(source, index);
            let parent = parents
                .get_mut(child)
                .ok_or_else(|| source.no_such(&place, "child node", child, nodes.len()))?;
            if let Some(other) = parent.replace(index) {
                return Err(source.invalid(
                    label(source, child),
                    format!("is a child of two nodes, {} and {place}", label(source, other)),
                    "copy the node so that each has one parent",
                ));
            }
        }
    }
    refuse_cycles(source, &parents)?;

    let mut placed = Vec::new();
    let mut shown = vec![false; nodes.len()];
    let mut stack: Vec<(usize, DAffine3, u32)> = Vec::new();
    for root in roots(source, &parents, report)? {
        stack.push((root, DAffine3::IDENTITY, 0));
        while let Some((index, parent, depth)) = stack.pop() {
            if std::mem::replace(&mut shown[index], true) {
                return Err(source.invalid(
                    label(source, index),
                    "is shown twice: the scene lists it, and its parent or itself again",
                    "list root nodes only, each once",
                ));
            }
            if depth > MAX_DEPTH {
                return Err(source.invalid(
                    label(source, index),
                    format!("lies more than {MAX_DEPTH} levels deep"),
                    "flatten the hierarchy",
                ));
            }
            let world = parent * local(source, index, report)?;
            if !world.is_finite() {
                return Err(not_finite(source, index));
            }
            placed.push(Placed { node: index, world });
            stack.extend(children(&nodes[index]).rev().map(|child| (child, world, depth + 1)));
        }
    }
    Ok(placed)
}

/// Moves nodes that stand together far from zero there, while everything is in `f64`: vertices would lose their digits. Returns where
/// zero was.
pub(super) fn recentre(source: &Source, placed: &mut [Placed]) -> DVec3 {
    // Metres: below it, steps of `f32` are a tenth of a millimetre.
    const FAR: f64 = 1024.0;
    const FAR_FOR_ITS_SIZE: f64 = 16.0;
    let has_mesh = |node: &&Placed| source.json.nodes[node.node].mesh.is_some();
    let places = || placed.iter().filter(has_mesh).map(|node| node.world.translation);
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (least, most) = places().fold(none, |(least, most), at| (least.min(at), most.max(at)));
    let (center, size) = (0.5 * (least + most), (most - least).length());
    if !center.is_finite() || center.length() < FAR.max(FAR_FOR_ITS_SIZE * size) {
        return DVec3::ZERO;
    }
    placed.iter_mut().for_each(|node| node.world.translation -= center);
    center
}

fn children(node: &Node) -> impl DoubleEndedIterator<Item = usize> {
    node.children.iter().flatten().map(|child| child.value())
}

/// How messages and origins call a node.
pub(super) fn label(source: &Source, index: usize) -> String {
    match source.json.nodes.get(index).and_then(|node| node.name.as_deref()) {
        Some(name) => format!("node {index} '{name}'"),
        None => format!("node {index}"),
    }
}

/// Placements of a node's mesh under `EXT_mesh_gpu_instancing`, relative to the node.
pub(super) fn instancing(source: &Source, index: usize, json: &Instancing) -> Result<Vec<DAffine3>, SceneError> {
    let open = |name: &str, shape: Type| {
        let attribute = json.attributes.get(name);
        let what = format!("{} {name}", label(source, index));
        attribute
            .map(|&accessor| Accessor::open(source, accessor, &what, &[shape]))
            .transpose()
    };
    let streams = [
        open("TRANSLATION", Type::Vec3)?,
        open("ROTATION", Type::Vec4)?,
        open("SCALE", Type::Vec3)?,
    ];
    let mut counts = streams.iter().flatten().map(Accessor::len);
    let Some(count) = counts.next() else {
        return Ok(vec![DAffine3::IDENTITY]);
    };
    if counts.any(|other| other != count) {
        return Err(source.invalid(
            label(source, index),
            "EXT_mesh_gpu_instancing attributes differ in length",
            "export the file again",
        ));
    }
    let [translation, rotation, scale] = &streams;
    (0..count)
        .map(|i| {
            let node = Node {
                translation: translation.as_ref().map(|a| first3(a.floats(i))),
                rotation: rotation.as_ref().map(|a| UnitQuaternion(a.floats(i))),
                scale: scale.as_ref().map(|a| first3(a.floats(i))),
                ..Node::default()
            };
            let (affine, _) = compose(&node);
            if affine.is_finite() {
                Ok(affine)
            } else {
                Err(not_finite(source, index))
            }
        })
        .collect()
}

fn first3(v: [f32; 4]) -> [f32; 3] {
    [v[0], v[1], v[2]]
}

/// With at most one parent each, a node lies on or below a cycle exactly if no root is reached by going up.
fn refuse_cycles(source: &Source, parents: &[Option<usize>]) -> Result<(), SceneError> {
    /// Marks: not seen, on the way up from the present start, known to end at a root.
    const NEW: u32 = 0;
    const FINE: u32 = u32::MAX;
    let mut mark = vec![NEW; parents.len()];
    for start in 0..parents.len() {
        let walk = start as u32 + 1;
        let mut at = Some(start);
        while let Some(node) = at.filter(|&node| mark[node] != FINE) {
            if mark[node] == walk {
                return Err(source.invalid(
                    label(source, node),
                    "is its own ancestor: the node graph has a cycle",
                    "remove one of the child links",
                ));
            }
            mark[node] = walk;
            at = parents[node];
        }
        let mut at = Some(start);
        while let Some(node) = at.filter(|&node| mark[node] != FINE) {
            mark[node] = FINE;
            at = parents[node];
        }
    }
    Ok(())
}

/// The root nodes to show: of the default scene, else of the first, else all nodes without a parent.
fn roots(source: &Source, parents: &[Option<usize>], report: &mut Report) -> Result<Vec<usize>, SceneError> {
    let json = &source.json;
    let index = match json.scene.map(|scene| scene.value()) {
        Some(index) if index < json.scenes.len() => index,
        Some(index) => return Err(source.no_such("scene", "scene", index, json.scenes.len())),
        None if json.scenes.is_empty() => {
            if !parents.is_empty() {
                report.warn("the file has nodes but no scene: all nodes are shown");
            }
            return Ok((0..parents.len()).filter(|&node| parents[node].is_none()).collect());
        }
        None => 0,
    };
    for _ in 1..json.scenes.len() {
        report.ignore("scenes other than the default one");
    }
    let roots: Vec<usize> = json.scenes[index].nodes.iter().map(|node| node.value()).collect();
    match roots.iter().find(|&&node| node >= parents.len()) {
        Some(&node) => Err(source.no_such(format!("scene {index}"), "node", node, parents.len())),
        None => Ok(roots),
    }
}

fn local(source: &Source, index: usize, report: &mut Report) -> Result<DAffine3, SceneError> {
    let (affine, note) = compose(&source.json.nodes[index]);
    if let Some(note) = note {
        report.warn(format!("{}: {note}", label(source, index)));
    }
    if affine.is_finite() {
        Ok(affine)
    } else {
        Err(not_finite(source, index))
    }
}

fn not_finite(source: &Source, index: usize) -> SceneError {
    source.invalid(
        label(source, index),
        "its transform is not finite",
        "correct the matrix, or translation, rotation and scale",
    )
}

/// The local transform of a node, and what had to be repaired.
fn compose(node: &Node) -> (DAffine3, Option<&'static str>) {
    if let Some(matrix) = node.matrix {
        let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
        let affine_row = matrix.row(3) == glam::DVec4::W;
        let note = (!affine_row).then_some("the last row of its matrix is not 0 0 0 1, taken as if it were");
        return (DAffine3::from_mat4(matrix), note);
    }
    let vector = |v: Option<[f32; 3]>, otherwise: DVec3| v.map_or(otherwise, |v| DVec3::from_array(v.map(f64::from)));
    let (rotation, note) = match node.rotation {
        None => (DQuat::IDENTITY, None),
        Some(UnitQuaternion(q)) => {
            let q = DQuat::from_array(q.map(f64::from));
            match q.length_squared() {
                0.0 => (
                    DQuat::IDENTITY,
                    Some("its rotation is a zero quaternion, taken as none"),
                ),
                // Quantised and rounded quaternions are common; glTF asks for unit ones.
                _ => (q * q.length_recip(), None),
            }
        }
    };
    let affine = DAffine3::from_scale_rotation_translation(
        vector(node.scale, DVec3::ONE),
        rotation,
        vector(node.translation, DVec3::ZERO),
    );
    (affine, note)
}
