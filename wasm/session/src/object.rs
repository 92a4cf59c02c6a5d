//! Plain objects and errors for JavaScript.
use js_sys::{Object, Reflect};
use wasm_bindgen::prelude::*;

/// Sets the entries of a plain object.
pub(crate) fn fill<const N: usize>(object: &Object, entries: [(&str, JsValue); N]) {
    for (name, value) in entries {
        // A plain object refuses nothing.
        let _ = Reflect::set(object, &name.into(), &value);
    }
}

/// A JavaScript error with this sentence.
pub(crate) fn error(sentence: &str) -> JsValue {
    js_sys::Error::new(sentence).into()
}

/// What an error says.
pub(crate) fn words(error: &JsValue) -> String {
    match error.dyn_ref::<js_sys::Error>() {
        Some(error) => error.message().into(),
        None => error.as_string().unwrap_or_else(|| format!("{error:?}")),
    }
}
