// SPDX-License-Identifier: BSD-3-Clause
// A page in headless Chromium, without a network: what it complains about, how wide it is, what axe finds in it, at three widths and in
// both schemes; then what its plots say at a cursor, the files that it gives, its scene, and how it prints.
//   look.cjs MODULES PAGE OUT_DIR WIDTHS [TIME …]    prints JSON; WIDTHS: 360,900,1600; TIME: where the cursor is put, s
const [modules, page, out, widths, ...times] = process.argv.slice(2);
const fs = require("fs"), path = require("path"), url = require("url");
const {chromium} = require(path.resolve(modules, "node_modules/playwright-core"));
const axe = fs.readFileSync(path.resolve(modules, "node_modules/axe-core/axe.min.js"), "utf8");

async function look(browser, width, scheme, script) {
  const context = await browser.newContext({viewport: {width, height: 900}, colorScheme: scheme, offline: true, javaScriptEnabled: script,
    acceptDownloads: true, bypassCSP: true}); // axe is put in by the test; the page's own policy is looked at below
  context.setDefaultTimeout(120000); // software drawing on a machine that others use
  const tab = await context.newPage(), complaints = [], asked = [];
  tab.on("console", (message) => ["error", "warning"].includes(message.type()) && complaints.push(message.text()));
  tab.on("pageerror", (error) => complaints.push(String(error)));
  tab.on("request", (request) => request.url().startsWith("file:") || request.url().startsWith("blob:") || request.url().startsWith("data:") || asked.push(request.url()));
  await tab.goto(url.pathToFileURL(path.resolve(page)).href);
  await tab.waitForTimeout(500);
  return {context, tab, complaints, asked};
}

async function measured(browser, width, scheme) {
  const {context, tab, complaints, asked} = await look(browser, width, scheme, true);
  const said = await tab.evaluate(() => ({scroll: document.documentElement.scrollWidth, width: innerWidth, ground: getComputedStyle(document.body).backgroundColor,
    plots: document.querySelectorAll("svg.chart[data-plot] .now").length, drawings: document.querySelectorAll("svg").length}));
  const plane = await tab.$("#plane-which");
  if (plane) await plane.selectOption("2"); // what it shows and tells is looked at too
  await tab.waitForTimeout(plane ? 200 : 0);
  said.scroll = await tab.evaluate(() => document.documentElement.scrollWidth);
  await tab.evaluate(axe);
  const found = await tab.evaluate(() => axe.run(document, {resultTypes: ["violations"]}));
  const grave = found.violations.filter((v) => ["serious", "critical"].includes(v.impact));
  await tab.screenshot({path: path.join(out, `${path.basename(page, ".html")}-${width}-${scheme}.png`)});
  await context.close();
  return {viewport: width, scheme, ...said, complaints, asked, rules: found.violations.length, grave: grave.map((v) => [v.id, v.nodes.slice(0, 3).map((n) => n.html.slice(0, 200))])};
}

// The plane of the field: off, then as each kind at its first place and one moved by a key; what is told and given of each.
async function planes(tab, colours, slider) {
  const given = async (name) => {
    const [download] = await Promise.all([tab.waitForEvent("download"), tab.click(name)]);
    return fs.readFileSync(await download.path(), "utf8");
  };
  const hidden = () => tab.$$eval(".plane [id]:not(select), .plane .scale, .plane output", (all) => all.filter((e) => getComputedStyle(e).display === "none").length);
  await slider.evaluate((element, to) => { element.value = to; element.dispatchEvent(new Event("input")); }, times[0]);
  await tab.waitForTimeout(200);
  const said = {off: {hidden: await hidden(), ...await colours()}, kinds: []};
  for (const kind of ["2", "0", "1"]) {
    await tab.selectOption("#plane-which", kind);
    for (const key of [null, "ArrowRight", "ArrowRight"]) {
      if (key) await tab.focus("#plane-where"), await tab.keyboard.press(key);
      await tab.waitForTimeout(200);
      said.kinds.push({kind, hidden: await hidden(), told: await tab.textContent(".plane output"), spoken: await tab.getAttribute("#plane-where", "aria-valuetext"),
        csv: await given("#plane-file"), ...await colours()});
    }
  }
  said.here = await tab.textContent("#plane-here");
  await tab.selectOption("#plane-which", "");
  await tab.waitForTimeout(200);
  said.again = await colours();
  return said;
}

