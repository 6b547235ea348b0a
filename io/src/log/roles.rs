//! Which column is PV, SP, MV and mode: by the words in their names first, by their behaviour where words fail.

use vasos_engine::signal::LogTable;

use super::Roles;
use super::behaviour::{Behaviour, Motion};
use super::role_words::{CERTAIN, LIKELY, MODES, OUTPUTS};

/// A part of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Pv,
    Sp,
    Mv,
    Mode,
}

/// A role a name speaks for, and how loudly: 3 certain and last in the tag, 2 certain, 1 likely.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Hint {
    role: Role,
    weight: u8,
}

/// Proposes columns. PV and MV are only left open when no column moves.
pub(super) fn propose(table: &LogTable) -> Roles {
    let columns = &table.columns;
    let behaviour = Behaviour::of(table);
    let hints: Vec<Option<Hint>> = columns.iter().map(|c| hint(&c.name, c.unit.as_deref())).collect();
    // Words are a mode; nothing can be fitted to them.
    let words: Vec<usize> = (0..columns.len()).filter(|&i| !columns[i].states.is_empty()).collect();
    let mut taken: Vec<usize> = words.clone();
    let moving = |i: usize| !matches!(behaviour.motion[i], Motion::Still | Motion::Counts);
    let pv = best_named(&hints, Role::Pv, &words, |i| (moving(i), 0));
    taken.extend(pv);
    let kin = |i: usize| pv.map_or(0, |pv| kinship(&columns[pv].name, &columns[i].name));
    let mut mv = best_named(&hints, Role::Mv, &taken, |i| (moving(i), kin(i)));
    taken.extend(mv);
    let mut sp = best_named(&hints, Role::Sp, &taken, |i| (true, kin(i)));
    taken.extend(sp);
    let not_words: Vec<usize> = taken.iter().copied().filter(|i| !words.contains(i)).collect();
    // A flag of a pump is no mode, and neither is a remark here and there.
    let mode = best_named(&hints, Role::Mode, &not_words, |i| (true, kin(i))).or_else(|| {
        let filled = |i: &usize| columns[*i].values.iter().filter(|v| v.is_finite()).count();
        words
            .iter()
            .copied()
            .find(|i| 2 * filled(i) >= table.len() && columns[*i].states.iter().any(|s| is_mode(s)))
    });
    taken.extend(mode);
    // A likely name on a column that never moves gives way to one that does.
    let named_mv = mv;
    if let Some(i) = mv
        && !moving(i)
        && hints[i].is_some_and(|h| h.weight < 2)
        && behaviour.any_moving_besides(&taken)
    {
        mv = None;
    }
    let named_pv = pv;
    let pv = pv.or_else(|| {
        sp = sp.or_else(|| behaviour.tracked(&taken).map(|(sp, _)| sp));
        let tracking = sp.and_then(|sp| behaviour.tracker_of(sp, &taken));
        let taken: Vec<usize> = taken.iter().copied().chain(sp).collect();
        tracking.or_else(|| behaviour.responder(&taken))
    });
    taken.extend(pv);
    taken.extend(sp);
    if mv.is_none() {
        let unhinted: Vec<usize> = (0..columns.len())
            .filter(|&i| hints[i].is_some_and(|h| h.role != Role::Mv && h.weight > 0) && named_pv.is_some())
            .collect();
        let off: Vec<usize> = taken.iter().chain(&unhinted).copied().collect();
        mv = pv.and_then(|pv| behaviour.driver_of(pv, sp.is_none() && named_pv.is_none(), &off)).or(named_mv);
        taken.extend(mv);
    }
    if sp.is_none() && named_pv.is_none() {
        sp = pv.and_then(|pv| behaviour.setpoint_of(pv, &taken));
    }
    let name = |i: Option<usize>| i.map(|i| columns[i].name.clone());
    Roles { pv: name(pv), sp: name(sp), mv: name(mv), mode: name(mode) }
}

/// The column whose name speaks loudest for a role; then the livelier, the closer kin, the first.
fn best_named(
    hints: &[Option<Hint>],
    role: Role,
    taken: &[usize],
    rank: impl Fn(usize) -> (bool, usize),
) -> Option<usize> {
    let named = (0..hints.len()).filter(|i| !taken.contains(i));
    let ranked = named.filter_map(|i| {
        let weight = hints[i].filter(|h| h.role == role)?.weight;
        let (lively, kin) = rank(i);
        // A tag that ends in .PV is the PV even when it stands still; below that, movement decides.
        let key = (u8::from(weight == 3 && role != Role::Mv) * 2, lively, kin, weight);
        Some((key, std::cmp::Reverse(i)))
    });
    ranked.max().map(|(_, i)| i.0)
}

/// Characters the names begin with in common, and a large bonus for the same number at the end.
fn kinship(a: &str, b: &str) -> usize {
    let common = a.chars().zip(b.chars()).take_while(|(a, b)| a == b).count();
    let number = |s: &str| -> String {
        let digits: String =
            s.chars().rev().skip_while(|c| !c.is_ascii_digit()).take_while(char::is_ascii_digit).collect();
        digits
    };
    let (na, nb) = (number(a), number(b));
    common.min(50) + if !na.is_empty() && na == nb { 100 } else { 0 }
}

