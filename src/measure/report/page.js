"use strict";
// Light or dark: what the system prefers until the button is used.
document.getElementById("theme").addEventListener("click", () => {
  const root = document.documentElement;
  const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "light" : "dark";
});
// Pairs of pictures: the slider says how much of the first one covers the second.
for (const slider of document.querySelectorAll(".slider")) {
  const over = slider.querySelector(".over");
  const show = event => { over.style.clipPath = `inset(0 ${100 - event.target.value}% 0 0)`; };
  slider.querySelector("input").addEventListener("input", show);
}
// Tables: a click on a heading sorts by it, a second one turns the order.
for (const head of document.querySelectorAll("thead th")) {
  head.addEventListener("click", () => {
    const column = [...head.parentNode.children].indexOf(head);
    const down = head.getAttribute("aria-sort") === "ascending";
    for (const other of head.parentNode.children) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const body = head.closest("table").tBodies[0];
    const text = row => row.cells[column] ? row.cells[column].textContent : "";
    const order = (a, b) => {
      const [x, y] = [parseFloat(text(a)), parseFloat(text(b))];
      const less = isNaN(x) || isNaN(y) ? text(a).localeCompare(text(b)) : x - y;
      return down ? -less : less;
    };
    body.append(...[...body.rows].sort(order));
  });
}
// What is printed is open.
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(d => { d.open = true; }));
