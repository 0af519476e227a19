//! Documentation page of a command line: every verb and flag, with the texts of `--help`.

use clap::{Arg, Command};
use std::fmt::Write;

/// Returns the documentation page of a program's command line, in Markdown.
pub fn manual(mut command: Command) -> String {
    command.build();
    let name = command.get_name().to_owned();
    let mut page = format!(
        "# Command line of `{name}`\n\nThis page is generated: `{name} --help` and `{name} VERB --help` show the same.\n"
    );
    verb(&mut page, &command, &name);
    page
}

fn verb(page: &mut String, command: &Command, name: &str) {
    let about = command.get_long_about().or(command.get_about()).map(ToString::to_string).unwrap_or_default();
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ").replace("\n       ", "\n");
    let _ = write!(page, "\n## {name}\n\n{}\n\n```text\n{usage}\n```\n", flat(&about));
    let shown: Vec<&Arg> = command.get_arguments().filter(|arg| !arg.is_hide_set() && arg.get_id() != "help").collect();
    if !shown.is_empty() {
        page.push_str("\n| argument | meaning | default |\n|---|---|---|\n");
    }
    for arg in shown {
        let _ = writeln!(page, "| {} | {} | {} |", code(&flag(arg)), meaning(arg), default(arg));
    }
    if let Some(after) = command.get_after_long_help().or(command.get_after_help()) {
        let _ = write!(page, "\n```text\n{}\n```\n", after.to_string().trim());
    }
    for inner in command.get_subcommands().filter(|inner| !inner.is_hide_set() && inner.get_name() != "help") {
        verb(page, inner, &format!("{name} {}", inner.get_name()));
    }
}

fn flag(arg: &Arg) -> String {
    let values: Vec<String> = arg.get_value_names().unwrap_or_default().iter().map(ToString::to_string).collect();
    let value = if arg.get_action().takes_values() { values.join(" ") } else { String::new() };
    match arg.get_long() {
        Some(long) => format!("--{long} {value}").trim_end().to_owned(),
        None => value,
    }
}

fn meaning(arg: &Arg) -> String {
    let words = flat(&arg.get_long_help().or(arg.get_help()).map(ToString::to_string).unwrap_or_default());
    if !arg.get_action().takes_values() {
        return words;
    }
    let values: Vec<String> =
        arg.get_possible_values().iter().filter(|v| !v.is_hide_set()).map(|v| code(v.get_name())).collect();
    if values.is_empty() { words } else { format!("{words} One of {}.", values.join(", ")) }
}

fn default(arg: &Arg) -> String {
    let values = arg.get_default_values();
    let shown: Vec<String> = values.iter().map(|value| value.to_string_lossy().into_owned()).collect();
    let text = shown.join(",");
    if text.is_empty() || !arg.get_action().takes_values() { String::new() } else { code(&text) }
}

/// Joins a text to one line, and escapes it for a table cell.
fn flat(words: &str) -> String {
    words.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}

fn code(text: &str) -> String {
    format!("`{}`", text.replace('|', "\\|"))
}
