//! The camera path: how it is followed, its keyframes, recording, and files.

use super::chooser::{Chooser, FileKind, Place};
use super::controls::toggle;
use super::theme::{CONTROL, SPACE};
use super::widgets::{button, columns, field, labelled, note, outcome, switch, tab};
use super::{ctx::Ctx, panel::Panel, timeline::Timeline, words::Word};
use crate::parameter::Parameter;
use crate::project::walk::SavedWalk;
use egui::{DragValue, ScrollArea, Ui, Vec2};
use promenade_core::{CameraPath, Keyframe};
use promenade_fault::with_causes;
use promenade_paths::edit::{self, EditError};
use promenade_paths::{Recorder, RecorderConfig, WriteFormat, write};
use std::path::Path;

/// A recording is reduced to as few keyframes as keep it this close, metres.
const TOLERANCE_M: f32 = 0.01;
/// A recording is reduced to as few keyframes as keep the head's turn this close, degrees.
const TOLERANCE_DEG: f32 = 0.5;
/// A keyframe that is added at the end comes this much after the last, seconds.
const NEXT_S: f64 = 1.0;

/// Plays, edits, records, imports and exports the camera path.
#[derive(Default)]
pub(super) struct PathPanel {
    recording: Option<Recording>,
    timeline: Timeline,
    /// Whether the user is asked before a path is recorded over.
    asks: bool,
    file: String,
    files: Chooser<Done>,
    /// What was done last, or what went wrong.
    outcome: Option<Result<String, String>>,
}

/// What was done with a file.
enum Done {
    /// Read, with remarks.
    Imported(SavedWalk, Vec<String>),
    /// Written, as it says.
    Exported(String),
}

/// Files of paths.
pub(super) const KIND: FileKind = FileKind { name: "Camera path", extensions: &["json", "csv", "gltf", "glb", "txt"] };
const WRITTEN: FileKind = FileKind { name: "Camera path", extensions: &["json", "csv"] };

struct Recording {
    recorder: Recorder,
    /// When it began, seconds of the window's time.
    began_s: f64,
}

impl Panel for PathPanel {
    fn title(&self) -> Word {
        Word::CameraPath
    }

    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        self.record(ui, ctx);
        if let Some((index, t_s)) = self.timeline.show(ui, ctx) {
            self.change(ctx, |keyframes| edit::set_time(keyframes, index, t_s).map(drop));
        }
        columns(ui, [228.0, 236.0, 196.0], |ui, column| match column {
            0 => playing(ui, ctx),
            1 => self.keyframes(ui, ctx),
            _ => self.files(ui, ctx),
        });
    }
}

/// How the path is followed.
fn playing(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    let (kept, _) = ctx.params().saved_walk.get();
    let mut speed = kept.speed;
    labelled(ui, ctx.palette, Word::Speed, |ui| {
        let drag = DragValue::new(&mut speed).range(-8.0..=8.0).speed(0.01).fixed_decimals(2).suffix(" x");
        if ui.add_sized(Vec2::new(72.0, CONTROL), drag).changed() {
            ctx.keep(&ctx.params().saved_walk, |walk| walk.speed = speed);
        }
        if switch(ui, ctx.palette, Word::Loop, kept.looping).clicked() {
            ctx.keep(&ctx.params().saved_walk, |walk| walk.looping = !walk.looping);
        }
    });
    toggle(ui, ctx, Parameter::Offset);
    if let Some(walk) = ctx.walk {
        note(ui, ctx.palette, format!("{} keyframes, {:.1} s", walk.path.keyframes().len(), walk.path.duration_s()));
    }
}

impl PathPanel {
    /// Takes the listener's pose while a walk is recorded.
    fn record(&mut self, ui: &Ui, ctx: &Ctx<'_>) {
        let Some(recording) = &mut self.recording else { return };
        // A picture may come before there is a new pose: then its time has not risen.
        let t_s = if ctx.frame.playing { ctx.frame.transport_s } else { ctx.now_s - recording.began_s };
        if recording.recorder.is_empty() && t_s > 0.0 {
            // The walk keeps its place in the song.
            let _first = recording.recorder.push(0.0, ctx.frame.pose);
        }
        let _too_soon = recording.recorder.push(t_s, ctx.frame.pose);
        ui.ctx().request_repaint();
    }

