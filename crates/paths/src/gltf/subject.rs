//! Which node of a glTF file is the listener, and which animation moves it.

use super::document::Document;
use crate::PathFileError;
use crate::text::quoted;
use gltf::json::animation::Property;
use gltf::json::validation::Checked;
use std::collections::BTreeSet;

pub(super) struct Subject {
    /// Number of the animation.
    pub(super) animation: usize,
    /// Numbers of the node and its parents, the node last; never empty.
    pub(super) chain: Vec<usize>,
}

impl Subject {
    /// The node in words.
    pub(super) fn name(&self, document: &Document<'_, '_>) -> String {
        self.chain.last().map_or_else(String::new, |node| node_name(document, *node))
    }
}

/// The animation, camera or node of a name; without one the first animated camera, else the first animated node.
pub(super) fn find(document: &Document<'_, '_>, name: Option<&str>, notes: &mut Vec<String>) -> Result<Subject, PathFileError> {
    let root = &document.root;
    if root.animations.is_empty() {
        return Err(PathFileError::content(document.file, "an animation", "none"));
    }
    let tree = Tree::new(document)?;
    let (animations, wanted) = match name {
        None => (0..root.animations.len(), None),
        Some(name) => match root.animations.iter().position(|a| a.name.as_deref() == Some(name)) {
            Some(animation) => (animation..animation + 1, None),
            None => {
                let node = (0..root.nodes.len()).find(|n| names(document, *n).contains(&Some(name)));
                let found = || format!("none of them; there are {}", all_names(document));
                let expected = format!("an animation, camera or node called {}", quoted(name));
                let node = node.ok_or_else(|| PathFileError::content(document.file, expected, found()))?;
                (0..root.animations.len(), Some(node))
            }
        },
    };
    let choices = |eligible: &dyn Fn(usize) -> bool| -> Vec<(usize, usize)> {
        let nodes: Vec<usize> = (0..root.nodes.len()).filter(|n| eligible(*n)).collect();
        animations.clone().flat_map(|a| nodes.iter().map(move |n| (a, *n))).filter(|(a, n)| tree.animated(*a, *n)).collect()
    };
    let cameras = match wanted {
        Some(wanted) => choices(&|n| n == wanted),
        None => choices(&|n| root.nodes[n].camera.is_some()),
    };
    // Of nodes without a camera one that moves itself: what hangs on it would be an arbitrary choice.
    let moved = || tree.moved.range((animations.start, 0)..(animations.end, 0)).next().copied();
    let chosen = cameras.first().copied().or_else(|| if wanted.is_none() { moved() } else { None });
    let Some((animation, node)) = chosen else {
        let expected = "an animation of the position or rotation of a camera or node";
        return Err(PathFileError::content(document.file, expected, format!("none; there are {}", all_names(document))));
    };
    if root.nodes[node].camera.is_none() {
        notes.push(format!("{} has no camera; it looks along its -z axis", node_name(document, node)));
    } else if cameras.len() > 1 && name.is_none() {
        let others: Vec<String> = cameras[1..].iter().take(8).map(|(_, n)| node_name(document, *n)).collect();
        notes.push(format!("the first of {} animated cameras; the others: {}", cameras.len(), others.join(", ")));
    }
    let mut chain: Vec<usize> = tree.upwards(node).collect();
    chain.reverse();
    Ok(Subject { animation, chain })
}

/// Parents above a node; far more than any scene has.
const MAX_DEPTH: usize = 1000;

/// Which node hangs on which, and which ones animations move.
struct Tree {
    parents: Vec<Option<usize>>,
    /// Animation and node of every channel for a position or rotation.
    moved: BTreeSet<(usize, usize)>,
}

impl Tree {
    fn new(document: &Document<'_, '_>) -> Result<Self, PathFileError> {
        let nodes = &document.root.nodes;
        let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
        for (index, node) in nodes.iter().enumerate() {
            for child in node.children.iter().flatten().map(|c| c.value()) {
                let place = format!("node {index}");
                match parents.get_mut(child) {
                    Some(parent @ None) => *parent = Some(index),
                    Some(Some(other)) => {
                        let found = format!("node {child}, which is one of node {other} already");
                        return Err(document.wrong(place, "children of its own", found));
                    }
                    None => {
                        let expected = format!("children among {} nodes", nodes.len());
                        return Err(document.wrong(place, expected, format!("number {child}")));
                    }
                }
            }
        }
        let mut moved = BTreeSet::new();
        for (number, animation) in document.root.animations.iter().enumerate() {
            for target in animation.channels.iter().map(|c| &c.target) {
                if matches!(target.path, Checked::Valid(Property::Translation | Property::Rotation)) {
                    if target.node.value() >= nodes.len() {
                        let expected = format!("a channel for one of {} nodes", nodes.len());
                        return Err(document.wrong(
                            format!("animation {number}"),
                            expected,
                            format!("number {}", target.node.value()),
                        ));
                    }
                    moved.insert((number, target.node.value()));
                }
            }
        }
        let tree = Self { parents, moved };
        match (0..nodes.len()).find(|n| tree.upwards(*n).count() > MAX_DEPTH) {
            Some(node) => {
                Err(document.wrong(format!("node {node}"), format!("at most {MAX_DEPTH} parents"), "more, or a circle"))
            }
            None => Ok(tree),
        }
    }

    /// A node, its parent, and so on; no more of them than [`MAX_DEPTH`] and one.
    fn upwards(&self, node: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(node), |n| self.parents[*n]).take(MAX_DEPTH + 1)
    }

    /// Whether an animation moves a node or one of its parents.
    fn animated(&self, animation: usize, node: usize) -> bool {
        self.upwards(node).any(|n| self.moved.contains(&(animation, n)))
    }
}

/// The names that a node goes by: its own and its camera's.
fn names<'d>(document: &'d Document<'_, '_>, node: usize) -> [Option<&'d str>; 2] {
    let node = &document.root.nodes[node];
    let camera = node.camera.and_then(|c| document.root.cameras.get(c.value()));
    [node.name.as_deref(), camera.and_then(|c| c.name.as_deref())]
}

fn node_name(document: &Document<'_, '_>, node: usize) -> String {
    let kind = if document.root.nodes[node].camera.is_some() { "camera" } else { "node" };
    match names(document, node).into_iter().flatten().next() {
        Some(name) => format!("{kind} {}", quoted(name)),
        None => format!("{kind} {node}"),
    }
}

/// Animations and cameras by their names, for errors.
fn all_names(document: &Document<'_, '_>) -> String {
    const SHOWN: usize = 16;
    let root = &document.root;
    let unnamed = || "one without a name".to_owned();
    let animations = root.animations.iter().map(|a| a.name.as_deref().map_or_else(unnamed, quoted)).take(SHOWN);
    let cameras = (0..root.nodes.len()).filter(|n| root.nodes[*n].camera.is_some()).map(|n| node_name(document, n)).take(SHOWN);
    let (animations, cameras): (Vec<_>, Vec<_>) = (animations.collect(), cameras.collect());
    let cameras = if cameras.is_empty() { "no camera".to_owned() } else { cameras.join(", ") };
    format!("animations {} and {cameras}", animations.join(", "))
}
