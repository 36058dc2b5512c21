//! Samplers as plain words, for back ends that draw elsewhere: `shaders/light_cache` reads what is written here.

use crate::tree::Tree;

/// How lights are drawn from the words: a file of that name in `shaders/light_cache`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scheme {
    /// Every light alike.
    Uniform,
    /// A discrete distribution for first hits, and one for later ones.
    Discrete,
    /// The plain light tree.
    Tree,
    /// Learned cuts of the light tree.
    Adaptive,
}

/// A sampler as it draws now.
#[derive(Clone, Debug)]
pub struct Packed {
    /// How to read `words`.
    pub scheme: Scheme,
    /// Its tables; the header comes first.
    pub words: Vec<u32>,
}

/// Words of a tree's header.
pub(crate) const TREE_HEADER: usize = 8;

/// Fills `words` up to a multiple of four, where records of whole vectors may begin.
pub(crate) fn align(words: &mut Vec<u32>) -> u32 {
    words.resize(words.len().next_multiple_of(4), 0);
    words.len() as u32
}

/// Appends `tree` and writes its header to the words from `header` on.
pub(crate) fn pack_tree(tree: &Tree, header: usize, words: &mut Vec<u32>) {
    let nodes = align(words);
    for node in &tree.nodes {
        for v in [node.center, node.half, node.axis] {
            words.extend(v.to_array().map(f32::to_bits));
        }
        words.extend([node.cos_o, node.sin_o, node.cos_e, node.weight].map(f32::to_bits));
        words.extend([node.first, node.count, node.child]);
    }
    let leaves = align(words);
    for leaf in &tree.leaves {
        words.extend(leaf.center.extend(leaf.radius).to_array().map(f32::to_bits));
        words.extend(leaf.axis.extend(leaf.weight).to_array().map(f32::to_bits));
        words.extend([leaf.cone_scale, leaf.cone_offset, leaf.inverse_range_sq].map(f32::to_bits));
        words.push(leaf.tag());
    }
    let distant = align(words);
    for light in &tree.distant {
        words.extend(light.direction.extend(light.weight).to_array().map(f32::to_bits));
        words.extend([light.index, 0, 0, 0]);
    }
    let ranks = words.len() as u32;
    words.extend(&tree.rank);
    let counts = [tree.nodes.len(), tree.leaves.len(), tree.distant.len()].map(|count| count as u32);
    words[header..header + 4].copy_from_slice(&[nodes, leaves, distant, ranks]);
    words[header + 4..header + 7].copy_from_slice(&counts);
    words[header + 7] = tree.least_second.to_bits();
}
