"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
const tabs = [...document.querySelectorAll('[role="tab"]')];
const plotLinks = [...document.querySelectorAll("#plot a")];
const rows = [...document.querySelectorAll("tbody tr")];
const views = [...document.querySelectorAll('input[name="view"]')];
let chosen = 0;

const hints = {
  picture: "The divider moves with the slider, with the arrow keys on it, or with the pointer on the picture.",
  indirect: "Indirect light alone, brightened by itself: what records make, and what the errors are measured on.",
  difference: "Of the indirect light, relative to the reference.",
  records: "Each dot is a record: a place where the light over the whole hemisphere was gathered by rays.",
};

function element(name, text, className) {
  const made = document.createElement(name);
  made.textContent = text;
  if (className) made.className = className;
  return made;
}

function showFacts(point) {
  const errors = byId("errors");
  errors.replaceChildren();
  for (const [name, value] of point.facts) errors.append(element("dt", name), element("dd", value));
  const stages = byId("stages");
  stages.replaceChildren();
  for (const stage of point.stages) {
    const row = document.createElement("li");
    const bar = element("div", "", "bar");
    const filled = document.createElement("span");
    filled.style.width = `${(100 * stage.share).toFixed(2)}%`;
    bar.append(filled);
    row.append(element("span", stage.name), bar, element("span", stage.text, "time"));
    stages.append(row);
  }
}

function showView() {
  const point = data.points[chosen];
  for (const radio of views) radio.disabled = !point.images[radio.value];
  let view = views.find((radio) => radio.checked).value;
  if (!point.images[view]) {
    view = "picture";
    views.find((radio) => radio.value === view).checked = true;
  }
  const slides = Boolean(data.reference[view]);
  byId("viewer").classList.toggle("slides", slides);
  byId("slider").hidden = !slides;
  byId("scale").hidden = view !== "difference";
  byId("hint").textContent = hints[view];
  byId("over").src = point.images[view];
  byId("over").alt = { picture: "The whole picture", indirect: "The indirect light",
    difference: "Heat map of the differences from the reference", records: "Where the records lie" }[view] +
    " of point " + point.name;
  byId("under").src = data.reference[slides ? view : "picture"];
}

function choose(index) {
  chosen = index;
  tabs.forEach((tab, i) => {
    tab.setAttribute("aria-selected", String(i === index));
    tab.tabIndex = i === index ? 0 : -1;
  });
  plotLinks.forEach((link) => link.classList.toggle("chosen", Number(link.dataset.point) === index));
  rows.forEach((row, i) => row.classList.toggle("chosen", i === index));
  const point = data.points[index];
  byId("panel").setAttribute("aria-labelledby", tabs[index].id);
  byId("panel").classList.toggle("traced", point.traced);
  byId("label").textContent = `${point.name}: ${point.label}`;
  byId("command").hidden = !point.command;
  byId("command").querySelector("code").textContent = point.command;
  showFacts(point);
  showView();
}

function moveSplit() {
  byId("viewer").style.setProperty("--split", `${byId("split").value}%`);
}

const steps = { ArrowRight: 1, ArrowLeft: -1, Home: -Infinity, End: Infinity };
tabs.forEach((tab, index) => {
  tab.addEventListener("click", () => choose(index));
  tab.addEventListener("keydown", (event) => {
    if (!(event.key in steps)) return;
    event.preventDefault();
    const next = Math.min(Math.max(index + steps[event.key], 0), tabs.length - 1);
    choose(next);
    tabs[next].focus();
  });
});
plotLinks.forEach((link) => link.addEventListener("click", (event) => {
  event.preventDefault();
  const index = Number(link.dataset.point);
  choose(index);
  byId("point").scrollIntoView();
  tabs[index].focus({ preventScroll: true });
}));
views.forEach((radio) => radio.addEventListener("change", showView));
byId("split").addEventListener("input", moveSplit);
byId("viewer").addEventListener("pointermove", (event) => {
  if (event.pointerType !== "mouse" && event.buttons === 0) return;
  const box = byId("viewer").getBoundingClientRect();
  byId("split").value = String(100 * (event.clientX - box.left) / box.width);
  moveSplit();
});

choose(data.first);
moveSplit();
