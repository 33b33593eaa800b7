//! What the viewer shows when a recording is opened: the cloth large, its figures beside it.
//!
//! Only views that have something to show. Rerun's blueprint interface has no setters for the
//! properties of a view (camera, background, grid), so those are logged into the blueprint's own
//! store, where the viewer looks for them.

use rerun::blueprint::components as parts;
use rerun::blueprint::{
    BarChartView, Blueprint, BlueprintActivation, BlueprintPanel, ContainerLike, Horizontal,
    SelectionPanel, Spatial2DView, Spatial3DView, Tabs, TextDocumentView, TextLogView, TimePanel,
    TimeSeriesView, Vertical,
};
use rerun::external::re_log_types::{BlueprintActivationCommand, StoreId};
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, EyeControls3D, LineGrid3D, PlotLegend, TimePanelBlueprint,
};
use rerun::log::LogMsg;
use rerun::{Color, EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamResult};

use super::camera::Camera;
use super::entity::ClothPaths;
use super::panels::{self, Panel};
use super::{drawing, entity, legend};
use crate::frame::{Frame, Header, SpringDetail};

/// Shares of the cloth and of the column beside it.
const COLUMNS: [f32; 2] = [1.75, 1.0];
/// Height of the tabs, of which the text needs most; a plot of two lines has 1.04.
const TABS_SHARE: f32 = 1.25;
/// Height of the legend, of the cloth's: its title and a strip.
const LEGEND_SHARE: f32 = 0.105;
/// Groups of series that share a place, as tabs where there are several plots; all others are with the text.
const PLACES: [&[&str]; 3] = [&["energy"], &["strain"], &["contact", "error", "solver"]];
/// Behind the cloth: dark enough for linen, light enough for the deepest blue and red.
const BACKGROUND: [u8; 3] = [44, 48, 56];

/// Sends the blueprint for a recording that begins with what `camera` sees.
pub(super) fn send(
    stream: &RecordingStream,
    header: &Header,
    camera: Camera,
) -> RecordingStreamResult<()> {
    if let Some((messages, activation)) = messages(header, camera)? {
        stream.send_blueprint(messages, activation);
    }
    Ok(())
}

/// The blueprint for the recording of a first frame, as messages for those who have no stream.
pub(crate) fn of(header: &Header, first: &Frame) -> RecordingStreamResult<Vec<LogMsg>> {
    let camera = Camera::framing(header, first);
    let (mut all, activation) = match messages(header, camera)? {
        Some(blueprint) => blueprint,
        None => return Ok(Vec::new()),
    };
    all.push(activation.into());
    Ok(all)
}

/// What tells a viewer that shows the blueprint `id` to play on by itself from the end to the start.
pub(crate) fn looping(id: &StoreId, speed: f64) -> RecordingStreamResult<Vec<LogMsg>> {
    let panel = TimePanelBlueprint::update_fields()
        .with_play_state(parts::PlayState::Playing)
        .with_loop_mode(parts::LoopMode::All)
        .with_playback_speed(speed);
    // A later change of the blueprint than those of the recording, which are at 0.
    let mut messages = drafted(id, 1, |draft| draft.log("time_panel", &panel))?;
    messages.push(activation(id).into());
    Ok(messages)
}

fn messages(
    header: &Header,
    camera: Camera,
) -> RecordingStreamResult<Option<(Vec<LogMsg>, BlueprintActivationCommand)>> {
    if !rerun::decide_logging_enabled(true) {
        // Rerun's blueprints obey RERUN=0 even where recordings don't, and panic then.
        tracing::warn!("RERUN is off in the environment: recording without a layout");
        return Ok(None);
    }
    let mut layout = Layout::default();
    let blueprint = layout.blueprint(header);
    let builder = RecordingStreamBuilder::new(entity::APPLICATION);
    let (draft, memory) = builder.enabled(true).send_properties(false).memory()?;
    blueprint.send(&draft, BlueprintActivation::default())?;
    let mut messages = memory.take();
    messages.retain(belongs_to_blueprint);
    let Some(id) = messages.first().map(|message| message.store_id().clone()) else {
        return Ok(None);
    };
    let properties = drafted(&id, 0, |draft| layout.log_properties(draft, camera))?;
    messages.extend(properties);
    Ok(Some((messages, activation(&id))))
}

