// Files, timeline and cursor; then all of it begins.
function csvOf(table) {
  const quoted = (name) => name.includes(",") ? `"${name}"` : name;
  return [table.columns.map(quoted).join(","), ...table.rows.map((row) => row.map((value) => value === null ? "" : String(value)).join(","))].join("\n") + "\n";
}

function giveFile(name, text) {
  const link = make("a", {download: name, href: URL.createObjectURL(new Blob([text], {type: "text/csv"}))});
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

function makeFiles() {
  document.querySelectorAll("[data-tables]").forEach((place) => place.dataset.tables.split(" ").filter(tableOf).forEach((id) => {
    const table = tableOf(id), rows = table.rows.length;
    const button = make("button", {type: "button", "data-table": id}, `${id}.csv: ` +
      (table.before ? `${rows} of ${table.before} rows, each peak kept` : `${rows} rows${table.thin > 1 ? `, one voxel of ${table.thin} along x and y` : ""}`));
    button.onclick = () => giveFile(id + ".csv", csvOf(table));
    place.append(button);
  }));
}

function makeTimeline() {
  const lanes = document.querySelector(".lanes");
  if (!lanes) return;
  const from = +lanes.dataset.from, until = +lanes.dataset.until, now = make("div", {class: "now"});
  lanes.append(now);
  cursor.shown.push((t) => {
    now.style.left = 100 * (t - from) / (until - from) + "%";
  });
  lanes.onclick = (event) => {
    const box = lanes.getBoundingClientRect();
    setCursor(from + (until - from) * (event.clientX - box.left) / box.width);
  };
  document.querySelectorAll("[data-time]").forEach((cell) => {
    const button = make("button", {type: "button", "aria-label": `Put the cursor to ${cell.textContent} s`}, cell.textContent);
    button.onclick = () => setCursor(+cell.dataset.time);
    cell.replaceChildren(button);
  });
}

function modeAt(t) {
  const mode = data.modes.find(([from, until]) => t >= from && t <= until);
  return mode ? `, ${mode[2]}: ${mode[3]}` : "";
}

function makeCursor() {
  const bar = document.querySelector(".cursor");
  if (!bar || !plots.length) return;
  bar.classList.add("drawn");
  document.documentElement.style.scrollPaddingBottom = "90px";
  const [from, until] = wholeTime(), slider = bar.querySelector("input"), told = bar.querySelector("output");
  Object.assign(slider, {min: from, max: until});
  cursor.shown.push((t) => {
    slider.value = t;
    told.textContent = placeOf(t) + modeAt(t);
    slider.setAttribute("aria-valuetext", told.textContent);
  });
  slider.oninput = () => setCursor(+slider.value);
  bar.querySelector("#closer").onclick = () => zoomBy(0.5);
  bar.querySelector("#farther").onclick = () => zoomBy(2);
  bar.querySelector("#whole").onclick = () => setWindow(...wholeTime());
}

makeFiles();
makeTimeline();
makeCharts();
makeScene();
makeCursor();
if (plots.length) {
  const [from, until] = wholeTime();
  setCursor(Math.max(from, Math.min(0.5 * (Math.max(from, 0) + until), until)));
}
