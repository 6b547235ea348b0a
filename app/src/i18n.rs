//! Languages: every sentence of the window comes from `assets/locales`.

use std::cell::Cell;

use vasos_engine::explain::Explain;

/// A language of the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum Language {
    /// English.
    #[default]
    #[serde(rename = "en")]
    English,
    /// Brazilian Portuguese.
    #[serde(rename = "pt-BR")]
    Portuguese,
}

impl Language {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::English, Self::Portuguese];

    /// Its tag, the name of its translation file.
    #[must_use]
    pub fn tag(self) -> &'static str {
        match self {
            Self::English => "en",
            Self::Portuguese => "pt-BR",
        }
    }

    /// The language of the system, where it is one of ours.
    #[must_use]
    pub fn of_system() -> Self {
        let variables = ["LC_ALL", "LC_MESSAGES", "LANG"];
        let set = variables.iter().find_map(|v| std::env::var(v).ok().filter(|s| !s.is_empty()));
        if set.is_some_and(|s| s.to_lowercase().starts_with("pt")) { Self::Portuguese } else { Self::English }
    }
}

thread_local! {
    static LANGUAGE: Cell<Language> = const { Cell::new(Language::English) };
}

/// Switches the language of this thread.
pub fn set(language: Language) {
    LANGUAGE.set(language);
}

/// The language of this thread.
#[must_use]
pub fn current() -> Language {
    LANGUAGE.get()
}

/// A sentence of the translation files in the present language: `tr!("pane.trend")`, with the values of
/// its placeholders as `tr!("fit.of", name = name)`.
#[macro_export]
macro_rules! tr {
    ($key:expr $(, $name:ident = $value:expr)* $(,)?) => {
        $crate::i18n::sentence($key, &[$((stringify!($name), $value.to_string())),*])
    };
}

/// A sentence by its key, with the values of its placeholders. A missing key shows as itself.
#[must_use]
pub fn sentence(key: &str, args: &[(&str, String)]) -> String {
    fill(&crate::translate(key, current().tag()), args)
}

fn fill(template: &str, args: &[(&str, String)]) -> String {
    let mut text = template.to_owned();
    for (name, value) in args {
        text = text.replace(&format!("%{{{name}}}"), value);
    }
    text
}

/// An error or finding of engine or io in the present language.
#[must_use]
pub fn say(what: &dyn Explain) -> String {
    let mut args = what.args();
    if let Some(cause) = what.cause() {
        args.retain(|(name, _)| *name != "error");
        args.push(("error", say(cause)));
    }
    sentence(&format!("said.{}", what.key()), &args)
}
