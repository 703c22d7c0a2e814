//! Accessors: typed views of buffers, read element by element where they lie.

use std::fmt::Display;

use super::Document;
use super::json::Sparse;
use crate::error::Result;
use crate::scene::text;

/// What the spec calls a component type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    const CODES: [(u32, Self); 6] = [
        (5120, Self::I8),
        (5121, Self::U8),
        (5122, Self::I16),
        (5123, Self::U16),
        (5125, Self::U32),
        (5126, Self::F32),
    ];

    fn of_code(code: u32) -> Option<Self> {
        Self::CODES.iter().find(|(known, _)| *known == code).map(|(_, component)| *component)
    }

    fn name(self) -> &'static str {
        match self {
            Self::I8 => "BYTE",
            Self::U8 => "UNSIGNED_BYTE",
            Self::I16 => "SHORT",
            Self::U16 => "UNSIGNED_SHORT",
            Self::U32 => "UNSIGNED_INT",
            Self::F32 => "FLOAT",
        }
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number in the first bytes of `bytes`, little-endian; f64 holds every one exactly.
    fn read(self, bytes: &[u8]) -> f64 {
        match (self, bytes) {
            (Self::I8, [a, ..]) => f64::from(i8::from_le_bytes([*a])),
            (Self::U8, [a, ..]) => f64::from(*a),
            (Self::I16, [a, b, ..]) => f64::from(i16::from_le_bytes([*a, *b])),
            (Self::U16, [a, b, ..]) => f64::from(u16::from_le_bytes([*a, *b])),
            (Self::U32, [a, b, c, d, ..]) => f64::from(u32::from_le_bytes([*a, *b, *c, *d])),
            (Self::F32, [a, b, c, d, ..]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
            // Views hold whole elements only.
            _ => 0.0,
        }
    }

    /// What a normalized integer of this type means (glTF 2.0, section 3.6.2.2).
    fn normalized(self, number: f64) -> f64 {
        match self {
            Self::I8 => (number / 127.0).max(-1.0),
            Self::U8 => number / 255.0,
            Self::I16 => (number / 32767.0).max(-1.0),
            Self::U16 => number / 65535.0,
            Self::U32 | Self::F32 => number,
        }
    }
}

/// What an accessor must be to be used somewhere.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// The spec's name of the shape.
    pub kind: &'static str,
    /// Numbers per element.
    pub width: usize,
    /// Types it may have.
    pub components: &'static [Component],
}

/// Vertex indices.
pub const INDICES: Expected =
    Expected { kind: "SCALAR", width: 1, components: &[Component::U8, Component::U16, Component::U32] };
/// Positions, those of KHR_mesh_quantization among them.
pub const POSITIONS: Expected = Expected {
    kind: "VEC3",
    width: 3,
    components: &[Component::F32, Component::I8, Component::U8, Component::I16, Component::U16],
};
/// Normals.
pub const NORMALS: Expected =
    Expected { kind: "VEC3", width: 3, components: &[Component::F32, Component::I8, Component::I16] };
/// Tangents with the bitangent's sign.
pub const TANGENTS: Expected =
    Expected { kind: "VEC4", width: 4, components: &[Component::F32, Component::I8, Component::I16] };
/// Texture coordinates, those of KHR_mesh_quantization among them.
pub const COORDINATES: Expected = Expected { kind: "VEC2", width: 2, ..POSITIONS };
/// Translations and scales of instances.
pub const VECTORS: Expected = Expected { kind: "VEC3", width: 3, components: &[Component::F32] };
/// Rotations of instances.
pub const QUATERNIONS: Expected =
    Expected { kind: "VEC4", width: 4, components: &[Component::F32, Component::I8, Component::I16] };

/// An accessor whose ranges were checked.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Number of elements.
    pub count: usize,
    component: Component,
    normalized: bool,
    /// `None`: all zeros.
    base: Option<Elements<'a>>,
    sparse: Option<Substitutes<'a>>,
}

/// Elements at equal distances.
#[derive(Clone, Copy, Debug)]
struct Elements<'a> {
    /// From the first byte of the first element to at least the last byte of the last one.
    bytes: &'a [u8],
    stride: usize,
}

/// Elements that replace others.
#[derive(Clone, Copy, Debug)]
struct Substitutes<'a> {
    count: usize,
    /// Which ones, strictly ascending.
    indices: Elements<'a>,
    component: Component,
    values: Elements<'a>,
}

impl<'a> Elements<'a> {
    fn get(&self, i: usize) -> &'a [u8] {
        &self.bytes[i * self.stride..]
    }
}

impl<'a> Substitutes<'a> {
    fn index(&self, k: usize) -> usize {
        self.component.read(self.indices.get(k)) as usize
    }

    fn find(&self, i: usize) -> Option<&'a [u8]> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low + (high - low) / 2;
            if self.index(middle) < i {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        (low < self.count && self.index(low) == i).then(|| self.values.get(low))
    }
}

impl View<'_> {
    /// The `N` numbers of element `i`, which must be below the count; N is the width that was expected.
    pub fn numbers<const N: usize>(&self, i: usize) -> [f64; N] {
        let replaced = self.sparse.and_then(|sparse| sparse.find(i));
        let Some(bytes) = replaced.or_else(|| self.base.map(|base| base.get(i))) else { return [0.0; N] };
        std::array::from_fn(|n| {
            let number = self.component.read(&bytes[n * self.component.size()..]);
            if self.normalized { self.component.normalized(number) } else { number }
        })
    }

    /// Element `i` as an index.
    pub fn index(&self, i: usize) -> u32 {
        self.numbers::<1>(i)[0] as u32
    }
}

