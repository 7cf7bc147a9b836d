//! The editor's words and what each of them means. Widgets take a [`Word`], so that there is none without its tooltip.

use crate::parameter::{Parameter, table::table};

table! {
    /// A word on a control, a line or a section, with its tooltip.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    pub enum Word: (&'static str, &'static str) {
        /// Top line.
        Scenes = ("Scenes", "Shows or hides the list of the rooms that can be played"),
        /// Top line.
        Light = ("Light", "Dark writing on a light ground"),
        /// Top line.
        Dark = ("Dark", "Light writing on a dark ground"),
        /// Menu of a control.
        UsualValue = ("Usual value", "The value that a new instance starts with"),
        /// Top line.
        Undo = ("Undo", "Takes the last change back (Ctrl Z)"),
        /// Top line.
        Redo = ("Redo", "Makes the change again that was taken back last (Ctrl Shift Z)"),
        /// Top line.
        A = ("A", "The first of both settings"),
        /// Top line.
        B = ("B", "The second of both settings; it begins as a copy of the first"),
        /// List of scenes.
        Folder = ("Folder", "Shows where files of your own rooms and camera paths belong"),
        /// List of scenes.
        Refresh = ("Refresh", "Looks for new files in these folders"),
        /// List of scenes.
        CopyPath = ("Copy path", "Puts the folder's name on the clipboard"),
        /// List of scenes.
        Open = ("Show", "Opens the folder in the system's file manager"),
        /// List of scenes.
        OpenScene = ("Open", "Plays a scene file from anywhere: one to choose, or the one that is named at Folder"),
        /// List of scenes.
        MatchLevels = ("Same loudness", "Plays a scene that is chosen here as loud as the one before it, and the project keeps \
            that; off, each is as loud as it is"),
        /// List of scenes.
        Playing = ("About this scene", "Who made the room that is heard, under which licence, and what its file holds"),
        /// View.
        Top = ("Top", "Looks at the place from above"),
        /// View.
        Orbit = ("3-D", "Looks at the place from any side: drag to turn, drag with Shift to move"),
        /// View.
        NoMap = ("No map", "Shows the plan without colours"),
        /// View.
        LevelMap = ("Level", "Colours the plan by how loud the source is there, at 500 Hz and 1 kHz, dB over its \
        direct sound at 1 m"),
        /// View.
        Fit = ("Fit", "Shows everything (F, or a double click beside the listener)"),
        /// Right.
        Listener = ("Listener", "Where the head is, in metres from the room's origin, and where it looks, in degrees"),
        /// Right.
        Reset = ("Reset", "Puts the listener where the scene starts (R in the view)"),
        /// Right.
        Movement = ("Movement", "What moves the listener besides your hand: a camera path, a head tracker, another instance"),
        /// Right.
        Head = ("Head", "Whose ears you hear with: the scene's own head, or one that was measured, such as yours"),
        /// Right.
        UseHead = ("Choose", "Takes a SOFA file of head-related responses: one to choose, or the one that is named beside; \
            the project keeps it"),
        /// Right.
        OwnHead = ("Scene's head", "Goes back to the head that the scene was measured with"),
        /// The sound panel.
        Headphones = ("Headphones", "Takes the colour of your headphones off what you hear, last of all; presets and undo \
            leave it as it is"),
        /// The sound panel.
        UseHeadphones = ("Choose", "Takes AutoEq's text of your headphones, or a SOFA file of their responses; the project \
            keeps it"),
        /// The sound panel.
        NoHeadphones = ("None", "What is heard goes out as it is"),
        /// Right.
        Source = ("Source", "How far the source is moved from its place in the scene, and where you hear it from; \
        with several, a click in the view chooses one"),
        /// Right.
        SourcePath = ("Choose", "Takes a file of a path for the source, as of a camera or an ADM object: one to choose, or the \
            one that is named beside. It is followed as Follow Path above says, and the project keeps it"),
        /// Right.
        NoSourcePath = ("No path", "The source stays where its offset puts it"),
        /// Right.
        Processor = ("Processor", "Time that a block takes to be played, as a share of the time that it lasts"),
        /// Right.
        Quality = ("Quality", "How near to all of the scene it stays, what that takes, and the budget of all instances"),
        /// Right.
        Budget = ("Budget", "The most that all instances may take together, as a share of one core: what is heard \
            least is played less accurately or not at all; bounces ignore it. 0 is no limit"),
        /// Right.
        Spent = ("All take", "What each instance may play within the budget, and what that takes: \
            an accuracy, or Waits (silent)"),
        /// Right.
        Output = ("Output", "What leaves the plugin"),
        /// Meters.
        In = ("In", "Level of the track as it comes, both channels"),
        /// Meters.
        Out = ("Out", "Level at the left and the right ear"),
        /// Meters.
        Momentary = ("M", "Loudness of both ears over the last 0.4 seconds, LUFS (EBU R 128)"),
        /// Meters.
        ShortTerm = ("S", "Loudness of both ears over the last 3 seconds, LUFS (EBU R 128)"),
        /// Meters.
        Integrated = ("I", "Loudness of all that was heard since this window was opened, without its pauses, LUFS (EBU R \
            128); a click begins anew"),
        /// Drawer.
        Response = ("Response", "What both ears hear of a click at the source: how it decays, and how loud each frequency is"),
        /// Response.
        AllOctaves = ("All", "Decay, T20 and C50 of the whole response"),
        /// Response.
        OneOctave = ("Octave", "Decay, T20 and C50 of the octave around this frequency, Hz"),
        /// Response.
        T20 = ("T20", "Time in which the sound falls by 60 dB, from its slope between -5 and -25 dB (ISO 3382-1), mean of \
            both ears"),
        /// Response.
        C50 = ("C50", "Clarity: sound of the first 50 milliseconds over what comes later (ISO 3382-1), mean of both ears"),
        /// Response.
        DecayCurve = ("Decay", "Energy that is still to come at each moment after the straight sound arrives, below all of it"),
        /// Response.
        Spectrum = ("Spectrum", "Level of the whole response, smoothed over a third of an octave; 0 dB is the track as it \
            comes"),
        /// Drawer.
        Sound = ("Sound", "How loud the parts of what is heard are, how long the room rings, and how wide it is"),
        /// Sound.
        Neutral = ("Reset sound", "Puts all of these back to where they change nothing"),
        /// Drawer.
        DirectSound = ("Direct sound", "What both ears hear of the sound that comes straight from the source"),
        /// Direct sound.
        Azimuth = ("Azimuth", "Direction of the source from the nose, positive to the left; drag or type, and the \
        host writes the source's x and y"),
        /// Direct sound.
        Elevation = ("Elevation", "Angle of the source above the head's level; drag or type, and the host writes \
        the source's place"),
        /// Direct sound.
        Distance = ("Distance", "Metres from the head to the source; drag or type, and the host writes the source's place"),
        /// Direct sound.
        Level = ("Level", "How much louder one ear hears the source than the other"),
        /// Direct sound.
        Time = ("Time", "How much earlier one ear hears the source than the other"),
        /// List of scenes.
        DrawRoom = ("Draw a room", "Puts a box room about the listener, to be given its lengths and the materials of its \
            walls"),
        /// List of scenes.
        YourRoom = ("Your room", "Plays the box room that was drawn; its panel is under the view, its walls can be dragged"),
        /// Drawer.
        Room = ("Room", "A box room to draw: how long, wide and high it is, and what its walls are made of"),
        /// Room.
        Length = ("Length", "How far the room reaches from its back wall to its front wall; drag, or click to type"),
        /// Room.
        Width = ("Width", "How far the room reaches from its right wall to its left wall; drag, or click to type"),
        /// Room.
        Height = ("Height", "How far the room reaches from its floor to its ceiling; drag, or click to type"),
        /// Room.
        BackWall = ("Back", "What the wall at the end of negative x is made of"),
        /// Room.
        FrontWall = ("Front", "What the wall at the end of positive x, ahead, is made of"),
        /// Room.
        RightWall = ("Right", "What the wall at the end of negative y is made of"),
        /// Room.
        LeftWall = ("Left", "What the wall at the end of positive y is made of"),
        /// Room.
        Floor = ("Floor", "What lies below the listener"),
        /// Room.
        Ceiling = ("Ceiling", "What lies above the listener"),
        /// Room.
        Volume = ("Volume", "Length times width times height, without furniture"),
        /// Room.
        Reverberation = ("T60", "Time in which the late sound falls by 60 dB, mean of 500 Hz and 1 kHz, as it is heard"),
        /// Room.
        T20At125 = ("T 125", "T20 at 125 Hz as measured, seconds; walls follow it. In brackets: as heard; 0: as the materials"),
        /// Room.
        T20At250 = ("T 250", "T20 at 250 Hz as measured, seconds; walls follow it. In brackets: as heard; 0: as the materials"),
        /// Room.
        T20At500 = ("T 500", "T20 at 500 Hz as measured, seconds; walls follow it. In brackets: as heard; 0: as the materials"),
        /// Room.
        T20At1k = ("T 1k", "T20 at 1 kHz as measured, seconds; walls follow it. In brackets: as heard; 0: as the materials"),
        /// Room.
        T20At2k = ("T 2k", "T20 at 2 kHz as measured, seconds; walls follow it. In brackets: as heard; 0: as the materials"),
        /// Room.
        T20At4k = ("T 4k", "T20 at 4 kHz as measured, seconds; walls follow it. In brackets: as heard; 0: as the materials"),
        /// Room.
        T20At8k = ("T 8k", "T20 at 8 kHz as measured, seconds; walls follow it. In brackets: as heard; 0: as the materials"),
        /// Room.
        OpenResponse = ("Response", "Takes the times of one measured response, WAV or SOFA: the file that is named beside, or \
            one to choose"),
        /// Room.
        AsMaterials = ("Clear", "Takes the times back: the walls absorb what their materials do"),
        /// Room.
        SaveScene = ("Save as scene", "Writes the room as a file of this name into the library's own folder, for other \
            projects and programs"),
        /// Drawer.
        CameraPath = ("Path", "A walk of the listener: record it, edit it, exchange it with other programs"),
        /// Camera path.
        Speed = ("Speed", "How fast the path is walked by the transport; below zero it goes backwards"),
        /// Camera path.
        Loop = ("Loop", "Begins again at the end of the path"),
        /// Camera path.
        Add = ("Add", "Adds a keyframe, a point of the path, where the listener is"),
        /// Camera path.
        Move = ("Move", "Takes the chosen keyframe to where the listener is"),
        /// Camera path.
        Delete = ("Delete", "Removes the chosen keyframe"),
        /// Camera path.
        Reverse = ("Reverse", "Walks the same way back"),
        /// Camera path.
        Record = ("Record a walk", "Writes down how the listener moves from now on, as the project's path; asks before it \
            replaces one"),
        /// Camera path.
        Replace = ("Replace", "Records over the project's path, which is lost but for Undo"),
        /// Camera path.
        Keep = ("Keep", "Leaves the project's path as it is and records nothing"),
        /// Camera path.
        StopRecording = ("Stop recording", "Makes what was recorded the project's path; Undo brings the former one back"),
        /// Camera path.
        Import = ("Import", "Reads a file as the project's path: the one that is named above, where a name without a \
            folder is one of the library's, or one to choose"),
        /// Camera path.
        Export = ("Export", "Writes the path as JSON or CSV: to the file that is named above, or to one to choose"),
        /// Camera path.
        Clear = ("Clear", "Removes the project's path; Undo brings it back"),
        /// Drawer.
        OscAndGroup = ("OSC and group", "Head trackers and remote control over Open Sound Control, and instances that \
            share a listener"),
        /// Open Sound Control.
        From = ("From", "Who may send: programs of this machine, or everybody on its networks"),
        /// Open Sound Control.
        Here = ("Here", "Only programs of this machine"),
        /// Open Sound Control.
        Network = ("Network", "Everybody on this machine's networks; there is no password"),
        /// Open Sound Control.
        Allow = ("Allow", "Lets everybody on this machine's networks move the listener of this project"),
        /// Open Sound Control.
        Name = ("Name", "Messages to /promenade/NAME/... reach the instances of this name only"),
        /// Open Sound Control.
        Format = ("Format", "Which program or device sends, so that its angles are understood"),
        /// Open Sound Control.
        UsedAs = ("Used as", "What the tracker does to the listener"),
        /// Open Sound Control.
        TrackerYaw = ("Yaw", "Which of the tracker's angles turns the head to the side"),
        /// Open Sound Control.
        TrackerPitch = ("Pitch", "Which of the tracker's angles tilts the head up and down"),
        /// Open Sound Control.
        TrackerRoll = ("Roll", "Which of the tracker's angles tilts the head to a shoulder"),
        /// Open Sound Control.
        Invert = ("Invert", "Counts the angle the other way round"),
        /// Open Sound Control.
        Recentre = ("Recentre", "Makes the head's present direction straight ahead; the choice is what that resets"),
        /// Open Sound Control.
        Now = ("Now", "Look ahead, then press: this is straight ahead"),
        /// Open Sound Control.
        RecentreYaw = ("Turn", "Direction and place; up and down stay those of gravity"),
        /// Open Sound Control.
        RecentreAll = ("All", "Every angle and the place, for a tracker that is mounted askew"),
        /// Open Sound Control.
        RecentreOff = ("Off", "Nothing: the tracker's own directions count"),
        /// Open Sound Control.
        Address = ("Address", "The address of the tracker's messages; * stands for any part"),
        /// Open Sound Control.
        Sends = ("Sends", "What the numbers of such a message are"),
        /// Open Sound Control.
        SendToPort = ("Send to port", "Sends the listener's pose to another program or instance"),
        /// Open Sound Control.
        AdmObject = ("ADM object", "Number of this source in ADM-OSC, 0 for none; and what a distance of 1 is there, metres"),
        /// Open Sound Control.
        SendAdm = ("As ADM-OSC", "Sends listener and source as ADM-OSC instead of the pose"),
        /// Open Sound Control.
        Host = ("Host", "Name or address of the machine that the pose is sent to"),
        /// Top line.
        Presets = ("Presets", "Settings to begin with, of the factory and your own: choose one, or save how it sounds now"),
        /// Top line.
        PreviousPreset = ("\u{2039}", "The preset before the chosen one"),
        /// Top line.
        NextPreset = ("\u{203A}", "The preset after the chosen one"),
        /// Top line.
        CopyToB = ("A to B", "Makes the second setting like the one that is heard"),
        /// Top line.
        CopyToA = ("B to A", "Makes the first setting like the one that is heard"),
        /// Presets.
        Save = ("Save", "Writes the preset's file, over one of the same name"),
        /// Drawer.
        Sources = ("Sources", "All sources: names, colours, mute, solo, levels, and where each is heard from"),
        /// Sources.
        Arrange = ("Arrange", "Puts all sources where the room has place: on an arc before the listener, then in rows"),
        /// Sources.
        HearAll = ("Hear all", "Takes every mute and solo back"),
        /// Sources.
        SourceName = ("Name", "What the source plays, as the view and the lists show it; the project keeps it"),
        /// Sources.
        SourceColour = ("Colour", "The colour of the source in the view; the project keeps it"),
        /// Sources.
        NoColour = ("None", "The colour that sources have at first"),
        /// Sources.
        Mute = ("M", "Mute: the source is not heard, neither dry nor in the room"),
        /// Sources.
        Solo = ("S", "Solo: only sources with this pressed are heard"),
        /// Camera path.
        Timeline = ("Timeline", "The path over time with what was heard: drag a keyframe to another time"),
        /// Errors.
        TrueStereo = ("True stereo", "Plays left and right with a source each, 60 degrees apart (Stereo in the panel Sound)"),
        /// Errors.
        TryAgain = ("Try again", "Looks for the missing file once more"),
        ;
        /// Beside the control of a parameter.
        Of(Parameter) = of
    }
}

