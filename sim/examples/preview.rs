//! Writes pictures of a scene as PGM files: `preview SCENE FOLDER FRAME…`.
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().ok_or("which scene?")?;
    let folder = PathBuf::from(arguments.next().ok_or("which folder?")?);
    let frames: Vec<usize> = arguments.map(|frame| frame.parse()).collect::<Result<_, _>>()?;
    let settings = SceneConfig::default();
    let scene = match scene.as_str() {
        "corridor" => Scene::corridor(&settings),
        "office" => Scene::office(&settings),
        "table2" => Scene::table2(&settings),
        other => return Err(format!("no scene {other}").into()),
    };
    let started = Instant::now();
    let simulation = Simulation::new(scene, default_rig()?, SimConfig::default())?;
    eprintln!("built in {:?}", started.elapsed());
    let (width, height) = (simulation.rig().camera().width(), simulation.rig().camera().height());
    let mut pixels = vec![0; width * height];
    std::fs::create_dir_all(&folder)?;
    for frame in frames {
        let started = Instant::now();
        simulation.render(frame, &mut pixels)?;
        let took = started.elapsed();
        let mut file = format!("P5\n{width} {height}\n255\n").into_bytes();
        file.extend_from_slice(&pixels);
        std::fs::write(folder.join(format!("{frame:06}.pgm")), file)?;
        let corners = simulation.corners(frame);
        eprintln!("frame {frame}: {took:?}, pose {:?}", simulation.true_pose(frame));
        for corner in corners {
            println!(
                "{frame},{},{:.2},{:.2},{:.3},{:.3},{:?}",
                corner.id, corner.pixel.x, corner.pixel.y, corner.range, corner.bearing, corner.hidden
            );
        }
    }
    Ok(())
}