impl Document<'_> {
    /// The accessor `index`, which `path` refers to, as what is `expected` there.
    ///
    /// # Errors
    /// An index that names nothing, another type, ranges beyond a buffer view or a buffer, a buffer without bytes.
    pub(super) fn view(&self, index: u32, expected: Expected, path: impl Display) -> Result<View<'_>> {
        let accessor = self.get(&self.root.accessors, "accessors", index, path)?;
        let path = format!("accessors[{index}]");
        if *accessor.kind != *expected.kind {
            let found = text::shown(accessor.kind.as_bytes());
            return Err(self.error(path, format!("expected the type `{}` here, found {found}", expected.kind)));
        }
        let component = Component::of_code(accessor.component_type);
        let Some(component) = component.filter(|c| expected.components.contains(c)) else {
            let names: Vec<_> = expected.components.iter().map(|c| c.name()).collect();
            let found = component.map_or(accessor.component_type.to_string(), |c| c.name().to_string());
            let what = format!("expected componentType {}, found {found}", names.join(" or "));
            return Err(self.error(path, what));
        };
        let count = usize::try_from(accessor.count).ok().filter(|&n| n < u32::MAX as usize);
        let Some(count) = count else {
            return Err(self.error(path, format!("count {} is too large: at most 2^32 - 2", accessor.count)));
        };
        let size = component.size() * expected.width;
        let base = match accessor.buffer_view {
            Some(view) => Some(self.elements(view, accessor.byte_offset, count, size, &path)?),
            None => None,
        };
        let sparse = match &accessor.sparse {
            Some(sparse) => Some(self.substitutes(sparse, count, size, &path)?),
            None => None,
        };
        Ok(View { count, component, normalized: accessor.normalized, base, sparse })
    }

    fn substitutes(&self, sparse: &Sparse, count: usize, size: usize, path: &str) -> Result<Substitutes<'_>> {
        let (indices, values) = (&sparse.indices, &sparse.values);
        let path = format!("{path}.sparse");
        let Some(many) = usize::try_from(sparse.count).ok().filter(|&many| many <= count) else {
            return Err(self.error(path, format!("count {} is more than the accessor's {count}", sparse.count)));
        };
        let component = Component::of_code(indices.component_type);
        let Some(component) = component.filter(|c| INDICES.components.contains(c)) else {
            return Err(self.error(path, "expected unsigned integers for indices"));
        };
        let substitutes = Substitutes {
            count: many,
            indices: self.elements(indices.buffer_view, indices.byte_offset, many, component.size(), &path)?,
            component,
            values: self.elements(values.buffer_view, values.byte_offset, many, size, &path)?,
        };
        // Looking at them takes time, if no memory, each time that the accessor is used.
        self.spend(4 * many as u64, &path)?;
        let ascending = (1..many).all(|k| substitutes.index(k - 1) < substitutes.index(k));
        if !ascending || (many > 0 && substitutes.index(many - 1) >= count) {
            return Err(self.error(path, format!("expected ascending indices below {count}")));
        }
        Ok(substitutes)
    }

    /// The bytes of the buffer view `index`, which `path` refers to.
    ///
    /// # Errors
    /// An index that names nothing, a range beyond the buffer, a buffer without bytes.
    pub(super) fn bytes(&self, index: u32, path: impl Display) -> Result<&[u8]> {
        let view = self.get(&self.root.buffer_views, "bufferViews", index, format_args!("{path}.bufferView"))?;
        let view_path = format_args!("bufferViews[{index}]");
        self.get(&self.root.buffers, "buffers", view.buffer, format_args!("{view_path}.buffer"))?;
        let bytes = self.buffers.bytes(view.buffer as usize);
        let bytes = bytes.map_err(|what| self.error(format_args!("buffers[{}]", view.buffer), what))?;
        let whole = range(view.byte_offset, view.byte_length).and_then(|range| bytes.get(range));
        let Some(whole) = whole else {
            let (at, long) = (view.byte_offset, view.byte_length);
            let what = format!("expected {long} bytes from byte {at} on, but the buffer has {}", bytes.len());
            return Err(self.error(view_path, what));
        };
        Ok(whole)
    }

    /// `count` elements of `size` bytes, from byte `offset` of the buffer view `index`.
    fn elements(&self, index: u32, offset: u64, count: usize, size: usize, path: &str) -> Result<Elements<'_>> {
        let whole = self.bytes(index, path)?;
        let view = &self.root.buffer_views[index as usize];
        let view_path = format_args!("bufferViews[{index}]");
        let stride = view.byte_stride.map_or(size, |stride| stride as usize);
        if stride < size {
            let what = format!("byteStride {stride} is less than the {size} bytes of an element of {path}");
            return Err(self.error(view_path, what));
        }
        let gaps = (count as u64).saturating_sub(1).saturating_mul(stride as u64);
        let need = if count == 0 { 0 } else { gaps.saturating_add(size as u64) };
        let used = range(offset, need).and_then(|range| whole.get(range));
        let Some(bytes) = used else {
            let what = format!(
                "{count} elements need {need} bytes from byte {offset} of {view_path}, which has {} bytes",
                whole.len()
            );
            return Err(self.error(path, what));
        };
        Ok(Elements { bytes, stride })
    }
}

fn range(start: u64, length: u64) -> Option<std::ops::Range<usize>> {
    let end = usize::try_from(start.checked_add(length)?).ok()?;
    Some(usize::try_from(start).ok()?..end)
}
