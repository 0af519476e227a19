"use strict";
// The state arrives as server-sent events; user requests are sent as POST. Nothing is loaded from other addresses.

const $ = (id) => document.getElementById(id);
const make = (tag, attributes = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), attributes);
  element.append(...children);
  return element;
};
const VIEWS = ["rgb", "nir", "labels", "depth"];

let state = null;
let view = "rgb";
let fit = true;
let pixel = null;
let failure = null;

// --- Requests ---

async function post(name, body) {
  const answer = await fetch(name, { method: "POST", body: JSON.stringify(body) });
  if (!answer.ok) throw new Error(await answer.text());
  const { asked } = await answer.json();
  if (state) state.asked = Math.max(state.asked, asked);
}

// One request at a time; changes made meanwhile are sent with the next one. While a slider moves, wait for the image of
// each value.
const fresh = () => !state || state.error || state.picture?.asked === state.asked;
const waiting = [];
let wanted = null;
let sending = false;
async function wish(change) {
  wanted = { ...wanted, ...change };
  if (sending) return;
  sending = true;
  try {
    while (wanted) {
      if (Object.keys(wanted).join() === "values" && !fresh()) {
        await new Promise((resolve) => waiting.push(resolve));
        continue;
      }
      const now = wanted;
      wanted = null;
      await post("wish", now);
    }
    failure = null;
  } catch (error) {
    failure = error.message;
  }
  sending = false;
  showError();
}

function listen() {
  const events = new EventSource("events");
  events.onmessage = (event) => { state = JSON.parse(event.data); show(); };
  events.onopen = () => $("dot").classList.remove("gone");
  events.onerror = () => $("dot").classList.add("gone");
}

// --- The image ---

let shownSource = "";
let loading = false;
function loadPicture() {
  const picture = state?.picture;
  if (!picture || loading) return;
  const source = `view/${view}?v=${picture.asked}-${picture.spp}-${picture.hash.slice(0, 8)}`;
  if (source === shownSource) return;
  loading = true;
  const next = new Image();
  Object.assign(next.dataset, { view, asked: picture.asked });
  const done = () => { loading = false; loadPicture(); };
  next.onload = () => {
    shownSource = source;
    next.id = "picture";
    next.alt = "";
    const last = $("picture");
    last.replaceWith(next);
    keepBefore(last, next.dataset);
    layOut();
    showBefore();
    document.body.dataset.shown = source;
    done();
  };
  next.onerror = () => { shownSource = source; done(); };
  next.src = source;
}

// The element of the last image of the request before the one shown. Its address would show the new image.
let comparing = false;
function keepBefore(last, { asked }) {
  if (!last.dataset.asked || last.dataset.asked === asked) return;
  last.id = "before";
  last.alt = "the image before the last change";
  $("before").replaceWith(last);
}
function showBefore() {
  const there = $("before").dataset.view === view;
  $("before").hidden = !(comparing && there);
  $("before-toggle").disabled = !there;
  press($("before-toggle"), comparing && there);
}
function toggleBefore() { comparing = !comparing; showBefore(); }

// CSS pixels per image pixel.
function zoom() {
  const picture = state?.picture;
  if (!picture) return 1;
  const box = $("shown").querySelector(".scroll");
  const style = getComputedStyle(box);
  const across = box.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight);
  const down = box.clientHeight - parseFloat(style.paddingTop) - parseFloat(style.paddingBottom);
  const narrow = matchMedia("(max-width: 820px)").matches;
  return fit ? Math.max(0.05, Math.min(across / picture.width, narrow ? Infinity : down / picture.height)) : 1;
}

function layOut() {
  const picture = state?.picture;
  if (!picture) return;
  const z = zoom();
  $("frame").style.width = `${picture.width * z}px`;
  $("frame").style.height = `${picture.height * z}px`;
  for (const id of ["picture", "before"]) $(id).classList.toggle("sharp", z >= 2.5);
  // Show the photograph at the pixel scale of the scene's own camera.
  const photo = $("photo");
  if (photo.naturalWidth) {
    photo.style.width = `${photo.naturalWidth * picture.scale * z}px`;
    photo.classList.toggle("sharp", picture.scale * z >= 2.5);
  }
  const cross = $("cross");
  cross.hidden = !pixel;
  if (pixel) {
    cross.style.left = `${(pixel.x + 0.5) * z}px`;
    cross.style.top = `${(pixel.y + 0.5) * z}px`;
    cross.style.width = cross.style.height = `${Math.max(9, z + 2)}px`;
  }
}

// --- One pixel ---

