//! What stays in its file until somebody needs it: meshes, and the texels of textures.

use crate::memory::{Droppable, Memory, OnDemand, Weigh};
use crate::{Mesh, SceneError};
use glam::Vec3;
use std::fmt;
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, OnceLock};

/// Something that may be in a file still: it is read by its first use, and again by the first use after it was dropped.
#[derive(Clone)]
struct Stored<T> {
    value: OnDemand<T>,
    /// `None` if it can be had from nowhere else.
    file: Option<Arc<InFile<T>>>,
}

/// How to get something from its file.
struct InFile<T> {
    read: Box<dyn Fn() -> Result<T, SceneError> + Send + Sync>,
    memory: Arc<Memory>,
    fault: OnceLock<SceneError>,
}

impl<T> fmt::Debug for Stored<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = match (self.value.peek(), &self.file) {
            (None, Some(_)) => "in its file",
            (Some(_), Some(_)) => "read from its file",
            (_, None) => "in memory",
        };
        f.write_str(state)
    }
}

impl<T> From<T> for Stored<T> {
    fn from(value: T) -> Self {
        Self {
            value: value.into(),
            file: None,
        }
    }
}

impl<T: Weigh + Send> Stored<T> {
    fn deferred(memory: Arc<Memory>, read: impl Fn() -> Result<T, SceneError> + Send + Sync + 'static) -> Self {
        Self {
            value: OnDemand::default(),
            file: Some(Arc::new(InFile {
                read: Box::new(read),
                memory,
                fault: OnceLock::new(),
            })),
        }
    }

    /// The value, read now if it is not there; `otherwise` if it cannot be read.
    #[inline]
    fn get(&self, otherwise: impl FnOnce() -> T + Send) -> &T {
        match self.value.get() {
            Some(value) => value,
            None => self.first_use(otherwise),
        }
    }

    #[cold]
    #[inline(never)]
    fn first_use(&self, otherwise: impl FnOnce() -> T + Send) -> &T {
        let file = self.file.as_ref().expect("what is in no file is there");
        self.value.get_or_make(&file.memory, || {
            (file.read)().unwrap_or_else(|error| {
                file.fault.get_or_init(|| error);
                otherwise()
            })
        })
    }

    fn fault(&self) -> Option<&SceneError> {
        self.file.as_ref().and_then(|file| file.fault.get())
    }

    /// For dropping it, if it can be read again.
    fn droppable(&mut self) -> Option<&mut dyn Droppable>
    where
        T: 'static,
    {
        self.file.is_some().then_some(&mut self.value as &mut dyn Droppable)
    }

    /// The value, if it can never be dropped.
    fn kept(&self) -> Option<&T> {
        self.value.peek().filter(|_| self.file.is_none())
    }

    /// The value to be changed: from now on it is in no file, unless it could not be read.
    fn get_mut(&mut self, otherwise: impl FnOnce() -> T + Send) -> &mut T {
        let bytes = self.get(otherwise).bytes();
        if let Some(file) = self.file.take_if(|file| file.fault.get().is_none()) {
            file.memory.forget(bytes);
        }
        self.value.get_mut().expect("it has just been read")
    }
}

/// A mesh of a scene. It is used like the [`Mesh`] that it stands for; one that is still in its file is read by the first use of any of its
/// streams, and only what [`StoredMesh`] itself answers is known without.
#[derive(Clone, Debug)]
pub struct StoredMesh {
    stored: Stored<Mesh>,
    /// Of one that is read when it is needed.
    outline: Option<Outline>,
}

/// What is known of a mesh that has not been read.
#[derive(Clone, Copy, Debug)]
pub struct Outline {
    /// Number of triangles. None of them emits.
    pub triangles: usize,
    /// Corners of the box around its vertices, local space: what its file claims, and what is checked when it is read.
    pub bounds: [Vec3; 2],
    /// Whether it has vertex normals.
    pub smooth: bool,
}

impl From<Mesh> for StoredMesh {
    fn from(mesh: Mesh) -> Self {
        Self {
            stored: mesh.into(),
            outline: None,
        }
    }
}

impl Default for StoredMesh {
    fn default() -> Self {
        Mesh::default().into()
    }
}

impl StoredMesh {
    /// A mesh that `read` gets from its file when it is needed, entered into `memory`. It must be valid, without emitting triangles, and as
    /// `outline` says.
    pub(crate) fn deferred(
        outline: Outline,
        memory: Arc<Memory>,
        read: impl Fn() -> Result<Mesh, SceneError> + Send + Sync + 'static,
    ) -> Self {
        Self {
            stored: Stored::deferred(memory, read),
            outline: Some(outline),
        }
    }

    /// The mesh without reading it, or what is known of it.
    fn known(&self) -> Result<&Mesh, &Outline> {
        match &self.outline {
            Some(outline) => Err(outline),
            None => Ok(self),
        }
    }

    /// Whether it came from a file that it is read from when it is needed: it may have been read meanwhile.
    pub fn is_deferred(&self) -> bool {
        self.outline.is_some()
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.known().map_or_else(|outline| outline.triangles, Mesh::len)
    }

