//! The core's pipeline on the heap, as one type without parameters.
//!
//! The compiler writes the code of a type with parameters where it is used, at that crate's level of optimisation. The
//! page's module is compiled for size, since nearly all of it waits for the browser; what takes the time is written
//! here, for speed.
use monorange_core::Result;
use monorange_core::image::Grey;
use monorange_core::lines::{EdgePoint, Extraction};
use monorange_core::pipeline::{Config, Memory, Odometry, OnHeap, Pipeline, Report, Stage};
use monorange_core::slam::{Filter, Health, Landmark};

/// The filter of [`Drive`].
pub type OnHeapFilter = Filter<f32, Vec<f32>, Vec<Landmark<f32>>>;

/// [`Pipeline`] with its memory in `Vec`s; the methods are the pipeline's own.
#[derive(Clone, Debug)]
pub struct Drive(Pipeline<OnHeap>);

impl Drive {
    /// A pipeline with room for so many landmarks.
    ///
    /// # Errors
    /// As [`Pipeline::new`].
    #[inline(never)]
    pub fn new(config: Config, landmarks: usize) -> Result<Self> {
        let camera = config.finder.camera();
        let memory = Memory::on_heap(camera.width(), camera.height(), landmarks);
        Ok(Self(Pipeline::new(config, memory)?))
    }

    /// As [`Pipeline::config`].
    pub fn config(&self) -> &Config {
        self.0.config()
    }

    /// As [`Pipeline::finder`].
    #[inline(never)]
    pub fn finder(&self) -> monorange_core::geometry::RangeFinder<f32> {
        self.0.finder()
    }

    /// As [`Pipeline::filter`].
    pub fn filter(&self) -> &OnHeapFilter {
        self.0.filter()
    }

    /// As [`Pipeline::health`].
    pub fn health(&self) -> &Health<f32> {
        self.0.health()
    }

    /// As [`Pipeline::edge_points`].
    pub fn edge_points(&self) -> &[EdgePoint] {
        self.0.edge_points()
    }

    /// As [`Pipeline::odometry`].
    ///
    /// # Errors
    /// As there.
    #[inline(never)]
    pub fn odometry(&mut self, time: f64, reading: &Odometry) -> Result<()> {
        self.0.odometry(time, reading)
    }

    /// Begins a picture and takes its rows.
    ///
    /// # Errors
    /// As [`Pipeline::push_row`].
    #[inline(never)]
    pub fn rows(&mut self, picture: Grey<'_>) -> Result<()> {
        self.0.begin();
        picture.rows().try_for_each(|row| self.0.push_row(row))
    }

    /// As [`Pipeline::extraction`].
    ///
    /// # Errors
    /// As there.
    #[inline(never)]
    pub fn extraction(&mut self) -> Result<&Extraction> {
        self.0.extraction()
    }

    /// As [`Pipeline::finish_timed`].
    ///
    /// # Errors
    /// As there.
    #[inline(never)]
    pub fn finish_timed(&mut self, time: f64, ended: &mut dyn FnMut(Stage)) -> Result<Report> {
        self.0.finish_timed(time, ended)
    }
}
