//! `slam` on several drives: side by side on all cores, with one line of progress.
use super::{Arguments, Drive, Inputs};
use crate::{
    commands::{progress, results},
    outputs::{Outputs, to_file_or_stdout},
    warnings,
};
use indicatif::ProgressBar;
use monorange_formats::{Error, Result};
use std::{
    collections::HashSet,
    num::NonZero,
    path::{Component, Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

/// Runs every drive; one that fails is told, and the others are done all the same.
pub(super) fn run(arguments: &Arguments, drives: &[Inputs]) -> Result<()> {
    let names = names(drives)?;
    // Before the drives' own folders, so that one that fails does not take it from the others.
    let folder = Outputs::into_folder(&arguments.out)?;
    let bar = progress::bar_of_drives();
    let count = |done: usize| bar.set_prefix(format!("{done} of {} drives done", drives.len()));
    count(0);
    warnings::print_above(Some(bar.clone()));
    let next = AtomicUsize::new(0);
    let begun = Mutex::new((0, 0));
    // Until all drives are read, those that are not count as long as the others on average.
    let begin = |frames: usize| {
        let mut begun = begun.lock().unwrap_or_else(PoisonError::into_inner);
        *begun = (begun.0 + frames, begun.1 + 1);
        bar.set_length((begun.0 * drives.len() / begun.1) as u64);
    };
    let told = Mutex::new((0, vec![None; drives.len()]));
    let work = || {
        while let (place, Some(inputs)) = {
            let place = next.fetch_add(1, Ordering::Relaxed);
            (place, drives.get(place))
        } {
            // What was warned of in this thread's last drive is that drive's.
            monorange_formats::warnings::forget();
            let out = arguments.out.join(names.get(place).map_or("", String::as_str));
            let result = one(arguments, inputs, &out, &bar, begin);
            let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
            match (result, told.1.get_mut(place)) {
                (Ok(text), Some(slot)) => *slot = Some(text),
                (Err(error), _) => bar.suspend(|| eprintln!("error: {error}")),
                _ => {}
            }
            told.0 += 1;
            count(told.0);
        }
    };
    let cores = thread::available_parallelism().map_or(1, NonZero::get).min(drives.len());
    thread::scope(|scope| (0..cores).for_each(|_| drop(scope.spawn(work))));
    bar.finish_and_clear();
    warnings::print_above(None);
    let (_, told) = told.into_inner().unwrap_or_else(PoisonError::into_inner);
    let done: Vec<String> = told.into_iter().flatten().collect();
    let failed = drives.len() - done.len();
    if done.is_empty() {
        drop(folder)
    } else {
        folder.commit()?
    }
    to_file_or_stdout(None, |out| match arguments.json {
        true => writeln!(out, "[\n{}\n]", done.join(",\n")),
        false => writeln!(out, "{}", done.join("\n")),
    })?;
    if failed > 0 {
        let cause = format!("{failed} of {} drives failed, as said above", drives.len());
        return Err(
            Error::new(cause).help("correct what is said there and run those again; the others are done")
        );
    }
    Ok(())
}

/// Runs one drive, and gives its summary.
fn one(
    arguments: &Arguments,
    inputs: &Inputs,
    out: &Path,
    bar: &ProgressBar,
    begin: impl Fn(usize),
) -> Result<String> {
    let (rig, sequence) = inputs.read()?;
    let map = arguments.saved()?;
    let mut outputs = arguments.outputs(out)?;
    let mut drive = Drive::new(arguments, inputs, &rig, &sequence, map.as_ref())?;
    begin(sequence.images.len());
    drive.all_frames(bar)?;
    let (mut run, _, scanned) = drive.finish(inputs, &mut outputs)?;
    results::write(&mut outputs, &mut run)?;
    scanned.iter().try_for_each(|scanned| scanned.write(&mut outputs))?;
    outputs.commit()?;
    Ok(results::summary(&run, out, arguments.json)?.trim_end().to_owned())
}

/// A name for each drive: its path without what all paths begin and end with.
///
/// # Errors
/// When that does not tell them apart.
fn names(drives: &[Inputs]) -> Result<Vec<String>> {
    let parts: Vec<_> = drives.iter().map(parts).collect();
    let shortest = parts.iter().map(Vec::len).min().unwrap_or(0);
    let same = |place: &dyn Fn(&Vec<String>) -> Option<String>| {
        let mut all = parts.iter().map(place);
        let first = all.next();
        all.all(|part| Some(part) == first)
    };
    let start = (0..shortest).take_while(|place| same(&|path| path.get(*place).cloned())).count();
    let end = (0..shortest - start).take_while(|place| same(&|path| path.iter().rev().nth(*place).cloned()));
    let end = end.count();
    let mut known = HashSet::new();
    let name = |(path, drive): (&Vec<String>, &Inputs)| {
        let name = path.get(start..path.len() - end).unwrap_or_default().join("-");
        match !name.is_empty() && known.insert(name.clone()) {
            true => Ok(name),
            false => Err(Error::new("cannot be told apart from another drive by its name")
                .at(drive.place())
                .help("give every drive once, and none inside another one")),
        }
    };
    parts.iter().zip(drives).map(name).collect()
}

/// The names of the folders on the way to a drive.
fn parts(drive: &Inputs) -> Vec<String> {
    let path = match drive.bag.first() {
        Some(bag) => bag.with_extension(""),
        None => drive.place().to_owned(),
    };
    let path: PathBuf = std::path::absolute(&path).unwrap_or(path);
    let part = |part: Component<'_>| match part {
        Component::Normal(name) => Some(name.to_string_lossy().into_owned()),
        _ => None,
    };
    path.components().filter_map(part).collect()
}
