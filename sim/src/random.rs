use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Numbers that depend on the seed and the stream alone, with the same bits on every target.
pub struct Random(ChaCha8Rng);

/// What a stream of random numbers is for: streams of one seed are independent of each other.
#[derive(Clone, Copy, Debug)]
pub enum Stream {
    /// Looks and layout of a scene.
    Scene,
    /// The floor.
    FloorTexture,
    /// The walls.
    WallTexture,
    /// People's will.
    Walkers,
    /// The wheels' errors.
    Odometry,
    /// Pixel noise, one stream a frame.
    Pixels(usize),
    /// The laser's noise, one stream a frame.
    Laser(usize),
    /// Whatever an experiment draws beside a simulation.
    Experiment(usize),
}

impl Random {
    /// The stream of a seed from its beginning.
    pub fn new(seed: u64, stream: Stream) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(match stream {
            Stream::Scene => 1,
            Stream::FloorTexture => 2,
            Stream::WallTexture => 3,
            Stream::Walkers => 4,
            Stream::Odometry => 5,
            Stream::Pixels(frame) => (1 << 32) | frame as u64,
            Stream::Laser(frame) => (2 << 32) | frame as u64,
            Stream::Experiment(number) => (3 << 32) | number as u64,
        });
        Self(generator)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform between two numbers.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// One of `0..len`.
    pub(crate) fn index(&mut self, len: usize) -> usize {
        ((self.unit() * len as f64) as usize).min(len.saturating_sub(1))
    }

    /// Standard normal, by Box and Muller.
    pub fn normal(&mut self) -> f64 {
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.unit()));
        radius * libm::cos(core::f64::consts::TAU * self.unit())
    }

    pub(crate) fn word(&mut self) -> u32 {
        self.0.next_u32()
    }

    pub(crate) fn fill(&mut self, bytes: &mut [u8]) {
        self.0.fill_bytes(bytes);
    }
}
