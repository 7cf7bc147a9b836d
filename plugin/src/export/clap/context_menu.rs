//! The host's own menu of a parameter, for the editor: the host's part of `clap.context-menu`, which the framework does not ask
//! for.

use super::{host_extension, parameter_id};
use crate::parameter::Parameter;
use crate::telemetry::host_side::{HostSide, MenuItem, MenuRequest};
use clack_extensions::context_menu::{
    ContextMenuBuilder, ContextMenuBuilderImpl, ContextMenuError, ContextMenuTarget, Item, ItemKind,
};
use clack_plugin::utils::ClapId;
use clap_sys::ext::context_menu::{CLAP_EXT_CONTEXT_MENU, CLAP_EXT_CONTEXT_MENU_COMPAT, clap_host_context_menu};
use nice_plug::wrapper::clap::{clap_host, clap_plugin};
use std::ffi::CStr;

const IDS: [&CStr; 2] = [CLAP_EXT_CONTEXT_MENU, CLAP_EXT_CONTEXT_MENU_COMPAT];

/// Answers what the editor has asked. Main thread.
pub(super) fn serve(plugin: *const clap_plugin, side: &HostSide) {
    for request in side.take_requests() {
        let extension = host_extension::<clap_host_context_menu>(plugin, &IDS);
        match (request, extension) {
            (MenuRequest::Show(parameter, at), Some((host, menu))) => {
                let items = populated(host, menu, parameter);
                if items.is_empty() {
                    pop_up(host, menu, parameter, at);
                }
                side.show_menu(parameter, items);
            }
            (MenuRequest::Perform(parameter, action), Some((host, menu))) => perform(host, menu, parameter, action),
            (_, None) => (),
        }
    }
}

fn target(parameter: Parameter) -> ContextMenuTarget {
    ContextMenuTarget::Param(ClapId::new(parameter_id(parameter)))
}

/// The host's lines; none where it gives none.
fn populated(host: *const clap_host, menu: &clap_host_context_menu, parameter: Parameter) -> Vec<MenuItem> {
    let Some(populate) = menu.populate else { return Vec::new() };
    let mut lines = Lines::default();
    let target = target(parameter).to_raw();
    let mut builder = ContextMenuBuilder::new(&mut lines);
    // SAFETY: the host is alive; target and builder live through the call.
    let done = unsafe { populate(host, &raw const target, builder.as_raw_mut()) };
    if done { lines.finished() } else { Vec::new() }
}

/// Has the host show a menu of its own, where it can.
fn pop_up(host: *const clap_host, menu: &clap_host_context_menu, parameter: Parameter, [x, y]: [i32; 2]) {
    let target = target(parameter).to_raw();
    if let (Some(can), Some(popup)) = (menu.can_popup, menu.popup) {
        // SAFETY: the host is alive, and the target lives through the call.
        unsafe {
            if can(host) {
                popup(host, &raw const target, 0, x, y);
            }
        }
    }
}

fn perform(host: *const clap_host, menu: &clap_host_context_menu, parameter: Parameter, action: u32) {
    let target = target(parameter).to_raw();
    // SAFETY: the host is alive, and the target lives through the call.
    let done = menu.perform.is_some_and(|perform| unsafe { perform(host, &raw const target, action) });
    if !done {
        nice_plug::nice_warn!("the host does not do what its menu offers");
    }
}

/// The lines as the host adds them, and the menus that are open meanwhile.
#[derive(Default)]
struct Lines {
    items: Vec<MenuItem>,
    open: Vec<(String, bool, Vec<MenuItem>)>,
}

impl Lines {
    /// All of them; menus that the host has left open are closed.
    fn finished(mut self) -> Vec<MenuItem> {
        while !self.open.is_empty() {
            self.close();
        }
        self.items
    }

    fn close(&mut self) -> bool {
        let Some((label, enabled, outer)) = self.open.pop() else { return false };
        let items = std::mem::replace(&mut self.items, outer);
        self.items.push(MenuItem::Submenu { label, enabled, items });
        true
    }
}

impl ContextMenuBuilderImpl for Lines {
    fn supports(&mut self, _kind: ItemKind) -> bool {
        true
    }

    fn add_item(&mut self, item: Item) -> Result<(), ContextMenuError> {
        let words = |text: &CStr| text.to_string_lossy().into_owned();
        match item {
            Item::Entry { label, enabled, action_id } => {
                self.items.push(MenuItem::Entry { label: words(label), enabled, checked: None, action: action_id.get() });
            }
            Item::CheckEntry { label, enabled, checked, action_id } => {
                let (label, checked) = (words(label), Some(checked));
                self.items.push(MenuItem::Entry { label, enabled, checked, action: action_id.get() });
            }
            Item::Separator => self.items.push(MenuItem::Separator),
            Item::Title { title, .. } => self.items.push(MenuItem::Title(words(title))),
            Item::BeginSubmenu { label, enabled } => {
                self.open.push((words(label), enabled, std::mem::take(&mut self.items)));
            }
            Item::EndSubmenu if self.close() => (),
            _ => return Err(ContextMenuError::Builder),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn menus_within_menus_are_put_together() {
        let mut lines = Lines::default();
        let entry = |label| Item::Entry { label, enabled: true, action_id: ClapId::new(7) };
        lines.add_item(Item::BeginSubmenu { label: c"MIDI", enabled: true }).unwrap();
        lines.add_item(entry(c"Learn")).unwrap();
        lines.add_item(Item::EndSubmenu).unwrap();
        assert!(lines.add_item(Item::EndSubmenu).is_err(), "none is open");
        lines.add_item(Item::Separator).unwrap();
        lines.add_item(Item::BeginSubmenu { label: c"Left open", enabled: false }).unwrap();
        let learn = MenuItem::Entry { label: "Learn".to_owned(), enabled: true, checked: None, action: 7 };
        let expected = [
            MenuItem::Submenu { label: "MIDI".to_owned(), enabled: true, items: vec![learn] },
            MenuItem::Separator,
            MenuItem::Submenu { label: "Left open".to_owned(), enabled: false, items: vec![] },
        ];
        assert_eq!(lines.finished(), expected);
    }
}
