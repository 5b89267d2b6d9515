"use strict";
const byId = (id) => document.getElementById(id);
const canvas = byId("picture"), context = canvas.getContext("2d", {alpha: false});
const decoder = new TextDecoder();

// Places and directions are arrays of three numbers.
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const subtract = (a, b) => add(a, b, -1);
const scaled = (a, s) => [s * a[0], s * a[1], s * a[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(...a);
const unit = (a) => scaled(a, 1 / length(a));
/** Rodrigues: v turned about a unit axis by an angle in radians. */
const turned = (v, axis, angle) => {
  const c = Math.cos(angle), s = Math.sin(angle);
  return add(add(scaled(v, c), cross(axis, v), s), axis, dot(axis, v) * (1 - c));
};

let hello = null, camera = null, socket = null, number = 0, pivot = null, lastCommand = "";
const STEEPEST = 0.02;  // the view comes no nearer to straight up or down [rad]

const frame = () => {
  const forward = unit(subtract(camera.target, camera.eye));
  const right = unit(cross(forward, camera.up));
  return {forward, right, above: cross(right, forward), distance: length(subtract(camera.target, camera.eye))};
};

const send = (message) => {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
};

const errorOf = (step) => Number((50 * Math.pow(0.01, step / 100)).toPrecision(2));  // 50 % down to 0.5 %
const stepOf = (error) => Math.round(100 * Math.log(error / 50) / Math.log(0.01));
let error = 10;

const look = () => {
  if (!camera) return;
  send({look: {number: ++number, ...camera, error,
    exposure: byId("auto").checked ? null : Number(byId("exposure").value), bounces: Number(byId("bounces").value),
    layer: document.querySelector('input[name="layer"]:checked').value}});
};

/** The angle between the view and `up` after a turn by `pitch` stays away from 0 and 180 degrees. */
const allowed = (pitch) => {
  const now = Math.acos(Math.max(-1, Math.min(1, dot(frame().forward, unit(camera.up)))));
  return now - Math.max(STEEPEST, Math.min(Math.PI - STEEPEST, now - pitch));
};

const orbit = (yaw, pitch) => {
  const {right} = frame(), up = unit(camera.up), about = pivot || camera.target, by = allowed(pitch);
  for (const end of ["eye", "target"]) {
    const from = subtract(camera[end], about);
    camera[end] = add(about, turned(turned(from, right, by), up, yaw));
  }
  look();
};
const lookAround = (yaw, pitch) => {
  const {right} = frame(), by = allowed(pitch), from = subtract(camera.target, camera.eye);
  camera.target = add(camera.eye, turned(turned(from, right, by), unit(camera.up), yaw));
  look();
};
const move = (step) => {
  camera.eye = add(camera.eye, step);
  camera.target = add(camera.target, step);
  look();
};
/** @param parts  of the way to the target; past the nearest point it goes on, and the target with it */
const dolly = (parts) => {
  const {forward, distance} = frame(), least = 0.02 * hello.radius;
  const step = parts * Math.max(distance, least);
  camera.eye = add(camera.eye, forward, step);
  if (distance - step < least) camera.target = add(camera.eye, forward, least);
  look();
};
const pan = (x, y) => {
  const {right, above, distance} = frame();
  const perPixel = 2 * Math.tan(camera.fov * Math.PI / 360) * distance / canvas.clientHeight;
  move(add(scaled(right, -x * perPixel), above, y * perPixel));
};
const reset = (to) => {
  camera = structuredClone({eye: to.eye, target: to.target, up: to.up, fov: to.fov});
  pivot = null;
  look();
};

// Mouse and touch.
const pointers = new Map();
let gesture = "";
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener("pointerdown", (event) => {
  if (!camera) return;
  canvas.setPointerCapture(event.pointerId);
  canvas.focus({preventScroll: true});
  pointers.set(event.pointerId, event);
  gesture = event.button === 2 ? "look" : event.button === 1 || event.shiftKey ? "pan" : "orbit";
  pivot = null;
  const box = canvas.getBoundingClientRect();
  const at = (value) => Math.max(0, Math.min(1, value));
  if (gesture === "orbit" && pointers.size === 1)
    send({pick: {x: at((event.clientX - box.left) / box.width), y: at((event.clientY - box.top) / box.height)}});
  event.preventDefault();
});
canvas.addEventListener("pointermove", (event) => {
  const before = pointers.get(event.pointerId);
  if (!before) return;
  const x = event.clientX - before.clientX, y = event.clientY - before.clientY;
  if (pointers.size === 2) {
    const [other] = [...pointers.values()].filter((p) => p.pointerId !== event.pointerId);
    const apart = (p) => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY) || 1;
    pointers.set(event.pointerId, event);
    pan(x / 2, y / 2);
    dolly(1 - apart(before) / apart(event));
    return;
  }
  pointers.set(event.pointerId, event);
  const perPixel = 2.5 / canvas.clientWidth;
  if (gesture === "pan") pan(x, y);
  else if (gesture === "look") lookAround(-x * perPixel, -y * perPixel);
  else orbit(-x * perPixel, -y * perPixel);
});
for (const end of ["pointerup", "pointercancel"])
  canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
canvas.addEventListener("wheel", (event) => {
  if (!camera) return;
  event.preventDefault();
  dolly(Math.max(-0.5, Math.min(0.5, -event.deltaY * (event.deltaMode === 1 ? 0.03 : 0.001))));
}, {passive: false});

// Keys, by where they are on the keyboard.
const WALK = {KeyW: [0, 0, 1], ArrowUp: [0, 0, 1], KeyS: [0, 0, -1], ArrowDown: [0, 0, -1], KeyA: [-1, 0, 0],
  ArrowLeft: [-1, 0, 0], KeyD: [1, 0, 0], ArrowRight: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0]};
