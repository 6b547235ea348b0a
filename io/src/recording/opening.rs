//! The blueprint as messages: what the builder of Rerun offers, and the time axes, which it does not.

use rerun::RecordingStreamBuilder;
use rerun::blueprint::BlueprintActivation;
use rerun::external::re_log_types::StoreKind;
use rerun::external::re_sdk_types::blueprint::archetypes::TimeAxis;
use rerun::external::re_sdk_types::blueprint::components::TimeRange;
use rerun::external::re_sdk_types::datatypes;
use rerun::log::{Chunk, LogMsg, RowId};
use rerun::time::{TimePoint, Timeline};

use super::layout::{Group, blueprint};

/// Messages that lay a viewer out for a run, with trends that show it from its start to its end.
///
/// # Errors
/// What Rerun says of its own types.
pub(super) fn blueprint_messages(groups: &[Group]) -> Result<Vec<LogMsg>, Box<dyn std::error::Error>> {
    let (blueprint, trends) = blueprint(groups);
    let (stream, storage) = RecordingStreamBuilder::new("vasos").enabled(true).memory()?;
    blueprint.send(&stream, BlueprintActivation { make_active: true, make_default: true })?;
    let all = storage.take();
    let of_blueprint = |message: &&LogMsg| message.store_id().kind() == StoreKind::Blueprint;
    let mut messages: Vec<LogMsg> = all.iter().filter(of_blueprint).cloned().collect();
    let Some(id) = messages.first().map(|message| message.store_id().clone()) else { return Ok(messages) };
    let whole = datatypes::TimeRange {
        start: datatypes::TimeRangeBoundary::Infinite,
        end: datatypes::TimeRangeBoundary::Infinite,
    };
    let axis = TimeAxis::new().with_view_range(TimeRange(whole));
    let activation = messages.pop();
    for trend in trends {
        let at = TimePoint::from_iter([(Timeline::new_sequence("blueprint"), 0)]);
        let chunk = Chunk::builder(format!("{trend}/TimeAxis")).with_archetype(RowId::new(), at, &axis);
        messages.push(LogMsg::ArrowMsg(id.clone(), chunk.build()?.to_arrow_msg()?));
    }
    messages.extend(activation);
    Ok(messages)
}
