//! Accessors to numbers: bounds, strides, component types, sparse substitution, all checked before a byte is read.
//! The document and its buffers come from `document` and `buffers`; numbers go to meshes, skins and animations.

use super::buffers::Buffers;
use ::gltf::json::Root;
use ::gltf::json::accessor::{ComponentType, Type};
use ::gltf::json::validation::Checked;

/// No accessor may hold more numbers.
const MAX_NUMBERS: u64 = 1 << 27;
/// Nor more of them without bytes in the file: a line of JSON can promise billions of zeros.
const MAX_ZEROS: u64 = 1 << 25;

/// The numbers of an accessor, element after element.
#[derive(Debug)]
pub(crate) struct Numbers {
    /// How many numbers make an element.
    pub width: usize,
    /// How many elements there are.
    pub count: usize,
    /// `width * count` numbers; normalised integers are brought to -1..=1 or 0..=1.
    pub values: Vec<f64>,
    /// The first element with a number that is infinite or none.
    pub bad: Option<usize>,
}

impl Numbers {
    fn new(width: usize, count: usize, values: Vec<f64>) -> Self {
        let bad = values.iter().position(|v| !v.is_finite()).map(|i| i / width.max(1));
        Self { width, count, values, bad }
    }

    /// Element `i`; missing ones are zero.
    pub fn element<const N: usize>(&self, i: usize) -> [f64; N] {
        let mut out = [0.0; N];
        let from = self.values.get(i * self.width..(i + 1) * self.width).unwrap_or(&[]);
        for (o, v) in out.iter_mut().zip(from) {
            *o = *v;
        }
        out
    }

    /// These of the elements.
    pub fn picked(&self, elements: &[usize]) -> Self {
        let of = |&i: &usize| self.values.get(i * self.width..(i + 1) * self.width).unwrap_or(&[]);
        Self::new(self.width, elements.len(), elements.iter().flat_map(of).copied().collect())
    }
}

/// A document with its bytes: what every reader needs.
#[derive(Clone, Copy)]
pub(crate) struct Data<'a> {
    pub root: &'a Root,
    pub buffers: &'a Buffers,
}

/// How one number is stored.
#[derive(Clone, Copy)]
struct Format {
    component: ComponentType,
    normalized: bool,
}

impl Format {
    fn size(self) -> usize {
        self.component.size()
    }

    fn read(self, b: &[u8]) -> f64 {
        fn le<const N: usize>(b: &[u8]) -> [u8; N] {
            b.first_chunk().copied().unwrap_or([0; N])
        }
        let (value, scale) = match self.component {
            ComponentType::I8 => (f64::from(i8::from_le_bytes(le(b))), 127.0),
            ComponentType::U8 => (f64::from(u8::from_le_bytes(le(b))), 255.0),
            ComponentType::I16 => (f64::from(i16::from_le_bytes(le(b))), 32_767.0),
            ComponentType::U16 => (f64::from(u16::from_le_bytes(le(b))), 65_535.0),
            ComponentType::U32 => (f64::from(u32::from_le_bytes(le(b))), 4_294_967_295.0),
            ComponentType::F32 => return f64::from(f32::from_le_bytes(le(b))),
        };
        if self.normalized { (value / scale).max(-1.0) } else { value }
    }
}

impl Data<'_> {
    /// Reads accessor `index` as whole numbers from 0 up: vertex indices.
    pub fn read_indices(&self, index: usize) -> Result<Numbers, String> {
        let component = self.root.accessors.get(index).map(|a| a.component_type);
        match component {
            Some(Checked::Valid(c)) if !matches!(c.0, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) => {
                Err(format!("componentType {:?}; expected U8, U16 or U32", c.0))
            }
            _ => self.read(index, &[Type::Scalar]),
        }
    }

    /// Reads accessor `index`, whose elements must be of one of `shapes`.
    pub fn read(&self, index: usize, shapes: &[Type]) -> Result<Numbers, String> {
        self.read_inner(index, shapes).map_err(|e| format!("accessor {index}: {e}"))
    }

    fn read_inner(&self, index: usize, shapes: &[Type]) -> Result<Numbers, String> {
        let all = &self.root.accessors;
        let accessor = all.get(index).ok_or_else(|| format!("not among the file's {}", all.len()))?;
        let (Checked::Valid(shape), Checked::Valid(component)) = (accessor.type_, accessor.component_type) else {
            return Err("unknown type or componentType".to_owned());
        };
        if !shapes.contains(&shape) {
            return Err(format!("type {shape:?}; expected {shapes:?}"));
        }
        let format = Format { component: component.0, normalized: accessor.normalized };
        let (width, total) = (shape.multiplicity(), accessor.count.0);
        let most = if accessor.buffer_view.is_some() { MAX_NUMBERS } else { MAX_ZEROS };
        if total.saturating_mul(width as u64) > most {
            return Err(format!("count {total}: at most {most} numbers are taken: split the mesh"));
        }
        let count = total as usize;
        let mut values = match accessor.buffer_view {
            Some(view) => self.dense(view.value(), accessor.byte_offset.map_or(0, |o| o.0), count, shape, format)?,
            None => vec![0.0; count * width],
        };
        if let Some(sparse) = &accessor.sparse {
            let Checked::Valid(index_type) = sparse.indices.component_type else {
                return Err("sparse indices: unknown componentType".to_owned());
            };
            if sparse.count.0 > total {
                return Err(format!("sparse: {} substitutes for {count} elements", sparse.count.0));
            }
            let n = sparse.count.0 as usize;
            let plain = Format { component: index_type.0, normalized: false };
            let at = self.dense(sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0, n, Type::Scalar, plain)?;
            let with = self.dense(sparse.values.buffer_view.value(), sparse.values.byte_offset.0, n, shape, format)?;
            for (i, new) in at.iter().zip(with.chunks_exact(width)) {
                let i = *i as usize;
                let old = values.get_mut(i * width..(i + 1) * width).ok_or_else(|| format!("sparse: index {i} of {count} elements"))?;
                old.copy_from_slice(new);
            }
        }
        Ok(Numbers::new(width, count, values))
    }

    fn dense(&self, view: usize, offset: u64, count: usize, shape: Type, format: Format) -> Result<Vec<f64>, String> {
        let (bytes, stride) = self.buffers.view(self.root, view)?;
        // Columns of matrices of small numbers start at multiples of four bytes.
        let rows = match shape {
            Type::Mat2 => 2,
            Type::Mat3 => 3,
            Type::Mat4 => 4,
            other => other.multiplicity(),
        };
        let columns = shape.multiplicity() / rows;
        let column = if columns > 1 { (rows * format.size()).next_multiple_of(4) } else { rows * format.size() };
        let element = column * columns;
        let stride = stride.unwrap_or(element);
        if stride < element {
            return Err(format!("bufferView {view}: byteStride {stride} is shorter than an element of {element} bytes"));
        }
        if count == 0 {
            return Ok(Vec::new());
        }
        let needed = (count as u64 - 1).saturating_mul(stride as u64).saturating_add(element as u64).saturating_add(offset);
        if needed > bytes.len() as u64 {
            return Err(format!("{count} elements need {needed} bytes of bufferView {view}, which has {}", bytes.len()));
        }
        let mut values = Vec::with_capacity(count * shape.multiplicity());
        for i in 0..count {
            let start = offset as usize + i * stride;
            for c in 0..columns {
                for r in 0..rows {
                    values.push(format.read(&bytes[start + c * column + r * format.size()..]));
                }
            }
        }
        Ok(values)
    }
}