let asking = false;
let next = null;
async function inspect(at) {
  const picture = state?.picture;
  if (!picture) return;
  const inside = (value, size) => Math.min(Math.max(value, 0), size - 1);
  pixel = { x: inside(at.x, picture.width), y: inside(at.y, picture.height) };
  layOut();
  next = pixel;
  if (asking) return;
  asking = true;
  while (next) {
    const { x, y } = next;
    next = null;
    try {
      const answer = await fetch(`at?x=${x}&y=${y}`);
      if (answer.ok) describe(await answer.json());
    } catch { /* The event stream shows that the program has ended. */ }
  }
  asking = false;
}

function describe(at) {
  const number = (value) => Number(value).toLocaleString("en", { maximumFractionDigits: 1 });
  const rows = [["class", at.class]];
  if (at.species) rows.push(["species", at.species]);
  if (at.plant) rows.push(["plant", at.plant]);
  if (at.leaf) rows.push(["leaf", at.leaf]);
  if (at.organ) rows.push(["organ", at.organ]);
  if (at.bbch != null) rows.push(["stage", `BBCH ${at.bbch}, ${number(at.age_days)} days`]);
  if (at.depth_m != null) rows.push(["depth", `${at.depth_m.toFixed(3)} m`]);
  rows.push(["pixel", `${at.x}, ${at.y}`]);
  $("pixel").replaceChildren(...rows.flatMap(([name, value]) => [make("dt", { textContent: name }), make("dd", { textContent: value })]));
  $("pixel").hidden = false;
  $("pixel-hint").hidden = true;
}

async function explain() {
  if (!pixel) return;
  $("explained").hidden = false;
  $("explained").textContent = "…";
  try {
    $("explained").textContent = await (await fetch(`explain?x=${pixel.x}&y=${pixel.y}`)).text();
  } catch (error) {
    $("explained").textContent = error.message;
  }
}

// --- The command ---

// Browsers offer the clipboard only to pages of this machine or with encryption; elsewhere the text is selected.
async function copyCommand() {
  try {
    await navigator.clipboard.writeText(state.command);
    $("copy").textContent = "copied";
    setTimeout(() => { $("copy").textContent = "copy"; }, 1500);
  } catch {
    getSelection().selectAllChildren($("command"));
  }
}

// --- Sliders ---

let built = "";
function showSliders() {
  const key = JSON.stringify(state.sliders);
  if (key !== built) {
    built = key;
    const focus = document.activeElement?.dataset?.path;
    for (const [id, drawn] of [["drawn", true], ["fixed", false]]) {
      $(id).replaceChildren(...state.sliders.filter((s) => s.drawn === drawn).map(slider));
    }
    $("drawn-hint").textContent = $("drawn").childElementCount ? "Move a slider to fix a value that is sampled for every field." : "The file contains no distributions.";
    if (focus) document.querySelector(`input[data-path="${CSS.escape(focus)}"]`)?.focus();
  }
  if (wanted?.values) state.values = wanted.values;
  for (const row of document.querySelectorAll(".slider")) row.refresh();
  $("reset").hidden = !Object.keys(state.values).length;
}

function slider(about) {
  const { path, says, line, low, high, step, at, values } = about;
  const list = values.length > 0;
  const digits = Math.max(0, Math.min(6, 1 - Math.floor(Math.log10(step || 1))));
  const round = (value) => (list || step === 1 ? value : Number(value.toFixed(digits)));
  const read = () => (list ? values[input.value] : round(Number(input.value)));
  const input = make("input", {
    type: "range", min: list ? 0 : low, max: list ? values.length - 1 : high, step: list ? 1 : step === 1 ? 1 : "any",
    ariaLabel: path,
  });
  input.dataset.path = path;
  const output = make("output");
  const release = make("button", { textContent: about.drawn ? "draw" : "reset", title: "Reset to the value of the file" });
  const write = make("button", { textContent: "write to file", title: `Replace ${says} in line ${line} (W)` });
  const row = make("div", { className: "slider" },
    make("label", {}, make("span", { className: "path", textContent: path }), output), input,
    make("div", { className: "under" }, make("span", { className: "says", textContent: `${says}`, title: `line ${line}: ${says}` }),
      make("span", { className: "acts" }, release, write)));
  const stepTo = (to) => { local = to; tell(); };
  let local = null;
  const tell = () => {
    const all = { ...state.values, ...(wanted?.values ?? {}) };
    if (local === null) delete all[path]; else all[path] = local;
    // An editor may have removed numbers from the file meanwhile.
    const known = new Set(state.sliders.map((of) => of.path));
    for (const old of Object.keys(all)) if (!known.has(old)) delete all[old];
    state.values = all;
    row.refresh();
    wish({ values: all });
  };
  input.oninput = () => stepTo(read());
  release.onclick = () => stepTo(null);
  write.onclick = async () => {
    if (state.values[path] === undefined) return;
    try {
      await post("write", { path, value: state.values[path] });
      failure = null;
    } catch (error) {
      failure = error.message;
    }
    showError();
  };
  row.write = () => write.click();
  row.refresh = () => {
    const value = state.values[path];
    const moved = value !== undefined;
    row.classList.toggle("moved", moved);
    output.textContent = moved ? String(value) : about.drawn ? "drawn" : String(at);
    if (document.activeElement === input && moved) return;
    const place = moved ? value : at;
    input.value = list ? Math.max(0, values.indexOf(place)) : place;
  };
  return row;
}