    /// Whether the mesh has no triangle.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether no triangle has vertex normals.
    pub fn is_flat(&self) -> bool {
        self.known()
            .map_or_else(|outline| !outline.smooth, |mesh| mesh.normals.is_empty())
    }

    /// The corners of the box around all triangles, local space, the lower one first; it is the upper one if there are none. Vertices that no
    /// triangle uses do not count, unless the mesh is deferred.
    pub fn bounds(&self) -> [Vec3; 2] {
        let of_corners = |mesh: &Mesh| {
            let corners = mesh.indices.as_flattened().iter().map(|&v| mesh.positions[v as usize]);
            corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| {
                [low.min(p), high.max(p)]
            })
        };
        self.known().map_or_else(|outline| outline.bounds, of_corners)
    }

    /// Why the mesh could not be read, if so. It is empty then.
    pub fn fault(&self) -> Option<&SceneError> {
        self.stored.fault()
    }

    /// For dropping it, if it can be read again.
    pub(crate) fn droppable(&mut self) -> Option<&mut dyn Droppable> {
        self.stored.droppable()
    }

    /// The mesh, if it can never be dropped.
    pub(crate) fn kept(&self) -> Option<&Mesh> {
        self.stored.kept()
    }
}

impl Deref for StoredMesh {
    type Target = Mesh;

    #[inline]
    fn deref(&self) -> &Mesh {
        self.stored.get(Mesh::default)
    }
}

impl DerefMut for StoredMesh {
    /// Reads the mesh; what is changed in it stays.
    fn deref_mut(&mut self) -> &mut Mesh {
        let _: &Mesh = self;
        if self.fault().is_none() {
            self.outline = None;
        }
        self.stored.get_mut(Mesh::default)
    }
}

/// The texels of a texture, used like the slice that they are; those of a texture in a file are decoded by their first use.
#[derive(Clone, Debug)]
pub struct Texels {
    stored: Stored<Vec<[u8; 4]>>,
    count: usize,
}

impl From<Vec<[u8; 4]>> for Texels {
    fn from(texels: Vec<[u8; 4]>) -> Self {
        Self {
            count: texels.len(),
            stored: texels.into(),
        }
    }
}

impl Texels {
    /// As many texels as `count`, which `decode` gets from a file when they are needed, entered into `memory`.
    pub(crate) fn deferred(
        count: usize,
        memory: Arc<Memory>,
        decode: impl Fn() -> Result<Vec<[u8; 4]>, SceneError> + Send + Sync + 'static,
    ) -> Self {
        Self {
            stored: Stored::deferred(memory, decode),
            count,
        }
    }

    /// Number of texels, known without decoding.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Whether they came from a file that they are decoded from when they are needed: they may have been meanwhile.
    pub fn is_deferred(&self) -> bool {
        self.stored.file.is_some()
    }

    /// Why the texels could not be decoded, if so. All are zero then.
    pub fn fault(&self) -> Option<&SceneError> {
        self.stored.fault()
    }

    /// For dropping them, if they can be decoded again.
    pub(crate) fn droppable(&mut self) -> Option<&mut dyn Droppable> {
        self.stored.droppable()
    }

    /// The texels, if they can never be dropped.
    pub(crate) fn kept(&self) -> Option<&Vec<[u8; 4]>> {
        self.stored.kept()
    }
}

impl Deref for Texels {
    type Target = [[u8; 4]];

    #[inline]
    fn deref(&self) -> &[[u8; 4]] {
        self.stored.get(|| vec![[0; 4]; self.count])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outline() -> Outline {
        Outline {
            triangles: 1,
            bounds: [Vec3::ZERO, Vec3::ONE],
            smooth: false,
        }
    }

    #[test]
    fn a_mesh_is_read_by_its_first_use_and_not_again() {
        let reads = Arc::new(std::sync::atomic::AtomicU32::new(0));
        let count = reads.clone();
        let stored = StoredMesh::deferred(outline(), Arc::default(), move || {
            count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            Ok(Mesh {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::ONE],
                indices: vec![[0, 1, 2]],
                materials: vec![0],
                ..Mesh::default()
            })
        });
        let read = || reads.load(std::sync::atomic::Ordering::Relaxed);
        assert_eq!(
            (stored.len(), stored.is_flat(), stored.bounds()),
            (1, true, [Vec3::ZERO, Vec3::ONE])
        );
        assert_eq!(read(), 0);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| assert_eq!(stored.corners(0)[1], Vec3::X));
            }
        });
        assert_eq!(read(), 1);
        let mut changed = stored.clone();
        changed.positions[1] = Vec3::Z;
        assert_eq!((changed.corners(0)[1], stored.corners(0)[1]), (Vec3::Z, Vec3::X));
        assert!(!changed.is_deferred() && stored.is_deferred());
    }

    #[test]
    fn one_that_cannot_be_read_is_empty_and_says_why() {
        let stored = StoredMesh::deferred(outline(), Arc::default(), || {
            Err(SceneError::Write {
                path: "nowhere".into(),
                source: std::io::Error::other("no"),
            })
        });
        assert!(stored.fault().is_none());
        assert!(stored.positions.is_empty());
        assert!(stored.fault().unwrap().to_string().contains("nowhere"));
    }
}
