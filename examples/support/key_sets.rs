//! Keys of many sizes: built-in captures, subdivided.
#![allow(dead_code)] // each uses its part

use meshloom::demo::Demo;
use meshloom::inbetween::Keys;
use meshloom::mesh::{FrameSource, Sequence, subdivide};

/// Frames `chosen` (from 0) of a demo, subdivided `times` times.
pub(crate) fn demo_keys(name: &str, chosen: &[usize], times: usize) -> Keys {
    let demo = Demo::find(name).expect("a demo of that name");
    let all = demo.generate();
    let positions = chosen.iter().flat_map(|&frame| all.frame(frame).to_vec());
    let few = Sequence::new(all.topology().clone(), positions.collect(), None);
    let fine = (0..times).fold(few, |keys, _| subdivide(&keys));
    Keys::new(fine, None).expect("two or more keys")
}

/// Three poses of the galloping horse that differ much.
pub(crate) const HORSE: [usize; 3] = [0, 5, 12];

/// How many triangles the keys have.
pub(crate) fn faces(keys: &Keys) -> usize {
    keys.poses().topology().triangles().len()
}
