//! What CLAP plugins and hosts tell each other beside sound and values: pages of remote controls, marks on parameters, and the
//! track.

use super::ClapPlugin;
use crate::Fault;
use crate::mark::{AutomationMark, Colour, Mark, Track};
use crate::menu::MenuAction;
use crate::remote_page::RemotePage;
use clack_extensions::param_indication::{ParamIndicationAutomation, PluginParamIndication};
use clack_extensions::remote_controls::{PluginRemoteControls, RemoteControlsPageBuffer};
use clack_extensions::track_info::PluginTrackInfo;
use clack_host::prelude::ClapId;
use clack_host::utils::Color;
use std::ffi::CString;

/// More pages than any plugin has.
const MOST_PAGES: u32 = 1_000;

fn opaque([red, green, blue]: Colour) -> Color {
    Color { alpha: 255, red, green, blue }
}

impl ClapPlugin {
    /// The pages that the plugin declares.
    pub(super) fn declared_pages(&mut self) -> Vec<RemotePage> {
        let Ok(remote) = self.extension::<PluginRemoteControls>("pages of remote controls") else { return Vec::new() };
        let handle = self.instance.plugin_handle();
        let mut buffer = RemoteControlsPageBuffer::new();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let mut all = Vec::new();
        for index in 0..remote.count(&handle).min(MOST_PAGES) {
            let Some(page) = remote.get(&handle, index, &mut buffer) else { continue };
            let parameters = page.param_ids.map(|id| id.map(ClapId::get));
            all.push(RemotePage { section: text(page.section_name), name: text(page.page_name), parameters });
        }
        all
    }

    /// Marks a parameter.
    pub(super) fn show_mark(&mut self, id: u32, mark: &Mark) -> Result<(), Fault> {
        let indication = self.extension::<PluginParamIndication>("marks on parameters")?;
        let handle = self.instance.plugin_handle();
        let text = |text: &str| CString::new(text).unwrap_or_default();
        match mark {
            Mark::Mapping(Some((label, description, colour))) => {
                let (label, description) = (text(label), text(description));
                let colour = Some(opaque(*colour));
                indication.set_mapping(&handle, ClapId::new(id), true, colour, Some(&label), Some(&description));
            }
            Mark::Mapping(None) => indication.set_mapping(&handle, ClapId::new(id), false, None, None, None),
            Mark::Automation(state, colour) => {
                let state = match state {
                    AutomationMark::None => ParamIndicationAutomation::None,
                    AutomationMark::Present => ParamIndicationAutomation::Present,
                    AutomationMark::Playing => ParamIndicationAutomation::Playing,
                    AutomationMark::Recording => ParamIndicationAutomation::Recording,
                    AutomationMark::Overriding => ParamIndicationAutomation::Overriding,
                };
                indication.set_automation(&handle, ClapId::new(id), state, colour.map(opaque));
            }
        }
        Ok(())
    }

    /// Tells the plugin of its track.
    pub(super) fn tell_track(&mut self, track: Track) -> Result<(), Fault> {
        let info = self.extension::<PluginTrackInfo>("interest in its track")?;
        self.requests.set_track(track);
        info.changed(&self.instance.plugin_handle());
        Ok(())
    }

    /// What was chosen in this host's menus, with the parameters.
    pub(super) fn chosen(&mut self) -> Vec<(u32, MenuAction)> {
        self.requests.take_chosen()
    }
}
