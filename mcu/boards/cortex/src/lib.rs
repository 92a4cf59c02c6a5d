//! What boards with a Cortex-M share: the [`stack`]'s guard and high-water mark, and the record that a [`fault`] leaves.
//! The handlers of panics and hard faults come with this crate.
#![no_std]

pub mod fault;
pub mod stack;
