use super::Bench;
use monorange_mcu::{Device, Engine};
use std::{
    collections::VecDeque,
    io::{self, Read, Write},
    time::Duration,
};

/// A line to a device in memory, which does not hear its first bytes.
pub(crate) struct Wire<E> {
    pub(crate) device: Device<E>,
    board: Bench,
    deaf_for: usize,
    answers: VecDeque<u8>,
}

impl<E: Engine> Wire<E> {
    pub(crate) fn new(engine: E, deaf_for: usize) -> Self {
        let (device, board) = (Device::new(engine), Bench::default());
        Self { device, board, deaf_for, answers: VecDeque::new() }
    }
}

impl<E: Engine> Write for Wire<E> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let unheard = self.deaf_for.min(bytes.len());
        self.deaf_for -= unheard;
        let mut answer = vec![];
        self.device.receive(&bytes[unheard..], &self.board, &mut answer);
        self.answers.extend(answer);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<E> Read for Wire<E> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.answers.is_empty() {
            std::thread::sleep(Duration::from_millis(5));
            return Err(io::ErrorKind::TimedOut.into());
        }
        self.answers.read(out)
    }
}