    fn keyframes(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        let chosen = ctx.selection.keyframe;
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = SPACE;
            if button(ui, ctx.palette, Word::Add).clicked() {
                self.add(ctx);
            }
            ui.add_enabled_ui(chosen.is_some(), |ui| {
                if button(ui, ctx.palette, Word::Move).clicked()
                    && let Some(index) = chosen
                {
                    let pose = ctx.frame.pose;
                    self.change(ctx, |keyframes| edit::move_to(keyframes, index, pose));
                }
                if button(ui, ctx.palette, Word::Delete).clicked()
                    && let Some(index) = chosen
                {
                    self.change(ctx, |keyframes| edit::delete(keyframes, index).map(drop));
                    ctx.selection.keyframe = None;
                }
            });
            if button(ui, ctx.palette, Word::Reverse).clicked() {
                self.change(ctx, edit::reverse);
            }
        });
        let Some(walk) = ctx.walk else { return };
        let keyframes = walk.path.keyframes();
        ScrollArea::vertical().auto_shrink(false).show_rows(ui, CONTROL, keyframes.len(), |ui, range| {
            for (index, keyframe) in keyframes.iter().enumerate().take(range.end).skip(range.start) {
                ui.horizontal(|ui| self.keyframe(ui, ctx, index, keyframe));
            }
        });
    }

    fn keyframe(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>, index: usize, keyframe: &Keyframe) {
        let mut t_s = keyframe.t_s;
        let drag = DragValue::new(&mut t_s).speed(0.02).fixed_decimals(2).suffix(" s").update_while_editing(false);
        if ui.add_sized(Vec2::new(68.0, CONTROL), drag).changed() {
            self.change(ctx, |keyframes| edit::set_time(keyframes, index, t_s).map(drop));
        }
        let p = keyframe.pose.position;
        let (yaw, ..) = keyframe.pose.ypr();
        let text = format!("{:.2}, {:.2}, {:.2} m   {:.0}°", p.x, p.y, p.z, yaw.to_degrees());
        if ui.selectable_label(ctx.selection.keyframe == Some(index), text).clicked() {
            ctx.selection.keyframe = Some(index);
        }
    }

    /// Adds a keyframe where the listener is: after the last, or half way to the one after the chosen.
    fn add(&mut self, ctx: &mut Ctx<'_>) {
        let pose = ctx.frame.pose;
        let times = ctx.walk.map_or_else(Vec::new, |walk| walk.path.keyframes().iter().map(|k| k.t_s).collect::<Vec<_>>());
        let after = ctx.selection.keyframe.filter(|index| index + 1 < times.len());
        let t_s = match (after, times.last()) {
            (Some(index), _) => 0.5 * (times[index] + times[index + 1]),
            (None, Some(last)) => last + NEXT_S,
            (None, None) => 0.0,
        };
        let added = self.change(ctx, |keyframes| {
            if keyframes.is_empty() {
                keyframes.push(Keyframe { t_s, pose });
                return Ok(());
            }
            let index = edit::insert(keyframes, t_s)?;
            edit::move_to(keyframes, index, pose)
        });
        if added {
            ctx.selection.keyframe = Some(after.map_or(times.len(), |index| index + 1));
        }
    }

    /// Changes the keyframes; returns whether that went well.
    fn change(&mut self, ctx: &mut Ctx<'_>, change: impl FnOnce(&mut Vec<Keyframe>) -> Result<(), EditError>) -> bool {
        let mut keyframes = ctx.walk.map_or_else(Vec::new, |walk| walk.path.keyframes().to_vec());
        let done = change(&mut keyframes);
        self.outcome = done.as_ref().err().map(|error| Err(with_causes(error)));
        if done.is_ok() {
            take(ctx, SavedWalk::of(&keyframes));
        }
        done.is_ok()
    }

    fn files(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        ui.horizontal(|ui| {
            let recording = self.recording.is_some();
            let word = if recording { Word::StopRecording } else { Word::Record };
            if self.asks {
                let replaces = button(ui, ctx.palette, Word::Replace).clicked();
                if replaces || button(ui, ctx.palette, Word::Keep).clicked() {
                    self.asks = false;
                }
                if replaces {
                    self.record_or_stop(ctx);
                }
                note(ui, ctx.palette, "the path?");
            } else if tab(ui, ctx.palette, word, recording).clicked() {
                self.asks = must_ask(recording, &ctx.params().saved_walk.get().0);
                if !self.asks {
                    self.record_or_stop(ctx);
                }
            }
            if let Some(recording) = &self.recording {
                note(ui, ctx.palette, format!("{:.1} s", recording.recorder.duration_s()));
            }
        });
        field(ui, &mut self.file, "File name, or leave empty");
        ui.horizontal(|ui| {
            ui.add_enabled_ui(!self.files.is_busy(), |ui| {
                if button(ui, ctx.palette, Word::Import).clicked() {
                    self.import(ctx);
                }
                ui.add_enabled_ui(ctx.walk.is_some(), |ui| {
                    if button(ui, ctx.palette, Word::Export).clicked() {
                        self.export(ctx);
                    }
                });
            });
            if button(ui, ctx.palette, Word::Clear).clicked() {
                take(ctx, SavedWalk::default());
                ctx.selection.keyframe = None;
            }
        });
        self.take_file(ctx);
        ScrollArea::vertical().id_salt("outcome").auto_shrink(false).min_scrolled_height(0.0).show(ui, |ui| {
            outcome(ui, ctx.palette, self.outcome.as_ref(), "JSON, CSV, glTF, COLMAP");
        });
    }

    fn record_or_stop(&mut self, ctx: &mut Ctx<'_>) {
        match self.recording.take() {
            Some(recording) => {
                let poses = recording.recorder.len();
                self.outcome = Some(match recording.recorder.finish(TOLERANCE_M, TOLERANCE_DEG.to_radians()) {
                    Ok(keyframes) => {
                        let done = format!("Recorded {poses} poses, kept as {} keyframes.", keyframes.len());
                        take(ctx, SavedWalk::of(&keyframes));
                        Ok(done)
                    }
                    Err(error) => Err(with_causes(&error)),
                });
            }
            None => match Recorder::new(RecorderConfig::default()) {
                Ok(recorder) => self.recording = Some(Recording { recorder, began_s: ctx.now_s }),
                Err(error) => self.outcome = Some(Err(with_causes(&error))),
            },
        }
    }

    fn import(&mut self, ctx: &Ctx<'_>) {
        let place = Place::typed_or(&self.file, Place::Existing);
        self.outcome = self.files.ask(ctx, KIND, place, imported).err().map(Err);
    }

    fn export(&mut self, ctx: &Ctx<'_>) {
        let Some(walk) = ctx.walk.cloned() else { return };
        let place = Place::typed_or(&self.file, Place::New);
        let write = move |file: &Path| export(&walk.path, file).map(Done::Exported);
        self.outcome = self.files.ask(ctx, WRITTEN, place, write).err().map(Err);
    }

    /// Takes what was read, or says what was written.
    fn take_file(&mut self, ctx: &mut Ctx<'_>) {
        let Some(done) = self.files.take() else { return };
        self.outcome = Some(done.map(|done| match done {
            Done::Imported(walk, notes) => {
                let done = [vec![format!("Imported {} keyframes.", walk.keyframes.len())], notes].concat().join(" ");
                ctx.undoable(|ctx| take(ctx, walk));
                ctx.selection.keyframe = None;
                done
            }
            Done::Exported(done) => done,
        }));
    }
}

