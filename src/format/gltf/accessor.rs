//! Numbers of a glTF file. Every claim of the description is held against the bytes that are there
//! before anything is allocated.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::accessor::{DataType, Dimensions, sparse};
use gltf::buffer::{Source, View};
use gltf::{Accessor, Document};

use super::damaged;
use crate::diag::{Diagnostic, Result};

/// The buffers of a file.
pub(super) struct Buffers {
    all: Vec<Vec<u8>>,
}

impl Buffers {
    /// The binary chunk, data in the text itself, and other files.
    pub(super) fn load(
        document: &Document,
        mut blob: Option<Vec<u8>>,
        resource: &dyn Fn(&str) -> Result<Vec<u8>>,
    ) -> Result<Self> {
        let mut all = Vec::new();
        for buffer in document.buffers() {
            let bytes = match buffer.source() {
                Source::Bin => blob.take().unwrap_or_default(),
                Source::Uri(uri) => match uri.split_once(";base64,") {
                    Some((_, text)) if uri.starts_with("data:") => {
                        let decoded = STANDARD.decode(text);
                        decoded.map_err(|error| Box::new(damaged(&error.to_string())))?
                    }
                    _ => resource(&unescaped(uri))?,
                },
            };
            if bytes.len() < buffer.length() {
                let (has, promised) = (bytes.len(), buffer.length());
                let told = format!("a buffer of {promised} bytes has {has}");
                return damaged(&told).err();
            }
            all.push(bytes);
        }
        Ok(Buffers { all })
    }

    /// All numbers of an accessor in a row; whole numbers that stand for fractions are made such.
    pub(super) fn floats(&self, accessor: &Accessor) -> Result<Vec<f32>> {
        let (kind, whole) = (accessor.data_type(), !accessor.normalized());
        self.numbers(accessor, |bytes| float(bytes, kind, whole))
    }

    /// The same with the number of components checked.
    pub(super) fn vectors(&self, accessor: &Accessor, dimensions: Dimensions) -> Result<Vec<f32>> {
        if accessor.dimensions() == dimensions {
            return self.floats(accessor);
        }
        damaged(&format!("{dimensions:?} was expected")).err()
    }

    /// All numbers of an accessor of whole numbers.
    pub(super) fn indices(&self, accessor: &Accessor) -> Result<Vec<u32>> {
        let kind = accessor.data_type();
        self.numbers(accessor, |bytes| index(bytes, kind))
    }

