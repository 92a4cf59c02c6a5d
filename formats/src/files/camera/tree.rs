//! Text of any form → named values.
use crate::{Error, Result};
use serde_json::{Map, Value};

/// What is read.
pub(super) const FORMS: &str = "give a camera file of ROS (camera_info), OpenCV, Kalibr, EuRoC, ORB-SLAM or KITTI, \
                                or write width, height, focal, principal and distortion into [camera] of the rig";

pub(super) type Tree = Map<String, Value>;

/// The documents of a text that hold something.
pub(super) fn trees(text: &str) -> Result<Vec<Tree>> {
    if text.trim().is_empty() {
        return Err(Error::new("is empty").help(FORMS));
    }
    if text.trim_start().starts_with('<') {
        return Ok(vec![from_xml(text)?]);
    }
    if text.lines().any(|line| line.trim() == "[image]") {
        return Ok(vec![from_ini(text)?]);
    }
    let mut trees = Vec::new();
    for document in documents(text) {
        match from_yaml(&document)? {
            Value::Object(tree) => trees.push(tree),
            Value::Null => {}
            _ => return Err(Error::new("is not a camera file: it has no named entries").help(FORMS)),
        }
    }
    Ok(trees)
}

/// The documents between lines of `---`, each with as many empty lines before it as there are lines, so that errors
/// count as an editor does. `%YAML:1.0`, with which OpenCV begins, is not YAML, and its tags say no more than the entries.
fn documents(text: &str) -> Vec<String> {
    let (mut documents, mut current) = (Vec::new(), String::new());
    for (before, line) in text.lines().enumerate() {
        let line = line.trim_end();
        if line == "---" || line == "..." {
            documents.push(std::mem::replace(&mut current, "\n".repeat(before + 1)));
        } else {
            if !line.starts_with('%') {
                current += &line.replace("!!opencv-matrix", "").replace("!!opencv-nd-matrix", "");
            }
            current.push('\n');
        }
    }
    documents.push(current);
    let content = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    documents.retain(|document| document.lines().any(content));
    documents
}

fn from_yaml(text: &str) -> Result<Value> {
    serde_saphyr::from_str(text).map_err(|error| {
        let first_line = error.to_string().lines().next().unwrap_or_default().to_owned();
        Error::new(format!("is not YAML: {first_line}")).help(FORMS)
    })
}

fn from_xml(text: &str) -> Result<Tree> {
    let document = roxmltree::Document::parse(text).map_err(|error| {
        Error::new(format!("is not XML: {error}")).help("give a camera file that OpenCV wrote")
    })?;
    Ok(elements(document.root_element()))
}

fn elements(node: roxmltree::Node<'_, '_>) -> Tree {
    let value = |child: roxmltree::Node<'_, '_>| {
        if child.children().any(|grandchild| grandchild.is_element()) {
            return Value::Object(elements(child));
        }
        let words: Vec<_> = child.text().unwrap_or_default().split_whitespace().collect();
        match words.as_slice() {
            [word] => scalar(word),
            words => words.iter().map(|word| scalar(word)).collect(),
        }
    };
    node.children()
        .filter(|child| child.is_element())
        .map(|child| (child.tag_name().name().to_owned(), value(child)))
        .collect()
}

/// The `.ini` of ROS's calibrator: a name on a line of its own, its numbers below it.
fn from_ini(text: &str) -> Result<Tree> {
    let (mut tree, mut name) = (Tree::new(), String::new());
    for (before, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with(['#', '[', ';']) {
            continue;
        }
        let number = |word| str::parse::<f64>(word).map(Value::from).map_err(|_| word);
        let numbers: std::result::Result<Vec<_>, _> = line.split_whitespace().map(number).collect();
        match (numbers, tree.get_mut(&name)) {
            (Ok(numbers), Some(Value::Array(list))) => list.extend(numbers),
            (Err(word), _) if line.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) => {
                let error = Error::new(format!("line {} holds `{word}`, which is no number", before + 1));
                return Err(error.help("correct the camera file"));
            }
            _ => {
                name = line.replace(' ', "_");
                tree.insert(name.clone(), Value::Array(Vec::new()));
            }
        }
    }
    Ok(tree)
}

fn scalar(word: &str) -> Value {
    word.parse::<f64>().map_or(Value::from(word), Value::from)
}