const held = new Set();
let walking = false, fast = false, then = 0;
const walk = (now) => {
  if (held.size === 0) { walking = false; return; }
  const {forward, right} = frame(), up = unit(camera.up);
  const way = 0.25 * hello.radius * Math.min(0.1, (now - then) / 1000) * (fast ? 4 : 1);  // [m]
  then = now;
  let step = [0, 0, 0];
  for (const key of held) {
    const [x, y, z] = WALK[key];
    step = add(add(add(step, right, x * way), up, y * way), forward, z * way);
  }
  if (length(step) > 0) move(step);
  requestAnimationFrame(walk);
};
addEventListener("keydown", (event) => {
  const away = event.target.closest("input, select, textarea, button, summary");
  if (!camera || away || event.ctrlKey || event.metaKey || event.altKey) return;
  fast = event.shiftKey;
  if (event.code in WALK) {
    event.preventDefault();
    held.add(event.code);
    if (!walking) { walking = true; then = performance.now(); requestAnimationFrame(walk); }
  } else if (event.code === "KeyR") reset(hello.start);
  else if (event.key === "+" || event.key === "=") dolly(0.1);
  else if (event.key === "-") dolly(-0.1);
});
addEventListener("keyup", (event) => { held.delete(event.code); fast = event.shiftKey; });
addEventListener("blur", () => held.clear());

// Controls.
const percent = (part) => `${(100 * part).toPrecision(2)} %`;
const signed = (value) => `${value > 0 ? "+" : ""}${value.toFixed(1)} EV`;
const showValues = () => {
  byId("error-text").textContent = `${error} %`;
  byId("bounces-text").textContent = byId("bounces").value;
  byId("exposure-text").textContent = signed(Number(byId("exposure").value));
  byId("legend").hidden = document.querySelector('input[name="layer"]:checked').value !== "error";
};
const say = (text, bad = false) => {
  byId("news").textContent = text;
  byId("news").toggleAttribute("data-bad", bad);
};
byId("controls").addEventListener("submit", (event) => event.preventDefault());
byId("controls").addEventListener("input", (event) => {
  if (event.target.id === "error") error = errorOf(Number(event.target.value));
  if (event.target.id === "exposure") byId("auto").checked = false;
  if (event.target.id === "camera" || event.target.id === "command") return;
  showValues();
  look();
});
byId("camera").addEventListener("change", () => {
  const index = Number(byId("camera").value);
  reset(index < 0 ? hello.start : hello.cameras[index]);
});
byId("reset").addEventListener("click", () => { byId("camera").value = "-1"; reset(hello.start); });
byId("afresh").addEventListener("click", () => send({afresh: true}));
byId("job").addEventListener("click", () => { say("sending …"); send({job: true}); });
byId("copy").addEventListener("click", async () => {
  byId("command").select();
  try {
    await navigator.clipboard.writeText(byId("command").value);
    say("copied");
  } catch {
    say(document.execCommand("copy") ? "copied" : "could not be copied: the text is selected", false);
  }
});

