//! Faults on the drawing: a menu under the right button switches them, badges show what is broken.

use eframe::egui;
use vasos_engine::plant::{Fault, FaultKind, FaultyPart};
use vasos_engine::session::{RigCommand, Snapshot};

use crate::action::Action;
use crate::{journal, text, tr};

/// A number of a fault that can be set: its name, unit and range.
fn size(fault: &mut Fault) -> Vec<(&mut f64, &'static str, std::ops::RangeInclusive<f64>, f64)> {
    match fault {
        Fault::Drift { rate_cm_s } => vec![(rate_cm_s, " cm/s", -1.0..=1.0, 0.001)],
        Fault::Spikes { height_cm, every_s } => {
            vec![(height_cm, " cm", 0.0..=30.0, 0.05), (every_s, " s", 0.2..=3600.0, 0.5)]
        }
        Fault::Clogged { share } | Fault::WeakPump { share } => vec![(share, "", 0.0..=1.0, 0.01)],
        Fault::Leak { k_cm2_5_s } => vec![(k_cm2_5_s, " cm²·⁵/s", 0.0..=50.0, 0.05)],
        Fault::Stuck | Fault::BrokenWire | Fault::DryPump | Fault::PowerCut => vec![],
    }
}

/// The fault of a kind that a tag has.
fn present(snapshot: &Snapshot, tag: &str, kind: FaultKind) -> Option<Fault> {
    snapshot.faults.iter().find(|f| f.tag == tag && f.fault.kind() == kind).map(|f| f.fault)
}

/// A menu of a part's faults under the right button.
pub fn menu(response: &egui::Response, snapshot: &Snapshot, tag: &str, actions: &mut Vec<Action>) {
    let Some(part) = FaultyPart::find(&snapshot.network, tag) else { return };
    egui::Popup::context_menu(response)
        .close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside)
        .show(|ui| switches(ui, snapshot, tag, part, actions));
}

/// A switch for every fault that a part can have, with the size of those that are on.
pub fn switches(
    ui: &mut egui::Ui,
    snapshot: &Snapshot,
    tag: &str,
    part: FaultyPart,
    actions: &mut Vec<Action>,
) {
    ui.set_min_width(190.0);
    ui.strong(tr!("pid.faults", tag = tag));
    for &kind in part.possible() {
        let now = present(snapshot, tag, kind);
        let mut on = now.is_some();
        ui.horizontal(|ui| {
            if ui
                .checkbox(&mut on, journal::fault_name(kind))
                .on_hover_text(tr!(&format!("fault_hint.{}", kind.key())))
                .changed()
            {
                let tag = tag.to_owned();
                actions.push(Action::Rig(if on {
                    RigCommand::Fault { tag, fault: kind.usual() }
                } else {
                    RigCommand::Repair { tag, kind: Some(kind) }
                }));
            }
            let Some(mut fault) = now else { return };
            let mut changed = false;
            for (value, unit, range, speed) in size(&mut fault) {
                let field =
                    egui::DragValue::new(value).range(range).speed(speed).max_decimals(3).suffix(unit);
                changed |= ui.add(field).on_hover_text(journal::fault_name(kind)).changed();
            }
            if changed {
                actions.push(Action::Rig(RigCommand::Fault { tag: tag.to_owned(), fault }));
            }
        });
    }
}

/// A menu of the whole rig: its power, and everything that is broken with a button to repair it.
pub fn overview(ui: &mut egui::Ui, snapshot: &Snapshot, actions: &mut Vec<Action>) {
    let id = &snapshot.network.spec.id;
    switches(ui, snapshot, id, FaultyPart::Rig, actions);
    ui.separator();
    if snapshot.faults.is_empty() {
        ui.weak(tr!("pid.no_fault"));
    }
    for active in &snapshot.faults {
        ui.horizontal(|ui| {
            ui.label(format!("{}: {}", active.tag, journal::fault_name(active.fault.kind())));
            if ui.small_button(tr!("pid.repair")).clicked() {
                let kind = Some(active.fault.kind());
                actions.push(Action::Rig(RigCommand::Repair { tag: active.tag.clone(), kind }));
            }
        });
    }
    if snapshot.faults.len() > 1 && ui.button(tr!("pid.repair_all")).clicked() {
        for active in &snapshot.faults {
            let kind = Some(active.fault.kind());
            actions.push(Action::Rig(RigCommand::Repair { tag: active.tag.clone(), kind }));
        }
    }
    ui.separator();
    let balance = snapshot.balance;
    let volume = |v: f64| format!("{} cm³", text::fixed(v, 1));
    egui::Grid::new("water").num_columns(2).show(ui, |ui| {
        for (name, value) in [
            (tr!("pid.water_tanks"), balance.tanks_cm3),
            (tr!("pid.water_air"), balance.in_flight_cm3),
            (tr!("pid.water_outside"), balance.outside_cm3),
            (tr!("pid.water_leaked"), balance.leaked_cm3),
        ] {
            ui.label(name);
            ui.label(volume(value));
            ui.end_row();
        }
    });
}
