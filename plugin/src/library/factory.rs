//! The scenes that are built into the plugin, so that it sounds at first insert.

/// A scene file inside the plugin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FactoryScene {
    /// The id in saved states; it never changes.
    pub id: &'static str,
    /// The scene file.
    pub bytes: &'static [u8],
}

/// A loft at 48 kHz, in which reflections keep their place while one walks: what a new instance plays. A project names it as it
/// names a file, by its content ([`LOFT_HASHES`]), so that its choice of scenes is that of earlier versions.
pub const LOFT: FactoryScene = FactoryScene {
    id: "loft",
    bytes: include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/scenes/loft.promenade")),
};

/// BLAKE3 of [`LOFT`], then of those before it. Projects name the loft by one of them, and play the newest.
pub const LOFT_HASHES: [&str; 4] = [
    "79bffa5c4cb3c1f14cb2ecc72fc179ee39a96730e8714ed6e0f4b0bda21bbab9",
    "3ecbf40e0c8d4b42d634c444a9e2c962d67c9010403e1a15c7e2d5f9f61d0dba",
    "376e90fcc83c0ede09bccf21363390ed7b82f0de119fb05bff81473bb7507a56",
    "090f28b1ee624915198ae0a99e820f09da483975cfd7d69a9701ddfd7e291f40",
];
/// Title of [`LOFT`].
pub const LOFT_TITLE: &str = "Loft, round a corner";

/// A dry studio by image sources, whose head drawn rooms are heard with.
pub const STUDIO: FactoryScene = FactoryScene {
    id: "dry-studio",
    bytes: include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/library/dry-studio.promenade")),
};

/// An office, dry.
pub const ROOM_A: FactoryScene = FactoryScene {
    id: "iosr-room-a",
    bytes: include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/scenes/iosr-room-a.promenade")),
};

/// A class room, live.
pub const ROOM_B: FactoryScene = FactoryScene {
    id: "iosr-room-b",
    bytes: include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/scenes/iosr-room-b.promenade")),
};

/// A place that comes with Promenade, which factory presets name by its file.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Name of its file.
    pub file: &'static str,
    /// Its level, as [`level_cb`](super::level::level_cb) has it.
    pub level_cb: i32,
}

/// All of them. They are too large to be built in, but for [`STUDIO`].
pub const PLACES: [Place; 11] = [
    Place { file: "cathedral.promenade", level_cb: -121 },
    Place { file: "club.promenade", level_cb: -92 },
    Place { file: "concert-hall.promenade", level_cb: -115 },
    Place { file: "corridor.promenade", level_cb: -106 },
    Place { file: "courtyard.promenade", level_cb: -70 },
    Place { file: "dry-studio.promenade", level_cb: -56 },
    Place { file: "l-shaped-loft.promenade", level_cb: -70 },
    Place { file: "living-room.promenade", level_cb: -46 },
    Place { file: "parking-deck.promenade", level_cb: -54 },
    Place { file: "stairwell.promenade", level_cb: -30 },
    Place { file: "street.promenade", level_cb: -61 },
];

/// The place of a file name.
pub fn place(file: &str) -> Option<&'static Place> {
    PLACES.iter().find(|place| place.file == file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::{cache::content_hash, level::level_cb};
    use promenade_core::{Scene, SceneCard};
    use std::path::Path;
    use std::sync::Arc;

    #[test]
    fn places_are_as_loud_as_is_written_of_them() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/library");
        let level = |place: &Place| {
            let scene = Scene::from_bytes(&std::fs::read(folder.join(place.file)).unwrap()).unwrap();
            level_cb(&Arc::new(scene)).unwrap()
        };
        let wrong: Vec<_> =
            PLACES.iter().map(|p| (p.file, p.level_cb, level(p))).filter(|(_, a, b)| (a - b).abs() > 1).collect();
        assert!(wrong.is_empty(), "{wrong:?}");
    }

    #[test]
    fn projects_that_name_the_loft_still_find_it() {
        assert_eq!(content_hash(LOFT.bytes), LOFT_HASHES[0], "a project that was saved with the loft would not find it");
        let card = SceneCard::from_head(LOFT.bytes).unwrap();
        assert_eq!((card.provenance.title.as_str(), card.sample_rate_hz), (LOFT_TITLE, 48_000.0));
    }
}
