//! Typed arrays in buffers. Every range is checked when an accessor is opened, so that reading cannot fail.

use super::source::Source;
use crate::SceneError;

/// Elements that an accessor without any bytes (all zeros) may claim in a small file.
const FREE_ZEROS: u64 = 1 << 16;

/// Type of one component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn from_gl(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// Elements at equal distances in bytes that are known to be there.
#[derive(Clone, Copy, Debug)]
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl Strided<'_> {
    fn at<const N: usize>(&self, element: usize, offset: usize) -> [u8; N] {
        let start = element * self.stride + offset;
        self.bytes[start..start + N].try_into().expect("N bytes")
    }

    fn unsigned(&self, element: usize, component: Component) -> u32 {
        match component {
            Component::U8 | Component::I8 => u32::from(self.at::<1>(element, 0)[0]),
            Component::U16 | Component::I16 => u32::from(u16::from_le_bytes(self.at(element, 0))),
            Component::U32 | Component::F32 => u32::from_le_bytes(self.at(element, 0)),
        }
    }
}

/// An accessor whose bytes are all there.
#[derive(Debug)]
pub(super) struct Accessor<'a> {
    count: usize,
    width: usize,
    component: Component,
    normalized: bool,
    /// `None`: zeros.
    dense: Option<Strided<'a>>,
    /// Strictly increasing element numbers, and their values.
    sparse: Option<(Vec<u32>, Strided<'a>)>,
}

impl<'a> Accessor<'a> {
    /// Opens accessor `index`, wanted as `what` (for messages) in one of the `shapes` ("VEC3").
    ///
    /// # Errors
    /// [`SceneError::Invalid`] if it does not exist, has another shape, or claims more than its buffers hold.
    pub(super) fn open(source: &'a Source, index: usize, what: &str, shapes: &[&str]) -> Result<Self, SceneError> {
        let all = &source.json.accessors;
        let json = all
            .get(index)
            .ok_or_else(|| source.no_such(what, "accessor", index, all.len()))?;
        let place = format!("accessor {index} ({what})");
        let bad = |problem: String| source.invalid(&place, problem, "the file is damaged: export it again");
        if !shapes.contains(&json.shape.as_str()) {
            return Err(bad(format!("type '{}' instead of {}", json.shape, shapes.join(" or "))));
        }
        let width = match json.shape.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let component = Component::from_gl(json.component_type)
            .ok_or_else(|| bad(format!("componentType {} is unknown", json.component_type)))?;
        let element = component.size() * width;
        if json.count > u64::from(u32::MAX) {
            return Err(bad(format!("claims {} elements", json.count)));
        }
        let strided = |view: usize, offset: u64, count: u64, element: u64| -> Result<Strided<'a>, SceneError> {
            let bytes = source.view(view, &place)?;
            // `view` has found it, so it is there.
            let stride = source.json.buffer_views[view].byte_stride.unwrap_or(element);
            if stride < element {
                return Err(bad(format!(
                    "byteStride {stride} is less than an element of {element} bytes"
                )));
            }
            let end = match count {
                0 => Some(0),
                _ => stride
                    .checked_mul(count - 1)
                    .and_then(|n| n.checked_add(element)?.checked_add(offset)),
            };
            match end {
                Some(end) if end <= bytes.len() as u64 => Ok(Strided {
                    bytes: bytes.get(offset as usize..).unwrap_or_default(),
                    stride: stride as usize,
                }),
                _ => Err(bad(format!(
                    "claims {count} elements of {element} bytes, but bufferView {view} has {} bytes",
                    bytes.len()
                ))),
            }
        };
        let dense = match json.buffer_view {
            Some(view) => Some(strided(view, json.byte_offset, json.count, element)?),
            None if json.count > source.bytes.max(FREE_ZEROS) => {
                return Err(bad(format!("claims {} elements without any data", json.count)));
            }
            None => None,
        };
        let sparse = match &json.sparse {
            None => None,
            Some(sparse) => {
                if sparse.count > json.count {
                    return Err(bad(format!(
                        "{} sparse values for {} elements",
                        sparse.count, json.count
                    )));
                }
                let kind = Component::from_gl(sparse.indices.component_type)
                    .filter(|kind| matches!(kind, Component::U8 | Component::U16 | Component::U32))
                    .ok_or_else(|| bad("sparse indices are not unsigned integers".into()))?;
                let indices = &sparse.indices;
                let raw = strided(indices.buffer_view, indices.byte_offset, sparse.count, kind.size())?;
                let values = strided(
                    sparse.values.buffer_view,
                    sparse.values.byte_offset,
                    sparse.count,
                    element,
                )?;
                let numbers: Vec<u32> = (0..sparse.count as usize).map(|i| raw.unsigned(i, kind)).collect();
                if !numbers.is_sorted_by(|a, b| a < b) || numbers.last().is_some_and(|&n| u64::from(n) >= json.count) {
                    return Err(bad("sparse indices are not increasing, or out of range".into()));
                }
                Some((numbers, values))
            }
        };
        Ok(Self {
            count: json.count as usize,
            width: width as usize,
            component,
            normalized: json.normalized,
            dense,
            sparse,
        })
    }

    /// Number of elements.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Whether the components are what indices may be.
    pub(super) fn is_unsigned(&self) -> bool {
        matches!(self.component, Component::U8 | Component::U16 | Component::U32)
    }

    /// Whether the components are 32-bit integers, which no attribute may have.
    pub(super) fn is_u32(&self) -> bool {
        self.component == Component::U32
    }

    /// Element `i` as an unsigned integer. `i < len()`.
    pub(super) fn index(&self, i: usize) -> u32 {
        let (bytes, i) = self.locate(i);
        bytes.map_or(0, |bytes| bytes.unsigned(i, self.component))
    }

    /// Element `i`, as floats, normalised as glTF 2.0 section 3.6.2.2 says. Missing components are 0. `i < len()`.
    pub(super) fn floats(&self, i: usize) -> [f32; 4] {
        let mut out = [0.0; 4];
        let (bytes, i) = self.locate(i);
        let Some(bytes) = bytes else { return out };
        let unit = |max: f32| if self.normalized { max } else { 1.0 };
        let low = if self.normalized { -1.0 } else { f32::NEG_INFINITY };
        for (k, value) in out[..self.width].iter_mut().enumerate() {
            *value = match self.component {
                Component::F32 => f32::from_le_bytes(bytes.at(i, 4 * k)),
                Component::U32 => u32::from_le_bytes(bytes.at(i, 4 * k)) as f32,
                Component::I8 => (f32::from(i8::from_le_bytes(bytes.at(i, k))) / unit(127.0)).max(low),
                Component::U8 => f32::from(u8::from_le_bytes(bytes.at(i, k))) / unit(255.0),
                Component::I16 => (f32::from(i16::from_le_bytes(bytes.at(i, 2 * k))) / unit(32767.0)).max(low),
                Component::U16 => f32::from(u16::from_le_bytes(bytes.at(i, 2 * k))) / unit(65535.0),
            };
        }
        out
    }

    /// Number of components of an element.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    fn locate(&self, i: usize) -> (Option<Strided<'a>>, usize) {
        if let Some((numbers, values)) = &self.sparse
            && let Ok(at) = numbers.binary_search(&(i as u32))
        {
            return (Some(*values), at);
        }
        (self.dense, i)
    }
}