/// What `log` logs into the blueprint `id` at a time of it.
fn drafted(
    id: &StoreId,
    time: i64,
    log: impl FnOnce(&RecordingStream) -> RecordingStreamResult<()>,
) -> RecordingStreamResult<Vec<LogMsg>> {
    let builder = RecordingStreamBuilder::from_store_id(id);
    let (draft, memory) = builder.enabled(true).send_properties(false).memory()?;
    draft.set_log_time_enabled(false);
    draft.set_time_sequence("blueprint", time);
    log(&draft)?;
    let mut messages = memory.take();
    messages.retain(belongs_to_blueprint);
    Ok(messages)
}

fn activation(id: &StoreId) -> BlueprintActivationCommand {
    BlueprintActivationCommand {
        blueprint_id: id.clone(),
        make_active: true,
        make_default: true,
    }
}

fn belongs_to_blueprint(message: &LogMsg) -> bool {
    let activation = matches!(message, LogMsg::BlueprintActivationCommand(_));
    message.store_id().is_blueprint() && !activation
}

/// The views whose properties are set once the blueprint stands.
#[derive(Debug, Default)]
struct Layout {
    spatial: Vec<EntityPath>,
    without_legend: Vec<EntityPath>,
    with_legend: Vec<EntityPath>,
}

impl Layout {
    fn blueprint(&mut self, header: &Header) -> Blueprint {
        let columns = [self.pictures(header), self.figures(header)];
        let time = TimePanel::new()
            .with_timeline(entity::SIM_TIME)
            .with_play_state(parts::PlayState::Following)
            .with_state(parts::PanelState::Collapsed);
        Blueprint::new(Horizontal::new(columns).with_column_shares(COLUMNS))
            .with_auto_views(false)
            .with_auto_layout(false)
            .with_blueprint_panel(BlueprintPanel::from_state(parts::PanelState::Collapsed))
            .with_selection_panel(SelectionPanel::from_state(parts::PanelState::Collapsed))
            .with_time_panel(time)
    }

    /// The cloth, behind it its springs, and below what their colours mean.
    fn pictures(&mut self, header: &Header) -> ContainerLike {
        let cloth = self.spatial("Cloth", without_springs_of_meshes(header));
        let picture = if has_springs_of_meshes(header) {
            let springs = self.spatial("Springs", without_meshes(header));
            Tabs::new([cloth, springs]).with_active_tab("0").into()
        } else {
            cloth
        };
        if header.cloths.is_empty() {
            return picture;
        }
        let legend = Spatial2DView::new(legend::title(header)).with_origin(entity::LEGEND);
        Vertical::new([picture, legend.into()])
            .with_row_shares([1.0, LEGEND_SHARE])
            .into()
    }

    /// Plots, the histogram, and tabs for what is read rather than watched. What is of one kind shares a place: in a
    /// window of 1300 × 800 there is room for five.
    fn figures(&mut self, header: &Header) -> ContainerLike {
        let panels = panels::of(&header.series);
        let mut rows: Vec<ContainerLike> = Vec::new();
        let mut shares: Vec<f32> = Vec::new();
        for groups in PLACES {
            let own = panels.iter().filter(|panel| groups.contains(&panel.group));
            let own: Vec<&Panel<'_>> = own.collect();
            shares.extend(own.first().map(|panel| share(panel)));
            let views: Vec<ContainerLike> = own.iter().map(|panel| self.plot(panel)).collect();
            rows.extend(in_one_place(views));
        }
        if header.cloths.iter().any(|cloth| !cloth.springs.is_empty()) {
            let histogram = BarChartView::new("Springs by strain (%)");
            let view = ContainerLike::from(histogram.with_origin(entity::HISTOGRAM));
            remember(&view, &mut self.without_legend);
            rows.push(view);
            shares.push(1.0);
        }
        let mut tabs: Vec<ContainerLike> = vec![
            TextDocumentView::new("Scene")
                .with_origin(entity::SCENE)
                .into(),
            TextLogView::new("Log").with_origin(entity::LOG).into(),
        ];
        let others = panels.iter().filter(|panel| {
            let mut placed = PLACES.iter().copied().flatten();
            !placed.any(|group| *group == panel.group)
        });
        tabs.extend(others.map(|panel| self.plot(panel)));
        rows.push(Tabs::new(tabs).into());
        shares.push(TABS_SHARE);
        Vertical::new(rows).with_row_shares(shares).into()
    }

