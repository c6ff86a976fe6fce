// The field in a box around the path: its layer at flight height as a table, and any plane through it in three dimensions.
const field = data.field && decodedField(data.field);
if (field) data.tables.push(Object.assign({id: "field"}, fieldRows(2, field.level)));

// A bound of 16 bits (core/reach/bound/bound_code.hpp), m/s²; null where the vehicle's centre cannot be.
function boundOf(code) {
  if (code === 0) return null;
  return code === 65535 ? Infinity : (1 + (code & 2047) / 2048) * 2 ** ((code >> 11) - 16);
}

function decodedField(kept) {
  const bytes = atob(kept.codes), bounds = [];
  for (let n = 0; n < bytes.length; n += 2) bounds.push(boundOf(bytes.charCodeAt(n) | bytes.charCodeAt(n + 1) << 8));
  const step = kept.stride.map((n) => n * kept.side), of = (i, j, k) => bounds[i + kept.count[0] * (j + kept.count[1] * k)];
  const finite = bounds.filter((bound) => bound !== null && bound !== Infinity);
  return Object.assign({}, kept, {step, of, largest: finite.reduce((a, b) => Math.max(a, b), 0),
    place: (axis, n) => +(kept.first[axis] + n * step[axis]).toPrecision(9)});
}

// Calls see(u, v, bound) for all of a plane across an axis; u and v count along the other two.
function eachInPlane(axis, n, see) {
  const [a, b] = [0, 1, 2].filter((other) => other !== axis), at = [0, 0, 0];
  at[axis] = n;
  for (at[a] = 0; at[a] < field.count[a]; ++at[a]) for (at[b] = 0; at[b] < field.count[b]; ++at[b]) see(at[a], at[b], field.of(...at), at);
  return [a, b];
}

function fieldRows(axis, n) {
  const rows = [];
  eachInPlane(axis, n, (u, v, bound, at) => bound === null || rows.push([...at.map((m, a) => field.place(a, m)), +bound.toPrecision(9)]));
  return {columns: ["x_m", "y_m", "z_m", "vertical_bound_mps2"], rows, thin: Math.max(...field.stride.slice(0, 2))};
}

function paletteColour(share) {
  const stops = field.palette, next = Math.max(1, stops.findIndex(([at]) => at >= Math.min(share, 1)));
  const [[low, from], [high, to]] = [stops[next - 1], stops[next]], part = (Math.min(share, 1) - low) / (high - low);
  return [1, 3, 5].map((c) => Math.round((1 - part) * parseInt(from.substr(c, 2), 16) + part * parseInt(to.substr(c, 2), 16)));
}

function planeMesh(axis, n) {
  const [a, b] = [0, 1, 2].filter((other) => other !== axis), width = field.count[a], height = field.count[b];
  const pixels = new Uint8Array(4 * width * height);
  eachInPlane(axis, n, (u, v, bound) => bound === null || pixels.set([...paletteColour(bound / field.largest), 255], 4 * (u + width * v)));
  const texture = new THREE.DataTexture(pixels, width, height, THREE.RGBAFormat);
  texture.needsUpdate = true;
  const corner = (u, v) => {
    const at = [0, 0, 0];
    at[axis] = field.place(axis, n), at[a] = field.place(a, u * width - 0.5), at[b] = field.place(b, v * height - 0.5);
    return at;
  };
  const ring = [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]], geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(ring.flatMap(([u, v]) => corner(u, v)), 3));
  geometry.setAttribute("uv", new THREE.Float32BufferAttribute(ring.flat(), 2));
  const mesh = new THREE.Mesh(geometry,
    new THREE.MeshBasicMaterial({map: texture, side: THREE.DoubleSide, transparent: true, opacity: 0.85, alphaTest: 0.1, depthWrite: false}));
  mesh.renderOrder = -1; // the tube is drawn over it
  return mesh;
}

// The bound in the voxel that a place is in; nothing outside the box.
function boundAt(place) {
  const at = place.map((value, a) => Math.round((value - field.first[a]) / field.step[a]));
  return at.some((n, a) => n < 0 || n >= field.count[a]) ? null : field.of(...at);
}

function planeKeys(change) {
  const box = make("div", {class: "keys plane", role: "group", "aria-label": "Plane of the disturbance"});
  const which = make("select", {id: "plane-which"}), where = make("input", {type: "range", id: "plane-where", "aria-label": "Where the plane is"});
  [["", "none"], [2, "level"], [0, "upright, across x"], [1, "upright, across y"]].forEach(([value, text]) => which.append(make("option", {value}, text)));
  const label = make("label", {for: "plane-which"}, "Plane of the disturbance "), told = make("output", {for: "plane-which plane-where"});
  const scale = make("span", {class: "scale"}), bar = make("span", {class: "bar", style: "background: linear-gradient(to right, " +
    field.palette.map(([at, colour]) => `${colour} ${100 * at}%`).join(", ") + ")"});
  scale.append("0 ", bar, ` ${rounded(field.largest)} m/s², bound along z`);
  const file = make("button", {type: "button", id: "plane-file"}, "plane.csv"), here = make("span", {id: "plane-here"});
  const now = () => which.value === "" ? null : {axis: +which.value, n: +where.value};
  const tell = () => {
    const plane = now();
    [where, told, scale, file, here].forEach((part) => { part.hidden = !plane; });
    if (plane) told.textContent = `${"xyz"[plane.axis]} = ${field.place(plane.axis, plane.n).toFixed(2)} m`;
    where.setAttribute("aria-valuetext", told.textContent);
    change(plane);
  };
  which.onchange = () => {
    const plane = now();
    if (plane) where.max = field.count[plane.axis] - 1;
    if (plane) where.value = plane.axis === 2 ? field.level : Math.floor(field.count[plane.axis] / 2);
    tell();
  };
  where.min = 0, where.step = 1, where.oninput = tell, label.append(which);
  file.onclick = () => { const plane = now(); giveFile("plane.csv", csvOf(fieldRows(plane.axis, plane.n))); };
  box.append(label, where, told, scale, here, file);
  tell();
  return {box, now, tellBody: (place) => { const bound = boundAt(place); here.textContent = "where the body is: " + (bound === null ? "none" : rounded(bound) + " m/s²"); }};
}
