// The charts of the page (core/report/page/chart.cpp draws them): each is zoomed by dragging, and those of tables share one cursor and window.
const charts = [...document.querySelectorAll("svg.chart[data-window]")].map(chartOf);
const plots = charts.filter((chart) => chart.plot && chart.table.rows.length > 1);

function draw(tag, of, text) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  Object.entries(of || {}).forEach(([name, value]) => element.setAttribute(name, value));
  if (text !== undefined) element.textContent = text;
  return element;
}

function chartOf(svg, n) {
  const [left, top, width, height] = svg.dataset.area.split(" ").map(Number), whole = svg.dataset.window.split(" ").map(Number);
  const clip = draw("clipPath", {id: `clip-${n}`}), plot = data.plots.find(({id}) => id === svg.dataset.plot);
  clip.append(draw("rect", {x: left, y: top, width, height}));
  svg.append(clip);
  svg.querySelector(".seen").setAttribute("clip-path", `url(#clip-${n})`);
  return {svg, left, top, width, height, whole, window: whole, plot, table: plot && tableOf(plot.table)};
}

// Round numbers within a range, about so many (steps in chart.cpp).
function steps(low, high, about) {
  const rough = (high - low) / about, power = 10 ** Math.floor(Math.log10(rough)), step = power * [1, 2, 5, 10].find((n) => rough <= n * power * (1 + 1e-9));
  const all = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; ++n) all.push(+(n * step).toPrecision(12));
  return all;
}

const atX = (chart, x) => chart.left + (x - chart.window[0]) / (chart.window[1] - chart.window[0]) * chart.width;
const atY = (chart, y) => chart.top + (chart.window[3] - y) / (chart.window[3] - chart.window[2]) * chart.height;

function show(chart, window) {
  const {svg, left, top, width, height, whole} = chart, right = left + width, bottom = top + height;
  chart.window = window;
  const across = (whole[1] - whole[0]) / (window[1] - window[0]), up = (whole[3] - whole[2]) / (window[3] - window[2]);
  svg.querySelector(".area").setAttribute("transform",
    `translate(${atX(chart, whole[0]) - across * left} ${atY(chart, whole[3]) - up * top}) scale(${across} ${up})`);
  chart.marks = chart.marks || [...svg.querySelectorAll(".mark")].map((mark) => [mark, mark.transform.baseVal[0].matrix.e, mark.transform.baseVal[0].matrix.f]);
  chart.marks.forEach(([mark, x, y]) => mark.setAttribute("transform",
    `translate(${atX(chart, whole[0]) + across * (x - left)} ${atY(chart, whole[3]) + up * (y - top)})`));
  const told = (y) => "logarithmic" in svg.dataset ? String(+(10 ** y).toPrecision(2)) : String(y);
  svg.querySelector(".tics").replaceChildren(
    ...steps(window[0], window[1], width / 110).flatMap((x) => [draw("path", {d: `M${atX(chart, x)} ${top}V${bottom}`}), draw("text", {x: atX(chart, x), y: bottom + 17}, x)]),
    ...steps(window[2], window[3], height / 45).flatMap((y) =>
      [draw("path", {d: `M${left} ${atY(chart, y)}H${right}`}), draw("text", {x: left - 6, y: atY(chart, y) + 4, "text-anchor": "end"}, told(y))]));
}

// Lowest and highest value of a plot's curves between two places; nothing where there is none.
function rangeOf({plot, table}, from, until) {
  const values = table.rows.filter(([t]) => t >= from && t <= until).flatMap((row) => plot.curves.flatMap(({column, mirrored}) => {
    const value = row[columnOf(table, column)];
    return value === null ? [] : mirrored ? [value, -value] : [value];
  }));
  return values.length ? [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))] : null;
}

// A window along what all plots share; each is as high as what it shows of it.
function setWindow(from, until) {
  plots.forEach((chart) => {
    const whole = from <= chart.whole[0] && until >= chart.whole[1], found = rangeOf(chart, from, until), more = found && (0.04 * (found[1] - found[0]) || 0.5);
    show(chart, [from, until, ...(whole || !found ? chart.whole.slice(2) : [found[0] - more, found[1] + more])]);
  });
  setCursor(cursor.t);
}

