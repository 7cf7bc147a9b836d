//! The command line.

mod air;
mod anchors;
mod bake;
mod capture;
mod completions;
mod eval;
mod examples;
mod figures;
mod fit;
mod help;
mod host;
mod import;
mod less;
mod map;
mod measure;
mod mesh;
mod path;
mod pictures;
mod placement;
mod reconstruction;
#[cfg(feature = "train")]
mod refine;
mod responses;
mod simulate;
#[cfg(feature = "train")]
mod simulation;
mod study;
mod surface;
#[cfg(feature = "train")]
mod train;
mod values;
mod web;

use clap::{Args, Parser, Subcommand};
use std::ffi::OsString;
use std::path::PathBuf;

pub(crate) use air::AirArgs;
pub(crate) use anchors::AnchorsArgs;
pub(crate) use bake::{BakeFieldArgs, BakeLessArgs, BakeResponsesArgs, BakeSource, LevelsArg, SideArg};
pub(crate) use capture::{CaptureCommand, CheckArgs, ClipArgs, EmitterArgs, HoldOutArgs, ImportCaptureArgs, LayoutArg};
pub(crate) use completions::CompletionsArgs;
pub(crate) use eval::{EvalArgs, PosesArg};
pub(crate) use figures::{FigureFiles, JsonFile, MarkdownFile};
pub(crate) use fit::{FitArgs, Hold, Per, T20};
pub(crate) use help::described;
pub(crate) use host::HostArgs;
pub(crate) use import::ImportArgs;
pub(crate) use less::LessArgs;
pub(crate) use map::{CompositeArgs, Map, MapArgs, MixMapArgs, SaliencyArgs, Strategy, VisibilityArgs};
pub(crate) use measure::MeasureArgs;
pub(crate) use mesh::MeshArgs;
pub(crate) use path::PathArgs;
pub(crate) use pictures::PictureArgs;
pub(crate) use reconstruction::ReconstructionArgs;
#[cfg(feature = "train")]
pub(crate) use refine::RefineArgs;
pub(crate) use responses::{AmbisonicArgs, ManifestArgs, NormalisationArg, ResponsesCommand};
pub(crate) use simulate::{JoinArgs, RoomArgs, RunArgs, Simulate, SimulateArgs, SimulateBoxArgs, SimulateMeshArgs};
#[cfg(feature = "train")]
pub(crate) use simulation::SimulationArgs;
pub(crate) use study::{Study, StudyArgs, StudyReportArgs, StudyServeArgs, StudySiteArgs};
pub(crate) use surface::{Shape, SurfaceArgs};
#[cfg(feature = "train")]
pub(crate) use train::{MAX_THREADS, TrainArgs};
pub(crate) use web::WebArgs;

/// Make a dry track sound as in a real, captured place, for a listener who walks and turns.
#[derive(Debug, Parser)]
#[command(name = "promenade", version)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Make a scene from measurements
    Bake {
        #[command(subcommand)]
        source: BakeSource,
    },
    /// Describe and make sets of responses, to bake
    Responses {
        #[command(subcommand)]
        command: ResponsesCommand,
    },
    /// Make a scene from a trained AV-Cloud checkpoint
    Import(Box<ImportArgs>),
    /// Render a sound file through a scene, along a path or at one pose; `promenade render --help` lists its options
    #[command(disable_help_flag = true)]
    Render(Rest),
    /// Render a WAV file through a plugin as a host does, with automation, or list its parameters
    Host(HostArgs),
    /// Convert a camera path, or show what it is: JSON, CSV, cameras of COLMAP or NeRF tools, or a glTF animation
    Path(PathArgs),
    /// Make the anchors of a model: of a reconstruction, a cloud of points or splats, a mesh or a box
    Anchors(Box<AnchorsArgs>),
    /// Make a room's mesh of a reconstruction: six walls around its points, or the space that was seen to be free
    Surface(Box<SurfaceArgs>),
    /// Make binaural responses of a simulated room, to bake or to train on
    Simulate(Box<SimulateArgs>),
    /// Put the parts of a simulation together
    Join(JoinArgs),
    /// Draw level, reverberation time, clarity and speech transmission over the plan of a simulated room, what a camera sees of
    /// its sound, or how a mix stands out over time
    Map(Box<MapArgs>),
    /// Fit a room to measured responses, and judge what it predicts
    Fit(Box<FitArgs>),
    /// Show what a scene file holds
    Inspect(InspectArgs),
    /// Compare a scene with the measurements held out of it and its streams with its model's clips, or measure a response
    Measure(MeasureArgs),
    /// Make, import and check captures: recordings of a walk beside their dry sound
    Capture {
        #[command(subcommand)]
        command: CaptureCommand,
    },
    /// Learn a scene from a capture and anchors
    #[cfg(feature = "train")]
    Train(Box<TrainArgs>),
    /// Learn a scene from a capture and anchors; this build says how to make one that can
    #[cfg(not(feature = "train"))]
    #[command(disable_help_flag = true)]
    Train(Rest),
    /// Learn a scene from a walk's recordings and a coarse room: the room's absorption from their decays, then what a network
    /// corrects of it, as far as emitters or clips that it is not told support that
    #[cfg(feature = "train")]
    Learn(Box<TrainArgs>),
    /// Learn a scene from recordings and a coarse room; this build says how to make one that can
    #[cfg(not(feature = "train"))]
    #[command(disable_help_flag = true)]
    Learn(Rest),
    /// Correct a simulated room by responses that were measured in it, for sources at new places
    #[cfg(feature = "train")]
    Refine(Box<RefineArgs>),
    /// Correct a simulated room by responses that were measured in it; this build says how to make one that can
    #[cfg(not(feature = "train"))]
    #[command(disable_help_flag = true)]
    Refine(Rest),
    /// Judge scenes on the recordings of captures, beside baselines
    Eval(EvalArgs),
    /// Make a page on which scenes are walked and heard, in a folder for any web server or served on this machine
    Web(WebArgs),
    /// Write completions for a shell, or completions and pages for man into a folder
    Completions(CompletionsArgs),
    /// Make a page that asks listeners which sounds better, take their answers, and say what they answered
    Study(Box<StudyArgs>),
}

