//! What Arm's MPS2 boards have beside their processor, the peripherals of CMSDK: the [`uart`] that is the line, and the [`board`]'s time, cost and
//! watchdog. A crate of its own, for the interrupt that takes every byte is compiled for speed and the program for size.
#![no_std]

pub mod board;
pub mod uart;
