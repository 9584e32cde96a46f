//! Cameras of a glTF file: their field of view, and the animated chain of nodes they hang on.
//! The document comes from `document`, the chain from `nodes`; paths go to scene files that name them.

use super::accessor::Data;
use super::nodes::Nodes;
use crate::camera::Animated;
use crate::scene::model::{Model, ModelCamera};
use ::gltf::json::camera::Type;
use ::gltf::json::validation::Checked;

/// Appends every camera that a node of the scene carries.
pub(crate) fn load(data: Data<'_>, nodes: &Nodes, model: &mut Model) -> Result<(), String> {
    for &n in &nodes.order {
        let node = &data.root.nodes[n];
        let Some(index) = node.camera.map(|c| c.value()) else { continue };
        let all = &data.root.cameras;
        let camera = all.get(index).ok_or_else(|| format!("node {n}: camera {index} of {}", all.len()))?;
        let mut names: Vec<String> = [camera.name.clone(), node.name.clone()].into_iter().flatten().collect();
        names.push(format!("{index}"));
        let path = match (camera.type_, &camera.perspective) {
            (Checked::Valid(Type::Perspective), Some(p)) => {
                let fov = f64::from(p.yfov).to_degrees();
                if fov > 0.0 && fov < 180.0 {
                    Ok(path(n, nodes, fov))
                } else {
                    Err(format!("its field of view is {fov} degrees; expected between 0 and 180"))
                }
            }
            (Checked::Valid(Type::Orthographic), _) => Err("it is orthographic; expected a perspective camera".to_owned()),
            _ => Err("its type is unknown or its perspective is missing".to_owned()),
        };
        model.cameras.push(ModelCamera { names, path });
    }
    Ok(())
}

fn path(node: usize, nodes: &Nodes, fov: f64) -> Animated {
    let mut chain = Vec::new();
    let mut range: Option<[f64; 2]> = None;
    let mut at = Some(node);
    // Only nodes of the scene: those are known to form a tree.
    while let Some(n) = at.filter(|&n| nodes.shown[n] && chain.len() < nodes.order.len()) {
        chain.push(nodes.links[n].clone());
        if let Some([first, last]) = nodes.ranges[n] {
            let [low, high] = range.unwrap_or([first, last]);
            range = Some([low.min(first), high.max(last)]);
        }
        at = nodes.parents[n];
    }
    chain.reverse();
    Animated { chain, range: range.unwrap_or([0.0, 0.0]), fov }
}
