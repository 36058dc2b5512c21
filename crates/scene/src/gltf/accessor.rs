//! Typed arrays in buffers. Every range is checked when an accessor is opened, so that reading cannot fail.

use super::json::{self, Checked, ComponentType, Index, Type, View};
use super::source::Source;
use crate::SceneError;
use std::borrow::Cow;

/// Elements that an accessor without any bytes (all zeros) may claim in a small file.
const FREE_ZEROS: u64 = 1 << 16;

/// Elements at equal distances in bytes that are known to be there.
#[derive(Clone, Debug)]
struct Strided<'a> {
    bytes: Cow<'a, [u8]>,
    stride: usize,
}

impl Strided<'_> {
    fn at<const N: usize>(&self, element: usize, offset: usize) -> [u8; N] {
        let start = element * self.stride + offset;
        self.bytes[start..start + N].try_into().expect("N bytes")
    }

    fn unsigned(&self, element: usize, component: ComponentType) -> u32 {
        match component {
            ComponentType::U8 | ComponentType::I8 => u32::from(self.at::<1>(element, 0)[0]),
            ComponentType::U16 | ComponentType::I16 => u32::from(u16::from_le_bytes(self.at(element, 0))),
            ComponentType::U32 | ComponentType::F32 => u32::from_le_bytes(self.at(element, 0)),
        }
    }
}

/// An accessor whose bytes are all there.
#[derive(Debug)]
pub(super) struct Accessor<'a> {
    count: usize,
    width: usize,
    component: ComponentType,
    normalized: bool,
    /// `None`: zeros.
    dense: Option<Strided<'a>>,
    /// Strictly increasing element numbers, and their values.
    sparse: Option<(Vec<u32>, Strided<'a>)>,
}

impl<'a> Accessor<'a> {
    /// Opens accessor `index`, wanted as `what` (for messages) in one of the `shapes`.
    ///
    /// # Errors
    /// [`SceneError::Invalid`] if it does not exist, has another shape, or claims more than its buffers hold.
    pub(super) fn open(
        source: &'a Source,
        index: Index<json::Accessor>,
        what: &str,
        shapes: &[Type],
    ) -> Result<Self, SceneError> {
        let index = index.value();
        let all = &source.json.accessors;
        let json = all
            .get(index)
            .ok_or_else(|| source.no_such(what, "accessor", index, all.len()))?;
        let place = format!("accessor {index} ({what})");
        let bad = |problem: String| source.invalid(&place, problem, "the file is damaged: export it again");
        let Checked::Valid(shape) = json.type_ else {
            return Err(bad("unknown type".into()));
        };
        if !shapes.contains(&shape) {
            let names = shapes.iter().map(|&shape| name(shape)).collect::<Vec<_>>();
            let problem = format!("type '{}' instead of {}", name(shape), names.join(" or "));
            return Err(bad(problem));
        }
        let Checked::Valid(component) = json.component_type else {
            return Err(bad("unknown componentType".into()));
        };
        let (component, width) = (component.0, shape.multiplicity());
        let element = (component.size() * width) as u64;
        let count = json.count.0;
        if count > u64::from(u32::MAX) {
            return Err(bad(format!("claims {count} elements")));
        }
        let strided = |view: Index<View>, offset: u64, count: u64, element: u64| -> Result<Strided<'a>, SceneError> {
            let length = source.view_length(view, &place)?;
            // `view` has found it, so it is there.
            let stride = source.json.buffer_views[view.value()]
                .byte_stride
                .map_or(element, |stride| stride.0 as u64);
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
                // An empty range may begin anywhere.
                Some(end) if end <= length => Ok(Strided {
                    bytes: source.range(view, offset.min(end)..end, &place)?,
                    stride: stride as usize,
                }),
                _ => Err(bad(format!(
                    "claims {count} elements of {element} bytes, but bufferView {view} has {length} bytes"
                ))),
            }
        };
        let dense = match json.buffer_view {
            Some(view) => Some(strided(view, json.byte_offset.unwrap_or_default().0, count, element)?),
            None if count > source.bytes.max(FREE_ZEROS) => {
                return Err(bad(format!("claims {count} elements without any data")));
            }
            None => None,
        };
        let sparse = match &json.sparse {
            None => None,
            Some(sparse) => {
                let (indices, values, few) = (&sparse.indices, &sparse.values, sparse.count.0);
                if few > count {
                    return Err(bad(format!("{few} sparse values for {count} elements")));
                }
                let Checked::Valid(kind) = indices.component_type else {
                    return Err(bad("sparse indices are not unsigned integers".into()));
                };
                let kind = kind.0;
                let raw = strided(indices.buffer_view, indices.byte_offset.0, few, kind.size() as u64)?;
                let values = strided(values.buffer_view, values.byte_offset.0, few, element)?;
                let numbers: Vec<u32> = (0..few as usize).map(|i| raw.unsigned(i, kind)).collect();
                if !numbers.is_sorted_by(|a, b| a < b) || numbers.last().is_some_and(|&n| u64::from(n) >= count) {
                    return Err(bad("sparse indices are not increasing, or out of range".into()));
                }
                Some((numbers, values))
            }
        };
        Ok(Self {
            count: count as usize,
            width,
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
        matches!(
            self.component,
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32
        )
    }

    /// Whether the components are 32-bit integers, which no attribute may have.
    pub(super) fn is_u32(&self) -> bool {
        self.component == ComponentType::U32
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
                ComponentType::F32 => f32::from_le_bytes(bytes.at(i, 4 * k)),
                ComponentType::U32 => u32::from_le_bytes(bytes.at(i, 4 * k)) as f32,
                ComponentType::I8 => (f32::from(i8::from_le_bytes(bytes.at(i, k))) / unit(127.0)).max(low),
                ComponentType::U8 => f32::from(u8::from_le_bytes(bytes.at(i, k))) / unit(255.0),
                ComponentType::I16 => (f32::from(i16::from_le_bytes(bytes.at(i, 2 * k))) / unit(32767.0)).max(low),
                ComponentType::U16 => f32::from(u16::from_le_bytes(bytes.at(i, 2 * k))) / unit(65535.0),
            };
        }
        out
    }

    /// Number of components of an element.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    fn locate(&self, i: usize) -> (Option<&Strided<'a>>, usize) {
        if let Some((numbers, values)) = &self.sparse
            && let Ok(at) = numbers.binary_search(&(i as u32))
        {
            return (Some(values), at);
        }
        (self.dense.as_ref(), i)
    }
}

/// As the file calls it.
fn name(shape: Type) -> String {
    format!("{shape:?}").to_uppercase()
}
