//! The search for fronts.

use super::*;
use promenade_testing::scenes::room_with_images;

#[test]
fn a_front_falls_and_has_what_is_asked_for_within_its_error() {
    let scene = room_with_images(8_000.0, 0.2, 0.05, 20);
    let points = front(&scene, &STANDARD_JNDS, &|| true).unwrap();
    assert_eq!(points[0].error.jnds, 0.0);
    assert!(points.windows(2).all(|p| p[0].cost > p[1].cost && p[0].error.jnds < p[1].error.jnds), "{points:?}");
    assert_eq!(points, front(&scene, &STANDARD_JNDS, &|| true).unwrap(), "another front of the same scene");
    let costs = STANDARD_JNDS.map(|jnds| FrontPoint::within(&points, jnds).unwrap().cost);
    assert!(costs.windows(2).all(|pair| pair[1] <= pair[0]) && costs[3] < 0.9, "{costs:?}");
    // What a file carries is taken as it is.
    let mut parts = scene.parts().clone();
    parts.front = points.clone();
    let carrying = Arc::new(Scene::new(parts).unwrap());
    let (kept, point) = scene_within(&carrying, 1.0, &|| false).unwrap();
    assert_eq!(Some(&point), FrontPoint::within(&points, 1.0));
    assert_eq!(point.setting, Setting::ALL.of(&kept));
    assert_eq!(front(&scene, &STANDARD_JNDS, &|| false), Err(JudgeError::Unwanted));
}
