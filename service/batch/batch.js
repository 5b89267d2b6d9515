"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const screen_ = document.getElementById("screen"), position = document.getElementById("position");
const caption = document.getElementById("caption"), play = document.getElementById("play");
const sheet = document.getElementById("sheet");
let shown = 0, timer = null;

function show(index) {
  shown = index;
  const frame = data.frames[index];
  screen_.src = frame.image;
  screen_.alt = frame.text;
  caption.textContent = frame.text;
  position.value = index;
  for (const [i, button] of [...sheet.querySelectorAll("button")].entries())
    button.setAttribute("aria-current", String(i === index));
}

function stop() {
  clearInterval(timer);
  timer = null;
  play.textContent = "Play";
  play.setAttribute("aria-pressed", "false");
}

if (data.frames.length > 0) {
  document.getElementById("none").hidden = true;
  document.getElementById("player").hidden = false;
  position.max = data.frames.length - 1;
  for (const [index, frame] of data.frames.entries()) {
    const item = document.createElement("li"), button = document.createElement("button");
    const picture = document.createElement("img");
    picture.src = frame.image;
    picture.alt = "";
    button.type = "button";
    button.title = frame.text;
    button.append(picture, String(frame.frame));
    button.addEventListener("click", () => { stop(); show(index); });
    item.append(button);
    sheet.append(item);
  }
  position.addEventListener("input", () => { stop(); show(Number(position.value)); });
  play.addEventListener("click", () => {
    if (timer !== null) { stop(); return; }
    play.textContent = "Stop";
    play.setAttribute("aria-pressed", "true");
    timer = setInterval(() => show((shown + 1) % data.frames.length), 1000 / Math.max(data.fps, 1));
  });
  show(0);
}
