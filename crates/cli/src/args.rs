//! The command line.

mod air;
mod anchors;
mod bake;
mod capture;
mod eval;
mod fit;
mod host;
mod import;
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
#[cfg(any(test, not(feature = "train")))]
mod untrained;
mod values;
mod web;

use clap::{Args, Parser, Subcommand};
use std::ffi::OsString;
use std::path::PathBuf;

pub(crate) use air::AirArgs;
pub(crate) use anchors::AnchorsArgs;
pub(crate) use bake::{BakeFieldArgs, BakeLessArgs, BakeResponsesArgs, BakeSource, LevelsArg, NodesArg, SideArg};
pub(crate) use capture::{
    CaptureCommand, CheckArgs, ClipArgs, EmitterArgs, FromResponsesArgs, HoldOutArgs, ImportCaptureArgs, LayoutArg, MixArgs,
};
pub(crate) use eval::{EvalArgs, PosesArg};
pub(crate) use fit::{FitArgs, Hold, Per, T20};
pub(crate) use host::HostArgs;
pub(crate) use import::ImportArgs;
pub(crate) use map::{Map, MapArgs, MixMapArgs, SaliencyArgs, Strategy};
pub(crate) use measure::{MeasureArgs, TableForm};
pub(crate) use mesh::MeshArgs;
pub(crate) use path::PathArgs;
pub(crate) use pictures::PictureArgs;
pub(crate) use reconstruction::ReconstructionArgs;
#[cfg(feature = "train")]
pub(crate) use refine::RefineArgs;
pub(crate) use responses::{AmbisonicArgs, ManifestArgs, NormalisationArg, ResponsesCommand};
pub(crate) use simulate::{
    JoinArgs, RoomArgs, RunArgs, Simulate, SimulateArgs, SimulateBoxArgs, SimulateMeshArgs, SizeScattering,
};
#[cfg(feature = "train")]
pub(crate) use simulation::SimulationArgs;
pub(crate) use study::{FigureFiles, Study, StudyArgs, StudyReportArgs, StudyServeArgs, StudySiteArgs};
pub(crate) use surface::{Shape, SurfaceArgs};
#[cfg(feature = "train")]
pub(crate) use train::{MAX_THREADS, TrainArgs};
#[cfg(not(feature = "train"))]
pub(crate) use untrained::WITH_TRAINING;
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
    /// Make a room's mesh of a reconstruction: six walls or a convex hull around its points
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
    /// Measure what each tier costs and how far it is off, which takes seconds
    #[arg(long)]
    pub(crate) cost: bool,
    /// As JSON
    #[arg(long)]
    pub(crate) json: bool,
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
    fn every_value_has_the_type_of_its_field() {
        for line in [
            "bake responses a -o b",
            "bake field a -o b",
            "responses manifest a",
            "responses ambisonic a --hrtf h -o b --distance 1",
            "import a -o b",
            "render a b c --path p --speed 2",
            "host a b c",
            "path a --fps 2 --simplify 1,1",
            "anchors a -o b",
            "surface a -o b.obj --shape hull --distance a b 2",
            "simulate box --size 1,1,1 --emitter 0,0,0 --head h -o b --path p --fit 1 --length 1",
            "simulate a.obj --source 1,1,1 --materials *=0.1:0.2,b=felt --scale 2 --head h -o b --path p --margin 1 --length 1",
            "simulate a.obj --source 1,1,1 --head h -o b --grid 1 --turns 4",
            "simulate a.obj --source 1,1,1 --head h -o b --part 2/3",
            "simulate materials",
            "join a b -o c",
            "map a.obj --source 1,1,1 --grid 1 --height 1 -o b.png -o b.svg",
            "map mix a.obj --source 1,1,1 --materials *=0.1 b.png c.png --sound d --camera 0,0,0,0,0,0 --strategy image \
             --strategy mix -o e",
            "fit 6x4x3 --t20 .5,.5,.4,.4,-,.3,.3 --materials *=0.2",
            "inspect a",
            "web a b --dry c d --path e -o f",
            "web a --serve",
            "web a --serve 8080",
            "measure a --seconds 1",
            "capture from-responses a -o b",
            "capture import a --layout rwavs -o b",
            "eval a b",
            "study a -o b",
            "study serve a --answers b --listen 0.0.0.0:80",
            "study report a b --level 0.01",
            "fit a --evaluate --source 1,2,3 --uncertainty 0.1 --rate 16000",
            "fit a.obj b -o c.obj --hold walls,places --per wall --order 6 --scale 0.01",
            "fit box a --changed b --alike y0,y1",
            "fit 1,2,3 a -o b.obj --changed c --materials x0=felt --emitter 1,1,1",
        ] {
            // A parser of another type than its field's panics here.
            assert!(Cli::try_parse_from(format!("promenade {line}").split(' ')).is_ok(), "{line}");
        }
    }
}