fn of(parameter: Parameter) -> (&'static str, &'static str) {
    (parameter.row().label, parameter.row().help)
}

impl Word {
    /// As it is written.
    pub fn label(self) -> &'static str {
        self.row().0
    }

    /// What it means.
    pub fn help(self) -> &'static str {
        self.row().1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Words of the code that mean nothing outside of it.
    const UNKNOWN: [&str; 7] = ["knob", "decod", "ears panel", "tier", "mask", "anchor", "baked"];

    /// Whether a text tells more than the name that it belongs to.
    fn explains(name: &str, text: &str) -> bool {
        let plain = |text: &str| text.to_lowercase();
        let words = |text: &str| plain(text).split(|c: char| !c.is_alphanumeric()).map(str::to_owned).collect::<HashSet<_>>();
        let new = words(text).difference(&words(name)).filter(|word| word.len() > 2).count();
        new >= 3
    }

    #[test]
    fn every_word_of_the_editor_is_explained_by_its_tooltip() {
        for word in Word::ALL.into_iter().chain(Parameter::EVERY.map(Word::Of)) {
            assert!(explains(word.label(), word.help()), "{}: {}", word.label(), word.help());
            for unknown in UNKNOWN {
                assert!(!word.label().to_lowercase().contains(unknown), "who knows what {} is?", word.label());
            }
        }
        for variants in Parameter::EVERY.into_iter().filter_map(Parameter::variants) {
            for (name, text) in variants.names.iter().zip(variants.help) {
                assert!(explains(name, text), "{name}: {text:?}");
            }
        }
    }

    /// The sources of the editor, so that no text is shown past [`Word`]: widgets take one, and only they paint names.
    #[test]
    fn no_control_has_a_label_of_its_own() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/editor");
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if !path.is_file() || path.ends_with("words.rs") || path.ends_with("widgets.rs") {
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            for own in ["ui.button(", "ui.checkbox(", "ui.radio(", "ui.heading(", "Button::new(\"", "on_hover_text(\""] {
                assert!(!text.contains(own), "{} has {own}", path.display());
            }
        }
    }
}
