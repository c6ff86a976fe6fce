// What the page was written with, and the moment that all of it shows.
const data = JSON.parse(document.getElementById("data").textContent);
const cursor = {t: 0, shown: []};

function make(tag, of, text) {
  const element = document.createElement(tag);
  Object.entries(of || {}).forEach(([name, value]) => element.setAttribute(name, value));
  if (text !== undefined) element.textContent = text;
  return element;
}

function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
}

function rounded(value) {
  if (value === null || value === undefined) return "–";
  const size = Math.abs(value);
  return value.toFixed(size >= 100 ? 0 : size >= 1 ? 2 : 4).replace("-", "−");
}

// A place along what the plots share.
function placeOf(t) {
  return data.along[1] ? `${t.toFixed(2)} ${data.along[1]}` : String(Math.round(t));
}

function tableOf(id) {
  return data.tables.find((table) => table.id === id);
}

function columnOf(table, name) {
  return table.columns.indexOf(name);
}

// The row whose time is nearest.
function nearest(rows, t) {
  let low = 0, high = rows.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (rows[middle][0] <= t) low = middle; else high = middle;
  }
  return Math.abs(rows[high][0] - t) < Math.abs(rows[low][0] - t) ? high : low;
}

function setCursor(t) {
  cursor.t = t;
  cursor.shown.forEach((show) => show(t));
}
