// The plots over time: one cursor and one window for all of them.
const plots = [];
let moving = false;

function seriesOf(plot, table) {
  const series = [];
  plot.curves.forEach((curve) => {
    const at = columnOf(table, curve.column), sign = (s) => (row) => row[at] === null ? null : s * row[at];
    series.push({curve, label: curve.name, value: sign(1), at});
    if (curve.mirrored) series.push({curve, label: "− " + curve.name, value: sign(-1), at});
  });
  return series;
}

function looks(series) {
  const look = {gridLineColor: colour("line"), axisLineColor: colour("line"), series: {}};
  series.forEach(({curve, label}) => {
    const dashes = {commanded: [7, 4], paper: [4, 4]}[curve.kind] || null;
    look.series[label] = {color: colour(curve.kind), strokeWidth: curve.kind === "flown" ? 2 : 1.5, strokePattern: dashes};
  });
  return look;
}

// Fills what lies between a bound and its negative.
function fillBand(plot, table, canvas, graph) {
  const band = plot.curves.find((curve) => curve.mirrored && curve.kind === "bound");
  if (!band) return;
  const at = columnOf(table, band.column), [from, until] = graph.xAxisRange();
  const rows = table.rows.filter((row) => row[at] !== null && row[0] >= from && row[0] <= until);
  if (rows.length < 2) return;
  canvas.fillStyle = colour("band");
  canvas.beginPath();
  rows.forEach((row, n) => canvas[n ? "lineTo" : "moveTo"](graph.toDomXCoord(row[0]), graph.toDomYCoord(row[at])));
  rows.slice().reverse().forEach((row) => canvas.lineTo(graph.toDomXCoord(row[0]), graph.toDomYCoord(-row[at])));
  canvas.fill();
}

// What its curves are at a row, by the colours that they have.
function tellValues(line, plot, table, row) {
  line.replaceChildren(`${plot.name} at ${row[0].toFixed(2)} s`);
  plot.curves.forEach((curve) => {
    line.append(make("span", {class: "mark" + (curve.kind === "commanded" || curve.kind === "paper" ? " dashed" : ""),
      style: `color: var(--${curve.kind})`}));
    const value = row[columnOf(table, curve.column)];
    line.append(`${curve.name} `, make("b", {"data-column": curve.column}, (curve.mirrored ? "±" : "") + rounded(value)), ` ${plot.unit}`);
  });
}

// A window that all plots share; `of` has it already.
function setWindow(window, of) {
  if (moving) return;
  moving = true;
  plots.forEach((plot) => plot.graph !== of && plot.graph.updateOptions({dateWindow: window}));
  moving = false;
  setCursor(cursor.t);
}

function zoomBy(factor) {
  if (!plots.length) return;
  const [low, high] = wholeTime(), [from, until] = plots[0].graph.xAxisRange(), half = factor * (until - from) / 2;
  const centre = Math.min(Math.max(cursor.t, from), until);
  setWindow([Math.max(low, centre - half), Math.min(high, centre + half)]);
}

function wholeTime() {
  let low = Infinity, high = -Infinity;
  data.plots.forEach((plot) => {
    const rows = tableOf(plot.table).rows;
    low = Math.min(low, rows[0][0]), high = Math.max(high, rows[rows.length - 1][0]);
  });
  return [low, high];
}

function makePlot(div, plot) {
  const table = tableOf(plot.table), series = seriesOf(plot, table);
  div.parentElement.classList.add("drawn");
  const finite = table.rows.flatMap((row) => series.map((s) => s.value(row))).filter((value) => value !== null);
  div.setAttribute("role", "img");
  div.setAttribute("aria-label", `Plot: ${plot.name} over time, from ${rounded(finite.reduce((a, b) => Math.min(a, b), Infinity))} to ` +
    `${rounded(finite.reduce((a, b) => Math.max(a, b), -Infinity))} ${plot.unit}`);
  const line = make("p", {class: "values"});
  div.after(line);
  const graph = new Dygraph(div, table.rows.map((row) => [row[0], ...series.map((s) => s.value(row))]), Object.assign({
    labels: ["time", ...series.map((s) => s.label)], legend: "never", ylabel: `${plot.name}, ${plot.unit}`, xlabel: "time, s",
    xLabelHeight: 16, yLabelWidth: 16, highlightCircleSize: 3, rightGap: 8, dateWindow: wholeTime(),
    axes: {x: {valueFormatter: String, axisLabelFormatter: (t) => String(+t.toFixed(3))}, y: {axisLabelWidth: 52}},
    highlightCallback: (event, t) => setCursor(t),
    zoomCallback: () => setWindow(graph.xAxisRange(), graph),
    underlayCallback: (canvas, area, drawn) => fillBand(plot, table, canvas, drawn),
  }, looks(series)));
  const now = make("div", {class: "now"});
  div.append(now);
  plots.push({graph, series});
  cursor.shown.push((t) => {
    const row = nearest(table.rows, t);
    graph.setSelection(row);
    const [from, until] = graph.xAxisRange(), area = graph.getArea();
    now.style.display = t >= from && t <= until ? "block" : "none";
    now.style.left = graph.toDomXCoord(t) - 1 + "px";
    now.style.height = area.h + "px";
    tellValues(line, plot, table, table.rows[row]);
  });
}

function makePlots() {
  if (!window.Dygraph) return;
  data.plots.forEach((plot) => {
    const div = document.querySelector(`[data-plot="${plot.id}"]`);
    if (div && tableOf(plot.table).rows.length > 1) makePlot(div, plot);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
    plots.forEach(({graph, series}) => graph.updateOptions(looks(series))));
  addEventListener("resize", () => setCursor(cursor.t));
}