function wholeTime() {
  return [Math.min(...plots.map(({whole}) => whole[0])), Math.max(...plots.map(({whole}) => whole[1]))];
}

function zoomBy(factor) {
  const [low, high] = wholeTime(), [from, until] = plots[0].window, half = factor * (until - from) / 2, centre = Math.min(Math.max(cursor.t, from), until);
  setWindow(Math.max(low, centre - half), Math.min(high, centre + half));
}

// What its curves are at a row, by the colours that they have.
function tellValues(line, plot, table, row) {
  line.replaceChildren(`${plot.name} at ${placeOf(row[0])}`);
  plot.curves.forEach((curve) => {
    line.append(make("span", {class: "line" + (curve.kind === "commanded" || curve.kind === "paper" ? " dashed" : ""), style: `color: var(--${curve.kind})`}));
    const value = row[columnOf(table, curve.column)];
    line.append(`${curve.name} `, make("b", {"data-column": curve.column}, (curve.mirrored ? "±" : "") + rounded(value)), ` ${plot.unit}`);
  });
}

function followCursor(chart) {
  const {svg, plot, table, whole} = chart, line = make("p", {class: "values"}), now = draw("path", {class: "now"});
  const found = rangeOf(chart, whole[0], whole[1]) || [null, null];
  svg.setAttribute("aria-label", `Plot: ${plot.name} over ${data.along[0]}, from ${rounded(found[0])} to ${rounded(found[1])} ${plot.unit}`);
  svg.querySelector(".seen").append(now);
  svg.closest(".drawing").after(line);
  cursor.shown.push((t) => {
    now.setAttribute("d", `M${atX(chart, t)} ${chart.top}v${chart.height}`);
    tellValues(line, plot, table, table.rows[nearest(table.rows, t)]);
  });
}

// Dragging chooses a part, two clicks show all of it again.
function zoomable(chart) {
  const {svg, whole} = chart, box = draw("path", {class: "chosen"}), shared = plots.includes(chart);
  const at = (event) => {
    const p = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse()), [x0, x1, y0, y1] = chart.window;
    const share = (value, size) => Math.min(Math.max(value / size, 0), 1);
    return [x0 + (x1 - x0) * share(p.x - chart.left, chart.width), y1 - (y1 - y0) * share(p.y - chart.top, chart.height)];
  };
  const seen = svg.querySelector(".seen");
  let begun = null;
  svg.addEventListener("pointerdown", (event) => { begun = event.button === 0 ? at(event) : null; });
  svg.addEventListener("pointermove", (event) => {
    const [x, y] = at(event);
    if (shared) setCursor(x);
    if (!begun || !event.buttons) return;
    box.setAttribute("d", shared ? `M${atX(chart, begun[0])} ${chart.top}v${chart.height}H${atX(chart, x)}v${-chart.height}z` :
      `M${atX(chart, begun[0])} ${atY(chart, begun[1])}V${atY(chart, y)}H${atX(chart, x)}V${atY(chart, begun[1])}z`);
    seen.append(box);
  });
  svg.addEventListener("pointerup", (event) => {
    const [x, y] = at(event), [from, low] = begun || [x, y], wide = Math.abs(x - from), tall = Math.abs(y - low);
    const few = 0.01 * (chart.window[1] - chart.window[0]);
    begun = null;
    box.remove();
    if (shared) {
      if (wide > few) setWindow(Math.min(x, from), Math.max(x, from));
      return;
    }
    if (wide <= few || tall <= 0.01 * (chart.window[3] - chart.window[2])) return;
    const middle = [(x + from) / 2, (y + low) / 2], shape = (whole[3] - whole[2]) / (whole[1] - whole[0]);
    const half = "equal" in svg.dataset ? [Math.max(wide, tall / shape) / 2, Math.max(wide * shape, tall) / 2] : [wide / 2, tall / 2];
    show(chart, [middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1]]);
  });
  svg.addEventListener("pointerleave", () => { begun = null; box.remove(); });
  svg.addEventListener("dblclick", () => shared ? setWindow(...wholeTime()) : show(chart, whole));
}

function makeCharts() {
  charts.forEach(zoomable);
  plots.forEach(followCursor);
  if (plots.length) setWindow(...wholeTime());
}
