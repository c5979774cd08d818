//! `.loom`: a loom in a safetensors container, so that numpy, PyTorch or ten lines of anything open it.
//!
//! ```text
//! 8 bytes   length of the header, little endian
//! header    JSON: for every array its dtype (F64, F32, U32), its shape and where its bytes are;
//!           under "__metadata__" one text, "meshloom": JSON with version, program, space, report
//! bytes     the arrays, little endian, the last index running fastest
//! ```
//!
//! Which arrays there are says [`crate::loom::file`]. In Python:
//! `safetensors.numpy.load_file("walk.loom")["shape/vectors"]`.

use std::borrow::Cow;
use std::collections::HashMap;

use safetensors::{Dtype, SafeTensors, View};

use crate::diag::{Diagnostic, Result};
use crate::loom::Loom;
use crate::loom::file::{Tensor, TensorData, from_tensors, to_tensors};

/// The key of our text in the container's metadata; a single one, so that the bytes have one order.
const TEXT: &str = "meshloom";

/// Whether these first bytes are a safetensors container: a length, then a JSON object.
pub fn recognises(head: &[u8]) -> bool {
    head.get(8) == Some(&b'{') && head.get(..8).is_some_and(|length| length[4..] == [0; 4])
}

/// A loom as the bytes of a file: the same loom gives the same bytes.
///
/// # Errors
/// The arrays do not fit into a container (more than 2^64 bytes).
pub fn write(loom: &Loom) -> Result<Vec<u8>> {
    let (tensors, text) = to_tensors(loom);
    let metadata = HashMap::from([(TEXT.to_string(), text)]);
    let views = tensors
        .iter()
        .map(|tensor| (tensor.name.as_str(), Bytes(tensor)));
    let bytes = safetensors::serialize(views, Some(metadata));
    bytes.map_err(|error| Diagnostic::error(format!("the loom cannot be written: {error}")).into())
}

/// The loom of a file's bytes. Memory is taken as the file has bytes, never as its header claims.
///
/// # Errors
/// Not a loom, cut short, or damaged: what is wrong is named.
pub fn read(bytes: &[u8]) -> Result<Loom> {
    let damaged = |error: &dyn std::fmt::Display| {
        Box::new(
            Diagnostic::error(format!("not a whole loom: {error}"))
                .hint("the file was cut short or is something else; fit the capture again"),
        )
    };
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(|error| damaged(&error))?;
    let text = header.metadata().as_ref().and_then(|texts| texts.get(TEXT));
    let text = text.ok_or_else(|| damaged(&"its header has no `meshloom` text"))?;
    let container = SafeTensors::deserialize(bytes).map_err(|error| damaged(&error))?;
    let mut tensors = Vec::with_capacity(container.len());
    for (name, view) in container.iter() {
        let data = match view.dtype() {
            Dtype::F64 => TensorData::F64(numbers(view.data(), f64::from_le_bytes)),
            Dtype::F32 => TensorData::F32(numbers(view.data(), f32::from_le_bytes)),
            Dtype::U32 => TensorData::U32(numbers(view.data(), u32::from_le_bytes)),
            other => return Err(damaged(&format!("array `{name}` holds {other:?}"))),
        };
        let shape = view.shape().to_vec();
        tensors.push(Tensor {
            name: name.to_string(),
            shape,
            data,
        });
    }
    from_tensors(tensors, text)
}

fn numbers<T, const N: usize>(bytes: &[u8], from: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes
        .as_chunks::<N>()
        .0
        .iter()
        .map(|chunk| from(*chunk))
        .collect()
}

/// An array as the container wants it.
struct Bytes<'a>(&'a Tensor);

impl View for Bytes<'_> {
    fn dtype(&self) -> Dtype {
        match self.0.data {
            TensorData::F64(_) => Dtype::F64,
            TensorData::F32(_) => Dtype::F32,
            TensorData::U32(_) => Dtype::U32,
        }
    }

    fn shape(&self) -> &[usize] {
        &self.0.shape
    }

    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Owned(match &self.0.data {
            TensorData::F64(data) => data.iter().flat_map(|x| x.to_le_bytes()).collect(),
            TensorData::F32(data) => data.iter().flat_map(|x| x.to_le_bytes()).collect(),
            TensorData::U32(data) => data.iter().flat_map(|x| x.to_le_bytes()).collect(),
        })
    }

    fn data_len(&self) -> usize {
        match &self.0.data {
            TensorData::F64(data) => 8 * data.len(),
            TensorData::F32(data) => 4 * data.len(),
            TensorData::U32(data) => 4 * data.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::loom::fit::{FitOptions, fit};
    use crate::mesh::{Sequence, Topology};
    use crate::task::Task;

    fn loom() -> Loom {
        let topology = Arc::new(Topology::from_triangles(3, &[[0, 1, 2]]).unwrap());
        let wave = |i: usize| ((i * i) as f32 * 0.37).sin();
        let sequence = Sequence::new(topology, (0..9 * 12).map(wave).collect(), Some(24.0));
        let options = FitOptions {
            controls: Some(6),
            sites: Some(5),
            modes: Some(3),
            ..FitOptions::default()
        };
        fit(&sequence, &options, &Task::default()).unwrap().output
    }

    #[test]
    fn a_loom_comes_back_to_the_last_bit() {
        let loom = loom();
        let bytes = write(&loom).unwrap();
        assert!(recognises(&bytes));
        let back = read(&bytes).unwrap();
        assert_eq!(back.fps(), Some(24.0));
        for t in [1.0, 2.3, 12.0] {
            assert_eq!(back.at(t).unwrap(), loom.at(t).unwrap());
        }
        assert_eq!(to_tensors(&back).0, to_tensors(&loom).0);
        assert_eq!(write(&loom).unwrap(), bytes);
    }

    #[test]
    fn damaged_bytes_are_refused_wherever_they_end() {
        let bytes = write(&loom()).unwrap();
        for length in (0..bytes.len()).step_by(97) {
            assert!(read(&bytes[..length]).is_err(), "{length}");
        }
    }
}
