const pairs = document.querySelectorAll(".pair");
const flipped = pair => pair.dataset.show === "a" ? "b" : "a";
for (const pair of pairs) {
  const stage = pair.querySelector(".stage");
  stage.addEventListener("click", () => pair.dataset.show = flipped(pair));
  for (const map of pair.querySelectorAll("[data-map]")) {
    // The enlarged map reuses the small image, so the page stores each once.
    const large = map.querySelector("img").cloneNode();
    large.className = map.dataset.map;
    stage.insertBefore(large, stage.querySelector(".badge"));
    map.addEventListener("click", () => {
      pair.dataset.show = pair.dataset.show === map.dataset.map ? "a" : map.dataset.map;
    });
  }
}
addEventListener("keydown", event => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const shown = { 1: "a", 2: "b", 3: "flip", 4: "ssim", 5: "delta" }[event.key];
  // All pairs follow the first one, so that they stay in sync.
  const all = shown ?? (event.key.toLowerCase() === "f" && pairs.length ? flipped(pairs[0]) : undefined);
  if (all) for (const pair of pairs) pair.dataset.show = all;
});
