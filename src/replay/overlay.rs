//! How recordings appear to viewers: one as itself, several over each other in one.
//!
//! Of several, what is `/world/sheet` and `/energy/kinetic` in the file `fine.rrd` is shown as `/world/fine: sheet`
//! and `/energy/fine: kinetic`: then one view of `/world` and one plot of `/energy` show all of them.

use super::survey::Survey;
use super::{Layout, ReadError, for_each_frame};
use crate::frame::{ClothFrame, ClothHeader, Frame, Header, ObstacleHeader, Series};
use crate::recorder::{blueprint, entity, statics};
use rerun::external::re_log_types::{RecordingId, SetStoreInfo, StoreId};
use rerun::log::{Chunk, LogMsg};
use rerun::{
    EntityPath, EntityPathPart, Mesh3D, RecordingStreamBuilder, RecordingStreamResult, Rgba32,
    SeriesLines, TextDocument,
};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// The series that are plotted of several recordings, in the order of their colours; the others are sent, too.
const PLOTTED: [&str; 5] = [
    "energy/kinetic",
    "energy/gravitational",
    "strain/max",
    "contact/depth",
    "error/time_step",
];
/// What the cloths of the second recording, the third and so on are tinted with; the first is as it is.
const TINTS: [[u8; 3]; 4] = [
    [130, 185, 255],
    [255, 200, 110],
    [140, 225, 150],
    [225, 150, 235],
];
/// Where the scenes of several recordings are: below `/scene` they would be one text too many for its view.
const SCENES: &str = "scenes";

/// How recordings appear.
#[derive(Debug)]
pub(super) struct Cast {
    store: StoreId,
    /// What each of several is called; empty for a single one.
    names: Vec<String>,
    header: Header,
    first: Frame,
}

impl Cast {
    /// How these appear: always as a new recording, since a viewer that has shown the old one is at its end.
    pub(super) fn of(recordings: &[(PathBuf, Survey)]) -> Result<Self, ReadError> {
        let application = recordings.iter().flat_map(|(_, survey)| &survey.sticky);
        let mut stores = application.map(LogMsg::store_id);
        let store = stores.find(|store| store.is_recording()).cloned();
        let store = store.unwrap_or_else(|| StoreId::recording(entity::APPLICATION, "muslin"));
        let mut cast = Self {
            store: store.with_recording_id(RecordingId::random()),
            names: Vec::new(),
            header: Header::default(),
            first: Frame::default(),
        };
        if recordings.len() > 1 {
            cast.names = names(recordings.iter().map(|(path, _)| path.as_path()));
            for (role, (path, survey)) in recordings.iter().enumerate() {
                cast.introduce(role, path, survey)?;
            }
            let place = |series: &Series| {
                let own =
                    |plotted: &&str| named(&cast.names, plotted).any(|path| path == series.path);
                PLOTTED.iter().position(own).unwrap_or(PLOTTED.len())
            };
            cast.header.series.sort_by_key(place);
        }
        Ok(cast)
    }

    /// A message that every viewer needs, as it appears.
    pub(super) fn message(&self, role: usize, message: &LogMsg) -> Option<LogMsg> {
        if !self.names.is_empty() {
            let LogMsg::ArrowMsg(store, rows) = message else {
                return None;
            };
            let chunk = Chunk::from_arrow_msg(rows)
                .ok()
                .filter(|_| store.is_recording())?;
            return self.rows(role, &chunk)?.ok();
        }
        Some(match message {
            LogMsg::SetStoreInfo(told) if told.info.store_id.is_recording() => {
                let mut told: SetStoreInfo = told.clone();
                told.info.store_id = self.store.clone();
                LogMsg::SetStoreInfo(told)
            }
            LogMsg::ArrowMsg(store, rows) if store.is_recording() => {
                LogMsg::ArrowMsg(self.store.clone(), rows.clone())
            }
            other => other.clone(),
        })
    }

    /// Rows as they appear, if they do.
    pub(super) fn rows(
        &self,
        role: usize,
        chunk: &Chunk,
    ) -> Option<rerun::log::ChunkResult<LogMsg>> {
        let rows = match self.names.get(role) {
            None => chunk.to_arrow_msg(),
            Some(_) if label(chunk).is_some() => return None, // has got a new one
            Some(name) => {
                let path = renamed(chunk.entity_path(), name)?;
                chunk.clone_with_new_entity_path(path).to_arrow_msg()
            }
        };
        Some(rows.map(|rows| LogMsg::ArrowMsg(self.store.clone(), rows)))
    }

    /// What only several need at first: their common name, labels and tints.
    pub(super) fn opening(&self) -> RecordingStreamResult<Vec<LogMsg>> {
        if self.names.is_empty() {
            return Ok(Vec::new());
        }
        let (stream, memory) = RecordingStreamBuilder::from_store_id(&self.store)
            .enabled(true)
            .send_properties(true)
            .recording_name(self.names.join(", "))
            .recording_started(0)
            .memory()?;
        stream.set_log_time_enabled(false);
        let list = self.names.iter().map(|name| format!("- {name}\n"));
        let text = format!("### Recordings\n\n{}", list.collect::<String>());
        stream.log_static(entity::SCENE, &TextDocument::from_markdown(text))?;
        statics::log_series(&stream, &self.header.series)?;
        for cloth in &self.header.cloths {
            let own = |name: &String| cloth.name.starts_with(&format!("{name}: "));
            if let Some(tint) = self
                .names
                .iter()
                .position(own)
                .and_then(|role| role.checked_sub(1))
            {
                let mesh = Mesh3D::update_fields()
                    .with_albedo_factor(Rgba32::from(TINTS[tint % TINTS.len()]));
                stream.log_static(entity::body(&cloth.name), &mesh)?;
            }
        }
        stream.flush_blocking().ok();
        Ok(memory.take())
    }

