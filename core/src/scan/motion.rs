use crate::geometry::Pose;

/// The robot's motion since the last picture of a run, as [`Scanner::follow`](super::Scanner::follow) takes it.
///
/// Where there are `wheels` it is what they tell (nothing, where their log has a gap): the scan is then that of the pictures and the wheels
/// alone, whatever the run makes of them. Without wheels it is the run's own, from its pose `before` to the one `now`, unless the pictures
/// could not tell it and the motion was `held`.
pub fn motion_in_run(
    wheels: Option<Option<Pose<f32>>>,
    held: bool,
    before: &Pose<f32>,
    now: &Pose<f32>,
) -> Option<Pose<f32>> {
    match wheels {
        Some(told) => told,
        None if held => None,
        None => Some(before.inverse().compose(now)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wheels_tell_the_motion_even_nothing_of_it_and_without_them_the_poses_do_unless_held() {
        let (before, now) = (Pose::new(1.0, 2.0, 0.0), Pose::new(1.5, 2.0, 0.0));
        let wheels = Pose::new(0.4, 0.0, 0.1);
        assert_eq!(motion_in_run(Some(Some(wheels)), true, &before, &now), Some(wheels));
        assert_eq!(motion_in_run(Some(None), false, &before, &now), None);
        assert_eq!(motion_in_run(None, false, &before, &now), Some(Pose::new(0.5, 0.0, 0.0)));
        assert_eq!(motion_in_run(None, true, &before, &now), None);
    }
}
