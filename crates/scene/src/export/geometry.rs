//! Meshes, cut into primitives.

use super::document::{Accessor, Attributes, BufferView, MeshEntry, Node, Primitive};
use crate::{Instance, Mesh, SceneParts};
use glam::{Affine3A, Vec2, Vec3, Vec4};

/// Above this many origins a mesh is written as one node per material: viewers choke on more nodes.
const MAX_NODES: usize = 50_000;

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The buffer's streams, each of which becomes one buffer view, and the accessors into them.
#[derive(Default)]
pub(super) struct Geometry<'a> {
    nodes: Vec<Node<'a>>,
    meshes: Vec<MeshEntry<'a>>,
    accessors: Vec<Accessor>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    tangents: Vec<Vec4>,
    colors: Vec<Vec4>,
    indices: Vec<u32>,
}

/// What goes into the file.
pub(super) struct Packed<'a> {
    pub(super) nodes: Vec<Node<'a>>,
    pub(super) meshes: Vec<MeshEntry<'a>>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) views: Vec<BufferView>,
    pub(super) buffer: Vec<u8>,
}

/// Which buffer view a stream is.
#[derive(Clone, Copy)]
enum Stream {
    Positions,
    Normals,
    Uvs,
    Tangents,
    Colors,
    Indices,
}

/// What a primitive has in common: origin (0 where they are merged), material, whether its normals are interpolated.
type Group = (u32, u32, bool);

impl<'a> Geometry<'a> {
    /// Cuts all meshes. One that is placed once and knows where its triangles come from becomes a node for each origin;
    /// one that is placed several times becomes one mesh shared by its nodes.
    pub(super) fn collect(parts: &'a SceneParts) -> Self {
        let mut out = Self::default();
        let mut placements: Vec<Vec<&Instance>> = vec![Vec::new(); parts.meshes.len()];
        for instance in &parts.instances {
            placements[instance.mesh as usize].push(instance);
        }
        for (mesh, instances) in parts.meshes.iter().zip(&placements) {
            match instances.as_slice() {
                _ if mesh.is_empty() => {}
                [instance] if !mesh.origins.is_empty() => out.explode(parts, mesh, instance),
                _ => out.share(parts, mesh, instances),
            }
        }
        out
    }

    fn explode(&mut self, parts: &'a SceneParts, mesh: &'a Mesh, instance: &Instance) {
        let mut origins: Vec<u32> = mesh.origins.clone();
        origins.sort_unstable();
        origins.dedup();
        let merge = origins.len() > MAX_NODES;
        let groups = grouped(mesh, |i| if merge { mesh.materials[i] } else { mesh.origins[i] });
        let mut vertices = VertexMap::new(mesh.positions.len());
        for primitives in groups.chunk_by(|a, b| a.0.0 == b.0.0) {
            let at = primitives[0].0.0 as usize;
            let (node, name) = if merge {
                (parts.materials[at].name.as_str(), "")
            } else {
                (parts.origins[at].0.as_str(), parts.origins[at].1.as_str())
            };
            self.mesh(mesh, name, primitives, &mut vertices);
            self.node(node, instance);
        }
    }

    fn share(&mut self, parts: &'a SceneParts, mesh: &'a Mesh, instances: &[&Instance]) {
        if instances.is_empty() {
            return;
        }
        self.mesh(
            mesh,
            &mesh.name,
            &grouped(mesh, |_| 0),
            &mut VertexMap::new(mesh.positions.len()),
        );
        for instance in instances {
            let name = parts
                .origins
                .get(instance.origin as usize)
                .map_or("", |origin| &origin.0);
            self.node(name, instance);
        }
    }

    /// A node that shows the last mesh.
    fn node(&mut self, name: &'a str, instance: &Instance) {
        let matrix = glam::Mat4::from(instance.world_from_local).to_cols_array();
        self.nodes.push(Node {
            name,
            mesh: Some(self.meshes.len() as u32 - 1),
            matrix: (instance.world_from_local != Affine3A::IDENTITY).then(|| Box::new(matrix)),
            ..Node::default()
        });
    }

    fn mesh(&mut self, mesh: &Mesh, name: &'a str, groups: &[(Group, Vec<u32>)], vertices: &mut VertexMap) {
        let primitives = groups
            .iter()
            .map(|((_, material, smooth), triangles)| self.primitive(mesh, *material, *smooth, triangles, vertices))
            .collect();
        self.meshes.push(MeshEntry { name, primitives });
    }