// --- The sheet of indices ---

let sheetKey = "";
function showSheet() {
  const { wanted, count, done, failed, key } = state.sheet;
  $("sheet").hidden = !wanted;
  press($("sheet-toggle"), wanted);
  if (!wanted) return;
  const now = `${key} ${done} ${state.index}`;
  if (now === sheetKey) return;
  sheetKey = now;
  const shape = state.picture ? `${state.picture.width} / ${state.picture.height}` : "4 / 3";
  $("sheet").replaceChildren(...Array.from({ length: count }, (_, i) => {
    const there = i < done && !failed[i];
    const image = there ? make("img", { alt: `index ${i}`, src: `sheet/${i}?v=${key}` }) : make("pre", { textContent: failed[i] ?? "" });
    image.style.aspectRatio = shape;
    const button = make("button", { onclick: () => wish({ index: i, sheet: false }) }, image, make("span", { textContent: i < done ? `index ${i}` : `index ${i} …` }));
    press(button, i === state.index);
    return make("li", {}, button);
  }));
}

// --- Everything ---

const press = (button, on) => button.setAttribute("aria-pressed", String(on));

function showError() {
  const words = failure ?? state?.error;
  $("error").hidden = !words;
  $("error-text").textContent = words ?? "";
  $("error").querySelector("p").hidden = failure !== null || !state?.picture;
  document.body.classList.toggle("failed", Boolean(state?.error));
}

function showStatus() {
  const { picture, doing, spp, error, asked } = state;
  const words = [];
  if (error) words.push("error");
  else if (picture?.asked !== asked) words.push(doing || "waiting");
  if (picture) {
    if (picture.asked !== asked) words.push(`shown: index ${picture.index} of seed ${picture.seed}, from an earlier request`);
    words.push(`${picture.width} × ${picture.height} px`, `${picture.spp} of ${spp} samples per pixel`, `${picture.plants} plant${picture.plants === 1 ? "" : "s"}`,
      `${(picture.triangles / 1e6).toFixed(2)} M triangles`, `first image after ${picture.first_s.toFixed(2)} s`);
    if (view === "depth") words.push(`depth ${picture.near_m.toFixed(3)} to ${picture.far_m.toFixed(3)} m`);
  }
  $("status").textContent = words.join("  ·  ");
  $("progress").max = spp;
  $("progress").value = picture?.asked === asked ? picture.spp : 0;
  $("wait").hidden = Boolean(picture || error);
  $("dot").classList.toggle("busy", Boolean(doing));
}

function show() {
  for (const resolve of waiting.splice(0)) resolve();
  const name = state.file.split("/").pop();
  $("file").textContent = name;
  $("file").title = state.file;
  document.title = `${state.error ? "✕ " : ""}${name} · Furrow`;
  for (const [id, value] of [["index", state.index], ["seed", state.seed ?? state.picture?.seed ?? ""]]) {
    if (document.activeElement !== $(id)) $(id).value = value;
  }
  press($("seed-file"), state.seed === null);
  if (![...$("width").options].some((o) => o.value === String(state.width))) $("width").prepend(make("option", { textContent: state.width }));
  $("width").value = state.width;
  for (const button of document.querySelectorAll("[data-view]")) press(button, button.dataset.view === view);
  press($("fit"), fit);
  press($("photo-toggle"), !$("beside").hidden);
  $("warnings").replaceChildren(...(state.warnings).map((w) => make("li", { textContent: w })));
  $("warnings-panel").hidden = !$("warnings").childElementCount;
  if (state.photo && !photoSeen) { photoSeen = true; setPhoto("photo", null); }
  $("command").textContent = state.command;
  showBefore();
  showError();
  showStatus();
  showSliders();
  showSheet();
  layOut();
  loadPicture();
}

