"use strict";
const element = (tag, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};
const byId = id => document.getElementById(id);
const percent = part => (100 * part).toFixed(1) + " %";
const seconds = s => s < 90 ? s.toFixed(1) + " s" : s < 5400 ? (s / 60).toFixed(0) + " min" : (s / 3600).toFixed(1) + " h";
const ask = async path => (await fetch(path)).json();
const PAGE = 60;  // frames at a time

// Jobs of interest first: failures, then what runs, what waits, what is done; the newest first among those.
const kind = job => job.failed > 0 || job.state === "failed" ? 0 : ["running", "cancel-requested"].includes(job.state) ? 1
  : ["queued", "paused"].includes(job.state) ? 2 : 3;
const KINDS = ["failed", "running", "waiting", "completed"];
const jobs = new Map();    // by number: what the server says of them
const shown = new Map();   // by number: their parts of the page
let complete = false;      // the oldest is among them

const frameKind = f => f.state === "failed" ? 0 : f.state === "active" || f.state === "soft-failed" ? 1 : f.state === "completed" ? 3 : 2;

function runningFrame(r) {
  const told = [r.stage, seconds(r.elapsed)];
  if (r.error_estimate !== undefined) told.push("error " + percent(r.error_estimate));
  if (r.eta !== undefined) told.push("about " + seconds(r.eta) + " to go");
  const box = element("div", {className: "run"},
    element("div", {}, `frame ${r.frame} `, element("progress", {value: r.fraction, max: 1}), " " + told.join(", ")));
  if (r.preview) box.append(element("img", {className: "preview", src: r.preview, alt: `frame ${r.frame} so far`}));
  return box;
}

function frameFigure(f) {
  const box = element("figure", {className: f.state});
  const files = f.files || [];
  if (f.thumbnail) {
    box.append(element("a", {href: files[0].path}, element("img", {src: f.thumbnail, alt: `frame ${f.number}`, loading: "lazy"})));
  }
  const told = [`frame ${f.number}: ${f.state}`];
  if (f.seconds) told.push(seconds(f.seconds));
  if (f.error) told.push("error " + percent(f.error));
  if (f.attempts) told.push(f.attempts + " attempts");
  box.append(element("figcaption", {}, told.join(", ")));
  for (const file of files.slice(1)) box.append(element("a", {href: file.path}, file.name), " ");
  if (f.reason) box.append(element("div", {className: "reason"}, f.reason));
  for (const warning of f.warnings || []) box.append(element("div", {className: "dim"}, warning));
  return box;
}

// Error over the frames; failed ones are strokes from top to bottom.
function curve(frames) {
  const known = frames.filter(f => f.error);
  if (known.length < 2) return "";
  const most = Math.max(...known.map(f => f.error)), first = frames[0].number, last = frames[frames.length - 1].number;
  const x = f => 100 * (f.number - first) / Math.max(1, last - first), y = f => 38 - 36 * f.error / most;
  const holes = frames.filter(f => f.state === "failed");
  const line = known.map((f, i) => (i ? "L" : "M") + x(f).toFixed(2) + " " + y(f).toFixed(2)).join("");
  const strokes = holes.map(f => `M${x(f).toFixed(2)} 0V40`).join("");
  const text = `error over the frames ${first} to ${last}: at most ${percent(most)}`;
  const picture = element("div");  // numbers alone
  picture.innerHTML = `<svg class="curve" viewBox="0 0 100 40" preserveAspectRatio="none" role="img"><path d="${line}"/><path class="hole" d="${strokes}"/></svg>`;
  picture.firstChild.setAttribute("aria-label", text);
  return element("div", {}, element("div", {className: "dim"}, text + (holes.length ? `; ${holes.length} failed` : "")), picture);
}

// What opens beneath a job: all its frames, those that failed first, a page at a time.
function drawFrames(part) {
  const wanted = part.choice.value;
  const frames = part.frames.filter(f => wanted === "" || KINDS[frameKind(f)] === wanted)
    .sort((a, b) => (frameKind(a) !== 0) - (frameKind(b) !== 0) || a.number - b.number);
  part.page = Math.max(0, Math.min(part.page, Math.ceil(frames.length / PAGE) - 1));
  const from = part.page * PAGE, to = Math.min(from + PAGE, frames.length);
  part.place.textContent = frames.length ? `${from + 1} to ${to} of ${frames.length}` : "none";
  part.before.disabled = from === 0;
  part.after.disabled = to === frames.length;
  part.list.replaceChildren(...frames.slice(from, to).map(frameFigure));
  const spent = part.frames.reduce((sum, f) => sum + (f.seconds || 0), 0);
  part.cost.textContent = `${seconds(spent)} of workers' time`;
  part.curve.replaceChildren(curve([...part.frames].sort((a, b) => a.number - b.number)));
}

async function loadFrames(part, number) {
  if (part.loading) return;
  part.loading = true;
  try {
    const frames = [];
    for (;;) {
      const some = (await ask(`/frames/${number}/${frames.length}`)).frames;
      frames.push(...some);
      if (some.length === 0 || frames.length >= jobs.get(number).frames) break;
    }
    part.frames = frames;
    part.loaded = true;
    drawFrames(part);
  } finally {
    part.loading = false;
  }
}

