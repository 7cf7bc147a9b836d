//! How large an editor's window is, and whether it takes keys.

use crate::worker::lock::lock;
use std::sync::{Mutex, MutexGuard};

/// What the window reports of its size and its keyboard.
#[derive(Debug, Default)]
pub(super) struct Geometry(Mutex<Held>);

#[derive(Debug, Default)]
pub(super) struct Held {
    /// Pixels, while a window is open.
    pub(super) open: Option<(u32, u32)>,
    /// Pixels per point at zoom 1; the last that a window had.
    pub(super) scale: Option<f64>,
    /// Whether keys go to a text field.
    pub(super) typing: bool,
    /// Whether the window is to close.
    pub(super) closing: bool,
    /// The X server's number of the window.
    pub(super) window: Option<u32>,
}

impl Geometry {
    /// Notes a window's size, pixels, and its pixels per point at zoom 1.
    pub(super) fn resized(&self, pixels: (u32, u32), scale: f64) {
        let mut held = self.held();
        (held.open, held.scale) = (Some(pixels), Some(scale));
    }

    /// Notes that the window is gone.
    pub(super) fn closed(&self) {
        let mut held = self.held();
        *held = Held { scale: held.scale, ..Held::default() };
    }

    /// Notes whether keys go to a text field.
    pub(super) fn types(&self, typing: bool) {
        self.held().typing = typing;
    }

    pub(super) fn held(&self) -> MutexGuard<'_, Held> {
        lock(&self.0)
    }
}