fn hint(name: &str, unit: Option<&str>) -> Option<Hint> {
    let mut words = words(name);
    let certain = |word: &str| role_of(word, CERTAIN).or_else(|| german(word));
    // PV.CV is the current value of the PV.
    if let [.., part, "cv" | "value" | "val"] = words.iter().map(String::as_str).collect::<Vec<_>>()[..]
        && certain(part).is_some()
    {
        words.pop();
    }
    let joined = words.join("");
    let last = words.iter().rev().find(|w| !w.bytes().all(|b| b.is_ascii_digit()));
    let two_words = words.windows(2).find_map(|w| certain(&w.concat()));
    if joined.contains("setpoint") || words.iter().any(|w| w.len() <= 4 && w.len() > 2 && w.ends_with("sp")) {
        return Some(Hint { role: Role::Sp, weight: 3 });
    }
    if let Some(role) = last.and_then(|w| certain(w)).or(two_words) {
        return Some(Hint { role, weight: 3 });
    }
    if let Some(role) = words.iter().find_map(|w| certain(w)) {
        return Some(Hint { role, weight: 2 });
    }
    let likely = |word: &str| role_of(word, LIKELY);
    let by_word = words.iter().rev().find_map(|w| Some((w, likely(w)?)));
    let is_quantity = || words.iter().any(|w| likely(w) == Some(Role::Pv));
    let by_word = by_word
        .map(|(word, role)| if OUTPUTS.contains(&word.as_str()) && is_quantity() { Role::Pv } else { role });
    let by_unit = || match unit?.to_lowercase().as_str() {
        "v" | "volts" | "pwm" => Some(Role::Mv),
        "cm" | "mm" | "°c" | "degc" | "degf" | "k" | "bar" | "kpa" => Some(Role::Pv),
        _ => None,
    };
    by_word.or_else(by_unit).map(|role| Hint { role, weight: 1 })
}

/// Whether a state is a mode of a controller.
fn is_mode(state: &str) -> bool {
    words(state).iter().any(|word| {
        let begins = |mode: &&str| (mode.chars().count() > 3 || !mode.is_ascii()) && word.starts_with(*mode);
        let long = ["cascade", "cascata", "local", "lokal", "remote", "remoto"];
        MODES.contains(&word.as_str()) || MODES.iter().any(begins) || long.contains(&word.as_str())
    })
}

/// What a table says of a word; words of Chinese, Japanese and Korean stand in others without blanks between.
fn role_of(word: &str, table: &[(&str, Role)]) -> Option<Role> {
    let is_ideograph = |c: char| c >= '\u{2e80}';
    let inside = |w: &str| w.contains(is_ideograph) && word.contains(w);
    let exact = table.iter().find(|(w, _)| *w == word);
    exact.or_else(|| table.iter().find(|(w, _)| inside(w))).map(|(_, role)| *role)
}

/// `solltemperatur`, `isttemperatur`, `fullstandsollwert`, `reglerausgang`.
fn german(word: &str) -> Option<Role> {
    let quantity = |part: &str| role_of(part, LIKELY).is_some();
    let ends = [
        ("sollwert", Role::Sp),
        ("istwert", Role::Pv),
        ("stellwert", Role::Mv),
        ("stellgroße", Role::Mv),
        ("reglerausgang", Role::Mv),
    ];
    let begins = [("soll", Role::Sp), ("ist", Role::Pv)];
    let by_end = ends.iter().find(|(end, _)| word.ends_with(end));
    by_end
        .or_else(|| begins.iter().find(|(b, _)| word.strip_prefix(b).is_some_and(quantity)))
        .map(|(_, role)| *role)
}

/// Words of a name in lower case without accents: `23LIC0001:InternalSetpoint`, `bomba_1`, `T1`.
fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut last = ' ';
    for c in name.chars() {
        let new = (last.is_lowercase() && c.is_uppercase())
            || (last.is_ascii_digit() != c.is_ascii_digit() && last.is_alphanumeric())
            || !last.is_alphanumeric();
        if c.is_alphanumeric() {
            let plain: String = c.to_lowercase().map(plain).collect();
            match words.last_mut() {
                Some(word) if !new => word.push_str(&plain),
                _ => words.push(plain),
            }
        }
        last = c;
    }
    words
}

/// A letter without its accent.
pub(super) fn plain(c: char) -> char {
    match c {
        'á' | 'à' | 'â' | 'ã' | 'ä' => 'a',
        'é' | 'ê' | 'è' => 'e',
        'í' | 'ì' => 'i',
        'ó' | 'ô' | 'õ' | 'ö' => 'o',
        'ú' | 'ü' => 'u',
        'ç' | 'ć' => 'c',
        'ñ' | 'ń' => 'n',
        'ś' => 's',
        'ą' => 'a',
        'ę' => 'e',
        'ł' => 'l',
        'ź' | 'ż' => 'z',
        c => c,
    }
}
