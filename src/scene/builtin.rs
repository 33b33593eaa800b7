//! Scenes and meshes that are part of the program, so that an installed binary runs them anywhere.

/// Name and TOML of every built-in scene.
pub const BUILTIN: &[(&str, &str)] = &[
    ("drape", include_str!("builtin/drape.toml")),
    ("hanging-cloth", include_str!("builtin/hanging-cloth.toml")),
    (
        "zero-length-spring",
        include_str!("builtin/zero-length-spring.toml"),
    ),
    ("spring", include_str!("builtin/spring.toml")),
    (
        "rusty-and-oiled",
        include_str!("builtin/rusty-and-oiled.toml"),
    ),
    (
        "spring-constants",
        include_str!("builtin/spring-constants.toml"),
    ),
    ("chain", include_str!("builtin/chain.toml")),
    ("sheets", include_str!("builtin/sheets.toml")),
    ("block", include_str!("builtin/block.toml")),
    ("edge-springs", include_str!("builtin/edge-springs.toml")),
    ("thin-shell", include_str!("builtin/thin-shell.toml")),
    (
        "walking-mannequin",
        include_str!("builtin/walking-mannequin.toml"),
    ),
    ("drape-sphere", include_str!("builtin/drape-sphere.toml")),
    ("table-cloth", include_str!("builtin/table-cloth.toml")),
    ("incline", include_str!("builtin/incline.toml")),
    ("bullet", include_str!("builtin/bullet.toml")),
    ("stack", include_str!("builtin/stack.toml")),
    ("twist", include_str!("builtin/twist.toml")),
];

/// Path and OBJ text of every built-in mesh.
const MESHES: &[(&str, &str)] = &[
    ("mannequin.obj", include_str!("../../meshes/mannequin.obj")),
    ("poncho.obj", include_str!("../../meshes/poncho.obj")),
    ("slab.obj", include_str!("../../meshes/slab.obj")),
    ("shell.obj", include_str!("../../meshes/shell.obj")),
    ("table.obj", include_str!("../../meshes/table.obj")),
    ("tube.obj", include_str!("../../meshes/tube.obj")),
];

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