function setView(name) { view = name; pixelLabel(); show(); }
function pixelLabel() { $("frame").setAttribute("aria-label", `the field, ${view}`); }
function toggleFit() { fit = !fit; show(); }
const clampWhole = (value) => Math.max(0, Math.min(Number.MAX_SAFE_INTEGER, Math.round(value)));
function step(name, by) {
  const now = state[name] ?? state.picture?.seed ?? 0;
  state[name] = clampWhole(now + by);
  $(name).value = state[name];
  wish({ [name]: state[name] });
}
function typed(name) {
  const value = Number($(name).value.trim());
  if ($(name).value.trim() !== "" && Number.isFinite(value)) wish({ [name]: clampWhole(value) });
}
function stepWidth(by) {
  const options = [...$("width").options].map((o) => Number(o.value)).sort((a, b) => a - b);
  const to = options[Math.max(0, Math.min(options.length - 1, options.indexOf(state.width) + by))];
  wish({ width: to });
}
function reset() { state.values = {}; wish({ values: {} }); showSliders(); }

// --- The photograph ---

let photoSeen = false;
function setPhoto(source, name) {
  $("photo").onload = layOut;
  $("photo").src = source;
  $("beside").hidden = false;
  $("photo-about").textContent = name ? `${name} stays in this browser. It is shown at the camera's pixel scale.` : "It is shown at the camera's pixel scale.";
  layOut();
}
function togglePhoto() { $("beside").hidden = !$("beside").hidden; show(); layOut(); }

// --- Keys and pointers ---

const KEYS = {
  1: () => setView("rgb"), 2: () => setView("nir"), 3: () => setView("labels"), 4: () => setView("depth"),
  ArrowLeft: () => step("index", -1), ArrowRight: () => step("index", 1),
  ",": () => step("seed", -1), ".": () => step("seed", 1), 0: () => wish({ seed: "file" }),
  "-": () => stepWidth(-1), "+": () => stepWidth(1), "=": () => stepWidth(1),
  f: toggleFit, s: () => wish({ sheet: !state.sheet.wanted }), p: togglePhoto, o: () => { if ($("beside").hidden) togglePhoto(); $("photo-input").click(); },
  b: toggleBefore, c: copyCommand, r: reset, d: () => document.querySelector(".slider input")?.focus(), Enter: explain,
  "?": () => $("help").open ? $("help").close() : $("help").showModal(),
  Escape: () => { if (state.sheet.wanted) wish({ sheet: false }); document.activeElement?.blur(); },
};
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

addEventListener("keydown", (event) => {
  if (!state || event.ctrlKey || event.metaKey || event.altKey) return;
  const target = event.target;
  const slides = target.matches("input[type=range]");
  const writes = target.matches("input:not([type=range]), select");
  if (writes && event.key !== "Escape") return;
  if ($("help").open && !["?", "Escape"].includes(event.key)) return;
  if ($("help").open && event.key === "Escape") return;
  if (slides && (event.key.startsWith("Arrow") || event.key === "-" || event.key === "+")) return;
  if (slides && event.key.toLowerCase() === "w") { target.closest(".slider").write(); return; }
  if (event.key === "Enter" && target.matches("button, summary")) return;
  if (event.shiftKey && MOVES[event.key] && state.picture) {
    const [dx, dy] = MOVES[event.key];
    const from = pixel ?? { x: state.picture.width >> 1, y: state.picture.height >> 1 };
    event.preventDefault();
    inspect({ x: from.x + dx, y: from.y + dy });
    return;
  }
  const act = KEYS[event.key] ?? KEYS[event.key.toLowerCase()];
  if (act) { event.preventDefault(); act(); }
});

const place = (event) => {
  const box = $("frame").getBoundingClientRect();
  const { width, height } = state.picture;
  return { x: Math.floor(((event.clientX - box.left) / box.width) * width), y: Math.floor(((event.clientY - box.top) / box.height) * height) };
};
$("frame").onpointermove = (event) => { if (state?.picture) inspect(place(event)); };
$("frame").onclick = (event) => { if (state?.picture) { inspect(place(event)); explain(); } };
for (const button of document.querySelectorAll("[data-view]")) button.onclick = () => setView(button.dataset.view);
for (const name of ["index", "seed"]) {
  $(`${name}-less`).onclick = () => step(name, -1);
  $(`${name}-more`).onclick = () => step(name, 1);
  $(name).onchange = () => typed(name);
}
$("seed-file").onclick = () => wish({ seed: "file" });
$("width").onchange = () => wish({ width: Number($("width").value) });
$("fit").onclick = toggleFit;
$("sheet-toggle").onclick = KEYS.s;
$("before-toggle").onclick = toggleBefore;
$("copy").onclick = copyCommand;
$("photo-toggle").onclick = togglePhoto;
$("photo-file").onclick = () => $("photo-input").click();
$("photo-input").onchange = () => {
  const [file] = $("photo-input").files;
  if (file) setPhoto(URL.createObjectURL(file), file.name);
};
$("reset").onclick = reset;
$("help-toggle").onclick = KEYS["?"];
addEventListener("resize", layOut);
listen();