    fn numbers<T: Copy + Default>(
        &self,
        accessor: &Accessor,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>> {
        let width = accessor.dimensions().multiplicity();
        let mut numbers = match accessor.view() {
            Some(view) => {
                let stride = view.stride().unwrap_or(accessor.size());
                let bytes = self.elements(&view, accessor.offset(), stride, accessor)?;
                let size = accessor.data_type().size();
                let element = |at: usize| bytes[at * stride..][..accessor.size()].chunks(size);
                (0..accessor.count()).flat_map(element).map(&read).collect()
            }
            None => self.zeros(accessor, width)?,
        };
        if let Some(sparse) = accessor.sparse() {
            self.replace(&sparse, accessor, &mut numbers, read)?;
        }
        Ok(numbers)
    }

    /// Numbers without bytes: as many as the file could hold.
    fn zeros<T: Copy + Default>(&self, accessor: &Accessor, width: usize) -> Result<Vec<T>> {
        let held: usize = self.all.iter().map(Vec::len).sum();
        match accessor.count().checked_mul(width) {
            Some(count) if count <= held => Ok(vec![T::default(); count]),
            _ => damaged("more zeros than the file has bytes").err(),
        }
    }

    /// The numbers of a sparse accessor that are not its base.
    fn replace<T: Copy>(
        &self,
        sparse: &sparse::Sparse,
        accessor: &Accessor,
        numbers: &mut [T],
        read: impl Fn(&[u8]) -> T,
    ) -> Result<()> {
        let (indices, values) = (sparse.indices(), sparse.values());
        let kind = match indices.index_type() {
            sparse::IndexType::U8 => DataType::U8,
            sparse::IndexType::U16 => DataType::U16,
            sparse::IndexType::U32 => DataType::U32,
        };
        let size = accessor.size();
        let count = sparse.count();
        let at = self.part(&indices.view(), indices.offset(), count, kind.size())?;
        let new = self.part(&values.view(), values.offset(), count, size)?;
        let width = accessor.dimensions().multiplicity();
        for (at, new) in at.chunks(kind.size()).zip(new.chunks(size)) {
            let at = index(at, kind) as usize;
            let place = at
                .checked_mul(width)
                .and_then(|start| numbers.get_mut(start..start + width));
            let Some(place) = place else {
                return damaged("a sparse value for an element that is not there").err();
            };
            for (number, bytes) in place
                .iter_mut()
                .zip(new.chunks(accessor.data_type().size()))
            {
                *number = read(bytes);
            }
        }
        Ok(())
    }

    /// The bytes from the first element of an accessor on, long enough for all of them.
    fn elements(
        &self,
        view: &View,
        offset: usize,
        stride: usize,
        accessor: &Accessor,
    ) -> Result<&[u8]> {
        let Some(last) = accessor.count().checked_sub(1) else {
            return Ok(&[]);
        };
        let bytes = self.view(view)?;
        let needed = last
            .checked_mul(stride)
            .and_then(|start| start.checked_add(accessor.size()));
        let bytes = bytes.get(offset..);
        match (bytes, needed) {
            (Some(bytes), Some(needed)) if bytes.len() >= needed && stride > 0 => Ok(bytes),
            _ => damaged("more elements than the file has bytes").err(),
        }
    }

    fn part(&self, view: &View, offset: usize, count: usize, size: usize) -> Result<&[u8]> {
        let length = count.checked_mul(size);
        let end = length.and_then(|length| offset.checked_add(length));
        let bytes = self.view(view)?;
        match end.and_then(|end| bytes.get(offset..end)) {
            Some(part) => Ok(part),
            None => damaged("more elements than the file has bytes").err(),
        }
    }

    fn view(&self, view: &View) -> Result<&[u8]> {
        let buffer = &self.all[view.buffer().index()];
        let end = view.offset().checked_add(view.length());
        match end.and_then(|end| buffer.get(view.offset()..end)) {
            Some(bytes) => Ok(bytes),
            None => damaged("a view reaches past the end of its buffer").err(),
        }
    }
}

/// A name with `%20` and the like spelt out.
fn unescaped(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        let code = match (first, tail) {
            (b'%', [high, low, ..]) => {
                let digits = [*high, *low];
                let text = std::str::from_utf8(&digits).unwrap_or_default();
                u8::from_str_radix(text, 16).ok()
            }
            _ => None,
        };
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { &tail[2..] } else { tail };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// One number; `bytes` has the size of its kind.
fn float(bytes: &[u8], kind: DataType, whole: bool) -> f32 {
    let scaled = |value: f32, largest: f32| {
        if whole {
            value
        } else {
            (value / largest).max(-1.0)
        }
    };
    match (kind, bytes) {
        (DataType::I8, &[a]) => scaled(f32::from(a as i8), 127.0),
        (DataType::U8, &[a]) => scaled(f32::from(a), 255.0),
        (DataType::I16, &[a, b]) => scaled(f32::from(i16::from_le_bytes([a, b])), 32767.0),
        (DataType::U16, &[a, b]) => scaled(f32::from(u16::from_le_bytes([a, b])), 65535.0),
        (DataType::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]) as f32,
        (DataType::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
        _ => f32::NAN,
    }
}

/// One whole number; `u32::MAX`, which names nothing, for kinds that hold none.
fn index(bytes: &[u8], kind: DataType) -> u32 {
    match (kind, bytes) {
        (DataType::U8, &[a]) => u32::from(a),
        (DataType::U16, &[a, b]) => u32::from(u16::from_le_bytes([a, b])),
        (DataType::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
        _ => u32::MAX,
    }
}

/// Refuses numbers that are not finite.
pub(super) fn finite(numbers: &[f32], what: &str) -> Result<()> {
    if numbers.iter().all(|number| number.is_finite()) {
        return Ok(());
    }
    Diagnostic::error(format!("{what} that are not finite numbers"))
        .hint("export the scene again")
        .err()
}