    fn spatial(&mut self, name: &str, contents: Vec<String>) -> ContainerLike {
        let view = Spatial3DView::new(name).with_origin(entity::WORLD);
        let view = ContainerLike::from(view.with_contents(contents));
        remember(&view, &mut self.spatial);
        view
    }

    fn plot(&mut self, panel: &Panel<'_>) -> ContainerLike {
        let paths = panel.series.iter().map(|s| entity::series(&s.path));
        let view = TimeSeriesView::new(panel.title())
            .with_origin(entity::path(&[panel.group]))
            .with_contents(paths.map(|path| format!("+ {path}")));
        let view = ContainerLike::from(view);
        if panel.series.len() == 1 {
            // Its title says it all.
            remember(&view, &mut self.without_legend);
        } else {
            remember(&view, &mut self.with_legend);
        }
        view
    }

    fn log_properties(&self, draft: &RecordingStream, camera: Camera) -> RecordingStreamResult<()> {
        for path in &self.spatial {
            let eye = EyeControls3D::new()
                .with_position(camera.eye)
                .with_look_target(camera.target)
                .with_eye_up([0.0_f32, 1.0, 0.0]);
            let background = Background::new(parts::BackgroundKind::SolidColor)
                .with_color(Color::from(BACKGROUND));
            draft.log(format!("{path}/EyeControls3D"), &eye)?;
            draft.log(format!("{path}/Background"), &background)?;
            let grid = LineGrid3D::new().with_visible(false);
            draft.log(format!("{path}/LineGrid3D"), &grid)?;
        }
        for path in &self.with_legend {
            // What happens first is seen least often again; what it comes to lies flat beside the names.
            let legend = PlotLegend::new().with_corner(parts::Corner2D::RightTop);
            draft.log(format!("{path}/PlotLegend"), &legend)?;
        }
        for path in &self.without_legend {
            let legend = PlotLegend::new().with_visible(false);
            draft.log(format!("{path}/PlotLegend"), &legend)?;
        }
        Ok(())
    }
}

/// Height of a plot: more lines need more, for the legend, too.
fn share(panel: &Panel<'_>) -> f32 {
    (0.8 + 0.16 * panel.series.len() as f32).min(1.9)
}

/// Where in the blueprint's store a view is.
fn remember(view: &ContainerLike, paths: &mut Vec<EntityPath>) {
    if let ContainerLike::View(view) = view {
        paths.push(view.blueprint_path());
    }
}

/// Views as tabs, the first in front; alone, or none, as they are.
fn in_one_place(mut views: Vec<ContainerLike>) -> Option<ContainerLike> {
    match views.len() {
        0 | 1 => views.pop(),
        _ => Some(Tabs::new(views).with_active_tab("0").into()),
    }
}

/// Everything but the springs that a mesh already shows.
fn without_springs_of_meshes(header: &Header) -> Vec<String> {
    let meshes = header.cloths.iter().filter(|c| !c.triangles.is_empty());
    let springs = meshes.map(|c| entity::path(&[entity::WORLD, &c.name, "springs"]));
    let mut contents = vec!["+ $origin/**".to_owned()];
    contents.extend(springs.map(|path| format!("- {path}/**")));
    contents
}

/// Everything but the meshes of cloths.
fn without_meshes(header: &Header) -> Vec<String> {
    let meshes = header.cloths.iter().filter(|c| !c.triangles.is_empty());
    let mut contents = vec!["+ $origin/**".to_owned()];
    for cloth in meshes {
        // Leaving out a path leaves out what is below it, too, unless that is named.
        let ClothPaths {
            mesh,
            springs,
            pins,
        } = ClothPaths::new(cloth);
        contents.push(format!("- {mesh}"));
        contents.extend(springs.iter().map(|path| format!("+ {path}")));
        contents.push(format!("+ {pins}"));
    }
    contents
}

fn has_springs_of_meshes(header: &Header) -> bool {
    let detail: SpringDetail = header.spring_detail;
    header.cloths.iter().any(|cloth| {
        let mut families = 0..cloth.springs.len();
        !cloth.triangles.is_empty() && families.any(|f| drawing::draws(detail, cloth, f))
    })
}
