//! What a project keeps: the parameters and everything that is saved beside them.

pub mod adm_config;
pub mod exchange;
pub mod file_wish;
pub(crate) mod host_values;
pub(crate) mod hosted;
pub mod leader;
pub mod matching;
pub mod osc_config;
pub mod params;
pub mod persisted;
pub mod preferences;
pub mod project_id;
pub mod saved_head;
pub mod saved_headphones;
pub mod scene_frame;
pub mod settings;
pub mod slots;
pub mod source_walks;
pub mod sources;
pub mod state;
pub mod walk;
