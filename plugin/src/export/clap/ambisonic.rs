//! Which Ambisonics a CLAP host gets: `clap.ambisonic` and the ports' type, neither of which the framework has.

use super::{Tables, framework_extension};
use crate::playing::output::Output;
use clap_sys::ext::ambisonic::{
    CLAP_AMBISONIC_NORMALIZATION_SN3D, CLAP_AMBISONIC_ORDERING_ACN, CLAP_EXT_AMBISONIC, CLAP_EXT_AMBISONIC_COMPAT,
    CLAP_PORT_AMBISONIC, clap_ambisonic_config, clap_plugin_ambisonic,
};
use clap_sys::ext::audio_ports::{CLAP_EXT_AUDIO_PORTS, clap_audio_port_info, clap_plugin_audio_ports};
use clap_sys::ext::audio_ports_config::{CLAP_EXT_AUDIO_PORTS_CONFIG, clap_audio_ports_config, clap_plugin_audio_ports_config};
use nice_plug::wrapper::clap::clap_plugin;
use std::ffi::CStr;
use std::mem::MaybeUninit;

/// Names of the extension, the present one first.
pub(super) const IDS: [&CStr; 2] = [CLAP_EXT_AMBISONIC, CLAP_EXT_AMBISONIC_COMPAT];
/// Names of the framework's tables that are amended.
pub(super) const PORTS: &CStr = CLAP_EXT_AUDIO_PORTS;
pub(super) const CONFIGS: &CStr = CLAP_EXT_AUDIO_PORTS_CONFIG;

/// The extension.
pub(super) static EXTENSION: clap_plugin_ambisonic =
    clap_plugin_ambisonic { is_config_supported: Some(is_config_supported), get_config: Some(get_config) };

/// AmbiX.
const CONFIG: clap_ambisonic_config =
    clap_ambisonic_config { ordering: CLAP_AMBISONIC_ORDERING_ACN, normalization: CLAP_AMBISONIC_NORMALIZATION_SN3D };

static PORT_TABLES: Tables<clap_plugin_audio_ports> = Tables::new();
static CONFIG_TABLES: Tables<clap_plugin_audio_ports_config> = Tables::new();

/// The framework's ports with the type of Ambisonic ones, if the framework has ports.
pub(super) fn ports(plugin: *const clap_plugin) -> Option<&'static clap_plugin_audio_ports> {
    let theirs = *framework_extension::<clap_plugin_audio_ports>(plugin, PORTS)?;
    PORT_TABLES.of(plugin, || clap_plugin_audio_ports { get: Some(get_port), ..theirs })
}

/// The framework's layouts with the type of Ambisonic ports, if the framework has layouts.
pub(super) fn configs(plugin: *const clap_plugin) -> Option<&'static clap_plugin_audio_ports_config> {
    let theirs = *framework_extension::<clap_plugin_audio_ports_config>(plugin, CONFIGS)?;
    CONFIG_TABLES.of(plugin, || clap_plugin_audio_ports_config { get: Some(get_layout), ..theirs })
}

fn is_ambisonic(channels: u32) -> bool {
    Output::of_channels(channels as usize) != Output::Binaural
}

unsafe extern "C" fn get_port(plugin: *const clap_plugin, index: u32, is_input: bool, info: *mut clap_audio_port_info) -> bool {
    let theirs = framework_extension::<clap_plugin_audio_ports>(plugin, PORTS);
    let Some(get) = theirs.and_then(|theirs| theirs.get) else { return false };
    // SAFETY: the plugin is the framework's, and the host's arguments are handed on.
    let known = unsafe { get(plugin, index, is_input, info) };
    // SAFETY: the framework has filled it in.
    if let Some(info) = unsafe { info.as_mut() }.filter(|_| known)
        && is_ambisonic(info.channel_count)
    {
        info.port_type = CLAP_PORT_AMBISONIC.as_ptr();
    }
    known
}

unsafe extern "C" fn get_layout(plugin: *const clap_plugin, index: u32, config: *mut clap_audio_ports_config) -> bool {
    let theirs = framework_extension::<clap_plugin_audio_ports_config>(plugin, CONFIGS);
    let Some(get) = theirs.and_then(|theirs| theirs.get) else { return false };
    // SAFETY: the plugin is the framework's, and the host's arguments are handed on.
    let known = unsafe { get(plugin, index, config) };
    // SAFETY: the framework has filled it in.
    if let Some(config) = unsafe { config.as_mut() }.filter(|_| known)
        && is_ambisonic(config.main_output_channel_count)
    {
        config.main_output_port_type = CLAP_PORT_AMBISONIC.as_ptr();
    }
    known
}

unsafe extern "C" fn is_config_supported(_plugin: *const clap_plugin, config: *const clap_ambisonic_config) -> bool {
    // SAFETY: the host hands over a configuration or none.
    let wanted = unsafe { config.as_ref() };
    wanted.is_some_and(|wanted| (wanted.ordering, wanted.normalization) == (CONFIG.ordering, CONFIG.normalization))
}

unsafe extern "C" fn get_config(
    plugin: *const clap_plugin,
    is_input: bool,
    port_index: u32,
    info: *mut clap_ambisonic_config,
) -> bool {
    let Some(get) = framework_extension::<clap_plugin_audio_ports>(plugin, PORTS).and_then(|ports| ports.get) else {
        return false;
    };
    let mut port = MaybeUninit::<clap_audio_port_info>::zeroed();
    // SAFETY: the plugin is the framework's, which fills in the port or says that there is none; all zeros are a port of no
    // channels.
    let channels = unsafe {
        let known = get(plugin, port_index, is_input, port.as_mut_ptr());
        if known { port.assume_init().channel_count } else { 0 }
    };
    // SAFETY: the host hands over room for it or none.
    match unsafe { info.as_mut() } {
        Some(info) if is_ambisonic(channels) => {
            *info = CONFIG;
            true
        }
        _ => false,
    }
}
