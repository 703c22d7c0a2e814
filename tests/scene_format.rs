//! The built-in scenes.
use lanecast::scene::{assembly::Assembly, builtin};
#[test]
fn builtin_scenes_load() {
    for name in builtin::NAMES {
        let t = std::time::Instant::now();
        match builtin::load(name, &[]) {
            Ok(d) => {
                let a = Assembly::new(&d).unwrap();
                println!("{name}: {} placements {} prims {:?}", a.placements.len(), a.instanced_prims(), t.elapsed());
            }
            Err(e) => println!("{e}"),
        }
    }
}