async function worked(browser) {
  const {context, tab, complaints} = await look(browser, 1200, "light", true);
  const said = {cursors: [], files: {}, complaints};
  const slider = await tab.$(".cursor.drawn input");
  for (const t of slider ? times : []) {
    await slider.evaluate((element, to) => { element.value = to; element.dispatchEvent(new Event("input")); }, t);
    said.cursors.push({t: +t, told: await tab.textContent(".cursor output"), values: await tab.$$eval(".values", (lines) => lines.map((line) =>
      [line.firstChild.textContent, ...[...line.querySelectorAll("[data-column]")].map((b) => [b.dataset.column, b.textContent])]))});
  }
  if (slider) { // by the keyboard alone
    await slider.focus();
    const before = await tab.textContent(".cursor output");
    await tab.keyboard.press("ArrowRight");
    said.keyboard = [before, await tab.textContent(".cursor output")];
    const windows = () => tab.evaluate(() => [...document.querySelectorAll("svg.chart[data-plot] .tics")].map((e) => e.textContent));
    const whole = await windows();
    await tab.click("#closer");
    said.zooms = (await windows()).every((tics, n) => tics !== whole[n]);
    await tab.click("#whole");
    const back = await windows(), charts = await tab.$$("svg.chart"); // by dragging over the first, which is a map, and the last, a plot
    const area = (chart) => chart.$eval(".area", (e) => e.getAttribute("transform"));
    said.dragged = back.join() === whole.join();
    for (const chart of [charts[0], charts[charts.length - 1]]) {
      await chart.scrollIntoViewIfNeeded();
      const before = await area(chart), box = await chart.boundingBox();
      await tab.mouse.move(box.x + 0.4 * box.width, box.y + 0.3 * box.height);
      await tab.mouse.down();
      await tab.mouse.move(box.x + 0.5 * box.width, box.y + 0.5 * box.height, {steps: 4});
      await tab.mouse.up();
      const near = await area(chart);
      await tab.mouse.dblclick(box.x + 0.4 * box.width, box.y + 0.3 * box.height);
      const scale = (text) => text ? +text.match(/scale\(([0-9.e+-]+)/)[1] : 1;
      said.dragged = said.dragged && scale(near) > 1.5 * scale(before) && Math.abs(scale(await area(chart)) - scale(before)) < 1e-9;
    }
  }
  for (const button of await tab.$$("button[data-table]")) {
    const [download] = await Promise.all([tab.waitForEvent("download"), button.click()]);
    said.files[download.suggestedFilename()] = fs.readFileSync(await download.path(), "utf8");
  }
  const colours = () => tab.evaluate(() => {
    const canvas = document.querySelector(".scene canvas");
    if (!canvas) return null;
    const flat = Object.assign(document.createElement("canvas"), {width: 200, height: 120}), pen = flat.getContext("2d"), seen = new Map();
    pen.drawImage(canvas, 0, 0, 200, 120);
    const pixels = pen.getImageData(0, 0, 200, 120).data;
    for (let n = 0; n < pixels.length; n += 4) seen.set(pixels.slice(n, n + 4).join(), (seen.get(pixels.slice(n, n + 4).join()) || 0) + 1);
    return {kinds: seen.size, most: Math.max(...seen.values()) / (200 * 120), hash: [...pixels].reduce((h, v) => (h * 31 + v) >>> 0, 7)};
  });
  said.scene = [await colours()];
  if (said.scene[0]) {
    await tab.focus(".scene .view");
    await tab.keyboard.press("ArrowLeft");
    await tab.waitForTimeout(200);
    said.scene.push(await colours());
    const box = await (await tab.$(".scene .view")).boundingBox();
    await tab.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await tab.mouse.down();
    await tab.mouse.move(box.x + box.width / 2 + 80, box.y + box.height / 2 + 30, {steps: 4});
    await tab.mouse.up();
    await tab.mouse.wheel(0, -300);
    await tab.waitForTimeout(200);
    said.scene.push(await colours());
  }
  if (await tab.$("#plane-which")) said.plane = await planes(tab, colours, slider);
  const shown = () => tab.$$eval(".drawing", (all) => all.filter((e) => getComputedStyle(e).display !== "none").length);
  said.shown = {screen: await shown()};
  await tab.emulateMedia({media: "print"});
  said.shown.print = await shown();
  said.shown.all = (await tab.$$(".drawing")).length;
  await context.close();
  const without = await look(browser, 900, "light", false);
  said.shown.without = await without.tab.locator(".drawing >> visible=true").count();
  said.complaints.push(...without.complaints);
  await without.context.close();
  return said;
}

(async () => {
  const browser = await chromium.launch({executablePath: "/usr/bin/chromium", args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]});
  const looks = [];
  for (const width of widths.split(",").map(Number)) for (const scheme of ["light", "dark"]) looks.push(await measured(browser, width, scheme));
  console.log(JSON.stringify({bytes: fs.statSync(page).size, looks, worked: await worked(browser)}));
  await browser.close();
})().catch((error) => { console.error(error); process.exit(1); });
