// Map, tube and path in three dimensions: z points up, metres.
const kShades = [0.78, 0.78, 0.68, 0.68, 0.55, 1]; // of the sides: x, x, y, y, seen from below, seen from above

function facesMesh(map) {
  const place = [], shade = [], base = new THREE.Color(colour("ground")).getHSL({}).l > 0.5 ? 0.86 : 0.52;
  map.faces.forEach((text, n, all) => {
    if (n % 6) return;
    const [side, plane, u0, v0, u1, v1] = all.slice(n, n + 6), axis = side >> 1, up = side % 2 === 1;
    const corner = (u, v) => {
      const at = [0, 0, 0];
      at[axis] = plane, at[axis === 0 ? 1 : 0] = u, at[axis === 2 ? 1 : 2] = v;
      return at.map((value, a) => map.origin[a] + map.side * value);
    };
    const quad = [corner(u0, v0), corner(u1, v0), corner(u1, v1), corner(u0, v1)];
    if ((axis !== 1) !== up) quad.reverse(); // counter-clockwise from the free side: the other one is not drawn
    [0, 1, 2, 0, 2, 3].forEach((k) => {
      place.push(...quad[k]);
      const grey = base * kShades[side];
      shade.push(grey, grey, grey * 1.02);
    });
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(place, 3));
  geometry.setAttribute("color", new THREE.Float32BufferAttribute(shade, 3));
  return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({vertexColors: THREE.VertexColors, clippingPlanes: []}));
}

// Each set as the prism that it is: top, bottom and sides.
function tubeMesh(tube) {
  const place = [];
  tube.forEach(([[x, y, z], h, flat]) => {
    const ring = [];
    for (let k = 0; k < flat.length; k += 2) ring.push([x + flat[k], y + flat[k + 1]]);
    ring.forEach((a, k) => {
      const b = ring[(k + 1) % ring.length], low = z - h, high = z + h;
      place.push(...a, low, ...b, low, ...b, high, ...a, low, ...b, high, ...a, high);
      if (k > 0 && k + 1 < ring.length)
        place.push(...ring[0], high, ...a, high, ...b, high, ...ring[0], low, ...b, low, ...a, low);
    });
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(place, 3));
  return new THREE.Mesh(geometry,
    new THREE.MeshBasicMaterial({color: colour("bound"), transparent: true, opacity: 0.16, depthWrite: false}));
}

function pathPoints(prefix) {
  const table = tableOf(data.scene.path), at = ["x_m", "y_m", "z_m"].map((name) => columnOf(table, prefix + name));
  return table.rows.map((row) => at.map((a) => row[a])).filter((p) => p.every((value) => value !== null));
}

function pathMesh(points, radius, name) {
  const kept = [];
  points.forEach((p) => {
    const v = new THREE.Vector3(...p);
    if (!kept.length || kept[kept.length - 1].distanceTo(v) > 0.02) kept.push(v);
  });
  if (kept.length < 2) return new THREE.Group();
  return new THREE.Mesh(new THREE.TubeBufferGeometry(new THREE.CatmullRomCurve3(kept), Math.min(1500, 2 * kept.length), radius, 6),
    new THREE.MeshBasicMaterial({color: colour(name)}));
}

function ball(radius, name, opacity) {
  return new THREE.Mesh(new THREE.SphereBufferGeometry(radius, 20, 14),
    new THREE.MeshBasicMaterial({color: colour(name), transparent: opacity < 1, opacity}));
}

// The eye on a sphere around what it looks at. `change` draws.
function orbit(view, camera, home, change) {
  const eye = {};
  const place = () => {
    eye.tilt = Math.min(Math.max(eye.tilt, 0.001), Math.PI - 0.001);
    eye.far = Math.min(Math.max(eye.far, 0.3), 200);
    camera.position.set(eye.at[0] + eye.far * Math.sin(eye.tilt) * Math.cos(eye.turn), eye.at[1] + eye.far * Math.sin(eye.tilt) * Math.sin(eye.turn),
      eye.at[2] + eye.far * Math.cos(eye.tilt));
    camera.lookAt(...eye.at);
    change();
  };
  const look = (to) => {
    Object.assign(eye, home, {at: home.at.slice(), far: home.far * Math.max(1, 1.3 / camera.aspect)}, to);
    place();
  };
  const turn = (x, y) => { eye.turn -= x; eye.tilt -= y; place(); };
  const zoom = (factor) => { eye.far *= factor; place(); };
  const shift = (x, y) => { // shares of the view
    const right = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 0), up = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 1);
    right.multiplyScalar(-x * eye.far).add(up.multiplyScalar(y * eye.far));
    eye.at = eye.at.map((value, a) => value + right.getComponent(a));
    place();
  };
  const fingers = new Map();
  view.addEventListener("pointerdown", (event) => {
    view.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  ["pointerup", "pointercancel"].forEach((name) => view.addEventListener(name, (event) => fingers.delete(event.pointerId)));
  view.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId), size = view.clientHeight;
    if (!before) return;
    const x = event.clientX - before[0], y = event.clientY - before[1];
    const span = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
    const wide = fingers.size === 2 ? span() : 0;
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (fingers.size === 2) zoom(wide / Math.max(span(), 1)), shift(x / size / 2, y / size / 2);
    else if (event.shiftKey || event.buttons & 2) shift(x / size, y / size);
    else turn(4 * x / size, 4 * y / size);
  });
  view.addEventListener("contextmenu", (event) => event.preventDefault());
  view.addEventListener("wheel", (event) => {
    if (document.activeElement !== view) return; // until it is chosen, the page scrolls
    event.preventDefault();
    zoom(Math.exp(0.001 * event.deltaY));
  }, {passive: false});
  view.addEventListener("keydown", (event) => {
    const step = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key];
    if (step) event.shiftKey ? shift(-0.05 * step[0], -0.05 * step[1]) : turn(0.1 * step[0], 0.1 * step[1]);
    else if (event.key === "+" || event.key === "=") zoom(0.87);
    else if (event.key === "-") zoom(1.15);
    else if (event.key === "Home") look({});
    else return;
    event.preventDefault();
  });
  return {look, zoom};
}

