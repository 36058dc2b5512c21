//! One module per command: its options, and what it does.

pub(crate) mod bench;
pub(crate) mod compare;
pub(crate) mod dump;
pub(crate) mod estimate;
pub(crate) mod info;
pub(crate) mod merge;
pub(crate) mod render;
