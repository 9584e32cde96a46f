//! The node tree: who is whose child, and where every node stands, at rest and at the start of the animations.
//! The document comes from `document`; transforms go to meshes, skins and cameras.

use super::accessor::Data;
use crate::camera::{Channel, Interpolation, Link, Property};
use crate::scene::error::Warnings;
use ::gltf::json;
use ::gltf::json::accessor::Type;
use ::gltf::json::validation::Checked;
use glam::{DMat4, DQuat, DVec3, DVec4};

/// A deeper tree than this is refused.
const MAX_DEPTH: usize = 512;

/// The nodes of the scene that is shown.
pub(crate) struct Nodes {
    /// Every node's parent.
    pub parents: Vec<Option<usize>>,
    /// The nodes of the scene, parents before children.
    pub order: Vec<usize>,
    /// Whether a node is in the scene.
    pub shown: Vec<bool>,
    /// World transforms at rest; identity for nodes that are not in the scene.
    pub rest: Vec<DMat4>,
    /// World transforms with every animated property at its first key.
    pub posed: Vec<DMat4>,
    /// Every node with its channels.
    pub links: Vec<Link>,
    /// First and last second of the animations that a node's channels come from.
    pub ranges: Vec<Option<[f64; 2]>>,
}

/// Orders the nodes of the default scene and poses them.
pub(crate) fn load(data: Data<'_>, warnings: &mut Warnings) -> Result<Nodes, String> {
    let root = data.root;
    let count = root.nodes.len();
    let mut parents = vec![None; count];
    for (i, node) in root.nodes.iter().enumerate() {
        for child in node.children.iter().flatten() {
            let slot = parents.get_mut(child.value()).ok_or_else(|| format!("{}: child {child} of {count} nodes", name(data, i)))?;
            if let Some(other) = slot.replace(i) {
                return Err(format!(
                    "{} is a child of nodes {other} and {i}; expected a tree: export the file again",
                    name(data, child.value())
                ));
            }
        }
    }
    let (order, shown) = order(data, &parents, warnings)?;
    let mut nodes = Nodes {
        order,
        shown,
        parents,
        rest: vec![DMat4::IDENTITY; count],
        posed: vec![DMat4::IDENTITY; count],
        links: root.nodes.iter().map(link).collect(),
        ranges: vec![None; count],
    };
    animate(data, &mut nodes, warnings)?;
    for &i in &nodes.order {
        let (rest, posed) = nodes.parents[i].map_or((DMat4::IDENTITY, DMat4::IDENTITY), |p| (nodes.rest[p], nodes.posed[p]));
        nodes.rest[i] = rest * nodes.links[i].rest;
        nodes.posed[i] = posed * nodes.links[i].at(f64::NEG_INFINITY);
    }
    Ok(nodes)
}

/// What messages call node `i`.
pub(crate) fn name(data: Data<'_>, i: usize) -> String {
    match data.root.nodes.get(i).and_then(|n| n.name.as_ref()) {
        Some(name) => format!("node \"{name}\""),
        None => format!("node {i}"),
    }
}

fn order(data: Data<'_>, parents: &[Option<usize>], warnings: &mut Warnings) -> Result<(Vec<usize>, Vec<bool>), String> {
    let root = data.root;
    let roots: Vec<usize> = if root.scenes.is_empty() {
        (0..parents.len()).filter(|&i| parents[i].is_none()).collect()
    } else {
        let chosen = root.scene.map_or(0, |s| s.value());
        let scene = root.scenes.get(chosen).ok_or_else(|| format!("scene {chosen} of {}", root.scenes.len()))?;
        if root.scenes.len() > 1 {
            warnings.add(format!("the file has {} scenes: only its default scene, number {chosen}, is shown", root.scenes.len()));
        }
        scene.nodes.iter().map(|n| n.value()).collect()
    };
    let mut order = Vec::new();
    let mut seen = vec![false; parents.len()];
    let mut stack: Vec<(usize, usize)> = roots.into_iter().rev().map(|i| (i, 0)).collect();
    while let Some((i, depth)) = stack.pop() {
        let Some(flag) = seen.get_mut(i) else { return Err(format!("the scene names node {i} of {}", parents.len())) };
        if std::mem::replace(flag, true) {
            return Err(format!("{} is reached twice, or is its own ancestor; expected a tree: export the file again", name(data, i)));
        }
        if depth > MAX_DEPTH {
            return Err(format!("{}: more than {MAX_DEPTH} ancestors: flatten the hierarchy", name(data, i)));
        }
        order.push(i);
        stack.extend(root.nodes[i].children.iter().flatten().rev().map(|c| (c.value(), depth + 1)));
    }
    if let Some(&i) = order.iter().find(|&&i| parents[i].is_some_and(|p| !seen[p])) {
        warnings.add(format!("{} is a root of the scene and another node's child: its parent's transform is not used", name(data, i)));
    }
    Ok((order, seen))
}