function homeOf(points) {
  const low = [0, 1, 2].map((a) => points.reduce((m, p) => Math.min(m, p[a]), Infinity));
  const high = [0, 1, 2].map((a) => points.reduce((m, p) => Math.max(m, p[a]), -Infinity));
  const across = Math.hypot(...low.map((value, a) => high[a] - value));
  return {at: low.map((value, a) => (value + high[a]) / 2), far: Math.max(4, 1.5 * across), turn: -1.9, tilt: 0.75,
    along: high[0] - low[0] > high[1] - low[1] ? -Math.PI / 2 : 0};
}

function sceneControls(holder, eye, home, planes, change, plane) {
  const keys = make("div", {class: "keys"});
  const button = (name, act) => keys.append(Object.assign(make("button", {type: "button"}, name), {onclick: act}));
  button("Whole path", () => eye.look({}));
  button("From above", () => eye.look({tilt: 0, turn: -Math.PI / 2}));
  button("From the side", () => eye.look({tilt: Math.PI / 2, turn: home.along}));
  button("Nearer", () => eye.zoom(0.8));
  button("Farther", () => eye.zoom(1.25));
  if (data.scene.map) {
    const faces = data.scene.map.faces, heights = [];
    for (let n = 0; n < faces.length; n += 6) if (faces[n] >> 1 === 2) heights.push(data.scene.map.origin[2] + data.scene.map.side * faces[n + 1]);
    const low = heights.reduce((a, b) => Math.min(a, b), Infinity), high = heights.reduce((a, b) => Math.max(a, b), -Infinity) + 0.05;
    if (high > low) {
      const label = make("label", {}, "Cut obstacles above "), range = make("input", {type: "range", min: low, max: high, step: "any", value: high});
      const told = make("span", {}, high.toFixed(2) + " m");
      range.oninput = () => { planes[0].constant = +range.value; told.textContent = (+range.value).toFixed(2) + " m"; change(); };
      label.append(range);
      planes[0].constant = high;
      keys.append(label, told);
    }
  }
  holder.append(keys, ...(plane ? [plane.box] : []), make("p", {id: "scene-keys"}, "Drag or arrow keys turn it, two fingers, wheel or + and − zoom, Shift moves it, Home shows the whole path. " +
    "The ball is the body at the cursor's time."));
}

function fillScene(scene, planes) {
  const flown = pathPoints(""), commanded = pathPoints("command_");
  if (data.scene.map) {
    const mesh = facesMesh(data.scene.map);
    mesh.material.clippingPlanes = planes;
    scene.add(mesh);
  }
  if (data.scene.tube.length) scene.add(tubeMesh(data.scene.tube));
  scene.add(pathMesh(flown, 0.018, "flown"), pathMesh(commanded, 0.009, "commanded"));
  const body = ball(Math.max(data.scene.radius, 0.05), "flown", 0.55);
  scene.add(body);
  return body;
}

function makeScene() {
  const holder = document.querySelector(".scene");
  if (!holder || !data.scene || !window.THREE) return;
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({antialias: true, alpha: true, preserveDrawingBuffer: true});
  } catch (none) {
    return; // no WebGL: the note stays
  }
  holder.parentElement.classList.add("drawn");
  const points = pathPoints(""), home = homeOf(points), view = make("div", {class: "view", tabindex: "0", role: "application",
    "aria-label": `Path, tube and obstacles in three dimensions, ${points.length} places`, "aria-describedby": "scene-keys"});
  holder.append(view);
  view.append(renderer.domElement);
  const planes = [new THREE.Plane(new THREE.Vector3(0, 0, -1), 1e9)], camera = new THREE.PerspectiveCamera(45, 1, 0.02, 500);
  camera.up.set(0, 0, 1);
  let scene = new THREE.Scene(), body = fillScene(scene, planes), asked = false;
  renderer.localClippingEnabled = true;
  const draw = () => { asked = false; renderer.render(scene, camera); };
  const change = () => { if (!asked) asked = true, requestAnimationFrame(draw); };
  const fit = () => {
    renderer.setPixelRatio(devicePixelRatio);
    renderer.setSize(view.clientWidth, view.clientHeight);
    camera.aspect = view.clientWidth / view.clientHeight;
    camera.updateProjectionMatrix();
    change();
  };
  const eye = orbit(view, camera, home, change);
  let shown = null;
  const showPlane = (plane) => {
    if (shown) scene.remove(shown), shown.material.map.dispose(), shown.material.dispose(), shown.geometry.dispose();
    shown = plane && planeMesh(plane.axis, plane.n);
    if (shown) scene.add(shown);
    change();
  };
  const plane = field && planeKeys(showPlane);
  sceneControls(holder, eye, home, planes, change, plane);
  const table = tableOf(data.scene.path), at = ["x_m", "y_m", "z_m"].map((name) => columnOf(table, name));
  const put = (t) => {
    const place = at.map((a) => table.rows[nearest(table.rows, t)][a]);
    body.position.set(...place);
    if (plane) plane.tellBody(place);
    change();
  };
  cursor.shown.push(put);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    scene = new THREE.Scene(), body = fillScene(scene, planes), shown = null;
    if (plane) showPlane(plane.now());
    put(cursor.t);
  });
  addEventListener("resize", fit);
  fit();
  eye.look({});
}
