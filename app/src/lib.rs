//! The Vasos workbench: a window and a command line over the engine.
//!
//! The window is [`workbench::Workbench`]: between frames it fetches what the session's worker has to say, in a
//! frame it shows it through [`panes`], each a function of what there is to its [`action::Action`]s, which one
//! dispatcher carries out. The command line is [`cli`]. Colours live in [`theme`], words in `assets/locales`.

rust_i18n::i18n!("../assets/locales", fallback = "en");

pub mod action;
pub mod answers;
pub mod cli;
pub mod experiments;
pub mod i18n;
pub mod journal;
pub mod panes;
pub mod plots;
pub mod text;
pub mod theme;
pub mod traces;
pub mod tuning;
pub mod widgets;
pub mod workbench;

/// A template of the translation files in a language; the key itself where there is none.
fn translate(key: &str, language: &str) -> std::borrow::Cow<'static, str> {
    match _rust_i18n_try_translate(language, key) {
        Some(text) => std::borrow::Cow::Owned(text.into_owned()),
        None => std::borrow::Cow::Owned(key.to_owned()),
    }
}
