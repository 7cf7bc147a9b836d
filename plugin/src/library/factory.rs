//! The scenes that are built into the plugin, so that it sounds at first insert.

/// A scene file inside the plugin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FactoryScene {
    /// The id in saved states; it never changes.
    pub id: &'static str,
    /// The scene file.
    pub bytes: &'static [u8],
}

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
