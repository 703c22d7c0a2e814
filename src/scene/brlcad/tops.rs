//! Which objects of a database are shown.

use super::model::{Database, ObjectKind, short};
use crate::error::{Error, Result, nearest_name};

/// Names that stand for the whole model by convention, the better one first.
const WHOLE: [&str; 2] = ["all.g", "all"];
/// Most names listed in a message.
const LISTED: usize = 12;

/// Objects that no combination uses, in the order of the file.
pub fn tops(database: &Database) -> Vec<u32> {
    let mut used = vec![false; database.objects.len()];
    for object in &database.objects {
        let ObjectKind::Combination(combination) = &object.kind else { continue };
        for index in combination.members.iter().filter_map(|member| database.find(&member.name)) {
            used[index as usize] = true;
        }
    }
    (0..used.len() as u32).filter(|&i| !used[i as usize]).collect()
}

/// The objects called `names`. Without names: `all.g` or `all` if there is one, else all combinations that no other
/// one uses, else all solids that none uses.
///
/// # Errors
/// A usage error for an unknown name, with what is near; for a database without objects.
pub fn choose_tops(database: &Database, names: &[String]) -> Result<Vec<u32>> {
    if !names.is_empty() {
        return names.iter().map(|name| named(database, name)).collect();
    }
    if let Some(whole) = WHOLE.iter().find_map(|name| database.find(name)) {
        return Ok(vec![whole]);
    }
    let all = tops(database);
    let is_combination = |i: &u32| matches!(database.objects[*i as usize].kind, ObjectKind::Combination(_));
    let combinations: Vec<u32> = all.iter().copied().filter(is_combination).collect();
    let chosen = if combinations.is_empty() { all } else { combinations };
    if chosen.is_empty() {
        return Err(Error::Usage("the database has no object that is not part of another: name one with --top".into()));
    }
    Ok(chosen)
}

fn named(database: &Database, name: &str) -> Result<u32> {
    database.find(name).ok_or_else(|| {
        let near = nearest_name(name, database.objects.iter().map(|o| o.name.as_str()));
        let near = near.map(|n| format!(" (did you mean `{}`?)", short(n))).unwrap_or_default();
        let tops = tops(database);
        let mut list: Vec<String> =
            tops.iter().take(LISTED).map(|&i| short(&database.objects[i as usize].name)).collect();
        if tops.len() > LISTED {
            list.push("...".into());
        }
        Error::Usage(format!("--top {}: no such object{near}; on top are: {}", short(name), list.join(", ")))
    })
}
