//! The page's words and order.
use super::{Carried, Run, Subject, floor_plan, plots, svg::escape};
use base64::{Engine, engine::general_purpose::STANDARD};
use monorange_core::slam::{Decision, Reason, Verdict};
use std::fmt::Write as _;

/// The whole page.
pub fn page(run: &Run) -> String {
    let mut html = String::new();
    let _ = write!(
        html,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>{} – monorange</title>\n<style>{}</style>\n<main>",
        escape(&run.title),
        super::STYLE
    );
    html += &header(run);
    html += &map_section(run);
    html += &frames_section(run);
    html += &pose_section(run);
    html += &innovation_section(run);
    html += &times_section(run);
    html += &settings_section(run);
    let _ = writeln!(
        html,
        "<footer>monorange {} · <code>{}</code></footer></main></html>",
        env!("CARGO_PKG_VERSION"),
        escape(&run.command)
    );
    html
}

fn header(run: &Run) -> String {
    let mut html =
        format!("<p class=\"brand\">monorange · {}</p><h1>{}</h1>", escape(&run.title), headline(run));
    let class = match run.verdict {
        Verdict::Consistent => "",
        Verdict::Unchecked | Verdict::Doubtful => "warn",
        Verdict::Lost => "bad",
    };
    let advice = match run.reason {
        Some(Reason::Attitude) => {
            "Say in the rig by how much tilt and roll change from picture to picture (sway under [filter]), or give what an IMU tells."
        }
        _ => run.subject.advice(run.verdict),
    };
    let reason = run.reason.map_or_else(String::new, |reason| format!(": {}", reason.as_str()));
    let innovation = match run.verdict {
        Verdict::Unchecked => String::new(),
        _ => format!(" · mean innovation {:.2} a degree of freedom (1 is right)", run.mean_nis),
    };
    let _ = write!(
        html,
        "<p class=\"lead\"><span class=\"verdict {class}\">{}</span>{reason}{innovation}. {advice}</p>",
        capital(run.verdict.as_str())
    );
    for sentence in remarks(run) {
        let _ = write!(html, "<p class=\"lead\">{sentence}</p>");
    }
    html += "<dl class=\"figures\">";
    let matched = run.count(&[Decision::Update, Decision::Tentative]);
    let refused = run.count(&[Decision::Gated, Decision::Rejected]);
    let [x, y, heading] = run.end_std();
    let mut figures = vec![
        ("Path", format!("{:.1} m", run.path()), format!("in {:.0} s", run.seconds())),
        ("Frames used", run.frames_used.to_string(), format!("of {}", run.frames)),
        ("Landmarks", run.map.len().to_string(), String::new()),
        (matched_label(run), matched.to_string(), format!("{refused} refused")),
        ("End, 1σ", length(libm::hypot(x, y)), format!("{:.2}°", heading.to_degrees())),
    ];
    if let Some(errors) = &run.errors {
        let absolute = &errors.absolute;
        let percent = format!("{:.2} % of the path", absolute.end_position_percent);
        figures.push(("End error", length(absolute.end_position), percent));
        let turn = format!("heading {:.2}°", absolute.heading.rms.to_degrees());
        figures.push(("Error, rms", length(absolute.position.rms), turn));
        if let Some(nees) = &errors.nees {
            let share = format!("{:.0} %", 100.0 * nees.inside_3_sigma);
            figures.push(("Poses inside 3σ", share, format!("NEES/3 {:.2}", nees.mean_per_dof)));
        }
    }
    if let Some(map) = &run.map_errors {
        let matched = format!("rms of {} of {}", map.matched, map.truth);
        figures.push(("Map, aligned", length(map.aligned_position.rms), matched));
    }
    for (name, value, more) in figures {
        let _ = write!(html, "<div><dt>{name}</dt><dd>{value}<small>{more}</small></dd></div>");
    }
    html + "</dl>"
}

fn matched_label(run: &Run) -> &'static str {
    match run.subject {
        Subject::FloorCorners => "Corners matched",
        Subject::Measurements => "Measurements matched",
    }
}

