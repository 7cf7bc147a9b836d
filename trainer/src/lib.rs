//! Training of scenes.
