//! What a user changes about a scene's sound.

use super::values::within;
use clap::Args;
use promenade_core::Trim;

#[derive(Debug, Args)]
#[command(next_help_heading = "Sound")]
pub(crate) struct SoundArgs {
    /// Level of the direct sound, dB
    #[arg(long, value_name = "DB", default_value_t = 0.0, value_parser = within(-120.0_f32, 24.0), allow_hyphen_values = true)]
    direct: f32,
    /// Level of the reflections up to 80 ms after it, dB
    #[arg(long, value_name = "DB", default_value_t = 0.0, value_parser = within(-120.0_f32, 24.0), allow_hyphen_values = true)]
    early: f32,
    /// Level of what comes after them, dB
    #[arg(long, value_name = "DB", default_value_t = 0.0, value_parser = within(-120.0_f32, 24.0), allow_hyphen_values = true)]
    late: f32,
    /// Reverberation time as a multiple of the scene's, 0.5 to 2
    #[arg(long, value_name = "TIMES", default_value_t = 1.0, value_parser = within(0.5_f32, 2.0))]
    decay: f32,
    /// Exponent of the distance that the direct sound falls by, 0 to 2: 1 is 6 dB each time it doubles, 0 none
    #[arg(long, value_name = "EXPONENT", default_value_t = 1.0, value_parser = within(0.0_f32, 2.0))]
    distance_law: f32,
    /// Level of the difference between the ears in the room's sound, 0 to 2
    #[arg(long, default_value_t = 1.0, value_parser = within(0.0_f32, 2.0))]
    width: f32,
    /// Takes the bass off the rendered sound below this frequency, 12 dB an octave; 10 to 1000 Hz [default: not]
    #[arg(long, value_name = "HZ", value_parser = within(10.0_f32, 1000.0))]
    low_cut: Option<f32>,
    /// Angle between the emitters of the left and the right channel, degrees where the scene starts [default: the mean of both
    /// has one emitter]
    #[arg(long, value_name = "DEG", value_parser = within(0.0_f32, 180.0))]
    pub(crate) stereo_spread: Option<f32>,
    /// The room alone, as on a send: neither the dry share nor the direct sound
    #[arg(long)]
    pub(crate) wet_solo: bool,
}

impl SoundArgs {
    pub(crate) fn trim(&self) -> Trim {
        let gain = |db: f32| if db == 0.0 { 1.0 } else { 10.0_f32.powf(db / 20.0) };
        Trim {
            direct: if self.wet_solo { 0.0 } else { gain(self.direct) },
            early: gain(self.early),
            late: gain(self.late),
            decay: self.decay,
            distance_law: self.distance_law,
            width: self.width,
            low_cut_hz: self.low_cut.unwrap_or(0.0),
        }
    }
}