fn headline(run: &Run) -> String {
    let [x, y, _] = run.end_std();
    let landmarks = match run.map.len() {
        0 => "no landmark found".to_owned(),
        1 => "1 landmark mapped".to_owned(),
        count => format!("{count} landmarks mapped"),
    };
    let certainty = match &run.errors {
        Some(errors) => format!("{} from the true position at the end", length(errors.absolute.end_position)),
        None => format!("position at the end known to ±{}", length(libm::hypot(x, y))),
    };
    format!("{:.1} m driven, {landmarks}, {certainty}.", run.path())
}

fn remarks(run: &Run) -> Vec<String> {
    let mut remarks: Vec<_> =
        run.warnings.iter().map(|warning| format!("Warning: {}.", escape(warning))).collect();
    if let Some(unmeasured) = run.unmeasured {
        remarks.push(match unmeasured {
            0 => "There was no odometry: the motion came from the pictures.".to_owned(),
            _ => format!(
                "There was no odometry: the motion came from the pictures. {unmeasured} of {} steps could not be \
                 measured and held the speed before.",
                run.trajectory.len() - 1
            ),
        });
    }
    if let Some(when) = run.knocked_when() {
        remarks.push(format!("The camera seems to have been knocked {when}; its mount was estimated anew."));
    }
    if let Some(Carried { floor, free, map }) = run.carried {
        remarks.push(format!(
            "The corners of {floor} pictures were predicted by the floor’s homography, of {free} by the free one, and of {map} \
             by the map."
        ));
    }
    if run.without_range > 0 {
        remarks.push(format!(
            "{} corners lay too near to the horizon for a range and were not used.",
            run.without_range
        ));
    }
    if run.no_room > 0 {
        remarks.push(format!("{} landmarks found no room; --max-landmarks gives more.", run.no_room));
    }
    match run.left_out.as_slice() {
        [] => {}
        [only] => remarks.push(format!("One frame was left out: {}.", escape(only))),
        [first, ..] => remarks.push(format!(
            "{} frames were left out, the first: {}.",
            run.left_out.len(),
            escape(first)
        )),
    }
    remarks
}

fn map_section(run: &Run) -> String {
    let mut keys = key("trajectory", "M0 6H26", "path")
        + &key("landmark", "M9 6a4 4 0 1 0 8 0a4 4 0 1 0 -8 0", "landmark");
    keys += &key("landmark-ellipse", "M1 6a12 5 0 1 0 24 0a12 5 0 1 0 -24 0", "its 3σ");
    if !run.pairs.is_empty() {
        keys += &key("truth", "M0 6H26", "truth");
    }
    if !run.true_map.is_empty() {
        keys += &key(
            "true-landmark",
            "M9 6h8m-4 -4v8",
            &format!(
                "true {}",
                match run.subject {
                    Subject::FloorCorners => "corner",
                    Subject::Measurements => "landmark",
                }
            ),
        );
    }
    if !run.laser.is_empty() {
        keys += &key("laser", "M3 8h0M9 5h0M14 8h0M20 4h0", "laser");
    }
    format!(
        "<section><h2>Map</h2><p class=\"hint\">{keys} Data: <code>trajectory.csv</code>, <code>map.csv</code>.</p><figure>{}</figure></section>",
        floor_plan::svg(&run.seen_from_above())
    )
}

fn frames_section(run: &Run) -> String {
    if run.shots.is_empty() {
        return String::new();
    }
    let mut html = "<section><h2>What the camera saw</h2><p class=\"hint\">Frames with the most floor corners of each part of the \
        drive, with the floor’s 1 m grid. Data: <code>observations.csv</code>.</p><div class=\"frames\">"
        .to_owned();
    for shot in &run.shots {
        let caption = escape(&shot.caption);
        let data = STANDARD.encode(&shot.jpeg);
        let _ = write!(
            html,
            "<figure><img alt=\"{caption}\" src=\"data:image/jpeg;base64,{data}\"><figcaption>{caption}</figcaption></figure>"
        );
    }
    html + "</div></section>"
}

