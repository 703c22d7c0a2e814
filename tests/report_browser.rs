//! The report in a real browser without a window: loads without errors, asks for nothing from outside, slider, tables and
//! the light or dark button work. `LANECAST_BROWSER` names a Chromium; without one the test says SKIPPED.

mod binary;

use std::path::{Path, PathBuf};
use std::process::Command;

use binary::{SQUARE, lanecast};

/// Runs first: notes errors and refused or made requests.
const BEFORE: &str = "<script>window.notes = [];
addEventListener('error', e => notes.push('error ' + e.message), true);
addEventListener('securitypolicyviolation', e => notes.push('blocked ' + e.blockedURI));</script>";

/// Runs last: uses the page and writes what came of it into the document.
const AFTER: &str = "<script>addEventListener('load', () => {
  const q = s => document.querySelector(s), style = (e, p) => getComputedStyle(e)[p], found = {};
  const slider = q('.slider input'), over = q('.slider .over');
  const set = v => { slider.value = v; slider.dispatchEvent(new Event('input')); return style(over, 'clipPath'); };
  found.slider = [set(0), set(80)];
  const table = q('#rates table'), head = table.querySelectorAll('thead th')[2];
  const column = () => [...table.tBodies[0].rows].map(r => parseFloat(r.cells[2].textContent));
  head.click(); found.up = column();
  head.click(); found.down = column();
  const look = () => style(document.body, 'backgroundColor');
  found.before = look(); q('#theme').click(); found.after = look();
  q('#theme').click(); found.again = look();
  found.images = [...document.images].map(i => i.naturalWidth);
  found.plots = document.querySelectorAll('.plot svg').length;
  found.ink = style(q('.plot svg text'), 'fill');
  found.requests = performance.getEntriesByType('resource').map(r => r.name).filter(n => !n.startsWith('data:'));
  found.notes = notes;
  found.wide = document.documentElement.scrollWidth > innerWidth;
  document.body.innerHTML = ''; document.body.dataset.found = JSON.stringify(found);
});</script>";

fn browser() -> Option<String> {
    let named = std::env::var("LANECAST_BROWSER").ok();
    let usual = ["chromium", "chromium-headless-shell", "chromium-browser", "google-chrome", "chrome-headless-shell"];
    let names: Vec<String> = named.map_or_else(|| usual.map(String::from).into(), |name| vec![name]);
    let works = |name: &&String| Command::new(name).arg("--version").output().is_ok_and(|out| out.status.success());
    let found = names.iter().find(works).cloned();
    if found.is_none() {
        println!("SKIPPED: no browser found ({})", names.join(", "));
    }
    found
}

/// A report of two runs with pictures, with the scripts above in it.
fn page(dir: &Path) -> PathBuf {
    std::fs::write(dir.join("square.ply"), SQUARE).expect("a scene");
    for out in ["r/old", "r/new"] {
        let eye = if out == "r/old" { "0.5,0.5,3" } else { "0.5,0.6,3" };
        let words = format!(
            "bench square.ply --eye {eye} --look-at 0.5,0.5,0 --size 64x48 --rays primary --repeat 3 --threads 1 -o {out}"
        );
        let ended = lanecast(dir, &words.split(' ').collect::<Vec<_>>());
        assert_eq!(ended.code, Some(0), "{}", ended.err);
    }
    let ended = lanecast(dir, &["report", "r", "-o", "report.html"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let text = std::fs::read_to_string(dir.join("report.html")).expect("a page");
    let text =
        text.replacen("<title>", &format!("{BEFORE}<title>"), 1).replacen("</body>", &format!("{AFTER}</body>"), 1);
    let path = dir.join("tested.html");
    std::fs::write(&path, text).expect("written");
    path
}

fn open(browser: &str, page: &Path, window: &str) -> serde_json::Value {
    let profile = tempfile::tempdir().expect("a temporary folder");
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--virtual-time-budget=5000"])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("--window-size={window}"))
        .arg("--dump-dom")
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("the browser runs");
    let dom = String::from_utf8_lossy(&output.stdout);
    let start = dom.find("data-found=\"").unwrap_or_else(|| panic!("the page's script did not end: {dom:.2000}"));
    let text = &dom[start + "data-found=\"".len()..];
    let text = text[..text.find('"').expect("an end")].replace("&quot;", "\"").replace("&amp;", "&");
    serde_json::from_str(&text).expect("what the script found")
}

#[test]
fn the_report_works_in_a_browser() {
    let Some(browser) = browser() else { return };
    let dir = tempfile::tempdir().expect("a temporary folder");
    let page = page(dir.path());
    for window in ["1200,900", "390,844"] {
        let found = open(&browser, &page, window);
        println!("{window}: {found}");
        assert_eq!((&found["notes"], &found["requests"]), (&serde_json::json!([]), &serde_json::json!([])), "{window}");
        assert_eq!(
            found["slider"],
            serde_json::json!(["inset(0px 100% 0px 0px)", "inset(0px 20% 0px 0px)"]),
            "{window}"
        );
        let numbers = |key: &str| -> Vec<f64> {
            found[key].as_array().expect("numbers").iter().map(|x| x.as_f64().expect("a number")).collect()
        };
        let (mut up, down) = (numbers("up"), numbers("down"));
        assert!(up.len() > 3 && up.is_sorted(), "{window}: {up:?}");
        up.reverse();
        assert_eq!(up, down, "{window}");
        assert!(found["before"] != found["after"] && found["before"] == found["again"], "{window}: {found}");
        assert!(numbers("images").iter().all(|w| *w > 0.0) && numbers("images").len() == 3, "{window}");
        assert!(found["plots"].as_u64() >= Some(1) && found["wide"] == false, "{window}: {found}");
        assert_ne!(found["ink"], found["before"], "{window}: plots are drawn in the colour of the page");
    }
}
