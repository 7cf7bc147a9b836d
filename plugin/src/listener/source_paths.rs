//! Where the sources of an instance are that follow paths of their own.

use super::Listener;
use crate::parameter::choices::Follow;
use crate::project::walk::Walk;
use promenade_core::glam::Vec3;

/// The paths of an instance's sources during one block.
#[derive(Clone, Copy, Default)]
pub(crate) struct SourcePaths<'a> {
    walks: &'a [Option<Walk>],
    /// Where the scene has its emitter, metres.
    home: Vec3,
}

impl<'a> SourcePaths<'a> {
    /// Paths in the world of a scene that has its emitter at `home`; a scene without one moves no source.
    pub(crate) fn new(walks: Option<&'a [Option<Walk>]>, home: Option<Vec3>) -> Self {
        walks.zip(home).map_or_else(Self::default, |(walks, home)| Self { walks, home })
    }
}

impl Listener<'_> {
    /// Whether sources move along paths.
    pub(crate) fn moves_sources(&self) -> bool {
        self.sources.follow != Follow::Off && self.paths.walks.iter().any(Option::is_some)
    }

    /// How far its path takes a source, 0 for the first, from the scene's emitter at a sample of the block, metres; nothing
    /// without a path that is followed.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn source_offset(&self, source: usize, sample: usize) -> Vec3 {
        let walk = self.paths.walks.get(source).and_then(Option::as_ref);
        let pose = walk.and_then(|walk| self.sources_at(sample).on(walk, self.time_s(sample)));
        pose.map_or(Vec3::ZERO, |pose| pose.position - self.paths.home)
    }
}