fn pose_section(run: &Run) -> String {
    let (title, hint) = if run.pairs.is_empty() {
        ("How certain the pose is", "±3σ of the filter. There was no truth to compare with.")
    } else {
        ("Pose errors", "Estimate minus truth (line) inside ±3σ of the filter (area).")
    };
    format!(
        "<section><h2>{title}</h2><p class=\"hint\">{hint} Data: <code>trajectory.csv</code>.</p><div class=\"charts\">{}</div></section>",
        plots::pose(run)
    )
}

fn innovation_section(run: &Run) -> String {
    if run.observations.iter().all(|seen| seen.nis.is_none()) {
        return String::new();
    }
    let keys = key("nis", "M13 6h0", "used")
        + &key("nis-gated", "M13 6h0", "refused")
        + &key("nis-mean", "M0 6H26", "mean of 64");
    format!(
        "<section><h2>Innovations</h2><p class=\"hint\">{keys} A consistent filter has its mean at 2; higher values lie on the upper edge. \
         Data: <code>observations.csv</code>.</p><figure>{}</figure></section>",
        plots::innovations(run)
    )
}

fn times_section(run: &Run) -> String {
    if run.stages.is_empty() {
        return String::new();
    }
    let stages: Vec<_> = run.stages.iter().map(|stage| (stage.name, stage.mean_median_max())).collect();
    let largest = stages.iter().map(|(_, [_, median, _])| *median).fold(1e-9, f64::max);
    let total: f64 = stages.iter().map(|(_, [_, median, _])| median).sum();
    let mut html = format!(
        "<section><h2>Time per frame</h2><p class=\"hint\">{total:.1} ms in all on this machine (medians), {:.0} frames a second.</p>\
         <table><tr><th>Stage<th class=\"n\">mean, ms<th class=\"n\">median<th class=\"n\">largest<th style=\"width:40%\"></tr>",
        1e3 / total.max(1e-9)
    );
    for (name, [mean, median, max]) in stages {
        let share = 100.0 * median / largest;
        let _ = write!(
            html,
            "<tr><td>{name}<td class=\"n\">{mean:.2}<td class=\"n\">{median:.2}<td class=\"n\">{max:.2}<td><span class=\"bar\" style=\"width:{share:.1}%\"></span></tr>"
        );
    }
    html + "</table></section>"
}

fn settings_section(run: &Run) -> String {
    let settings = &run.setup.settings;
    let changed = settings.iter().filter(|setting| setting.changed).count();
    let mut html = format!(
        "<section><h2>Settings</h2><p class=\"hint\">{} {changed} of {} settings differ from their defaults.</p>\
         <details><summary>All settings</summary><table><tr><th>Setting<th class=\"n\">value<th>unit<th>meaning<th>where the default comes from</tr>",
        escape(&run.setup.words),
        settings.len()
    );
    for setting in settings {
        let class = if setting.changed { " class=\"changed\"" } else { "" };
        let _ = write!(
            html,
            "<tr{class}><td>{}<td class=\"n\">{}<td>{}<td>{}<td>{}</tr>",
            setting.name,
            escape(&setting.value),
            setting.unit,
            escape(setting.help),
            escape(setting.origin)
        );
    }
    html + "</table></details></section>"
}

fn key(class: &str, path: &str, words: &str) -> String {
    format!(
        "<span class=\"key\"><svg viewBox=\"0 0 26 12\" aria-hidden=\"true\"><path class=\"{class}\" d=\"{path}\"/></svg>{words}</span>"
    )
}

/// A length in the unit in which it is short.
fn length(metres: f64) -> String {
    match metres.abs() {
        size if size < 0.01 => format!("{:.1}\u{a0}mm", metres * 1e3),
        size if size < 1.0 => format!("{:.1}\u{a0}cm", metres * 1e2),
        _ => format!("{metres:.2}\u{a0}m"),
    }
}

fn capital(word: &str) -> String {
    let mut characters = word.chars();
    characters.next().map_or(String::new(), |first| first.to_uppercase().chain(characters).collect())
}