fn link(node: &json::Node) -> Link {
    let vec3 = |v: Option<[f32; 3]>, default: DVec3| v.map_or(default, |v| DVec3::from_array(v.map(f64::from)));
    let translation = vec3(node.translation, DVec3::ZERO);
    let scale = vec3(node.scale, DVec3::ONE);
    let rotation = node.rotation.as_ref().map_or(DVec4::W, |r| DVec4::from_array(r.0.map(f64::from))).try_normalize().unwrap_or(DVec4::W);
    let rotation = DQuat::from_vec4(rotation);
    match &node.matrix {
        Some(m) => {
            let rest = DMat4::from_cols_array(&m.map(f64::from));
            Link { rest, parts: parts(&rest), channels: Vec::new() }
        }
        None => Link {
            rest: DMat4::from_scale_rotation_translation(scale, rotation, translation),
            parts: (translation, rotation, scale),
            channels: Vec::new(),
        },
    }
}

/// A matrix in parts, translation first.
fn parts(matrix: &DMat4) -> (DVec3, DQuat, DVec3) {
    if matrix.determinant() == 0.0 || !matrix.is_finite() {
        return (matrix.w_axis.truncate(), DQuat::IDENTITY, DVec3::ONE);
    }
    let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
    (translation, rotation, scale)
}

/// Gives every node its channels: for each property the first animation that drives it.
fn animate(data: Data<'_>, nodes: &mut Nodes, warnings: &mut Warnings) -> Result<(), String> {
    for (a, animation) in data.root.animations.iter().enumerate() {
        let what = animation.name.as_ref().map_or(format!("animation {a}"), |n| format!("animation \"{n}\""));
        let mut driven = Vec::new();
        let mut range: Option<[f64; 2]> = None;
        for (c, channel) in animation.channels.iter().enumerate() {
            let place = |e: String| format!("{what}: channel {c}: {e}");
            let node = channel.target.node.value();
            if node >= nodes.links.len() {
                return Err(place(format!("node {node} of {}", nodes.links.len())));
            }
            let property = match channel.target.path {
                Checked::Valid(json::animation::Property::Translation) => Property::Translation,
                Checked::Valid(json::animation::Property::Rotation) => Property::Rotation,
                Checked::Valid(json::animation::Property::Scale) => Property::Scale,
                Checked::Valid(json::animation::Property::MorphTargetWeights) => {
                    warnings.add("morph targets are ignored: meshes keep their base shape");
                    continue;
                }
                Checked::Invalid => return Err(place("unknown path; expected translation, rotation, scale or weights".to_owned())),
            };
            let sampler = animation.samplers.get(channel.sampler.value());
            let sampler = sampler.ok_or_else(|| place(format!("sampler {} of {}", channel.sampler, animation.samplers.len())))?;
            let keys = keys(data, sampler, property).map_err(place)?;
            if let (Some(&first), Some(&last)) = (keys.times.first(), keys.times.last()) {
                let [low, high] = range.unwrap_or([first, last]);
                range = Some([low.min(first), high.max(last)]);
            }
            driven.push((node, keys));
        }
        for (node, keys) in driven {
            let link = &mut nodes.links[node];
            if link.channels.iter().all(|c| c.property != keys.property) {
                link.channels.push(keys);
                if let (Some([low, high]), Some([first, last])) = (nodes.ranges[node], range) {
                    nodes.ranges[node] = Some([low.min(first), high.max(last)]);
                } else {
                    nodes.ranges[node] = range;
                }
            }
        }
    }
    Ok(())
}

fn keys(data: Data<'_>, sampler: &json::animation::Sampler, property: Property) -> Result<Channel, String> {
    let interpolation = match sampler.interpolation {
        Checked::Valid(json::animation::Interpolation::Linear) => Interpolation::Linear,
        Checked::Valid(json::animation::Interpolation::Step) => Interpolation::Step,
        Checked::Valid(json::animation::Interpolation::CubicSpline) => Interpolation::Cubic,
        Checked::Invalid => return Err("unknown interpolation; expected LINEAR, STEP or CUBICSPLINE".to_owned()),
    };
    let times = data.read(sampler.input.value(), &[Type::Scalar])?;
    let shape = if property == Property::Rotation { Type::Vec4 } else { Type::Vec3 };
    let values = data.read(sampler.output.value(), &[shape])?;
    if times.count == 0 {
        return Err("no keys".to_owned());
    }
    if let Some(i) = times.bad.or_else(|| times.values.windows(2).position(|w| w[1] <= w[0]).map(|i| i + 1)) {
        return Err(format!("key {i}: time {} does not come after the one before it", times.values[i]));
    }
    let expected = times.count * if interpolation == Interpolation::Cubic { 3 } else { 1 };
    if values.count != expected {
        return Err(format!("{} values for {} keys; expected {expected}", values.count, times.count));
    }
    if let Some(i) = values.bad {
        return Err(format!("value {i} is not a number"));
    }
    let values = (0..values.count).map(|i| DVec4::from_array(values.element::<4>(i))).collect();
    Ok(Channel { property, interpolation, times: times.values, values })
}