function makePart(number) {
  const part = {page: 0, frames: [], text: "", progress: ""};
  part.head = element("div", {className: "head"});
  part.news = element("div");
  part.choice = element("select", {}, ...[["", "all"], ["failed", "failed"], ["completed", "completed"], ["running", "running"], ["waiting", "waiting"]]
    .map(([value, text]) => element("option", {value}, text)));
  part.before = element("button", {type: "button"}, "previous");
  part.after = element("button", {type: "button"}, "next");
  part.place = element("span", {});
  part.cost = element("span", {className: "dim"});
  part.list = element("div", {className: "frames"});
  part.curve = element("div");
  part.choice.onchange = () => { part.page = 0; drawFrames(part); };
  part.before.onclick = () => { --part.page; drawFrames(part); };
  part.after.onclick = () => { ++part.page; drawFrames(part); };
  part.box = element("details", {id: "job-" + number}, element("summary", {}, part.head), part.news, part.curve,
    element("div", {className: "tools"}, element("label", {}, "frames ", part.choice), part.before, part.place, part.after, part.cost), part.list);
  part.box.ontoggle = () => { if (part.box.open && !part.loaded) loadFrames(part, number); };
  return part;
}

function drawJob(job) {
  if (!shown.has(job.job)) shown.set(job.job, makePart(job.job));
  const part = shown.get(job.job), text = JSON.stringify(job);
  if (part.text === text) return part;
  part.text = text;
  const told = [new Date(job.submitted).toLocaleString(), job.owner, "priority " + job.priority];
  if (job.started) told.push("waited " + seconds((job.started - job.submitted) / 1000));
  if (job.finished && job.started) told.push("took " + seconds((job.finished - job.started) / 1000));
  if (job.error_estimate !== undefined) told.push("error " + percent(job.error_estimate) + " in the mean");
  if (job.delivered) told.push(job.delivered + " delivered");
  part.head.replaceChildren(element("b", {}, "job " + job.job), element("span", {className: "state " + job.state}, job.state),
    element("span", {}, job.scene), element("span", {}, `${job.completed} of ${job.frames} frames` + (job.failed ? `, ${job.failed} failed` : "")),
    ...Object.entries(job.labels).map(([name, value]) => element("span", {className: "label"}, `${name}: ${value}`)),
    element("span", {className: "dim"}, told.join(", ")));
  const isOpen = ["queued", "paused", "running", "cancel-requested"].includes(job.state), news = [];
  if (job.reason) news.push(element("div", {className: "reason"}, job.reason));
  if (job.delivery_error) news.push(element("div", {className: "reason"}, "not delivered yet: " + job.delivery_error));
  if (isOpen && job.waits_for) news.push(element("div", {className: "dim"}, "waits for job " + job.waits_for.join(", ")));
  if (isOpen && job.frames > 1)
    news.push(element("div", {}, element("progress", {value: job.fraction, max: 1}), job.eta === undefined ? "" : ` about ${seconds(job.eta)} to go`));
  part.news.replaceChildren(...news, ...job.running.map(runningFrame));
  const progress = job.completed + "/" + job.failed;
  if (part.loaded && part.progress !== progress) loadFrames(part, job.job);
  const asked = location.hash === "#" + part.box.id;
  if (!part.progress && (kind(job) === 0 || asked)) part.box.open = true;  // failures are there without a click
  part.progress = progress;
  return part;
}

function matches(job) {
  const state = byId("state").value, text = byId("text").value.trim().toLowerCase();
  if (state && KINDS[kind(job)] !== state) return false;
  const words = [job.job, job.scene, job.owner, job.reason, ...Object.entries(job.labels).map(([n, v]) => `${n}=${v} ${n}: ${v}`)];
  return !text || words.join(" ").toLowerCase().includes(text);
}

function draw() {
  const listed = [...jobs.values()].filter(matches).sort((a, b) => kind(a) - kind(b) || b.job - a.job);
  const boxes = listed.map(job => drawJob(job).box), main = byId("jobs");
  if (boxes.some((box, i) => main.children[i] !== box) || main.children.length !== boxes.length) main.replaceChildren(...boxes);
  if (!boxes.length) main.replaceChildren(element("p", {}, jobs.size ? "no job is like that" : "no jobs yet"));
  byId("count").textContent = `${listed.length} of ${jobs.size}` + (complete ? "" : " and older ones");
  byId("older").hidden = complete;
}

// What lies between the first and the last of them is as they say: the rest has expired.
function take(status, isFirst) {
  const told = new Set(status.jobs.map(job => job.job)), last = status.more ? Math.min(...told) : 0;
  if (isFirst) for (const number of jobs.keys()) if (number >= last && !told.has(number)) jobs.delete(number);
  for (const job of status.jobs) jobs.set(job.job, job);
  if (!status.more) complete = true;
}

async function refresh() {
  const health = byId("health");
  try {
    const status = await ask("/status.json");
    health.textContent = (status.serving ? "serving" : "NOT serving: " + status.message) +
      `; ${status.busy} of ${status.workers} workers busy, ${status.waiting} frames waiting` +
      (status.paused ? ", the queue is PAUSED" : !status.eta ? "" : `, about ${seconds(status.eta)} of work`) + `, up for ${seconds(status.uptime)}` +
      (status.seal ? `; workers are kept from ${status.seal}` : "");
    take(status, true);
    draw();
  } catch (error) {
    health.textContent = "the server does not answer";
  }
  setTimeout(refresh, 1000);
}
byId("filter").oninput = draw;
byId("filter").onsubmit = event => event.preventDefault();
byId("older").onclick = async () => {
  take(await ask("/status.json/" + Math.min(...jobs.keys())), false);
  draw();
};
refresh();
