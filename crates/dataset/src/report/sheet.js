"use strict";
// Filters, sorts and enlarges the images of the contact sheet. Without this script all images are shown, and their
// links open the files.
(() => {
  const byId = (id) => document.getElementById(id);
  const sheet = document.querySelector(".sheet");
  const tools = document.querySelector(".tools");
  const large = byId("large");
  if (!sheet || !tools || !large) return;
  const shots = [...sheet.querySelectorAll(".shot")];
  const number = (shot, key) => Number(shot.dataset[key] ?? NaN);
  const cover = (shot) => number(shot, "crop") + number(shot, "weed");
  const wanted = {
    all: () => true,
    crop: (shot) => number(shot, "crop") > 0,
    weed: (shot) => number(shot, "weed") > 0,
    bare: (shot) => cover(shot) === 0,
  };
  const order = {
    place: () => 0,
    unusual: (shot) => -number(shot, "unusual"),
    cover: (shot) => -cover(shot),
    bare: cover,
    sun: (shot) => (shot.dataset.sun === undefined ? 1e3 : number(shot, "sun")),
    stage: (shot) => -(shot.dataset.stage === undefined ? -1 : number(shot, "stage")),
  };
  const update = () => {
    const show = byId("show").value;
    const [, kind, name] = show.match(/^(species|light):(.*)$/) ?? [];
    const keep = kind === undefined ? wanted[show] : (shot) => shot.dataset[kind].split("|").includes(name);
    const text = byId("find").value.trim();
    let count = 0;
    for (const shot of shots) {
      shot.hidden = !keep(shot) || !shot.dataset.name.includes(text);
      count += shot.hidden ? 0 : 1;
    }
    const rank = order[byId("sort").value];
    sheet.append(...shots.map((shot, i) => [rank(shot), i, shot]).sort((a, b) => a[0] - b[0] || a[1] - b[1]).map((all) => all[2]));
    byId("shown").textContent = `${count} of ${shots.length}`;
  };
  for (const id of ["show", "sort", "find"]) byId(id).addEventListener("input", update);
  sheet.addEventListener("click", (event) => {
    const link = event.target.closest("a.enlarge");
    if (!link) return;
    event.preventDefault();
    const [, folder, photograph] = link.getAttribute("href").match(/^(.*?)([^/]*)$/);
    const name = link.closest(".shot").dataset.name;
    const files = [[photograph, "image "], ["semantics.png", "labels of image "]].slice(photograph === "semantics.png" ? 1 : 0);
    const pictures = files.map(([file, words]) => {
      const picture = new Image();
      picture.alt = words + name;
      picture.onerror = () => { picture.hidden = true; };
      picture.src = folder + file;
      return picture;
    });
    large.querySelector("div").replaceChildren(...pictures);
    large.querySelector("p").textContent = link.closest("figcaption").textContent;
    if (again) {
      again.value = Number(name);
      write(Number(name));
    }
    large.showModal();
  });
  // The command that renders an image again: of the number that is typed, or of the image that was enlarged last.
  const again = byId("again");
  const write = (number) => {
    const command = byId("command");
    const lights = Number(command.dataset.lights);
    const numbers = { INDEX: Math.floor(number / lights), LIGHT: number % lights, IMAGE: number };
    command.textContent = command.dataset.command.replace(/INDEX|LIGHT|IMAGE/g, (word) => numbers[word]);
  };
  again?.addEventListener("input", () => { if (again.checkValidity()) write(Number(again.value)); });
  tools.hidden = false;
  update();
})();
