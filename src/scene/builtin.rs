//! Scenes and meshes that are part of the program, so that an installed binary runs them anywhere.

/// Name and TOML of every built-in scene.
pub const BUILTIN: &[(&str, &str)] = &[
    ("drape", include_str!("builtin/drape.toml")),
    ("hanging-cloth", include_str!("builtin/hanging-cloth.toml")),
    ("chain", include_str!("builtin/chain.toml")),
];

/// Path and OBJ text of every built-in mesh.
const MESHES: &[(&str, &str)] = &[("mannequin.obj", include_str!("../../meshes/mannequin.obj"))];

/// The TOML of a built-in scene.
pub fn builtin_scene(name: &str) -> Option<&'static str> {
    find(BUILTIN, name)
}

/// The OBJ text of a built-in mesh.
pub fn builtin_mesh(path: &str) -> Option<&'static str> {
    find(MESHES, path)
}

fn find(list: &'static [(&str, &str)], name: &str) -> Option<&'static str> {
    list.iter()
        .find(|(known, _)| *known == name)
        .map(|(_, text)| *text)
}