// What the server says.
const STATES = {moving: "moving, coarse", refining: "coming nearer", done: "done"};
const greet = (told) => {
  const first = !hello;
  hello = told;
  document.title = `${hello.scene} – rcsplat view`;
  byId("scene").textContent = hello.scene;
  [canvas.width, canvas.height] = hello.size;
  const choices = [["-1", "where it began"], ...hello.cameras.map((c, i) => [String(i), c.name || `camera ${i}`])];
  byId("camera").replaceChildren(...choices.map(([value, text]) => new Option(text, value)));
  byId("job").disabled = !hello.server;
  byId("job").title = hello.server ? `to the render server ${hello.server}` : "rcsplat view was started without --server";
  if (first) {
    error = hello.error;
    byId("error").value = stepOf(error);
    byId("bounces").value = hello.bounces;
    byId("auto").checked = hello.exposure === null;
    if (hello.exposure !== null) byId("exposure").value = hello.exposure;
    showValues();
    reset(hello.start);
  } else look();
};
const numbers = (header) => {
  const parts = [`error about ${percent(header.error)}`, `indirect ${percent(header.indirect_error)}`,
    `${header.records.toLocaleString("en")} records`, `${header.seconds.toFixed(header.seconds < 1 ? 2 : 1)} s`];
  if (header.filled > 0.0005) parts.splice(2, 0, `${percent(header.filled)} filled in from around`);
  return parts.join("  ·  ");
};
const show = async (data) => {
  const size = new DataView(data).getUint32(0);
  const header = JSON.parse(decoder.decode(new Uint8Array(data, 4, size)));
  const image = await createImageBitmap(new Blob([new Uint8Array(data, 4 + size)], {type: header.type}));
  context.imageSmoothingQuality = "high";
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  image.close();
  send({shown: header.frame});
  canvas.dataset.look = header.look;
  canvas.dataset.progress = header.progress;
  canvas.dataset.error = header.error;
  canvas.dataset.indirect = header.indirect_error;
  byId("state").textContent = STATES[header.progress];
  byId("state").dataset.progress = header.progress;
  byId("numbers").textContent = numbers(header);
  if (byId("auto").checked) {
    byId("exposure").value = header.exposure;
    byId("exposure-text").textContent = signed(header.exposure);
  }
  if (header.command !== lastCommand) byId("command").value = lastCommand = header.command;
};
const hear = (message) => {
  if (message.hello) greet(message.hello);
  if ("picked" in message && message.picked && pointers.size === 1) pivot = message.picked;
  if (message.failed) say(message.failed, true);
  if (message.job)
    message.job.error ? say(message.job.error, true)
      : say(`job ${message.job.number} is queued: rcsplat watch ${message.job.number} shows it, rcsplat fetch ${message.job.number} writes its picture`);
};
const connect = () => {
  const address = new URL("socket", location.href);
  address.protocol = "ws:";
  socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  socket.addEventListener("message", (event) => {
    if (typeof event.data === "string") hear(JSON.parse(event.data));
    else show(event.data);
  });
  socket.addEventListener("close", (event) => {
    byId("state").dataset.progress = canvas.dataset.progress = "lost";
    byId("state").textContent = event.reason || "rcsplat view has ended, or cannot be reached";
    byId("numbers").textContent = event.reason ? "reload the page to see it here" : "";
  });
};
connect();