    /// The blueprint of several; a single one has its own.
    pub(super) fn layout(&self) -> RecordingStreamResult<Vec<LogMsg>> {
        if self.names.is_empty() {
            return Ok(Vec::new());
        }
        let mut header = self.header.clone();
        let plotted = |series: &Series| {
            PLOTTED
                .iter()
                .any(|plotted| named(&self.names, plotted).any(|path| path == series.path))
        };
        header.series.retain(plotted);
        blueprint::of(&header, &self.first)
    }

    /// Adds a recording's cloths, obstacles and series by the names under which they appear.
    fn introduce(&mut self, role: usize, path: &Path, survey: &Survey) -> Result<(), ReadError> {
        let name = &self.names[role];
        let layout = Layout::read(path)?;
        let mut places = None;
        for_each_frame(path, &layout, |frame| {
            places = Some(frame.cloths);
            ControlFlow::Break(())
        })?;
        let places = places.unwrap_or_default().into_iter();
        self.first.cloths.extend(places.map(|positions| ClothFrame {
            positions,
            ..ClothFrame::default()
        }));
        self.header
            .cloths
            .extend(layout.cloths.into_iter().map(|cloth| ClothHeader {
                name: format!("{name}: {}", cloth.name),
                triangles: cloth.triangles,
                ..ClothHeader::default()
            }));
        self.header
            .obstacles
            .extend(layout.obstacles.into_iter().map(|obstacle| ObstacleHeader {
                name: format!("{name}: {}", obstacle.name),
                positions: obstacle.positions.unwrap_or_default(),
                ..ObstacleHeader::default()
            }));
        for message in &survey.sticky {
            let LogMsg::ArrowMsg(store, rows) = message else {
                continue;
            };
            let chunk = Chunk::from_arrow_msg(rows)
                .ok()
                .filter(|_| store.is_recording());
            if let Some(chunk) = chunk
                && let Some(label) = label(&chunk)
                && let Some(path) = renamed(chunk.entity_path(), name)
            {
                let parts: Vec<_> = path.iter().map(EntityPathPart::unescaped_str).collect();
                self.header.series.push(Series {
                    path: parts.join("/"),
                    label: format!("{name}: {label}"),
                });
            }
        }
        Ok(())
    }
}

/// What a series is called, if these rows tell.
fn label(chunk: &Chunk) -> Option<String> {
    let component = SeriesLines::descriptor_names().component;
    let mut names = chunk.iter_slices::<String>(component);
    Some(names.next()?.first()?.as_str().to_owned())
}

/// The paths of a series in each of several recordings.
fn named<'a>(names: &'a [String], series: &'a str) -> impl Iterator<Item = String> + 'a {
    let (group, last) = series.rsplit_once('/').unwrap_or(("", series));
    names
        .iter()
        .map(move |name| format!("{group}/{name}: {last}"))
}

/// Where an entity of the recording `name` is among several; `None` for what is only of its own.
fn renamed(path: &EntityPath, name: &str) -> Option<EntityPath> {
    let parts: Vec<&str> = path.iter().map(EntityPathPart::unescaped_str).collect();
    let own = |part: &str| format!("{name}: {part}");
    let mut parts: Vec<String> = parts.into_iter().map(str::to_owned).collect();
    match parts.as_mut_slice() {
        [] => return None,
        [first, ..] if first.starts_with("__") => return None, // properties of a recording
        [first] if first == entity::WORLD => {}
        [first, second, ..] if first == entity::WORLD => *second = own(second),
        [first, ..] if first == entity::SCENE => {
            SCENES.clone_into(first);
            parts.insert(1, name.to_owned());
        }
        [first, ..] if first == entity::LOG || first == entity::CHECKPOINT => {
            parts.insert(1, name.to_owned());
        }
        [.., last] => *last = own(last),
    }
    Some(entity::path(
        &parts.iter().map(String::as_str).collect::<Vec<_>>(),
    ))
}

/// What files are called: by their names without the ending, and by a number where that isn't enough.
fn names<'a>(paths: impl Iterator<Item = &'a Path>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for path in paths {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let numbered = (2..).map(|n| format!("{stem} {n}"));
        let mut choices = std::iter::once(stem.clone().into_owned()).chain(numbered);
        names.extend(choices.find(|name| !names.contains(name)));
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_has_its_place_beside_its_like() {
        let cases = [
            ("/world", Some("/world")),
            ("/world/my\\ sheet", Some("/world/fine:\\ my\\ sheet")),
            (
                "/world/sheet/springs/shear",
                Some("/world/fine:\\ sheet/springs/shear"),
            ),
            ("/energy/kinetic", Some("/energy/fine:\\ kinetic")),
            ("/log", Some("/log/fine")),
            ("/scene", Some("/scenes/fine")),
            ("/checkpoint/sheet", Some("/checkpoint/fine/sheet")),
            ("/__properties/sim", None),
        ];
        for (path, expected) in cases {
            let renamed = renamed(&EntityPath::parse_forgiving(path), "fine");
            assert_eq!(renamed, expected.map(EntityPath::parse_forgiving), "{path}");
        }
        let names: Vec<_> = named(&["a".to_owned(), "b".to_owned()], "strain/max").collect();
        assert_eq!(names, ["strain/a: max", "strain/b: max"]);
    }

    #[test]
    fn files_of_one_name_are_told_apart() {
        let paths = ["a/drape.rrd", "b/drape.rrd", "drape 2.rrd", "x.rrd"].map(Path::new);
        assert_eq!(
            names(paths.into_iter()),
            ["drape", "drape 2", "drape 2 2", "x"]
        );
    }
}