/// Whether the user is asked before the button does what it says: a recording would replace a path.
fn must_ask(recording: bool, kept: &SavedWalk) -> bool {
    !recording && !kept.keyframes.is_empty()
}

/// Reads a path, with remarks.
pub(super) fn read(file: &Path) -> Result<(SavedWalk, Vec<String>), String> {
    SavedWalk::from_file(file).map_err(|error| with_causes(&error))
}

fn imported(file: &Path) -> Result<Done, String> {
    read(file).map(|(walk, notes)| Done::Imported(walk, notes))
}

fn export(path: &CameraPath, file: &Path) -> Result<String, String> {
    let format = WriteFormat::of(&file.display().to_string()).map_err(|error| with_causes(&error))?;
    let folder = file.parent().map_or(Ok(()), std::fs::create_dir_all);
    let written = folder.and_then(|()| std::fs::write(file, write(path, format)));
    written.map_err(|error| format!("{}: {error}", file.display()))?;
    Ok(format!("Written to {}", file.display()))
}

/// Makes a path the project's own, with the speed and the looping that are set.
pub(super) fn take(ctx: &mut Ctx<'_>, new: SavedWalk) {
    let (kept, _) = ctx.params().saved_walk.get();
    ctx.keep_walk(SavedWalk { speed: kept.speed, looping: kept.looping, slot: 0, ..new });
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::Pose;

    #[test]
    fn a_path_is_not_recorded_over_unasked() {
        let kept = SavedWalk::of(&[Keyframe { t_s: 0.0, pose: Pose::IDENTITY }]);
        let asked = [(false, &kept), (true, &kept), (false, &SavedWalk::default())].map(|(on, kept)| must_ask(on, kept));
        assert_eq!(asked, [true, false, false]);
    }

    #[test]
    fn a_file_is_read_as_a_path_or_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let [good, bad] = ["walk.json", "scene.promenade"].map(|name| folder.path().join(name));
        std::fs::write(&good, r#"[{"t": 0, "position": [1, 2, 3], "ypr": [0, 0, 0]}]"#).unwrap();
        std::fs::write(&bad, crate::library::factory::ROOM_B.bytes).unwrap();
        assert!(matches!(&imported(&good), Ok(Done::Imported(walk, _)) if walk.keyframes.len() == 1));
        let why = imported(&bad).err().unwrap();
        assert!(
            ["scene.promenade", "expected", "csv", "found"].iter().all(|words| why.to_lowercase().contains(words)),
            "{why}"
        );
    }

    #[test]
    fn what_is_exported_is_imported_again() {
        let folder = tempfile::tempdir().unwrap();
        let keyframes = [0.0, 2.0].map(|t_s| Keyframe { t_s, pose: Pose::IDENTITY });
        let path = CameraPath::new(keyframes.to_vec()).unwrap();
        for name in ["new/walk.csv", "walk.json"] {
            let file = folder.path().join(name);
            export(&path, &file).unwrap();
            let (kept, _) = SavedWalk::from_file(&file).unwrap();
            assert_eq!(kept.to_walk().unwrap().unwrap().path, path);
        }
        let error = export(&path, &folder.path().join("walk.mp3")).unwrap_err();
        assert!(error.contains("walk.mp3") && error.contains(".csv"), "{error}");
    }
}