    fn primitive(
        &mut self,
        mesh: &Mesh,
        material: u32,
        smooth: bool,
        triangles: &[u32],
        map: &mut VertexMap,
    ) -> Primitive {
        let first_index = self.indices.len();
        let corners = triangles.iter().flat_map(|&i| mesh.indices[i as usize]);
        map.renumber(corners, &mut self.indices);
        let used = &map.old_from_new;
        let count = used.len();
        fn gather<T: Copy>(used: &[u32], from: &[T], to: &mut Vec<T>) -> Option<usize> {
            let start = to.len();
            (!from.is_empty()).then(|| to.extend(used.iter().map(|&v| from[v as usize])))?;
            Some(start)
        }
        let first = self.positions.len();
        gather(used, &mesh.positions, &mut self.positions);
        let normals = smooth.then(|| gather(used, &mesh.normals, &mut self.normals)).flatten();
        let uv = gather(used, &mesh.uvs, &mut self.uvs);
        let uv1 = gather(used, &mesh.uvs1, &mut self.uvs);
        let tangents = gather(used, &mesh.tangents, &mut self.tangents);
        let colors = gather(used, &mesh.colors, &mut self.colors);

        let (low, high) = self.positions[first..]
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| {
                (low.min(p), high.max(p))
            });
        let position = self.accessor(Stream::Positions, first, count);
        let bounded = &mut self.accessors[position as usize];
        bounded.min = Some(low.to_array());
        bounded.max = Some(high.to_array());
        let mut vertex = |stream, start: Option<usize>| start.map(|start| self.accessor(stream, start, count));
        let attributes = Attributes {
            position,
            normal: vertex(Stream::Normals, normals),
            uv: vertex(Stream::Uvs, uv),
            uv1: vertex(Stream::Uvs, uv1),
            tangent: vertex(Stream::Tangents, tangents),
            color: vertex(Stream::Colors, colors),
        };
        let indices = self.accessor(Stream::Indices, first_index, self.indices.len() - first_index);
        Primitive {
            attributes,
            indices,
            material,
        }
    }

    fn accessor(&mut self, stream: Stream, start: usize, count: usize) -> u32 {
        let (size, component_type, shape) = match stream {
            Stream::Positions | Stream::Normals => (12, FLOAT, "VEC3"),
            Stream::Uvs => (8, FLOAT, "VEC2"),
            Stream::Tangents | Stream::Colors => (16, FLOAT, "VEC4"),
            Stream::Indices => (4, UNSIGNED_INT, "SCALAR"),
        };
        self.accessors.push(Accessor {
            buffer_view: stream as u32,
            byte_offset: (start * size) as u64,
            component_type,
            count: count as u64,
            shape,
            min: None,
            max: None,
        });
        self.accessors.len() as u32 - 1
    }

    /// The bytes of the streams in the order of their buffer views; empty ones are dropped and the accessors follow.
    pub(super) fn into_buffer(mut self) -> Packed<'a> {
        use bytemuck::cast_slice;
        let streams: [(&[u8], u32); 6] = [
            (cast_slice(&self.positions), 12),
            (cast_slice(&self.normals), 12),
            (cast_slice(&self.uvs), 8),
            (cast_slice(&self.tangents), 16),
            (cast_slice(&self.colors), 16),
            (cast_slice(&self.indices), 0),
        ];
        let mut buffer = Vec::with_capacity(streams.iter().map(|(bytes, _)| bytes.len()).sum());
        let mut views = Vec::new();
        let mut view_of_stream = [0; 6];
        for (stream, (bytes, stride)) in streams.into_iter().enumerate() {
            if bytes.is_empty() {
                continue;
            }
            view_of_stream[stream] = views.len() as u32;
            views.push(BufferView {
                buffer: 0,
                byte_offset: buffer.len() as u64,
                byte_length: bytes.len() as u64,
                // Accessors that share a view of vertices must say the stride, even where it is the natural one.
                byte_stride: (stride > 0).then_some(stride),
                target: Some(if stride > 0 { ARRAY_BUFFER } else { ELEMENT_ARRAY_BUFFER }),
            });
            buffer.extend_from_slice(bytes);
        }
        for accessor in &mut self.accessors {
            accessor.buffer_view = view_of_stream[accessor.buffer_view as usize];
        }
        Packed {
            nodes: self.nodes,
            meshes: self.meshes,
            accessors: self.accessors,
            views,
            buffer,
        }
    }
}

/// The triangles of `mesh` by (`part`, material, smooth), each group in the order of the mesh.
fn grouped(mesh: &Mesh, part: impl Fn(usize) -> u32) -> Vec<(Group, Vec<u32>)> {
    let key = |i: u32| {
        let at = i as usize;
        let smooth =
            !mesh.normals.is_empty() && mesh.indices[at].iter().all(|&v| mesh.normals[v as usize] != Vec3::ZERO);
        (part(at), mesh.materials[at], smooth)
    };
    let mut order: Vec<u32> = (0..mesh.len() as u32).collect();
    order.sort_by_key(|&i| key(i));
    order
        .chunk_by(|&a, &b| key(a) == key(b))
        .map(|run| (key(run[0]), run.to_vec()))
        .collect()
}

/// Renumbers the vertices of one primitive after another.
struct VertexMap {
    new_from_old: Vec<u32>,
    old_from_new: Vec<u32>,
}

impl VertexMap {
    const UNUSED: u32 = u32::MAX;

    /// For a mesh of this many vertices.
    fn new(vertices: usize) -> Self {
        Self {
            new_from_old: vec![Self::UNUSED; vertices],
            old_from_new: Vec::new(),
        }
    }

    /// Appends the new numbers of `corners` to `indices`; `old_from_new` then tells the vertices.
    fn renumber(&mut self, corners: impl Iterator<Item = u32>, indices: &mut Vec<u32>) {
        for &old in &self.old_from_new {
            self.new_from_old[old as usize] = Self::UNUSED;
        }
        self.old_from_new.clear();
        for old in corners {
            let new = &mut self.new_from_old[old as usize];
            if *new == Self::UNUSED {
                *new = self.old_from_new.len() as u32;
                self.old_from_new.push(old);
            }
            indices.push(*new);
        }
    }
}
