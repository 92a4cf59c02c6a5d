//! A run: every picture through the pipeline, in order, with word of it several times a second.
use crate::decode::Picture;
use crate::readers::{JsRig, Listener, Shown};
use crate::source::{Decoding, Frame};
use crate::stepper::{self, Motion, Stepper, now};
use crate::{Session, object};
use js_sys::{Array, Float32Array};
use monorange_wasm_record::Record;
use std::collections::VecDeque;
use wasm_bindgen::prelude::*;

/// Results are handed over this often, with the newest picture.
const WORD_EVERY_MS: f64 = 100.0;
/// Pictures that are decoded ahead; more would only fill memory.
const AHEAD: usize = 3;

pub(crate) async fn run(
    session: &Session,
    number: u32,
    rig: &JsRig,
    listener: &Listener,
) -> Result<bool, JsValue> {
    let frames = session.frames.borrow().clone();
    let times = session.times.borrow().clone();
    let start = times.first().copied().unwrap_or_default();
    let motion = match (session.motion(), &session.layout) {
        ("odometry", Some(layout)) => Motion::Wheels(layout.clone()),
        ("pictures", _) => Motion::Pictures,
        _ => Motion::Nothing,
    };
    let unmeasured = matches!(motion, Motion::Pictures).then_some(0);
    let title = session.record.borrow().title.clone();
    let mut stepper = Stepper::new(rig, &session.readers, start, motion)?.with_scan(rig, &session.readers);
    let carried = stepper.carried();
    *session.record.borrow_mut() =
        Record { title, frames: frames.len(), start, unmeasured, carried, ..Record::default() };
    let done = Run { session, frames: &frames, times: &times, listener, number }.go(&mut stepper).await;
    if session.running.get() == number || !matches!(done, Ok(true)) {
        stepper.end(&mut session.record.borrow_mut(), &session.readers);
    }
    done
}

struct Run<'a> {
    session: &'a Session,
    frames: &'a [Frame],
    times: &'a [f64],
    listener: &'a Listener,
    number: u32,
}

impl Run<'_> {
    /// Whether it came to its end.
    async fn go(&self, stepper: &mut Stepper) -> Result<bool, JsValue> {
        let readers = &self.session.readers;
        let mut ahead: VecDeque<Result<Decoding, JsValue>> = VecDeque::new();
        let mut waiting = self.frames.iter();
        let (begin, mut word) = (now(), 0.0);
        let mut results = Array::new();
        for (index, frame) in self.frames.iter().enumerate() {
            ahead.extend(waiting.by_ref().take(AHEAD - ahead.len()).map(|next| next.begin(readers)));
            let asked = now();
            let picture = match ahead.pop_front() {
                Some(Ok(decoding)) => decoding.finish(readers).await,
                Some(Err(error)) => Err(error),
                None => Err("it was lost".into()),
            };
            if self.session.running.get() != self.number {
                return Ok(false);
            }
            let picture = picture.map_err(|error| object::words(&error));
            let time = self.times.get(index).copied().unwrap_or_default();
            let (result, used) = stepper.step(&picture, index, &frame.name(), time, now() - asked);
            results.push(&result);
            stepper::note(&mut self.session.record.borrow_mut(), used);
            if now() - word > WORD_EVERY_MS {
                word = now();
                let shown = match &picture {
                    Ok(picture) => shown(picture, Some(stepper.edges())).await?.into(),
                    Err(_) => JsValue::NULL,
                };
                let done = (index + 1) as f64;
                let left = (word - begin) / 1000.0 / done * (self.frames.len() as f64 - done);
                self.listener.progress(core::mem::take(&mut results), shown, left);
            }
        }
        self.listener.progress(results, JsValue::NULL, 0.0);
        Ok(true)
    }
}

/// A picture for the screen.
pub(crate) async fn shown(picture: &Picture, edges: Option<Vec<f32>>) -> Result<Shown, JsValue> {
    let edges = edges.map_or(JsValue::NULL, |edges| Float32Array::from(edges.as_slice()).into());
    let shown = js_sys::Object::new();
    object::fill(&shown, [("picture", picture.bitmap().await?.into()), ("edges", edges)]);
    Ok(shown.unchecked_into())
}