/// Whatever follows, for whom it is meant.
#[derive(Debug, Args)]
pub(crate) struct Rest {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    pub(crate) words: Vec<OsString>,
}

#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    /// Scene file; several are listed, a line for each
    #[arg(required = true, value_name = "SCENE")]
    pub(crate) scenes: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) json: JsonFile,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_grammar_holds_together() {
        Cli::command().debug_assert();
    }

    #[test]
    fn commands_of_the_documents_are_understood() {
        let all = promenade_testing::documents::commands("promenade");
        assert!(all.len() > 40, "{} commands", all.len());
        let ours = all.iter().filter(|(_, words)| words[0] != "render");
        let wrong = ours.filter_map(|(path, words)| {
            let parsed = Cli::try_parse_from([&["promenade".to_owned()], &words[..]].concat());
            parsed.err().map(|error| format!("{}: promenade {}: {error}", path.display(), words.join(" ")))
        });
        assert_eq!(wrong.collect::<Vec<_>>().join("\n"), "");
    }

    #[test]
    fn older_names_are_understood() {
        for (line, now) in [
            ("bake responses a -o b --source 1", "bake responses a -o b --emitter-number 1"),
            ("responses ambisonic a --hrtf h -o b", "responses ambisonic a --head h -o b"),
            ("simulate a.obj --source 1,1,1 --head h -o b", "simulate a.obj --emitter 1,1,1 --head h -o b"),
            (
                "simulate box --size 6x4x3 --emitter 0,0,0 --head h -o b",
                "simulate box --size 6,4,3 --emitter 0,0,0 --head h -o b",
            ),
            ("map a.obj --source 1,1,1 -o b.png", "map a.obj --emitter 1,1,1 -o b.png"),
            (
                "map mix a.obj c.png --source 1,1,1 --sound d --camera 0,0,0,0,0,0 -o e",
                "map mix a.obj c.png --emitter 1,1,1 --sound d --camera 0,0,0,0,0,0 -o e",
            ),
            (
                "fit 6,4,3 a --evaluate --source 1,2,3 --source-number 2",
                "fit 6,4,3 a --evaluate --measured-emitter 1,2,3 --emitter-number 2",
            ),
            ("eval a b --hrtf h --plots p", "eval a b --head h --plot p"),
            ("study report a --plots p", "study report a --plot p"),
            ("anchors a -o b --scale 2", "anchors a -o b --metres-per-unit 2"),
        ] {
            let parsed = |line: &str| {
                let cli = Cli::try_parse_from(format!("promenade {line}").split(' '));
                format!("{:?}", cli.unwrap_or_else(|error| panic!("{line}: {error}")).command)
            };
            assert_eq!(parsed(line), parsed(now));
        }
        for older in ["host a b c", "web a --serve 8080", "fit 1,2,3 a --evaluate --markdown"] {
            assert!(Cli::try_parse_from(format!("promenade {older}").split(' ')).is_ok(), "{older}");
        }
        let help = help::command().render_long_help().to_string();
        assert!(!help.contains("--hrtf"), "{help}");
        // What follows such an option is no file to write over.
        let said =
            Cli::try_parse_from(["promenade", "inspect", "--json", "a.promenade", "b.promenade"]).unwrap_err().to_string();
        assert!(said.contains("expected a name that ends in .json, or this option at the end of the line"), "{said}");
    }
}
